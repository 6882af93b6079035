"""The faces of a mesh that bends, as one part: triangles with shading normals, which the UV map may show in any way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import ReceiverError
from ..messages import Message, note, warning
from .bending import BALL, Bending, bending_of
from .ears import triangle_corners
from .islands import NO_UV_AREA, UNWRAP, connected_in_map
from .planes import FLATNESS_TOLERANCE, NO_AREA_BESIDE
from .polygons import Polygons, same_faces
from .sheet import bodies_of, closed_bodies

# Part of a mesh's edges, or of its area, that a sentence about them needs. More: fewer notes about small faults.
MIN_FAULT = 0.01

# Number of loose parts, the largest ones, among which near ones are looked for. More: slower, more complete.
MAX_LOOSE_PARTS = 256


@dataclass(frozen=True, eq=False)
class BentIsland:
    """Triangles that one image shows.

    Attributes
    ----------
    polygons : the triangles, with UVs from 0 to 1 in the image.
    pieces : int (N,), number of the piece of the UV map that shows each triangle.
    tile : number of the UDIM tile; 0 for one image.
    """

    polygons: Polygons
    pieces: np.ndarray
    tile: int = 0

    @cached_property
    def lengths(self) -> tuple[float, float]:
        """Lengths of the image's sides on the surface, root mean square over its area."""
        corners, uvs = self.polygons.corners.reshape(-1, 3, 3), self.polygons.uvs.reshape(-1, 3, 2)
        (a, b), (p, q) = ((values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]) for values in (uvs, corners))
        area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        is_shown = np.abs(area) > NO_UV_AREA
        a, b, p, q, area = a[is_shown], b[is_shown], p[is_shown], q[is_shown], area[is_shown, None]
        slopes = (p * b[:, 1:] - q * a[:, 1:]) / area, (q * a[:, :1] - p * b[:, :1]) / area
        weights = np.abs(area[:, 0])
        means = (np.average((slope**2).sum(axis=1), weights=weights) for slope in slopes)
        along, up = np.sqrt(list(means)).tolist()
        return along, up


@dataclass(frozen=True, eq=False)
class BentPart:
    """All faces of a mesh that bends; `islands` are those of each UDIM tile, `bending` that of them."""

    islands: tuple[BentIsland, ...]
    bending: Bending = BALL


def bent_part(polygons: Polygons) -> BentPart:
    """The part of faces whose UVs are checked; those without an area in space or in the UV map are left out.

    Raises
    ------
    ReceiverError
        No face has an area in the UV map.
    """
    is_shown = (polygons.uv_areas > NO_UV_AREA) & (polygons.areas > NO_AREA_BESIDE * polygons.areas.max())
    if not is_shown.any():
        raise ReceiverError("The UV map has no area in any face.", UNWRAP)
    islands = []
    for tile, part in polygons.of_faces(np.flatnonzero(is_shown)).by_tile().items():
        pieces, (corners, owners) = connected_in_map(part), triangle_corners(part, np.arange(part.count))
        islands.append(BentIsland(_outward(part, corners, owners), pieces[owners], tile))
    return BentPart(tuple(islands), bending_of(polygons))


def _outward(polygons: Polygons, corners: np.ndarray, owners: np.ndarray) -> Polygons:
    """Triangles of polygons, which `owners` names, anticlockwise seen from outside."""
    a, b, c = (polygons.corners[places] for places in corners.T)
    area_vectors = 0.5 * np.cross(b - a, c - a)
    is_turned = np.einsum("ij,ij->i", area_vectors, polygons.area_vectors[owners]) < 0
    corners = np.where(is_turned[:, None], corners[:, ::-1], corners).ravel()
    numbers = owners if polygons.numbers is None else polygons.numbers[owners]
    shading = None if polygons.corner_normals is None else polygons.corner_normals[corners]
    triangles = Polygons(
        polygons.corners[corners],
        polygons.uvs[corners],
        3 * np.arange(len(owners) + 1),
        polygons.normals[owners],
        polygons.uv_map,
        numbers,
        corner_normals=shading,
    )
    triangles.__dict__["area_vectors"] = np.where(is_turned[:, None], -area_vectors, area_vectors)  # known already
    return triangles


def facing_outward(
    polygons: Polygons, name: str, spread: float = 0.0, is_sheet: bool = False, whole: Polygons | None = None
) -> tuple[Polygons, list[Message]]:
    """The faces of the object `name` with closed bodies turned right side out, and messages about faces gone wrong.

    `spread`: how far light spreads, for the message about loose parts; 0: nowhere. The normals of a sheet tell its
    front, and stay. `whole`: all faces of the mesh, since bodies may have several materials; None: these are all.
    """
    body_of = bodies_of(polygons)
    messages = [*_faults(polygons, name), *_loose_parts(polygons, body_of, spread, name)]
    if is_sheet:
        return polygons, messages
    is_inward = _looks_inward(polygons, body_of) if whole is None else _looks_inward(whole)[polygons.numbers]
    if is_inward.any():
        are = "The normals" if is_inward.all() else f"The normals of {polygons.listed(is_inward)}"
        text = f"{are} of '{name}' point inward; it is baked as if they pointed outward."
        messages.append(note(name, text, "Recalculate them (Edit Mode: Shift N)."))
        polygons = _turned(polygons, is_inward)
    return polygons, messages


def _turned(polygons: Polygons, is_chosen: np.ndarray) -> Polygons:
    """The faces, of which the chosen ones look to their other side."""
    signs = np.where(is_chosen, -1.0, 1.0)[:, None]
    shading = polygons.corner_normals
    shading = None if shading is None else shading * signs[polygons.face_of].astype(np.float32)
    return replace(polygons, normals=polygons.normals * signs, corner_normals=shading)


