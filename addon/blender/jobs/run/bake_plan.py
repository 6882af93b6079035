"""Plans of bakes: targets as the scene has them at one time, from which jobs are made; for operator, engine and batch.

Jobs are large, so a plan makes its job when its turn comes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ....core.bake.bake_settings import COMBINED, BakeSettings
from ....core.bake.finish import with_seams
from ....core.bake.forecast import Finders, Forecast
from ....core.bake.job import BakeJob
from ....core.bake.runner import Bake
from ....core.bake.spread import Spread, length_of, mean_size
from ....core.bake.spread_light import backs_of
from ....core.bake.steps import BAKE_STEPS, needs_medium, to_simulate
from ....core.bake.surface import Surface
from ....core.bake.surroundings import Surroundings, surroundings_of
from ....core.errors import BakeError
from ....core.native import native
from ....core.scene.bent_grid import AnyGrid
from ....core.scene.flat_mesh import FlatMesh
from ....core.scene.illumination import Illumination
from ....core.scene.receiver import build_receiver, outline
from ....core.scene.texture import BaseColor, TextureUse
from ....core.target import FRONT, Target
from ...cycles.colors import BaseColorByCycles, not_evaluated
from ...cycles.cycles_light import CyclesLight
from ...cycles.scene_copy import CopyForCycles
from ...node.find import find_node_in_groups, medium_of
from ...node.node import BeamspreadNode
from ...node.uv_maps import Outcome, make_maps
from ...read.base_color import read_texture
from ...read.lights import read_illumination
from ...read.scene_cache import SceneCache, scene_cache
from ...read.visibility import as_rendered, check_instance, find_instances, render_visible_names
from ..state import state
from .receiving import Receiving, read_receiver, sized

PLACEHOLDER_COLOR = (0.5, 0.5, 0.5)
"""Base color until Cycles has evaluated it."""

MAX_TRACED = 1_000_000
"""Number of triangles up to which estimates trace rays among them; more keep the window waiting when a bake begins."""


@dataclass(frozen=True, eq=False)
class BakePlan:
    """A target as it was read, and the light of its scene. Plans need no depsgraph.

    Attributes
    ----------
    image : full name of the node's image; "" if it has none.
    mesh, size : parts of the object; width and height of the texture.
    surface : values of the node, without its linked base color.
    by_cycles : completes the illumination, which all plans share.
    color : base color that is linked to the node, or None.
    use : how its texture colors the surface; None without one.
    matrix : rows of the matrix of the instance that is baked; None if the object itself is.
    """

    target: Target
    image: str
    mesh: FlatMesh
    size: tuple[int, int]
    surface: Surface
    illumination: Illumination
    by_cycles: CyclesLight
    color: BaseColor | None = None
    use: TextureUse | None = None
    matrix: list | None = None

    def surface_with_color(self) -> Surface:
        """The surface with its mean base color; with a placeholder if only Cycles can evaluate it."""
        if self.color is None:
            return self.surface
        if self.color.unknown:
            return replace(self.surface, base_color=PLACEHOLDER_COLOR)
        return self.surface.colored(self.color)

    def to_simulate(self, settings: BakeSettings) -> list:
        """Media that the bake would have to simulate first."""
        return to_simulate(self.surface_with_color(), settings, self.mesh.is_bent)

    def forecast(self) -> Forecast:
        """Facts that tell how long the bake will take."""
        name, grids = self.target.object_name, [outline(self.mesh, part, *self.size) for part in self.mesh.parts]
        light = self.illumination.lighting(name)
        lamps = sum(name in bpy.data.objects for name in light.by_cycles)
        grids = [grid if self.target.side == FRONT else grid.flipped() for grid in grids]
        sides = [*grids, *(backs_of(grids) if self.surface.thickness > 0 else [])]
        bounced = bool(light.lights or light.by_cycles) and self.by_cycles.is_below_something(sides)
        is_own = not (lamps or light.untraceable)
        finders = Finders(
            bounced=bounced,
            is_own=is_own,
            world=len(light.by_cycles) > lamps,
            lamps=lamps,
            colors=self.color is not None and bool(self.color.unknown),
            around=self._around(grids, light, len(light.by_cycles) > lamps) if bounced else Surroundings(),
        )
        facts = light.lights, light.triangle_count, self.surface_with_color(), finders
        scatters = self.color is not None and self.use is not None and self.use.is_scattered
        return Forecast(name, grids, *facts, is_bent=self.mesh.is_bent, scatters=scatters)

    def _around(self, grids: list[AnyGrid], light: Illumination, has_unknown_sky: bool) -> Surroundings:
        """Surroundings of the receiver; by boxes around objects where rays would keep the window waiting."""
        if self._announced_around() is not None:
            return self._announced_around()
        if light.triangle_count <= MAX_TRACED:
            return surroundings_of(grids, light, has_unknown_sky)
        return Surroundings(max(map(self.by_cycles.enclosed_part, grids)))

    def _announced_around(self) -> Surroundings | None:
        """Surroundings by the rays with which the bake was announced, which know what color surfaces have."""
        announced = state.announced.get(self.target)
        return None if announced is None else announced.around

    def bake(self, settings: BakeSettings) -> Bake:
        """The bake, with its job or the error; call it in the main thread."""
        try:
            receiver = build_receiver(self.mesh, *self.size, self.target.object_name)
            receiver = with_seams(receiver, self.mesh, settings).seen_from(self.target.side)
            messages = *self.mesh.messages, *receiver.messages(self.target.object_name)
            illumination = self.illumination.lighting(self.target.object_name).with_messages(*messages)
            job = BakeJob(
                self.target.object_name, receiver, illumination, self.surface_with_color(), settings, BAKE_STEPS
            )
            job = self._with_color(self.by_cycles.complete(job))
            job = replace(job, around=self._announced_around())
            if settings.layer == COMBINED:
                job = replace(job, spread=Spread.of(length_of(self.mesh), job.surface, mean_size(self.mesh, self.size)))
            job.check_memory()
            return Bake(self.target, job)
        except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
            return Bake(self.target, error=error)

    def _with_color(self, job: BakeJob) -> BakeJob:
        """The job with the base color that is linked to the node, or a step that evaluates it."""
        if self.color is None:
            return job
        if not self.color.unknown:
            return job.colored(self.color)
        if not needs_medium(job.settings):
            return job
        copy = self.by_cycles.copy()
        if copy is None:
            unknown = not_evaluated(self.target, "There is no copy of the scene.")
            return replace(job, surface=self.surface).colored(unknown)
        step = BaseColorByCycles(copy, self.target, self.surface, self.use, self.matrix)
        illumination = job.illumination.with_messages(*copy.scene.warnings)
        return replace(job, illumination=illumination, steps=(step, *job.steps))


@dataclass(frozen=True, eq=False)
class FailedPlan:
    """A target that could not be read, or whose reading was cancelled."""

    target: Target
    error: BaseException
    image = ""

    def to_simulate(self, _settings: BakeSettings) -> list:
        return []

    def forecast(self) -> None:
        return None

    def bake(self, _settings: BakeSettings) -> Bake:
        if not isinstance(self.error, (KeyboardInterrupt, native.Cancelled)):
            return Bake(self.target, error=self.error)
        bake = Bake(self.target)
        bake.cancel()
        return bake


Plan = BakePlan | FailedPlan


Check = Callable[[], None]
"""Called while nodes are evaluated; raises Cancelled to cancel all bakes."""


def prepare_scene(
    context, targets: list[Target], settings: BakeSettings, resolution: int | None = None, check: Check | None = None
) -> Iterator[Bake]:
    """Read the scene as it would render at its current frame; makes a bake for each target when it is asked for."""
    plans = read_scene(context, targets, resolution, check, settings.indirect)
    return (plan.bake(settings) for plan in plans)


def read_scene(
    context,
    targets: list[Target],
    resolution: int | None = None,
    check: Check | None = None,
    indirect: bool | None = None,
    fills_nodes: bool = False,
) -> list[Plan]:
    """Read the targets in the scene as it would render at its current frame.

    Parameters
    ----------
    resolution : texels along the longer side; None keeps the size of the node's image, or follows the scene's settings
        where there is none.
    indirect : True if light may bounce; None: as the scene's settings say.
    fills_nodes : True if the results fill the nodes' images, False if they go to files.
    """
    view_layer = context.view_layer
    _update_nodes(context.evaluated_depsgraph_get())
    with as_rendered(view_layer):
        visible, depsgraph = render_visible_names(view_layer), context.evaluated_depsgraph_get()
        maps = make_maps(depsgraph, targets, fills_nodes)
        if maps:
            depsgraph = context.evaluated_depsgraph_get()
        scene_cache.check_images()
        options = {"cache": scene_cache, "check": check, "indirect": indirect, "maps": maps}
        options["fills_nodes"] = fills_nodes
        plans = read_plans(depsgraph, targets, visible, resolution, **options)
    if not context.scene.beamspread.use_live:
        scene_cache.drop_arrays()
    return plans


def _update_nodes(depsgraph) -> None:
    """Tag the trees of Beamspread nodes whose evaluated copies are not up to date."""
    for material in bpy.data.materials:  # of other objects, too: their Beamspread nodes must not emit light
        _, around = find_node_in_groups(material) or (None, None)
        if around is None:
            continue
        trees = [group.node_tree for group in around]
        copies = [material.evaluated_get(depsgraph).node_tree, *(tree.evaluated_get(depsgraph) for tree in trees)]
        # Tag only changed trees: a tag restarts viewports and material icons.
        for tree, copy in zip([material.node_tree, *trees], copies):
            if not all(map(_is_current, tree.nodes, copy.nodes)):
                tree.update_tag()


def _is_current(node, copy) -> bool:
    """True if the evaluated copy of a node is up to date.

    A copy is stale if its class was registered later, or if a script set a value, which tags nothing.
    """
    if copy.bl_idname != node.bl_idname or not isinstance(node, BeamspreadNode):
        return copy.bl_idname == node.bl_idname
    return _read_values(copy) == _read_values(node)


def _read_values(node) -> tuple:
    return node.surface(), node.texture_use(), node.uv_map, node.sides()


def read_plans(
    depsgraph,
    targets: list[Target],
    visible: set[str] | None = None,
    resolution: int | None = None,
    size: tuple[int, int] | None = None,
    copy: CopyForCycles | None = None,
    cache: SceneCache | None = None,
    check: Check | None = None,
    indirect: bool | None = None,
    maps: Mapping[str, Outcome] | None = None,
    fills_nodes: bool = False,
    uv_map: str = "",
) -> list[Plan]:
    """Read the targets and the light of a depsgraph, which is not needed afterwards.

    Parameters
    ----------
    visible : names of the objects that render; None: all.
    resolution, indirect, fills_nodes : as for `read_scene`.
    size : width and height of the texture, overrides all other sizes.
    uv_map : name of the UV map of that texture; "": each node's choice.
    copy : copy of the scene for Cycles, if there is one already. Else the first job that needs one makes it.
    cache : results of earlier reads, for a depsgraph of the viewport; None: everything is read.
    maps : outcomes of `make_maps`.
    """
    maps = maps or {}
    indirect = depsgraph.scene.beamspread.use_indirect if indirect is None else indirect
    try:
        instances = find_instances(depsgraph, {target.object_name for target in targets}, visible)
        illumination = read_illumination(depsgraph, cache, check, medium_of if indirect else None)
        light = illumination, CyclesLight(depsgraph, copy)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - each bake asked for needs an answer
        return [FailedPlan(target, error) for target in targets]
    plans: dict[Target, Plan] = {}
    receivers: dict[Target, Receiving] = {}

    def each(read: Callable[[Target], None]) -> None:
        for target in targets:
            try:
                read(target)
            except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
                plans[target] = FailedPlan(target, error)

    def read_mesh(target: Target) -> None:
        instance, outcome = instances.get(target.object_name), maps.get(target.object_name)
        check_instance(target.object_name, instance, depsgraph.view_layer)
        if isinstance(outcome, BakeError):
            raise outcome
        receivers[target] = read_receiver(target, instance, size is None, outcome, uv_map)

    def read_plan(target: Target) -> None:
        if target in receivers:
            receiving, settings = receivers[target], depsgraph.scene.beamspread
            mesh, chosen = receiving.mesh, size
            if size is None:
                mesh, chosen = sized(receiving, receivers.values(), resolution, settings, fills_nodes)
            plans[target] = _plan(receiving, mesh, chosen, light, check)

    try:
        each(read_mesh)
        each(read_plan)
    except (KeyboardInterrupt, native.Cancelled) as error:
        return [FailedPlan(target, error) for target in targets]
    return [plans[target] for target in targets]


def _plan(
    receiving: Receiving,
    mesh: FlatMesh,
    size: tuple[int, int],
    light: tuple[Illumination, CyclesLight],
    check: Check | None,
) -> BakePlan:
    target, instance = receiving.target, receiving.instance
    image, node = target.image, target.node
    plan = BakePlan(target.name, "" if image is None else image.name_full, mesh, size, receiving.surface, *light)
    if not node.has_texture():
        return plan
    receiver, use = build_receiver(mesh, *size), node.texture_use()
    color = read_texture(node.color_input(target.groups), use, instance, receiver, check)
    matrix = np.array(instance.matrix).tolist() if instance.is_instance else None
    return replace(plan, color=color, use=use, matrix=matrix)
