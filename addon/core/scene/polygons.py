"""Faces of a mesh, and which of them touch."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

# Distance of corners, over the diagonal of all, below which they are the same point.
SAME_POINT = 1e-6

# Number of faces after a face, in the order of their numbers, with which an edge pairs it. More find coplanar faces at
# edges of more than nine faces.
MAX_APART = 8

# Largest coordinate, in scene units. Native code takes ten times as much (`max_coordinate` in triangle_set.cpp).
MAX_COORDINATE = 1e17

# Largest number of faces, or runs of faces, that a message lists.
MAX_LISTED = 5


@dataclass(frozen=True, eq=False)
class Polygons:
    """The faces that receive light.

    Attributes
    ----------
    corners : float64 (K, 3), world positions of all face corners.
    uvs : float64 (K, 2), or None if the mesh has no UV map.
    starts : int (N + 1,), face i has the corners starts[i] : starts[i + 1].
    normals : float64 (N, 3), outward unit normals, world.
    uv_map : name of the map of the UVs; "" is the one that renders.
    numbers : int (N,), numbers of the faces in the mesh; None: all in their order.
    tiles : int (N,), number of each face's UDIM tile, in which its UVs lie; None: one image.
    corner_normals : float32 (K, 3), shading normals of the corners, world; None: those of the faces.
    whole : all faces of the mesh, of which these have the `numbers`; None: these are all, or the others don't matter.
    """

    corners: np.ndarray
    uvs: np.ndarray | None
    starts: np.ndarray
    normals: np.ndarray
    uv_map: str = ""
    numbers: np.ndarray | None = None
    tiles: np.ndarray | None = None
    corner_normals: np.ndarray | None = None
    whole: Polygons | None = None

    @property
    def count(self) -> int:
        """Number of faces."""
        return len(self.starts) - 1

    @property
    def sizes(self) -> np.ndarray:
        """Number of corners of each face, int (N,)."""
        return np.diff(self.starts)

    @property
    def face_of(self) -> np.ndarray:
        """Face of each corner, int (K,)."""
        return np.repeat(np.arange(self.count), self.sizes)

    @cached_property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around all corners."""
        return float(np.linalg.norm([np.ptp(column) for column in self.corners.T])) if len(self.corners) else 0.0

    @cached_property
    def is_finite(self) -> np.ndarray:
        """True for each face whose corners are at finite positions that computations can tell apart, bool (N,)."""
        is_far = ~(np.abs(self.corners) < MAX_COORDINATE).all(axis=1)
        return sums(is_far, self.starts) == 0

    @cached_property
    def area_vectors(self) -> np.ndarray:
        """Area of each face times its unit normal, float64 (N, 3), outward."""
        points = self.corners - self.corners[np.repeat(self.starts[:-1], self.sizes)]
        x, y, z = points.T
        next_x, next_y, next_z = points[self.next_corners].T
        crosses = y * next_z - z * next_y, z * next_x - x * next_z, x * next_y - y * next_x
        vectors = 0.5 * np.stack([sums(part, self.starts) for part in crosses], axis=1)
        is_inward = np.einsum("ij,ij->i", vectors, np.nan_to_num(self.normals)) < 0
        return np.where(is_inward[:, None], -vectors, vectors)

    @cached_property
    def areas(self) -> np.ndarray:
        """Area of each face, float64 (N,)."""
        return np.linalg.norm(self.area_vectors, axis=1)

    @cached_property
    def uv_areas(self) -> np.ndarray:
        """Area of each face in the UV map, float64 (N,)."""
        u, v = (self.uvs - self.uvs[np.repeat(self.starts[:-1], self.sizes)]).T
        return 0.5 * np.abs(sums(u * v[self.next_corners] - v * u[self.next_corners], self.starts))

    @cached_property
    def points(self) -> np.ndarray:
        """Number of the point of each corner, int (K,): corners at the same position are one point."""
        step = SAME_POINT * max(self.diagonal, 1e-30)
        low = np.array([column.min() for column in self.corners.T])
        cells = np.round((self.corners - low) / step).astype(np.int64)
        return np.unique(_mixed(cells), return_inverse=True)[1]

    @cached_property
    def shared_edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of corners, two arrays (P,), at which edges begin that two faces have in common.

        An edge of many faces gives pairs of each face and the `MAX_APART` after it.
        """
        begin, end = self.points, self.points[self.next_corners]
        edges = np.minimum(begin, end) * (begin.max(initial=0) + 1) + np.maximum(begin, end)
        order = np.argsort(edges, kind="stable")
        order = order[(begin != end)[order]]
        edges, first, second = edges[order], [], []
        for apart in range(1, MAX_APART + 1):
            is_same = edges[apart:] == edges[:-apart]
            if not is_same.any():
                break
            first.append(order[:-apart][is_same])
            second.append(order[apart:][is_same])
        return tuple(np.concatenate([*pairs, np.zeros(0, int)]) for pairs in (first, second))

    @cached_property
    def next_corners(self) -> np.ndarray:
        """The next corner of the same face, int (K,)."""
        following = np.arange(1, len(self.corners) + 1)
        ends = self.starts[1:][self.sizes > 0] - 1
        following[ends] = self.starts[:-1][self.sizes > 0]
        return following

    def split(self, points: np.ndarray) -> list[np.ndarray]:
        """Split a per-corner array into one array per face."""
        return [points[begin:end] for begin, end in zip(self.starts[:-1], self.starts[1:])]

    def of_faces(self, faces: np.ndarray) -> Polygons:
        """Polygons of these faces alone."""
        if np.array_equal(faces, np.arange(self.count)):
            return self._numbered()
        sizes = self.sizes[faces]
        starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        corners = np.repeat(self.starts[:-1][faces] - starts[:-1], sizes) + np.arange(starts[-1])
        uvs = None if self.uvs is None else self.uvs[corners]
        numbers = np.arange(self.count)[faces] if self.numbers is None else self.numbers[faces]
        tiles = None if self.tiles is None else self.tiles[faces]
        shading = None if self.corner_normals is None else self.corner_normals[corners]
        part = Polygons(self.corners[corners], uvs, starts, self.normals[faces], self.uv_map, numbers, tiles, shading)
        for name in ("area_vectors", "areas"):
            if name in self.__dict__:  # known already
                part.__dict__[name] = self.__dict__[name][faces]
        return part

    def _numbered(self) -> Polygons:
        """The same polygons with `numbers`, and all that is known of them."""
        if self.numbers is not None:
            return self
        same = copy(self)
        object.__setattr__(same, "numbers", np.arange(self.count))
        return same

    def alone(self) -> Polygons:
        """The same polygons without the `whole` mesh, and all that is known of them."""
        if self.whole is None:
            return self
        same = copy(self)
        object.__setattr__(same, "whole", None)
        return same

    def by_tile(self) -> dict[int, Polygons]:
        """Faces of each UDIM tile, by its number; all by 0 without tiles."""
        if self.tiles is None:
            return {0: self}
        numbers = np.unique(self.tiles).tolist()
        return {number: self.of_faces(np.flatnonzero(self.tiles == number)) for number in numbers}

    @property
    def deviations(self) -> np.ndarray:
        """Largest distance of a corner from the mean plane of its face, float64 (N,)."""
        normals = self.area_vectors / np.maximum(self.areas, 1e-300)[:, None]
        heights = np.einsum("ij,ij->i", self.corners, normals[self.face_of])
        means = sums(heights, self.starts) / np.maximum(self.sizes, 1)
        return largest(np.abs(heights - means[self.face_of]), self.starts)

    def listed(self, faces: np.ndarray) -> str:
        """Words for faces (an index) by their numbers: "faces 2, 5 and 6 to 9"; the first few of many."""
        numbers = np.unique(np.arange(self.count)[faces] if self.numbers is None else self.numbers[faces])
        runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
        names = [name for run in runs for name in (map(str, run) if len(run) < 3 else [f"{run[0]} to {run[-1]}"])]
        names[MAX_LISTED:] = ["more"] * (len(names) > MAX_LISTED)
        listed = " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
        return f"face{'s' if len(numbers) > 1 else ''} {listed}"


def same_faces(polygons: Polygons) -> np.ndarray:
    """A number for each face, int (N,), that faces with the same corners share."""
    keys = np.random.default_rng(0).random(polygons.points.max(initial=0) + 1)
    faces = np.column_stack([1e9 * sums(keys[polygons.points], polygons.starts), polygons.sizes])
    return np.unique(_mixed(np.round(faces).astype(np.int64)), return_inverse=True)[1].ravel()


def sums(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Sum of the values (K,) of each run that begins at starts[:-1]; 0 for an empty one."""
    return _of_runs(np.add, values, starts)


