"""Islands: parts of a plane that the UV map shows in one piece, by an affine map P = p_0 + u p_u + v p_v."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from ..errors import ReceiverError
from ..native import native
from .ears import triangles_of_face
from .planes import FLATNESS_TOLERANCE, Plane
from .polygons import Polygons, components

# Largest distance of UVs from 0..1: rounding of float32 coordinates.
UV_TOLERANCE = 1e-4

# Extent in UVs, over that of the whole map, below which an island has no area.
NO_EXTENT = 1e-6

# Area of a face in the UV map, over that of the image, that counts as none.
NO_UV_AREA = 1e-14

# Part of all area that may lie in faces without area in the UV map: those of tiny bevels.
MAX_LOST = 0.01

# Texels along the side of an image in which overlaps are looked for, and part of the map that may overlap: rounding,
# and faces that share a border.
PROBE_SIDE, MAX_OVERLAP = 2048, 0.01

# Sum, over all edges, of the probe's texels that an edge passes through, from which on the probe takes every n-th row.
# This many take a second; slivers across the image pass through more. An overlap between two of the rows stays unseen.
MAX_PASSED = 1e8

# Part of the map that must overlap, by the areas of its faces, from which on no texels are filled: this takes as many
# times as long as faces lie on each other.
CLEAR_OVERLAP = 0.9

# Largest number of islands of a mesh; more take much time and memory.
MAX_ISLANDS = 100_000


@dataclass(frozen=True, eq=False)
class Island:
    """Faces of a plane with P(u, v) = p_0 + u p_u + v p_v; `polygons` have their corners on the plane.

    `tile` is the number of the UDIM tile whose corner is the UV (0, 0); 0 for one image.
    """

    polygons: Polygons
    p_0: np.ndarray
    p_u: np.ndarray
    p_v: np.ndarray
    tile: int = 0

    @property
    def lengths(self) -> tuple[float, float]:
        """Lengths of the image's sides on the plane."""
        return float(np.linalg.norm(self.p_u)), float(np.linalg.norm(self.p_v))

    def is_orthogonal(self) -> bool:
        """True if texels are rectangles."""
        cosine = self.p_u @ self.p_v / (np.linalg.norm(self.p_u) * np.linalg.norm(self.p_v))
        return abs(cosine) < FLATNESS_TOLERANCE


NEW_MAP = "If the node's UV Map is empty, Beamspread's own Bake makes a map."
"""Other uses than a bake, such as Live, make no map."""

UNWRAP = f"Unwrap the mesh again. {NEW_MAP}"
UNWRAP_APART = f"Unwrap the mesh so that each face has its own place (UV > Smart UV Project). {NEW_MAP}"


def check_uvs(uvs: np.ndarray | None) -> None:
    """Raise ReceiverError for UVs that are missing, no numbers, or outside of the image."""
    if uvs is None or len(uvs) == 0:
        raise ReceiverError("The mesh has no UV map.", "Bake it: Beamspread's own Bake makes a UV map.")
    if not np.isfinite(uvs).all():
        raise ReceiverError("The UV map has coordinates that are not numbers.", UNWRAP)
    low, high = uvs.min(), uvs.max()
    if low < -UV_TOLERANCE or high > 1 + UV_TOLERANCE:
        raise ReceiverError(
            f"The UV map reaches outside the image (coordinates from {low:.3g} to {high:.3g}).",
            UNWRAP,
        )


def check_map(polygons: Polygons) -> None:
    """Raise ReceiverError for a UV map that can't show each face in a place of its own in one image."""
    check_uvs(polygons.uvs)
    sizes = polygons.uv_areas
    is_lost = (sizes <= NO_UV_AREA) & (polygons.areas > 0)
    if polygons.areas[is_lost].sum() > MAX_LOST * polygons.areas.sum():
        listed = "" if is_lost.all() else f": {polygons.listed(is_lost)}"
        text = f"The UV map has no area in {is_lost.sum()} of {polygons.count} faces{listed}."
        raise ReceiverError(text, UNWRAP)
    total, in_tiles = max(float(sizes.sum()), 1e-30), polygons.by_tile()
    least = 1 - len(in_tiles) / total  # images show no more
    if least > CLEAR_OVERLAP:
        _refuse_overlap(f"over {min(int(100 * least), 99)}%")
    covered, drawn = np.sum([_shown(part) for part in in_tiles.values()], axis=0)
    if drawn - covered > MAX_OVERLAP * drawn:
        _refuse_overlap(f"{1 - covered / drawn:.0%}")


def _refuse_overlap(part: str) -> NoReturn:
    text = f"The UV map overlaps: {part} of it show several faces."
    raise ReceiverError(text, UNWRAP_APART)


