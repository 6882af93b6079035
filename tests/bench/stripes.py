"""Stripes of two albedos: error of the convention for textures, against a photon simulation of the stripes.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/stripes.py [PHOTONS]

Light falls in straight and evenly. Profiles over a period are compared: the mean of the differences over the mean.
"""

import sys

import beamspread
import numpy as np

G, ALBEDOS = 0.8, (0.99, 0.9)
BINS, TEXELS_PER_BIN, REACH = 20, 2, 400.0
AT_ONCE, FAINT = 50_000, 0.05


def scattered(way, random):
    """Unit vectors (N, 3) after a scattering by Henyey and Greenstein."""
    bend = (1 - G**2) / (1 - G + 2 * G * random.random(len(way)))
    cosine = (1 + G**2 - bend**2) / (2 * G)
    azimuth = 2 * np.pi * random.random(len(way))
    helper = np.where(np.abs(way[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    first = np.cross(way, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turned = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * np.cross(way, first)
    return cosine[:, None] * way + np.sqrt(1 - cosine**2)[:, None] * turned


def simulated(period, photons):
    """Exitance (BINS,) across a period, per unit of irradiance; lengths in mean free paths."""
    random, left = np.random.default_rng(1), np.zeros(BINS)
    for _ in range(photons // AT_ONCE):
        x, z, power = random.random(AT_ONCE) * period, np.zeros(AT_ONCE), np.ones(AT_ONCE)
        way = np.tile((0.0, 0.0, -1.0), (AT_ONCE, 1))
        while len(x):
            length = random.exponential(size=len(x))
            out = z + way[:, 2] * length > 0
            place = x[out] - way[out, 0] * z[out] / way[out, 2]
            left += np.bincount((np.mod(place, period) / period * BINS).astype(int) % BINS, power[out], BINS)
            x, z = (x + way[:, 0] * length)[~out], (z + way[:, 2] * length)[~out]
            power = power[~out] * np.where(np.mod(x, period) < period / 2, *ALBEDOS)
            survives = (power >= FAINT) | (random.random(len(power)) < power / FAINT)
            x, z, power = x[survives], z[survives], np.maximum(power, FAINT)[survives]
            way = scattered(way[~out][survives], random)
    return left / (photons // AT_ONCE * AT_ONCE) * BINS


def by_convention(period, blur):
    """The same from the mean albedo, the texture's power `blur` on the way in and the rest on the way out."""
    medium = beamspread.Medium(g=G)
    library = beamspread.library(medium)
    colors = [library.diffuse_reflectance(albedo) for albedo in ALBEDOS]
    (albedo, _, _), mean = beamspread.albedo_from_color(np.mean(colors), medium), np.mean(colors)
    texels = BINS * TEXELS_PER_BIN
    periods = int(np.ceil(REACH / period)) | 1
    texture = np.tile(np.repeat(np.array(colors) / mean, texels // 2), periods)
    light = np.tile(np.float32(texture**blur), (len(texture), 1))
    luminance = beamspread.convolve(light, (0.0, 0.0, -1.0), library, albedo, 1.0, period / texels)[..., 0]
    row = np.pi * luminance[len(texture) // 2] * texture ** (1 - blur)
    middle = (periods // 2) * texels
    return row[middle : middle + texels].reshape(BINS, TEXELS_PER_BIN).mean(axis=1)


def main():
    photons = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
    for period in (10.0, 100.0):
        truth = simulated(period, photons)
        for blur in (0.0, 0.5, 1.0):
            found = by_convention(period, blur)
            error = np.abs(found - truth).mean() / truth.mean()
            contrast = [half[: BINS // 2].mean() / half[BINS // 2 :].mean() for half in (truth, found)]
            print(
                f"period {period:g}, blur {blur:g}: off by {error:.3f}; bright over dark {contrast[0]:.2f}, "
                f"by the convention {contrast[1]:.2f}; mean {found.mean() / truth.mean():.3f} of the truth"
            )


main()
