"""The flat parts of a target as they were read, and the size of its texture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ....core.bake.spread import length_of
from ....core.bake.surface import Surface
from ....core.messages import Message
from ....core.scene.flat_mesh import FlatMesh, flatten
from ....core.scene.receiver import texture_size
from ....core.target import Target
from ...images.facts import is_sequence, size_of_frames
from ...images.files import check_image
from ...node.find import BakeTarget, targets_of
from ...read.geometry import read_polygons
from ...read.visibility import ObjectInstance
from ...settings import BeamspreadSettings


@dataclass(frozen=True, eq=False)
class Receiving:
    """A target with its flat parts."""

    target: BakeTarget
    instance: ObjectInstance
    surface: Surface
    mesh: FlatMesh


def read_receiver(target: Target, instance: ObjectInstance, fills_image: bool, outcome: Message | None) -> Receiving:
    evaluated: BakeTarget = next(evaluated for evaluated in targets_of(instance.obj) if evaluated.name == target)
    surface, image = evaluated.node.surface(), evaluated.image
    surface.check()
    if fills_image and image is not None and not is_sequence(image):  # a batch fills a sequence's files
        check_image(image)
    polygons = read_polygons(instance.obj, target.material_name, instance.matrix, evaluated.node.uv_map)
    mesh = flatten(polygons, min(surface.material.mean_free_path), target.object_name)
    if outcome is not None:
        mesh = replace(mesh, messages=(outcome, *mesh.messages))
    return Receiving(evaluated, instance, surface, mesh)


def size_for(
    receiving: Receiving, together: Iterable[Receiving], resolution: int | None, settings: BeamspreadSettings
) -> tuple[int, int]:
    """Width and height of a target's texture. Targets of one material without an image will share a new one."""
    target, image = receiving.target, receiving.target.image
    if resolution is None and image is not None:
        return size_of_frames(image) if is_sequence(image) else tuple(image.size)
    sharing = [item for item in together if item.target.material.name == target.material.name]
    is_textured = target.node.has_texture()
    sides = (settings.side_for(length_of(item.mesh), item.surface, is_textured) for item in sharing)
    return texture_size(receiving.mesh, resolution or max(sides))
