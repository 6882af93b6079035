"""How each target becomes a job, or a sentence that says why it can't; shared by operator, engine and batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import bpy

from ....core.bake.bake_settings import BakeSettings
from ....core.bake.estimate import machine_bytes
from ....core.bake.job import BakeJob, needs_medium, to_simulate
from ....core.bake.runner import Bake
from ....core.bake.surface import Surface
from ....core.errors import BakeError
from ....core.scene.receiver import build_receiver, texture_size
from ....core.scene.uv_map import fit_uv_maps
from ....core.target import Target
from ...cycles.colors import bytes_of_colors, seconds_of_colors
from ...cycles.cycles_light import CopyForCycles, CyclesLight
from ...images.files import check_image
from ...images.sequence import is_sequence, size_of_frames
from ...node.find import find_node_in_groups, materials_of
from ...node.node import BeamspreadNode
from ...read.geometry import read_polygons
from ...read.lights import read_illumination
from ...read.visibility import ObjectInstance, as_rendered, check_instance, find_instances, render_visible_names
from .linked_color import BaseColor, ColorByCycles, read_texture

# Stands for a base color that is found when the job runs.
SOME_COLOR = (0.5, 0.5, 0.5)


def prepare_scene(
    context, targets: list[Target], settings: BakeSettings, resolution: int | None = None
) -> Iterator[Bake]:
    """Read the scene as it would render at its current frame; a bake for each target, as they are asked for."""
    return map(read_scene(context, targets, settings, resolution).bake, targets)


def read_scene(context, targets: list[Target], settings: BakeSettings, resolution: int | None = None) -> Preparation:
    """Read what bakes of the targets need, as the scene would render at its current frame.

    Parameters
    ----------
    resolution : texels along the longer side; None keeps the size of the node's image, or the scene's setting where
        there is none.
    """
    depsgraph = context.evaluated_depsgraph_get()
    places = {material: find_node_in_groups(material) for material in bpy.data.materials}
    # Also materials of other objects: their nodes must be known not to shine.
    for material, (_, around) in ((material, place) for material, place in places.items() if place is not None):
        evaluated = material.evaluated_get(depsgraph).node_tree
        groups = [group.node_tree for group in around]
        # No more than needs it is tagged: views, and the material's icons, would start again.
        for tree, copy in [(material.node_tree, evaluated), *((one, one.evaluated_get(depsgraph)) for one in groups)]:
            if not all(map(_is_current, tree.nodes, copy.nodes)):
                tree.update_tag()
    with as_rendered(context.view_layer):
        visible = render_visible_names(context.view_layer)
        return Preparation(context.evaluated_depsgraph_get(), targets, settings, resolution, visible=visible)


def _is_current(node, copy) -> bool:
    """Whether a node is evaluated as it is.

    It is of an unknown class where that was before its class was registered, and values that scripts set tag nothing.
    """
    if copy.bl_idname != node.bl_idname or not isinstance(node, BeamspreadNode):
        return copy.bl_idname == node.bl_idname
    return (copy.surface(), copy.texture_blur) == (node.surface(), node.texture_blur)


class Preparation:
    """What was read of a scene at one time, from which each target's job is made when it is its turn: jobs are large.

    `size` overrides all other sizes, `visible` names the objects that render, None: all. Afterwards the depsgraph is
    no longer needed, but for the copy of the scene that Cycles gets, where none is given: the first job that needs one
    makes it.
    """

    def __init__(
        self,
        depsgraph,
        targets: list[Target],
        settings: BakeSettings,
        resolution: int | None = None,
        size: tuple[int, int] | None = None,
        visible: set[str] | None = None,
        copy: CopyForCycles | None = None,
    ) -> None:
        self.settings = settings
        self._plans: dict[Target, _Plan | Exception] = {}
        try:
            self._illumination, self._by_cycles = read_illumination(depsgraph), CyclesLight(depsgraph, copy)
            placed = find_instances(depsgraph, {target.object_name for target in targets}, visible)
        except Exception as error:  # noqa: BLE001 - each bake asked for needs an answer
            self._plans = dict.fromkeys(targets, error)
            return
        for target in targets:
            try:
                here = placed.get(target.object_name)
                check_instance(target.object_name, here, depsgraph.view_layer)
                self._plans[target] = _read_target(depsgraph, target, here, resolution, size)
            except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
                self._plans[target] = error

    def size(self, target: Target) -> tuple[int, int] | None:
        """Of the target's image, in texels."""
        plan = self._plans[target]
        return None if isinstance(plan, Exception) else plan.size

    def to_simulate(self, target: Target, quality: str) -> list:
        """The media that its bake would have to simulate first."""
        plan = self._plans[target]
        return [] if isinstance(plan, Exception) else to_simulate(plan.surface, replace(self.settings, quality=quality))

    def color_seconds(self, target: Target) -> float:
        """About how long Cycles takes for its base colour, where it does."""
        plan = self._plans[target]
        asks = (
            needs_medium(self.settings) and not isinstance(plan, Exception) and isinstance(plan.texture, ColorByCycles)
        )
        return seconds_of_colors(*plan.size) if asks else 0.0

    def bake(self, target: Target, settings: BakeSettings | None = None) -> Bake:
        """The target's bake, with its job or the reason why there is none; in the main thread."""
        plan = self._plans[target]
        if isinstance(plan, Exception):
            return Bake(target, error=plan)
        try:
            receiver = build_receiver(plan.maps, *plan.size)
            illumination = self._illumination.lighting(target.object_name)
            job = BakeJob(target.object_name, receiver, illumination, plan.surface, settings or self.settings)
            if isinstance(plan.texture, ColorByCycles):
                job = plan.texture.in_job(job, self._by_cycles.copy())
            elif plan.texture is not None:
                job = plan.texture.in_job(job)
            job = self._by_cycles.complete(job)
            check_memory(job, self.settings.memory_limit)
            return Bake(target, job)
        except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
            return Bake(target, error=error)


