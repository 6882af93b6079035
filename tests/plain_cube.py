"""Monte Carlo of diffuse light in a cube with refraction, sharing no code with the engine.

Scattering is isotropic; lengths are in mean free paths. By reciprocity the part of diffuse light from one point that
leaves anywhere is the exitance of that point over its irradiance in a world that is even all around.
"""

import numpy as np

# Photons of less than this weight end by halves. Smaller: slower, less noise.
LEAST_WEIGHT = 0.05


def fresnel(cosine, ratio):
    """Reflectance of unpolarized light; `ratio`: index on its side over the one beyond."""
    square = ratio * ratio * (1 - cosine * cosine)
    beyond = np.sqrt(np.clip(1 - square, 0, 1))
    across = (ratio * cosine - beyond) / (ratio * cosine + beyond)
    along = (cosine - ratio * beyond) / (cosine + ratio * beyond)
    return np.where(square >= 1, 1.0, (across**2 + along**2) / 2)


def returned(point, half, albedo, ior, photons, seed=1):
    """Part of diffuse light at a point of a cube's face z = `half` that leaves the cube, and its standard error."""
    rng = np.random.default_rng(seed)
    cosine = np.sqrt(rng.random(photons))
    sine, turn = np.sqrt(1 - cosine**2) / ior, 2 * np.pi * rng.random(photons)
    way = np.stack([sine * np.cos(turn), sine * np.sin(turn), -np.sqrt(1 - sine**2)], 1)
    place, weight = np.tile(np.array(point, float), (photons, 1)), 1 - fresnel(cosine, 1 / ior)
    left, inside = np.zeros(photons), np.arange(photons)
    while len(inside):
        at, to = place[inside], way[inside]
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.where(to > 0, (half - at) / to, (-half - at) / to)
        ends[to == 0] = np.inf
        axis, flight = ends.argmin(1), -np.log(1 - rng.random(len(inside)))
        ahead = ends[np.arange(len(inside)), axis]
        at += to * np.minimum(flight, ahead)[:, None]
        hit = np.flatnonzero(flight >= ahead)
        is_mirrored = rng.random(len(hit)) < fresnel(np.abs(to[hit, axis[hit]]), ior)
        mirrored, gone = hit[is_mirrored], hit[~is_mirrored]
        to[mirrored, axis[mirrored]] *= -1
        at[hit] = np.clip(at[hit], -half, half)
        left[inside[gone]] = weight[inside[gone]]
        stay = np.ones(len(inside), bool)
        stay[gone] = False
        scatter = np.flatnonzero(flight < ahead)
        weight[inside[scatter]] *= albedo
        z, turn = 2 * rng.random(len(scatter)) - 1, 2 * np.pi * rng.random(len(scatter))
        flat = np.sqrt(1 - z * z)
        to[scatter] = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], 1)
        weak = np.flatnonzero(stay & (weight[inside] < LEAST_WEIGHT))
        lives = rng.random(len(weak)) < 0.5
        weight[inside[weak[lives]]] *= 2
        stay[weak[~lives]] = False
        place[inside], way[inside] = at, to
        inside = inside[stay]
    return left.mean(), left.std() / np.sqrt(photons)
