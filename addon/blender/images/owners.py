"""Whose results an image holds. It is noted in the image, so that no bake overwrites another's result unasked.

Names are noted: a pointer would keep deleted objects in the file, and bring them along where the image is appended.
"""

from __future__ import annotations

import json

import bpy
import numpy as np

from ...core.bake.margin import WHOLE
from ...core.errors import BakeError
from ...core.scene.receiver import Receiver, build_receiver
from ...core.scene.uv_map import fit_uv_maps
from ...core.target import Target
from ..node.find import find_node, find_targets
from ..read.geometry import read_polygons
from ..read.instances import with_instanced

# Of an image: JSON, a list of (object, material).
KEY = "beamspread_results"

# Texels wholly inside two charts, as a part of one of them: more than rounding at a common border.
OVERLAP_TOLERANCE = 0.01

# Of each chart: column and row of its first texel, and the part of each texel inside it, float32 (rows, columns).
Parts = tuple[tuple[int, int, np.ndarray], ...]


def note_owner(image, target: Target) -> None:
    """Note that the image holds the result of the target beside those of its other owners."""
    owners = [*owners_of(image), target]
    image[KEY] = json.dumps(sorted({(one.object_name, one.material_name) for one in owners}))


def owners_of(image) -> list[Target]:
    """The targets whose results the image holds and that still show it; renamed ones under their new names."""
    noted = _noted(image)
    users = users_of(image) if noted else []
    return list(dict.fromkeys(user for one in noted for user in _known_as(one, users)))


def noted_as(image, target: Target) -> Target:
    """Under what names the image knows the target, which may have been renamed since its bake."""
    noted = _noted(image)
    if target in noted:
        return target
    users = users_of(image) if noted else []
    former = (one for one in noted if one not in users and _known_as(one, users) == [target])
    return next(former, target)


def others_in(image, target: Target) -> list[Target]:
    """Its owners but for the target."""
    return [owner for owner in owners_of(image) if owner != target]


def users_of(image) -> list[Target]:
    """What shows the image in its Beamspread node, in any scene."""
    return [
        target
        for target in find_targets(with_instanced(obj for obj in bpy.data.objects if obj.users_scene))
        if find_node(bpy.data.materials[target.material_name]).image == image
    ]


def _noted(image) -> list[Target]:
    return [Target(*names) for names in json.loads(image.get(KEY, "[]"))]


def _known_as(noted: Target, users: list[Target]) -> list[Target]:
    """The user of these names; else, as one of them may have changed, those of the same material or object."""
    if noted in users:
        return [noted]
    same_material = [user for user in users if user.material_name == noted.material_name]
    return same_material or [user for user in users if user.object_name == noted.object_name]


def parts_of(receiver: Receiver) -> Parts:
    """Where a receiver's charts lie in its texture."""
    return tuple((*chart.offset, chart.coverage) for chart in receiver.charts)


def read_parts(target: Target, width: int, height: int) -> Parts:
    """Where the charts of a target lie in a texture of that size: all over it, if that can't be told."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    try:
        obj = bpy.data.objects[target.object_name].evaluated_get(depsgraph)
        return parts_of(build_receiver(fit_uv_maps(read_polygons(obj, target.material_name)), width, height))
    except BakeError:
        return ((0, 0, np.ones((height, width), np.float32)),)


def within(texture: np.ndarray, column: int, row: int, coverage: np.ndarray) -> np.ndarray:
    """The part of a texture (height, width) where a chart lies, a view."""
    return texture[row : row + coverage.shape[0], column : column + coverage.shape[1]]


def overlaps(receiver: Receiver, parts: Parts) -> bool:
    """Whether a receiver's charts lie on those of others in the same texture by more than rounding."""
    shared = sum(int(((within(receiver.coverage, *part) > WHOLE) & (part[2] > 0)).sum()) for part in parts)
    return shared > OVERLAP_TOLERANCE * receiver.inside().sum()
