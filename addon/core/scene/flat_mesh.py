"""A mesh as parts that can be baked: planes with the islands that show them in a texture, or one part that bends."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ReceiverError
from ..messages import Message, note, warning
from .bent_part import BentIsland, BentPart, bent_part, facing_outward, lost_faces, lost_in_map
from .ears import with_triangles
from .islands import NO_UV_AREA, UNWRAP, Island, check_uvs, find_islands
from .planes import FLATNESS_TOLERANCE, FLATTENED, Plane, find_planes
from .polygons import Polygons
from .sheet import sheet_messages
from .tiles import Place, Tiling

# Part of the area that may lie near edges at which planes meet, if the planes are baked apart. Larger: faster, and more
# light is lost at edges.
MAX_EDGES = 0.05


@dataclass(frozen=True, eq=False)
class FlatPart:
    """Faces of a mesh on one plane."""

    plane: Plane
    islands: tuple[Island, ...]


@dataclass(frozen=True, eq=False)
class FlatMesh:
    """Parts of a mesh that can be baked, and messages about them; `uv_map` as of `Polygons`.

    The parts are planes, the largest first, or one that bends. `tiling` has the UDIM tiles of its islands in the
    texture; None for one image.
    """

    parts: tuple[FlatPart, ...] | tuple[BentPart]
    messages: tuple[Message, ...] = ()
    uv_map: str = ""
    tiling: Tiling | None = None

    @property
    def islands(self) -> list[Island] | list[BentIsland]:
        """Islands of all parts."""
        return [island for part in self.parts for island in part.islands]

    @property
    def is_bent(self) -> bool:
        """True if all faces are one part that bends."""
        return any(isinstance(part, BentPart) for part in self.parts)

    def within(self, tiling: Tiling) -> FlatMesh:
        """The islands in these tiles."""
        parts = []
        for part in self.parts:
            islands = tuple(island for island in part.islands if island.tile in tiling.sizes)
            parts += [replace(part, islands=islands)] if islands else []
        return replace(self, parts=tuple(parts), tiling=tiling)

    def place(self, island: Island | BentIsland, width: int, height: int) -> Place:
        """Texels of the island's image in a texture of this size."""
        return Place(0, 0, width, height) if self.tiling is None else self.tiling.places[island.tile]


NO_FACES = "No face uses this material.", "Assign it to the faces that should be baked."
"""Text and remedy of the error about a material without faces."""


def finite_remedy(name: str) -> str:
    """Advice about an object with vertices at no finite position."""
    return (
        "Check its scale and modifiers, or move the vertices (Edit Mode). "
        f"bpy.data.objects['{name}'].data.validate() in the Python Console moves those of a mesh that are no numbers."
    )


