"""Seams: edges of islands with the faces on their other sides, from which margins may take their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .chart import Chart
from .flat_mesh import FlatMesh
from .islands import Island
from .polygons import Polygons, sums


@dataclass(frozen=True, eq=False)
class Seams:
    """Edges of all islands in a texture.

    Attributes
    ----------
    ends : float64 (E, 2, 2), both ends of each edge, column and row in texels.
    charts : int (E,), chart of the face on the other side; -1 where there is none.
    to_grid : float64 (E, 2, 3), maps (column, row, 1) in the texture to the grid of that chart, as if its face were
        folded into the plane of the island.
    """

    ends: np.ndarray
    charts: np.ndarray
    to_grid: np.ndarray


def find_seams(mesh: FlatMesh, charts: Sequence[Chart], width: int, height: int) -> Seams:
    """Seams of a mesh and of its charts, in a texture of that size."""
    islands = [island for part in mesh.parts for island in part.islands]
    chart_of = np.repeat(np.arange(len(mesh.parts)), [len(part.islands) for part in mesh.parts])
    polygons = _joined([island.polygons for island in islands])
    island_of = np.repeat(np.arange(len(islands)), [len(island.polygons.corners) for island in islands])
    first, second = polygons.shared_edges
    is_open = polygons.points != polygons.points[polygons.next_corners]
    is_open[first] = is_open[second] = False
    is_seam = island_of[first] != island_of[second]
    first, second = first[is_seam], second[is_seam]
    near, far = np.concatenate([first, second]), np.concatenate([second, first])
    edges = np.concatenate([near, np.flatnonzero(is_open)])
    places = np.array([mesh.place(island, width, height) for island in islands])
    at = polygons.uvs * places[island_of, 2:4] + places[island_of, :2]
    ends = np.stack([at[edges], at[polygons.next_corners[edges]]], axis=1)
    charts_beyond, to_grid = np.full(len(edges), -1), np.zeros((len(edges), 2, 3))
    charts_beyond[: len(far)] = chart_of[island_of[far]]
    normals = np.array([part.plane.normal for part in mesh.parts])[chart_of]
    beyond = _unfolded(polygons, normals[island_of], _texel_positions(islands, places)[island_of[near]], near, far)
    axes, origins = _frames([chart.grid for chart in charts])
    beyond[..., 2] -= origins[chart_of[island_of[far]]]
    to_grid[: len(far)] = axes[chart_of[island_of[far]]] @ beyond
    return Seams(ends, charts_beyond, to_grid)


def _texel_positions(islands: Sequence[Island], places: np.ndarray) -> np.ndarray:
    """Maps (N, 3, 3) of (column, row, 1) in the texture to world positions on the plane of each island."""
    maps = []
    for island, (column, row, width, height, *_) in zip(islands, places):
        across, up = island.p_u / width, island.p_v / height
        maps.append(np.stack([across, up, island.p_0 - column * across - row * up], axis=1))
    return np.array(maps)


def _frames(grids: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Axes of grids over the sizes of their texels, (N, 2, 3), and their origins, (N, 3)."""
    axes = [[np.array(grid.x_axis) / grid.pitch_x, np.array(grid.y_axis) / grid.pitch_y] for grid in grids]
    return np.array(axes), np.array([grid.origin for grid in grids])


def _unfolded(
    polygons: Polygons, normals: np.ndarray, positions: np.ndarray, near: np.ndarray, far: np.ndarray
) -> np.ndarray:
    """Maps (E, 3, 3) of (column, row, 1) to positions on the faces beyond edges.

    A position p at a distance d outside an edge of a face, at length s along that edge, becomes the position at
    distance d inside the other face of the edge, at the same length.

    Parameters
    ----------
    normals : of the planes of all corners.
    positions : maps (E, 3, 3) of (column, row, 1) to positions p.
    near, far : corners at which the edges begin, of the face and of the other one.
    """
    begin = polygons.corners[near]
    along = _unit(polygons.corners[polygons.next_corners[near]] - begin)
    relative = positions.copy()
    relative[..., 2] -= begin
    distance = -np.einsum("ei,eij->ej", _inward(polygons, normals[near], near), relative)
    length = np.einsum("ei,eij->ej", along, relative)
    across = _inward(polygons, normals[far], far)
    beyond = along[:, :, None] * length[:, None] + across[:, :, None] * distance[:, None]
    beyond[..., 2] += begin
    return beyond


def _inward(polygons: Polygons, normals: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Unit vectors (E, 3) in planes of these normals, from the edges at the corners to the inside of their faces."""
    points = polygons.corners - polygons.corners[np.repeat(polygons.starts[:-1], polygons.sizes)]
    crosses = np.cross(points, points[polygons.next_corners])
    vectors = np.stack([sums(crosses[:, axis], polygons.starts) for axis in range(3)], axis=1)
    is_turned = np.einsum("ei,ei->e", vectors[polygons.face_of[corners]], normals) < 0
    edges = polygons.corners[polygons.next_corners[corners]] - polygons.corners[corners]
    inward = _unit(np.cross(normals, edges))
    return np.where(is_turned[:, None], -inward, inward)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def _joined(parts: Sequence[Polygons]) -> Polygons:
    sizes = np.concatenate([part.sizes for part in parts])
    corners, uvs, normals = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("corners", "uvs", "normals")
    )
    return Polygons(corners, uvs, np.concatenate([[0], np.cumsum(sizes)]).astype(int), normals)