def _looks_inward(polygons: Polygons, body_of: np.ndarray | None = None) -> np.ndarray:
    """True for each face of a body that is inside out; `body_of` is the result of `bodies_of` if that is known."""
    body_of = bodies_of(polygons) if body_of is None else body_of
    return _is_inside_out(polygons, body_of)[body_of]


def _is_inside_out(polygons: Polygons, body_of: np.ndarray) -> np.ndarray:
    """True for each body that is closed and whose faces look inward, unless it is the hollow of another one."""
    is_closed, volumes = closed_bodies(polygons, body_of)
    is_inward, is_outward = is_closed & (volumes < 0), is_closed & (volumes > 0)
    if not (is_inward.any() and is_outward.any()):
        return is_inward
    lows, highs = _boxes(polygons.corners, body_of[polygons.face_of], len(volumes))
    outer = np.flatnonzero(is_outward)
    for body in np.flatnonzero(is_inward).tolist():
        is_around = (lows[outer] <= lows[body]).all(axis=1) & (highs[outer] >= highs[body]).all(axis=1)
        is_inward[body] = not (is_around & (volumes[outer] > -volumes[body])).any()
    return is_inward


def _faults(polygons: Polygons, name: str) -> list[Message]:
    """Messages about faces that light can't pass between as in a solid."""
    messages = []
    first, second = polygons.shared_edges
    # Neighbors run along their common edge in opposite directions, unless a normal tells that a face is mirrored.
    looks = np.sign(np.einsum("ij,ij->i", _by_order(polygons), polygons.area_vectors))[polygons.face_of]
    is_same_way = polygons.points[first] == polygons.points[second]
    # More than two faces meet where bodies touch or lie on each other, and look to any side there.
    meetings = np.bincount(np.concatenate([first, second]), minlength=len(looks))
    is_told = (meetings[first] == 1) & (meetings[second] == 1) & (looks[first] * looks[second] != 0)  # by an area
    is_wrong = (is_same_way == (looks[first] == looks[second])) & is_told
    if is_wrong.sum() > MIN_FAULT * len(first):
        where = f"at {is_wrong.sum()} of {len(first)} edges: light can't be right there."
        text = f"Faces of '{name}' that touch look to opposite sides, {where}"
        remedy = "Recalculate the normals (Edit Mode: Shift N), or check modifiers."
        messages.append(warning(name, text, remedy))
    same = same_faces(polygons)
    is_double = np.bincount(same)[same] > 1
    part = polygons.areas[is_double].sum() / polygons.areas.sum()
    if part > MIN_FAULT:
        text = f"Faces of '{name}' lie on each other, {part:.0%} of its surface: light counts for each of them there."
        remedy = "Check the object's scale and modifiers, or merge them (Edit Mode: A, then M, By Distance)."
        messages.append(warning(name, text, remedy))
    return messages


def _loose_parts(polygons: Polygons, body_of: np.ndarray, spread: float, name: str) -> list[Message]:
    """The note about parts without a common edge that are so near to each other that light crosses between them."""
    areas = np.bincount(body_of, polygons.areas)
    largest = np.argsort(-areas, kind="stable")[:MAX_LOOSE_PARTS]
    # Bevels of no width leave faces without an area, which are no part of anything.
    largest = largest[areas[largest] > NO_AREA_BESIDE * polygons.areas.max()]
    if spread == 0 or len(largest) < 2:
        return []
    place = np.full(len(areas), -1)
    place[largest] = np.arange(len(largest))
    of_corner = place[body_of][polygons.face_of]
    lows, highs = _boxes(polygons.corners[of_corner >= 0], of_corner[of_corner >= 0], len(largest))
    is_near = (lows[:, None] <= highs[None] + spread).all(axis=2) & (lows[None] <= highs[:, None] + spread).all(axis=2)
    count = int((is_near.sum(axis=1) > 1).sum())
    if not count:
        return []
    text = f"{count} loose parts of '{name}' are near to others: light crosses between them as if they touched."
    return [note(name, text, "Separate them (Edit Mode: P, By Loose Parts) where it should not.")]


def _boxes(corners: np.ndarray, body_of: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates (count, 3) of the corners (K, 3) of each body, which has some."""
    order = np.argsort(body_of, kind="stable")
    starts = np.searchsorted(body_of[order], np.arange(count))
    return tuple(reduce.reduceat(corners[order], starts) for reduce in (np.minimum, np.maximum))


def _by_order(polygons: Polygons) -> np.ndarray:
    """Normals of faces by the order of their corners, float64 (N, 3), of any length."""
    points = polygons.corners - polygons.corners[np.repeat(polygons.starts[:-1], polygons.sizes)]
    crosses = np.cross(points, points[polygons.next_corners])
    return np.add.reduceat(crosses, polygons.starts[:-1], axis=0)


def lost_in_map(polygons: Polygons, name: str) -> list[Message]:
    """The warning about faces without an area in the UV map."""
    is_lost = (polygons.uv_areas <= NO_UV_AREA) & (polygons.areas > 0)
    part = polygons.areas[is_lost].sum() / polygons.areas.sum()
    return [] if part <= FLATNESS_TOLERANCE else [lost_faces(polygons, is_lost, part, name)]


def lost_faces(polygons: Polygons, is_lost: Sequence[bool], part: float, name: str) -> Message:
    """The warning about faces without an area in the UV map, a part of the surface."""
    text = f"Faces of '{name}' have no area in the UV map: {part:.1%} of its surface stay black."
    remedy = f"Unwrap the mesh again{': ' + polygons.listed(is_lost) if np.any(is_lost) else ''}."
    return warning(name, text, remedy)
