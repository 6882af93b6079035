"""A mesh as flat parts, each a plane with the islands that show it in a texture."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import ReceiverError
from ..messages import Message, note, warning
from .islands import MAX_LOST, Island, check_uvs, find_islands
from .planes import FLATNESS_TOLERANCE, FLATTENED, Plane, find_planes
from .polygons import Polygons


@dataclass(frozen=True, eq=False)
class FlatPart:
    """Faces of a mesh on one plane."""

    plane: Plane
    islands: tuple[Island, ...]


@dataclass(frozen=True, eq=False)
class FlatMesh:
    """Parts of a mesh that can be baked, the largest first; messages about the rest; `uv_map` as of `Polygons`."""

    parts: tuple[FlatPart, ...]
    messages: tuple[Message, ...] = ()
    uv_map: str = ""


def finite_remedy(name: str) -> str:
    """Advice about an object with vertices at no finite position."""
    return f"Check its scale and modifiers, or run bpy.data.objects['{name}'].data.validate() in the Python Console."


def flatten(polygons: Polygons, mean_free_path: float = 0.0, name: str = "") -> FlatMesh:
    """Find the flat parts of a mesh of the object `name`.

    Faces are flattened onto a plane within a mean free path, in the units of the mesh, or within `FLATTENED`: the
    medium, or the texels, show no more.

    Raises
    ------
    ReceiverError
        The mesh has no faces, no area or no flat part, or UVs that are missing, outside 0..1 or without area.
    """
    if not polygons.count:
        raise ReceiverError("No face uses this material.", "Assign it to the faces that should be baked.")
    if not polygons.is_finite.all():
        text = f"The positions of {polygons.listed(~polygons.is_finite)} are infinite or not numbers."
        raise ReceiverError(text, finite_remedy(name))
    tolerance = max(mean_free_path, FLATTENED * polygons.diagonal)
    planes, bent = find_planes(polygons, tolerance)
    if not planes:
        raise ReceiverError(
            "The faces are not flat: they bend from one to the next.",
            "Only flat faces, and edges of 30 degrees or more between them, can be baked.",
        )
    check_uvs(polygons.uvs)
    exact = FLATNESS_TOLERANCE * polygons.diagonal
    parts = []
    for plane in planes:
        # Faces that are flattened are shorter on the plane than their UVs say.
        fitted = tolerance if plane.deviation > exact else exact
        parts.append(FlatPart(plane, find_islands(polygons, plane, fitted)))
    areas = [sum(float(island.polygons.areas.sum()) for island in part.islands) for part in parts]
    lost = 1 - sum(areas) / sum(float((polygons.area_vectors[plane.faces] @ plane.normal).sum()) for plane in planes)
    if lost > MAX_LOST:
        raise ReceiverError("The UV map has no area, in all or some of the faces.", "Unwrap the mesh again.")
    parts = [part for part, area in zip(parts, areas) if area > 0]
    messages = []
    if lost > FLATNESS_TOLERANCE:
        text = f"Faces of '{name}' have no area in the UV map: {lost:.1%} of its surface stay black."
        messages.append(warning(name, text, "Unwrap the mesh again."))
    if len(bent):
        text = f"{len(bent)} of {polygons.count} faces of '{name}' are bent and stay black."
        remedy = f"Give them another material, or flatten them: {polygons.listed(bent)}."
        messages.append(warning(name, text, remedy))
    deviation = max(plane.deviation for plane in planes)
    if deviation > exact:
        messages.append(note(name, f"'{name}' is baked as flat faces; it departs from them by {deviation:.3g} units."))
    return FlatMesh(tuple(parts), tuple(messages), polygons.uv_map)
