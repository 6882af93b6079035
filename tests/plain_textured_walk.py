"""A photon count in NumPy on a plane whose albedo differs from texel to texel; it shares no code with the engine.

Lengths are in mean free paths, the index of refraction is 1.
"""

import numpy as np

AT_ONCE, FAINT = 100_000, 0.02


def scattered(way, g, random):
    """Unit vectors (N, 3) after a scattering by Henyey and Greenstein."""
    bend = (1 - g * g) / (1 - g + 2 * g * random.random(len(way)))
    cosine = np.clip((1 + g * g - bend**2) / (2 * g), -1, 1)
    azimuth = 2 * np.pi * random.random(len(way))
    helper = np.where(np.abs(way[:, 2:]) < 0.9, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    first = np.cross(way, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    turned = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * np.cross(way, first)
    return cosine[:, None] * way + np.sqrt(1 - cosine**2)[:, None] * turned


def exitance(irradiance, travel, albedo, pitch, g, photons, thickness=np.inf, seed=1):
    """Exitance (H, W) of the lit face and of the far one; the latter without light that does not scatter.

    irradiance, albedo : (H, W). travel : (3,) or (H, W, 3), z < 0; the medium is below z = 0.
    """
    height, width = albedo.shape
    random = np.random.default_rng(seed)
    share = (irradiance / irradiance.sum()).ravel()
    travel = np.broadcast_to(travel, (height, width, 3)).reshape(-1, 3)
    power_of_photon = irradiance.sum() / (photons // AT_ONCE * AT_ONCE)
    faces = np.zeros((2, height, width))
    for _ in range(photons // AT_ONCE):
        texel = random.choice(len(share), AT_ONCE, p=share)
        at = np.stack([texel % width, texel // width], 1) + random.random((AT_ONCE, 2))
        place = np.column_stack([at * pitch, np.zeros(AT_ONCE)])
        way, power, is_scattered = travel[texel].astype(float), np.ones(AT_ONCE), np.zeros(AT_ONCE, bool)
        while len(place):
            step = random.exponential(size=len(place))
            depth = place[:, 2] + step * way[:, 2]
            for face, limit, out in ((0, 0.0, depth > 0), (1, -thickness, depth < -thickness)):
                left = out & is_scattered
                leaving = place[left] + ((limit - place[left, 2]) / way[left, 2])[:, None] * way[left]
                x, y = np.floor(leaving[:, :2] / pitch).astype(int).T
                within = (x >= 0) & (x < width) & (y >= 0) & (y < height)
                np.add.at(faces[face], (y[within], x[within]), power[left][within])
            stays = (depth <= 0) & (depth >= -thickness)
            place, way, power = (place + step[:, None] * way)[stays], way[stays], power[stays]
            column, row = (
                np.clip(np.floor(place[:, axis] / pitch), 0, size - 1).astype(int)
                for axis, size in ((0, width), (1, height))
            )
            power = power * albedo[row, column]
            survives = (power >= FAINT) | (random.random(len(power)) < power / FAINT)
            place, way, power = place[survives], way[survives], np.maximum(power, FAINT)[survives]
            is_scattered = np.ones(len(place), bool)
            way = scattered(way, g, random)
    return faces * power_of_photon
