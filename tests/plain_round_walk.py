"""The simplest Monte Carlo in a ball and round a hollow ball, as `plain_walk`: shares no code with the engine.

Positions are relative to the ball's centre, and the surface is met by the usual formula for a ray and a sphere.
"""

import numpy as np

from plain_walk import fresnel, turn


def plain_round_walk(medium, curvature, angle, albedo, photons, seed):
    """Exits after at least one scattering as arrays (chord, azimuth, weight, order).

    Weights are per unit power that entered. The light enters at the top, (0, 0, radius), and travels toward +x.
    """
    rng = np.random.default_rng(seed)
    radius, inside = 1 / abs(curvature), curvature > 0
    sin_in = np.sin(np.radians(angle)) / medium.ior
    down = -1.0 if inside else 1.0  # into the medium
    entry = np.array([0.0, 0.0, radius])
    x = np.tile(entry, (photons, 1))
    w = np.tile([sin_in, 0.0, down * np.sqrt(1 - sin_in**2)], (photons, 1))
    weight, order = np.full(photons, 1.0 / photons), np.zeros(photons, int)
    exits = []
    while len(x):
        flight = rng.exponential(size=len(x))
        half_b, c = (x * w).sum(1), (x * x).sum(1) - radius**2
        root = np.sqrt(np.maximum(half_b**2 - c, 0.0))
        # From inside the ball the far root counts; from outside a hollow the near root, if the ray comes closer.
        limit = -half_b + root if inside else np.where((half_b < 0) & (half_b**2 > c), -half_b - root, np.inf)
        meets = flight >= limit
        x += np.where(meets, limit, flight)[:, None] * w
        normal = x / np.linalg.norm(x, axis=1, keepdims=True)
        cosine = np.abs((normal * w).sum(1))
        leaves = meets & (rng.random(len(x)) >= fresnel(np.minimum(cosine, 1.0), 1 / medium.ior))
        chosen = leaves & (order > 0)
        d = x[chosen] - entry
        exits.append(
            np.column_stack([np.linalg.norm(d, axis=1), np.arctan2(d[:, 1], d[:, 0]), weight[chosen], order[chosen]])
        )
        turned = meets & ~leaves
        x[turned] = radius * normal[turned]
        w[turned] -= 2 * (normal[turned] * w[turned]).sum(1, keepdims=True) * normal[turned]
        w[~meets] = turn(w[~meets], medium.g, rng)
        order[~meets] += 1
        weight[~meets] *= albedo
        faint = weight < 1e-2 / photons
        lost = faint & (rng.random(len(x)) >= 0.25)
        weight[faint] *= 4
        keep = ~leaves & ~lost
        x, w, weight, order = x[keep], w[keep], weight[keep], order[keep]
    return np.concatenate(exits).T
