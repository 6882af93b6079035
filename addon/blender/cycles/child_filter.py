"""Removes noise from maps of light by the means of their neighbors, as wide as the light allows, and measures the rest.

Part of the child process (child.py). Two independent halves of the samples show at each width both errors: noise, which
only one half has, and blur, which makes the filtered half differ from the other one (as in Rousselle, Manzi and Zwicker
2013, "Robust denoising using feature and color information").
"""

import math
from functools import lru_cache

import numpy as np

# Passes of the filter 1/4, 1/2, 1/4 along both axes, for each width; sigma is the root of half the number, in nodes.
PASSES = (0, 1, 3, 8, 20, 48)

# Passes for local means of squared errors. More choose the width more surely, for larger parts of the map.
LOCAL_PASSES = 96

# Factor of the mean squared error over its estimate, which is of the same samples as the choice of the widths.
HIDDEN_ERROR = 1.4

# Neighbors of a node in space, and nodes whose neighbors are found at once. More neighbors: wider tails, more time.
NEAREST, CHUNK = 16, 256

# Fraction of the strata with light around a dark node, from which the node counts as the inside of an object.
# Larger values darken surfaces beside objects; smaller ones brighten those that light seldom reaches.
LIT_STRATA = 0.25


def final_share(passes: int, variance: float) -> float:
    """Part of the noise's variance that is left after these passes and a Gaussian of a variance, in squared nodes."""
    return min(1.0, 1 / (4 * math.pi * (passes / 2 + variance)))


def node_share(passes: int) -> float:
    """Variance that is left at a node after these passes: the squared sum of squared weights along an axis."""
    return (math.comb(4 * passes, 2 * passes) / 16**passes) ** 2


def filter_map(first, second, inside, variance, neighbors):
    """The filtered mean of two independent maps, float32 (rows, columns, 3), and mean squares of its error.

    Parameters
    ----------
    inside : bool (rows, columns), nodes inside of objects, which stay dark and don't count.
    variance : of the Gaussian that reduces noise as much as all that follows, in squared distances of nodes.
    neighbors : `Grid` or `Cloud`; the nodes of the latter are rows of one column.

    Returns
    -------
    The map, and mean squared noise and blur of its mean channel, as they are at the end.
    """
    lit = (~inside).astype(np.float32)
    if not lit.any():
        return np.zeros_like(first), 0.0, 0.0
    difference = ((first - second).mean(axis=-1)) ** 2 / 2
    local_variance = smooth(difference, lit, LOCAL_PASSES, neighbors)
    costs, versions = [], []
    sides = [first, second]
    done = 0
    for passes in PASSES:
        sides = [smooth(side, lit, passes - done, neighbors) for side in sides]
        done = passes
        crossed = sum(((a - b).mean(axis=-1)) ** 2 for a, b in zip(sides, (second, first))) / 2
        blur = crossed - (1 + node_share(passes)) * difference  # square of the blur, on average
        noise = final_share(passes, variance) / 2
        local_error = smooth(crossed, lit, LOCAL_PASSES, neighbors)
        costs.append(local_error + (noise - 1 - node_share(passes)) * local_variance)
        versions.append(((sides[0] + sides[1]) / 2, blur, noise * difference))
    best = np.argmin(costs, axis=0)
    result, blurs, noises = np.zeros_like(first), np.zeros(lit.shape), np.zeros(lit.shape)
    for number, (values, blur, noise) in enumerate(versions):
        chosen = smooth((best == number).astype(np.float32), lit, 1, neighbors)
        result += chosen[..., None] * values
        blurs += chosen * blur
        noises += chosen * noise
    result *= lit[..., None]
    before, after = ((first + second) / 2).mean(axis=(0, 1)), result.mean(axis=(0, 1))
    result *= np.divide(before, after, out=np.zeros_like(before), where=after > 0)
    return result, HIDDEN_ERROR * float((noises * lit).mean()), HIDDEN_ERROR * max(float((blurs * lit).mean()), 0.0)


def smooth(values, lit, passes: int, neighbors):
    """Means of the neighbors that are lit, after these passes."""
    if not passes:
        return values
    weights = lit if values.ndim == 2 else lit[..., None]
    total, weight = neighbors.passed(values * weights, passes), neighbors.passed(weights, passes)
    return np.divide(total, weight, out=np.zeros_like(total), where=weight > 1e-6) * weights


class Grid:
    """Neighbors on a plane."""

    @staticmethod
    def passed(values, passes: int):
        """The values after these passes along both axes; beyond the border they go on with the last one."""
        down, across = (_matrix(length, passes) for length in values.shape[:2])
        return np.einsum(
            "ij,jk...->ik...", down, np.einsum("kl,jl...->jk...", across, values, optimize=True), optimize=True
        )


class Cloud:
    """Neighbors among nodes in space, for which a pass is about as wide as one on a grid.

    Parameters
    ----------
    positions, normals : (N, 3).
    spacing : distance of neighbors, about.
    """

    def __init__(self, positions, normals, spacing: float) -> None:
        positions, normals = np.asarray(positions), np.asarray(normals)
        count = min(NEAREST, len(positions))
        self._nearest = np.empty((len(positions), count), np.intp)
        self._weights = np.empty((len(positions), count), np.float32)
        squares = (positions**2).sum(1)
        for first in range(0, len(positions), CHUNK):
            part = slice(first, first + CHUNK)
            squared = squares[part, None] + squares - 2 * positions[part] @ positions.T
            nearest = np.argpartition(squared, count - 1, axis=1)[:, :count]
            distance = np.maximum(np.take_along_axis(squared, nearest, 1), 0)
            alike = np.maximum(np.einsum("ni,nki->nk", normals[part], normals[nearest]), 0)
            weights = np.exp(-distance / spacing**2) * alike + 1e-30
            self._nearest[part], self._weights[part] = nearest, weights / weights.sum(1, keepdims=True)

    def passed(self, values, passes: int):
        """The values (N, 1, ...) after these passes."""
        for _ in range(passes):
            values = np.einsum("nk,nk...->n...", self._weights, values[self._nearest])
        return values


@lru_cache(maxsize=32)
def _matrix(length: int, passes: int):
    once = np.zeros((length, length))
    for i in range(length):
        for j, weight in ((i - 1, 0.25), (i, 0.5), (i + 1, 0.25)):
            once[i, min(max(j, 0), length - 1)] += weight
    return np.linalg.matrix_power(once, passes).astype(np.float32)


def insides(radiance, neighbors):
    """Nodes inside of objects, bool (rows, columns): dark ones, among nodes that most strata light.

    `radiance` is (K, rows, columns, 3). Nodes that are dark by chance, where light is rare, are no insides.
    """
    fraction = (radiance.any(axis=-1)).mean(axis=0)
    dark = fraction == 0
    total, weight = fraction.astype(np.float32), (~dark).astype(np.float32)
    total, weight = neighbors.passed(total, 2), neighbors.passed(weight, 2)
    around = np.divide(total, weight, out=np.zeros_like(total), where=weight > 0)
    return dark & (around > LIT_STRATA)
