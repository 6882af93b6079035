"""The simplest Monte Carlo of the same medium, sharing no code with the engine: analog exits, weight by albedo.

Slow on purpose and easy to check: photons move by exponential flights, turn by the Henyey-Greenstein phase function,
meet the boundaries by Fresnel's formulas, and are counted where they leave.
"""

import numpy as np


def fresnel(cos_i, eta):
    """Unpolarized reflectance; eta is the index behind the boundary over the one before it."""
    sin2_t = (1 - cos_i**2) / eta**2
    cos_t = np.sqrt(np.maximum(0, 1 - sin2_t))
    parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    return np.where(sin2_t >= 1, 1.0, (parallel**2 + perpendicular**2) / 2)


def turn(w, g, rng):
    """New directions after one scattering; w is (n, 3)."""
    n = len(w)
    u = rng.random(n)
    cos_d = 1 - 2 * u if g == 0 else (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
    sin_d = np.sqrt(np.maximum(0, 1 - cos_d**2))
    phi = 2 * np.pi * rng.random(n)
    helper = np.where(np.abs(w[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    a = np.cross(helper, w)
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(w, a)
    return cos_d[:, None] * w + sin_d[:, None] * (np.cos(phi)[:, None] * a + np.sin(phi)[:, None] * b)


def plain_walk(medium, angle, albedo, photons, seed):
    """Exits as arrays (u, v, weight, transmitted); weights are per unit incident power, unscattered light included."""
    rng = np.random.default_rng(seed)
    cos_out = np.cos(np.radians(angle))
    sin_in = np.sin(np.radians(angle)) / medium.ior
    x = np.zeros((photons, 3))
    w = np.tile([sin_in, 0.0, np.sqrt(1 - sin_in**2)], (photons, 1))
    weight = np.full(photons, (1 - float(fresnel(cos_out, medium.ior))) / photons)
    start = weight[0]
    exits = []
    while len(x):
        flight = rng.exponential(size=len(x))
        with np.errstate(divide="ignore"):
            to_bottom = (medium.thickness - x[:, 2]) / np.maximum(w[:, 2], 1e-300)
            limit = np.where(w[:, 2] < 0, -x[:, 2] / w[:, 2], to_bottom)
        meets = flight >= limit
        x += np.where(meets, limit, flight)[:, None] * w
        up = w[:, 2] < 0
        leaves = meets & (rng.random(len(x)) >= fresnel(np.abs(w[:, 2]), 1 / medium.ior))
        exits.append(np.column_stack([x[leaves, :2], weight[leaves], ~up[leaves]]))
        x[meets, 2] = np.where(up[meets], 0.0, medium.thickness)
        w[meets & ~leaves, 2] *= -1
        w[~meets] = turn(w[~meets], medium.g, rng)
        weight[~meets] *= albedo
        # Russian roulette where next to nothing is left.
        faint = weight < 1e-2 * start
        lost = faint & (rng.random(len(x)) >= 0.25)
        weight[faint] *= 4
        keep = ~leaves & ~lost
        x, w, weight = x[keep], w[keep], weight[keep]
    u, v, weights, side = np.concatenate(exits).T
    return u, v, weights, side > 0