@dataclass(frozen=True)
class _Plan:
    """What is kept of a target until it is its turn."""

    maps: list
    size: tuple[int, int]
    surface: Surface
    texture: BaseColor | ColorByCycles | None = None


def _read_target(
    depsgraph, target: Target, placed: ObjectInstance, resolution: int | None, size: tuple[int, int] | None
) -> _Plan:
    node, groups = find_node_in_groups(
        next(one for one in materials_of(placed.obj) if one.name == target.material_name)
    )
    surface = node.surface()
    surface.check()
    if size is None and node.image is not None:
        image = node.image.original
        if not is_sequence(image):  # a batch fills its files
            check_image(image)
        own = size_of_frames(image) if is_sequence(image) else tuple(image.size)
        size = own if resolution is None else None
    maps = fit_uv_maps(read_polygons(placed.obj, target.material_name, placed.matrix))
    size = size or texture_size(maps, resolution or depsgraph.scene.beamspread.resolution)
    if not node.has_texture():
        return _Plan(maps, size, surface)
    texture = read_texture(node, groups, placed, build_receiver(maps, *size))
    if texture.unknown:
        by_cycles = ColorByCycles(target, surface, texture.blur, placed)
        return _Plan(maps, size, replace(surface, base_color=SOME_COLOR), by_cycles)
    return _Plan(maps, size, texture.on(surface), texture)


def check_memory(job: BakeJob, limit: int) -> None:
    """Raise BakeError if a bake, or Cycles before it, would take more bytes than allowed; 0: than the machine has."""
    limit = limit or machine_bytes()
    size = job.receiver.width, job.receiver.height
    texels = f"{size[0]} x {size[1]} texels"
    needs = [(job.memory_bytes(), f"{texels} take about")]
    if job.more_color is not None:
        needs.append((bytes_of_colors(*size), f"Cycles' process for the base color of {texels} takes about"))
    needed, who = max(needs)
    if limit and needed > limit:
        raise BakeError(
            f"{who} {needed / 2**30:.1f} GB of memory, and {limit / 2**30:.1f} GB are "
            "allowed: lower the resolution, or raise the memory limit in the add-on's preferences."
        )
