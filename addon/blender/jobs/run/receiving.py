"""The parts of a target as they were read, and the size of its texture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from ....core.bake.spread import length_of, lengths_of_tiles, spread_over_edges
from ....core.bake.surface import Surface
from ....core.errors import ReceiverError
from ....core.messages import Message
from ....core.scene.flat_mesh import FlatMesh, flatten
from ....core.scene.receiver import texture_size
from ....core.scene.tiles import Tiling
from ....core.target import Target
from ...images.facts import is_sequence, size_of_frames
from ...images.files import check_image
from ...images.image_operators import wanted_size
from ...images.udim import sizes_for
from ...node.find import BakeTarget, targets_of, uses_tiles
from ...read.geometry import read_polygons, remedy_for
from ...read.visibility import ObjectInstance
from ...settings import BeamspreadSettings


@dataclass(frozen=True, eq=False)
class Receiving:
    """A target with its parts."""

    target: BakeTarget
    instance: ObjectInstance
    surface: Surface
    mesh: FlatMesh
    is_tiled: bool


def read_receiver(
    target: Target, instance: ObjectInstance, fills_image: bool, outcome: Message | None, uv_map: str = ""
) -> Receiving:
    """Read a target; `fills_image` is False if its result goes to another image than the node's.

    `uv_map` names the map of that image; "": the node's choice.
    """
    evaluated: BakeTarget = next(evaluated for evaluated in targets_of(instance.obj) if evaluated.name == target)
    surface, image = evaluated.node.surface(), evaluated.image
    surface.check()
    if fills_image and image is not None and not is_sequence(image):  # a batch fills a sequence's files
        check_image(image)
    is_tiled = fills_image and uses_tiles(evaluated.node, target.side)
    polygons = read_polygons(
        instance.obj, target.material_name, instance.matrix, uv_map or evaluated.node.uv_map, is_tiled
    )
    path = min(surface.material.mean_free_path)
    try:
        mesh = flatten(polygons, path, target.object_name, spread_over_edges(surface), surface.thickness > 0)
    except ReceiverError as error:
        raise ReceiverError(error.text, remedy_for(instance.obj, error.remedy)) from error
    for_type = (replace(message, remedy=remedy_for(instance.obj, message.remedy)) for message in mesh.messages)
    mesh = replace(mesh, messages=tuple(for_type))
    if outcome is not None:
        mesh = replace(mesh, messages=(outcome, *mesh.messages))
    return Receiving(evaluated, instance, surface, mesh, is_tiled)


def sized(
    receiving: Receiving,
    together: Iterable[Receiving],
    resolution: int | None,
    settings: BeamspreadSettings,
    fills_nodes: bool,
) -> tuple[FlatMesh, tuple[int, int]]:
    """The mesh with its UDIM tiles, and width and height of its texture.

    If the results fill the nodes' images, targets of one material without an image will share a new one.
    """
    target, image, mesh = receiving.target, receiving.target.image, receiving.mesh
    sharing = [item for item in together if item.target.name.image_key == target.name.image_key]
    if receiving.is_tiled:
        sizes = _tile_sizes(receiving, sharing, resolution, settings)
        tiling = Tiling(tuple(sorted(sizes.items())), settings.margin)
        return replace(mesh, tiling=tiling), tiling.size
    if resolution is None and image is not None:
        return mesh, size_of_frames(image) if is_sequence(image) else tuple(image.size)
    is_textured = target.node.has_texture()
    sides = (settings.side_for(length_of(item.mesh), item.surface, is_textured, item.mesh.is_bent) for item in sharing)
    beside = [item.mesh for item in sharing] if fills_nodes else []
    return mesh, texture_size(mesh, resolution or max(sides), beside)


def _tile_sizes(
    receiving: Receiving, sharing: list[Receiving], resolution: int | None, settings: BeamspreadSettings
) -> dict[int, tuple[int, int]]:
    """Width and height of the tiles that a target uses, by their numbers. New tiles are squares."""
    target, numbers = receiving.target, sorted({island.tile for island in receiving.mesh.islands})
    if target.image is not None:
        sizes = sizes_for(target.image, numbers, target.name.object_name)
        return {number: wanted_size(size, resolution or max(size)) for number, size in sizes.items()}
    sides = dict.fromkeys(numbers, resolution or 0)
    for item in [] if resolution else sharing:
        for number, length in lengths_of_tiles(item.mesh).items():
            if number in sides:
                side = settings.side_for(length, item.surface, target.node.has_texture(), item.mesh.is_bent)
                sides[number] = max(sides[number], side)
    return {number: (side, side) for number, side in sides.items()}