def largest(values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Largest value (K,), 0 or more, of each run that begins at starts[:-1]; 0 for an empty one."""
    return _of_runs(np.maximum, values, starts)


def _of_runs(operation: np.ufunc, values: np.ndarray, starts: np.ndarray) -> np.ndarray:
    result = np.zeros(len(starts) - 1)
    is_filled = np.diff(starts) > 0
    if is_filled.any():
        result[is_filled] = operation.reduceat(values, starts[:-1][is_filled])
    return result


def components(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Number of the connected part of each of `count` items, int (count,), from pairs of connected items."""
    label = np.arange(count)
    while len(first):
        low = np.minimum(label[first], label[second])
        before = label.copy()
        np.minimum.at(label, first, low)
        np.minimum.at(label, second, low)
        np.minimum.at(label, before[first], low)
        np.minimum.at(label, before[second], low)
        while True:  # every item points at the first item of its part
            shorter = label[label]
            if np.array_equal(shorter, label):
                break
            label = shorter
        if np.array_equal(label[first], label[second]):
            break
    return np.unique(label, return_inverse=True)[1]


def _mixed(cells: np.ndarray) -> np.ndarray:
    """A number for each row of integers (K, 1 to 3); different rows have different ones but for 1 in 2^40 pairs."""
    factors = 0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
    with np.errstate(over="ignore"):
        keys = sum(column * np.uint64(factor) for column, factor in zip(cells.astype(np.uint64).T, factors))
    return keys ^ (keys >> np.uint64(29))