def _shown(polygons: Polygons) -> tuple[float, float]:
    """Texels of the probe that faces of one image cover, and the sum of the faces' areas in these texels."""
    texels = np.ascontiguousarray(np.clip(polygons.uvs, 0, 1) * PROBE_SIDE)
    passed = np.abs(texels - texels[polygons.next_corners]).sum()
    step = int(np.clip(np.ceil(passed / MAX_PASSED), 1, PROBE_SIDE // 2))
    counts, rows = polygons.sizes.astype(np.uint32), PROBE_SIDE // step
    coverage = native.coverage(texels, counts, PROBE_SIDE, rows, row_step=step, is_cut=False)
    return float(np.minimum(coverage, 1).sum(dtype=float)), float(coverage.sum(dtype=float))


def find_islands(polygons: Polygons, plane: Plane, tolerance: float) -> tuple[Island, ...]:
    """Islands of a plane, the largest first. Corners are within `tolerance` of their affine map.

    Faces that their UVs bend, as trapezoids on squares, are cut into triangles. Faces without area in the map are left
    out.
    """
    part = polygons.of_faces(plane.faces)
    heights = (part.corners - plane.centre) @ plane.normal
    part = replace(part, corners=part.corners - heights[:, None] * plane.normal)
    islands: list[Island] = []
    for tile, polygons in part.by_tile().items():
        islands += [replace(island, tile=tile) for island in _in_one_image(polygons, plane, tolerance)]
    return tuple(sorted(islands, key=lambda island: -island.polygons.areas.sum()))


def _in_one_image(part: Polygons, plane: Plane, tolerance: float) -> list[Island]:
    whole = _fit(part, plane, tolerance)
    if whole is not None:
        return [whole]
    islands: list[Island] = []
    for piece in _pieces(part, connected_in_map(part)):
        island = _fit(piece, plane, tolerance)
        islands += [island] if island is not None else _of_triangles(piece, plane, tolerance)
    return islands


def _of_triangles(piece: Polygons, plane: Plane, tolerance: float) -> list[Island]:
    """Islands of faces that the UV map bends: of faces where it is affine within one, else of triangles."""
    islands = []
    for face in _pieces(piece, np.arange(piece.count)):
        island = _fit(face, plane, tolerance)
        if island is not None:
            islands.append(island)
            continue
        islands += filter(None, (_fit(triangle, plane, np.inf) for triangle in _triangles(face, plane)))
    return _joined(islands)


def _triangles(face: Polygons, plane: Plane) -> list[Polygons]:
    """Triangles with an area of a face on a plane."""
    corners = triangles_of_face(face.corners, plane.normal)
    starts, normals = np.arange(0, corners.size + 1, 3), np.repeat(face.normals, len(corners), axis=0)
    triangles = Polygons(face.corners[corners.ravel()], face.uvs[corners.ravel()], starts, normals)
    return [triangle for triangle in _pieces(triangles, np.arange(triangles.count)) if triangle.areas.any()]


def _joined(islands: Sequence[Island]) -> list[Island]:
    """Islands with the same map become one."""
    groups: dict[tuple, list[Island]] = {}
    for island in islands:
        values = np.concatenate([island.p_0, island.p_u, island.p_v])
        step = FLATNESS_TOLERANCE * np.linalg.norm(island.p_u)
        groups.setdefault(tuple(np.round(values / step).tolist()), []).append(island)
    return [_union(group) for group in groups.values()]


def _union(group: Sequence[Island]) -> Island:
    parts = [island.polygons for island in group]
    sizes = np.concatenate([part.sizes for part in parts])
    corners, uvs, normals = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("corners", "uvs", "normals")
    )
    joined = Polygons(corners, uvs, np.concatenate([[0], np.cumsum(sizes)]).astype(int), normals)
    return replace(group[0], polygons=joined)


def connected_in_map(part: Polygons) -> np.ndarray:
    """Number of the connected part in the UV map of each face, int (N,)."""
    first, second = part.shared_edges
    following = part.next_corners
    is_same = np.zeros(len(first), bool)
    for begin, end in ((second, following[second]), (following[second], second)):
        near = np.abs(part.uvs[first] - part.uvs[begin]).max(axis=1) < UV_TOLERANCE * 0.1
        near &= np.abs(part.uvs[following[first]] - part.uvs[end]).max(axis=1) < UV_TOLERANCE * 0.1
        is_same |= near
    faces = part.face_of
    return components(part.count, faces[first[is_same]], faces[second[is_same]])


def _pieces(part: Polygons, labels: np.ndarray) -> list[Polygons]:
    order = np.argsort(labels, kind="stable")
    counts = np.bincount(labels)
    if len(counts) > MAX_ISLANDS:
        raise ReceiverError(
            f"The UV map has {len(counts)} islands; {MAX_ISLANDS} are allowed.", "Unwrap the mesh again."
        )
    return [part.of_faces(faces) for faces in np.split(order, np.cumsum(counts)[:-1])]


def _fit(part: Polygons, plane: Plane, tolerance: float) -> Island | None:
    """The island of faces; None if no affine map with an area fits them."""
    corners, uvs = part.corners, part.uvs
    uv_centre, centre = uvs.mean(axis=0), corners.mean(axis=0)
    extents = np.linalg.svd(uvs - uv_centre, compute_uv=False)
    if extents[1] < NO_EXTENT * np.sqrt(len(uvs)):
        return None
    slopes = np.linalg.lstsq(uvs - uv_centre, corners - centre, rcond=None)[0]
    if np.abs(centre + (uvs - uv_centre) @ slopes - corners).max() > tolerance:
        return None
    p_u, p_v = slopes - np.outer(slopes @ plane.normal, plane.normal)
    if np.linalg.norm(np.cross(p_u, p_v)) < 1e-9 * np.linalg.norm(p_u) * np.linalg.norm(p_v):
        return None
    return Island(part, centre - uv_centre @ slopes, p_u, p_v)