def flatten(
    polygons: Polygons, mean_free_path: float = 0.0, name: str = "", spread: float = 0.0, is_sheet: bool = False
) -> FlatMesh:
    """Find the parts of a mesh of the object `name`.

    Faces are flattened onto a plane within a mean free path, in the units of the mesh, or within `FLATTENED`: the
    medium, or the texels, show no more. If the rest of the faces does not consist of planes, or if much light crosses
    the edges at which planes meet, all faces are one part. `spread`: how far light spreads; 0: it crosses no edges.
    `is_sheet`: the faces are slabs, and normals tell their front.

    Raises
    ------
    ReceiverError
        The mesh has no faces, no area or vertices at no finite position; or UVs that are missing, outside 0..1 or all
        without area.
    """
    check_faces(polygons, name)
    tolerance, whole, polygons = _tolerance(polygons, mean_free_path), polygons.whole, polygons.alone()
    polygons, planes, bent = _planes_of(polygons, tolerance)
    check_uvs(polygons.uvs)
    about_sheet = sheet_messages(polygons, name) if is_sheet else []
    if len(bent) or _edge_part(polygons, planes, spread) > MAX_EDGES:
        polygons, messages = facing_outward(polygons, name, spread, is_sheet, whole)
        messages += about_sheet + lost_in_map(polygons, name)
        return FlatMesh((bent_part(polygons),), tuple(messages), polygons.uv_map)
    exact = FLATNESS_TOLERANCE * polygons.diagonal
    messages, black, parts, lost = about_sheet, [], [], 0.0
    is_lost = np.zeros(polygons.count, bool)
    for plane in planes:
        # Faces that are flattened are shorter on the plane than their UVs say.
        fitted = tolerance if plane.deviation > exact else exact
        try:
            islands = find_islands(polygons, plane, fitted)
        except ReceiverError as error:
            text = f"{error.text} {_capital(polygons.listed(plane.faces))} of '{name}' stay black."
            black.append(warning(name, text, error.remedy))
            continue
        area = sum(float(island.polygons.areas.sum()) for island in islands)
        lost += float((polygons.area_vectors[plane.faces] @ plane.normal).sum()) - area
        is_lost[plane.faces] = polygons.uv_areas[plane.faces] <= NO_UV_AREA if area > 0 else True
        if area > 0:
            parts.append(FlatPart(plane, islands))
    if not parts:
        if black:
            raise ReceiverError(black[0].text, black[0].remedy)
        raise ReceiverError("The UV map has no area in any face.", UNWRAP)
    messages += black
    part_lost = lost / sum(float(polygons.areas[plane.faces].sum()) for plane in planes)
    if part_lost > FLATNESS_TOLERANCE:
        messages.append(lost_faces(polygons, is_lost, part_lost, name))
    deviation = max(part.plane.deviation for part in parts)
    if deviation > exact:
        text = f"'{name}' is baked as flat faces; it departs from them by {deviation:.3g} units"
        paths = f", {deviation / mean_free_path:.2g} mean free paths" if mean_free_path > 0 else ""
        messages.append(note(name, f"{text}{paths}."))
    return FlatMesh(tuple(parts), tuple(messages), polygons.uv_map)


def check_faces(polygons: Polygons, name: str) -> None:
    """Raise ReceiverError if the object `name` has no faces, or vertices at no finite position."""
    if not polygons.count:
        raise ReceiverError(*NO_FACES)
    if not polygons.is_finite.all():
        text = f"The positions of {polygons.listed(~polygons.is_finite)} are infinite or not numbers."
        raise ReceiverError(text, finite_remedy(name))


def bends(polygons: Polygons, mean_free_path: float = 0.0, spread: float = 0.0) -> bool:
    """True if faces with an area, at finite positions, would be one part that bends; arguments as of `flatten`."""
    polygons, planes, bent = _planes_of(polygons, _tolerance(polygons, mean_free_path))
    return len(bent) > 0 or _edge_part(polygons, planes, spread) > MAX_EDGES


def _tolerance(polygons: Polygons, mean_free_path: float) -> float:
    return max(mean_free_path, FLATTENED * polygons.diagonal)


def _planes_of(polygons: Polygons, tolerance: float) -> tuple[Polygons, list[Plane], np.ndarray]:
    """The faces, warped ones as triangles, with the results of `find_planes`."""
    planes, bent = find_planes(polygons, tolerance)
    warped = bent[(polygons.sizes[bent] > 3) & (polygons.deviations[bent] > tolerance)]
    if len(warped):
        polygons = with_triangles(polygons, warped)
        planes, bent = find_planes(polygons, tolerance)
    return polygons, planes, bent


def _edge_part(polygons: Polygons, planes: Sequence[Plane], spread: float) -> float:
    """Part of the area that lies within `spread` of edges at which planes meet, about."""
    plane_of = np.full(polygons.count, -1)
    for number, plane in enumerate(planes):
        plane_of[plane.faces] = number
    first, second = polygons.shared_edges
    faces = polygons.face_of
    meets = (plane_of[faces[first]] != plane_of[faces[second]]) & (plane_of[faces[[first, second]]] >= 0).all(axis=0)
    begin = first[meets]
    lengths = np.linalg.norm(polygons.corners[polygons.next_corners[begin]] - polygons.corners[begin], axis=1)
    return 2 * spread * float(lengths.sum()) / float(polygons.areas.sum())


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
