"""The setting of the paper's figures, and its method as published.

Lengths are in units of the paper, 1 unit = 1 texel. It doesn't say how many of them are a mean free path. We take one
(not in Fig. 7): a simulation that knows nothing but its medium counts in mean free paths. See `fig6` for others.
"""

import functools
from itertools import product

import beamspread as bs
import numpy as np
from scipy.ndimage import gaussian_filter, rotate, uniform_filter

UNIT = 1.0  # mean free paths
SLAB = bs.Medium(g=0.8, ior=1.0, thickness=750 * UNIT)
WINDOW = 150  # units: the part of an LDF that the paper keeps
LASER_DIAMETER = 40.0  # units, where irradiance is 1 / e^2 of its peak

# Samples and colours of Fig. 7 to 9.
ANGLES = (0.0, 60.0)
ALBEDOS = (0.2, 0.999)
ALBEDO_RGB = (0.6, 0.9, 0.3)
ALBEDO_RGB_SWAPPED = (0.9, 0.3, 0.6)


def laser_image(library, angle, albedo, size, unit=UNIT, diameter=LASER_DIAMETER):
    """Mean exitance of texels of one unit around a Gaussian beam, 1/mfp^2; `unit` in mean free paths."""
    sigma = diameter / 4  # exp(-2 (r / radius)^2) = exp(-r^2 / (2 sigma^2))
    border = int(4 * sigma + 1)
    pencil = library.image(angle, albedo, size + 2 * border, unit).astype(float)
    return gaussian_filter(pencil, sigma)[border:-border, border:-border]


def laser_sample(library, angle, albedo, size=WINDOW, unit=UNIT, diameter=LASER_DIAMETER):
    """The same as an LdfSample."""
    image = laser_image(library, angle, albedo, size, unit, diameter)
    return bs.LdfSample(image, unit, angle, albedo, diameter * unit, library.medium.g)


def square_sample(library, angle, albedo, side):
    """LdfSample of a beam that fills `side` x `side` texels; the window reaches as far beyond them as beyond one."""
    size = WINDOW + side
    pencil = library.image(angle, albedo, (size + side) // 2 * 2 + 1, UNIT).astype(float)
    # A square of even side has its centre between texels: half a texel right of and above that of the filter.
    first = (len(pencil) - 1) // 2 - (size - 1) // 2
    image = uniform_filter(pencil, side, mode="constant")[first : first + size, first : first + size]
    return bs.LdfSample(image, UNIT, angle, albedo, 2 / np.sqrt(np.pi) * side * UNIT, library.medium.g)


@functools.cache
def square_samples(library, side):
    """The four samples of Fig. 8 and 9."""
    return [square_sample(library, *at, side) for at in product(ANGLES, ALBEDOS)]


@functools.cache
def square_kernel(library, angle, albedo, side, azimuth):
    return turned(bs.interpolate(square_samples(library, side), angle, albedo, method="angular").image, azimuth)


def turned(image, azimuth):
    """An LDF of a beam that travels toward an azimuth, degrees; window and all."""
    if azimuth % 360 == 0:
        return image
    if azimuth % 360 == 180:
        return image[::-1, ::-1]
    # rotate() turns from the first axis to the second: rows go up here, so its angles run clockwise.
    return rotate(image, -azimuth, order=1)


def travel(angle, azimuth):
    """Unit vector along which a beam travels, in the plane's frame; degrees."""
    theta, beta = np.radians([angle, azimuth])
    return np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), -np.cos(theta)


def stamp(luminance, image, row, column, power):
    """Adds the light of one beam: O, the image's centre, at (row, column), in texels from the lower left corner."""
    height, width = image.shape
    top, left = round(row - height / 2), round(column - width / 2)
    bottom, right = top + height, left + width
    inside = image[max(0, -top) : height - max(0, bottom - len(luminance)),
                   max(0, -left) : width - max(0, right - luminance.shape[1])]  # fmt: skip
    luminance[max(0, top) : bottom, max(0, left) : right] += np.float32(power / np.pi) * inside


def convolve(library, beams, angle, azimuth, albedos, shape):
    """Eq. 2 by beams of different sizes (Sec. 3.3): luminance, shape + (3,), under an irradiance of 1 on each square.

    `beams`: as adaptive_beams gives them.
    """
    luminance = np.zeros((*shape, 3), np.float32)
    for channel, albedo in enumerate(albedos):
        plane = np.zeros(shape, np.float32)
        for row, column, side, power in beams.tolist():
            image = square_kernel(library, angle, albedo, side, azimuth)
            stamp(plane, image, row + side / 2, column + side / 2, power)
        luminance[..., channel] = plane
    return luminance
