"""Makes the job of each target, or the error that says why there is none; for operator, engine and batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ....core.bake.bake_settings import BakeSettings
from ....core.bake.job import BakeJob, needs_medium, to_simulate
from ....core.bake.runner import Bake
from ....core.bake.surface import Surface
from ....core.scene.receiver import build_receiver, texture_size
from ....core.scene.texture import BaseColor
from ....core.scene.uv_map import fit_uv_maps
from ....core.target import Target
from ...cycles.colors import BaseColorByCycles, not_evaluated
from ...cycles.cycles_light import CopyForCycles, CyclesLight
from ...images.files import check_image
from ...images.sequence import is_sequence, size_of_frames
from ...node.find import find_node_in_groups, materials_of
from ...node.node import BeamspreadNode
from ...read.base_color import read_texture
from ...read.geometry import read_polygons
from ...read.lights import read_illumination
from ...read.visibility import ObjectInstance, as_rendered, check_instance, find_instances, render_visible_names

PLACEHOLDER_COLOR = (0.5, 0.5, 0.5)
"""Base color until Cycles has evaluated it."""


def prepare_scene(
    context, targets: list[Target], settings: BakeSettings, resolution: int | None = None
) -> Iterator[Bake]:
    """Read the scene as it would render at its current frame; makes a bake for each target when it is asked for."""
    return map(read_scene(context, targets, settings, resolution).bake, targets)


def read_scene(context, targets: list[Target], settings: BakeSettings, resolution: int | None = None) -> Preparation:
    """Read the scene for bakes of the targets, as it would render at its current frame.

    Parameters
    ----------
    resolution : texels along the longer side; None keeps the size of the node's image, or the scene's setting where
        there is none.
    """
    depsgraph = context.evaluated_depsgraph_get()
    places = {material: find_node_in_groups(material) for material in bpy.data.materials}
    # Materials of other objects count as well: their Beamspread nodes must not emit light.
    for material, (_, around) in ((material, place) for material, place in places.items() if place is not None):
        evaluated = material.evaluated_get(depsgraph).node_tree
        groups = [group.node_tree for group in around]
        # Tag only changed trees: a tag restarts viewports and material icons.
        for tree, copy in [
            (material.node_tree, evaluated),
            *((group, group.evaluated_get(depsgraph)) for group in groups),
        ]:
            if not all(map(_is_current, tree.nodes, copy.nodes)):
                tree.update_tag()
    with as_rendered(context.view_layer):
        visible = render_visible_names(context.view_layer)
        return Preparation(context.evaluated_depsgraph_get(), targets, settings, resolution, visible=visible)


def _is_current(node, copy) -> bool:
    """True if the evaluated copy of a node is up to date.

    A copy is stale if its class was registered later, or if a script set a value, which tags nothing.
    """
    if copy.bl_idname != node.bl_idname or not isinstance(node, BeamspreadNode):
        return copy.bl_idname == node.bl_idname
    return (copy.surface(), copy.texture_blur) == (node.surface(), node.texture_blur)


class Preparation:
    """A scene as it was read at one time. Each target's job is made when its turn comes, since jobs are large.

    Afterwards the depsgraph is not needed. The first job that needs a copy of the scene for Cycles makes one.

    Parameters
    ----------
    size : width and height of the texture, overrides all other sizes.
    visible : names of the objects that render; None: all.
    copy : copy of the scene for Cycles, if there is one already.
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

    def to_simulate(self, target: Target, quality: str) -> list:
        """Media that the target's bake would have to simulate first."""
        plan = self._plans[target]
        return [] if isinstance(plan, Exception) else to_simulate(plan.surface, replace(self.settings, quality=quality))

    def bake(self, target: Target, settings: BakeSettings | None = None) -> Bake:
        """The target's bake, with its job or the error; call it in the main thread."""
        plan = self._plans[target]
        if isinstance(plan, Exception):
            return Bake(target, error=plan)
        try:
            receiver = build_receiver(plan.maps, *plan.size)
            illumination = self._illumination.lighting(target.object_name)
            settings = settings or self.settings
            job = BakeJob(target.object_name, receiver, illumination, plan.surface, settings)
            job = self._with_color(self._by_cycles.complete(job), target, plan)
            job.check_memory()
            return Bake(target, job)
        except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
            return Bake(target, error=error)

    def _with_color(self, job: BakeJob, target: Target, plan: _Plan) -> BakeJob:
        """The job with the base color that is linked to the node, or a step that evaluates it."""
        color = plan.color
        if color is None:
            return job
        if not color.unknown:
            return job.colored(color)
        if not needs_medium(job.settings):
            return job
        copy = self._by_cycles.copy()
        if copy is None:
            return replace(job, surface=plan.own_surface).colored(
                not_evaluated(target, "There is no copy of the scene.")
            )
        step = BaseColorByCycles(copy, target, plan.own_surface, plan.blur, plan.matrix)
        illumination = job.illumination.with_messages(*copy.scene.warnings)
        return replace(job, illumination=illumination, steps=(step, *job.steps))


@dataclass(frozen=True)
class _Plan:
    """A target as it was read, until its job is made.

    Attributes
    ----------
    surface : with the mean base color; a placeholder if only Cycles can evaluate it.
    own_surface : surface of the node, without its linked base color.
    color : base color that is linked to the node, or None.
    blur : fraction of its texture that light passes on its way in.
    matrix : rows of the matrix of the instance that is baked; None if the object itself is.
    """

    maps: list
    size: tuple[int, int]
    surface: Surface
    own_surface: Surface
    color: BaseColor | None = None
    blur: float = 0.0
    matrix: list | None = None


def _read_target(
    depsgraph, target: Target, placed: ObjectInstance, resolution: int | None, size: tuple[int, int] | None
) -> _Plan:
    node, groups = find_node_in_groups(
        next(material for material in materials_of(placed.obj) if material.name == target.material_name)
    )
    surface = node.surface()
    surface.check()
    if size is None and node.image is not None:
        image = node.image.original
        if not is_sequence(image):  # a batch fills its files
            check_image(image)
        image_size = size_of_frames(image) if is_sequence(image) else tuple(image.size)
        size = image_size if resolution is None else None
    maps = fit_uv_maps(read_polygons(placed.obj, target.material_name, placed.matrix))
    size = size or texture_size(maps, resolution or depsgraph.scene.beamspread.resolution)
    if not node.has_texture():
        return _Plan(maps, size, surface, surface)
    blur = node.texture_blur
    color = read_texture(node.color_input(groups), blur, placed, build_receiver(maps, *size))
    mixed = replace(surface, base_color=PLACEHOLDER_COLOR) if color.unknown else surface.colored(color)
    matrix = np.array(placed.matrix).tolist() if placed.is_instance else None
    return _Plan(maps, size, mixed, surface, color, blur, matrix)
