"""The render engine: Blender's own Bake fills the active image through it."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Iterator
from functools import partial

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ....core.bake.bake_settings import COMBINED
from ....core.bake.runner import WRITTEN, Bake, Sink, run_bakes
from ....core.errors import text_of
from ....core.progress import Progress
from ....core.target import BACK, Target
from ... import compat
from ...cycles.scene_copy import CopyForCycles
from ...node.find import NOTHING_FOUND, BakeTarget, find_misplaced, find_targets, image_of, targets_of
from ...node.node import image_of_side
from ...registration import all_or_nothing, classes, handlers
from ..out_of_date import stale
from ..out_of_date.fingerprint import Parts
from ..state import state
from .active_image import ENGINE, active_image, check_active_image, note_results, other_map
from .bake_plan import FailedPlan, Plan, read_plans
from .render_copy import render_picture, show_by_eevee

MAX_PROBED = 1000
"""Number of texels that tell which UV map Blender bakes to, about."""


class BeamspreadEngine(bpy.types.RenderEngine):
    """Bakes translucent surfaces. Cycles or EEVEE render for it, and EEVEE draws its viewports."""

    bl_idname = ENGINE
    bl_label = "Beamspread"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def render(self, depsgraph) -> None:
        render_picture(self, depsgraph)

    def view_update(self, context, _depsgraph) -> None:
        show_by_eevee(context)

    def view_draw(self, _context, _depsgraph) -> None:
        """For a moment, until the viewport shows Material Preview."""

    def bake(self, depsgraph, obj, _pass_type, _pass_filter, width, height) -> None:
        bake_active_image(self, depsgraph, obj, width, height)


def bake_active_image(engine, depsgraph, obj, width: int, height: int) -> None:
    """Fill the image that Blender bakes to. If that fails, Blender still reports success, but panels show the error."""
    # A layer name of its own per call: results of the same layer overwrite each other.
    result = engine.begin_result(0, 0, width, height, layer=f"Beamspread {uuid.uuid4()}")
    passes, filled = result.layers[0].passes, False
    try:
        bakes = _prepare(engine, depsgraph, obj, passes, (width, height))
        sink = _ActiveImage(engine, bakes, (width, height))
        run_bakes(bakes, sink)
        for bake in bakes:
            for message in bake.messages:
                engine.report({message.level.value}, f"{bake.target}: {message}")
        note_results(bakes)
        if all(bake.status == WRITTEN for bake in bakes):
            compat.write_pass(passes["Combined"], sink.pixels)
            filled = True
            fillings.add([bake for bake in bakes if _fills_own_image(bake)])
    except Exception as error:  # noqa: BLE001 - Blender would swallow it
        engine.report({"ERROR"}, text_of(error))
    finally:
        engine.end_result(result, cancel=not filled)


class _ActiveImage(Sink):
    """Collects the results of bakes that share the active image; `pixels` are RGBA, float32 (height, width, 4)."""

    def __init__(self, engine, bakes: list[Bake], size: tuple[int, int]) -> None:
        seconds = [bake.job.seconds() if bake.job else 0.0 for bake in bakes]
        self._parts = iter(Progress(lambda fraction: _step(engine, fraction)).split(seconds))
        self.pixels = np.zeros((*size[::-1], 4), np.float32)

    def run(self, bake: Bake) -> Iterator[None]:
        bake.run(next(self._parts))
        return iter(())

    def store(self, bake: Bake) -> str:
        inside = bake.job.receiver.inside()
        self.pixels[inside, :3], self.pixels[inside, 3] = bake.texture[inside], 1
        return ""

    def end(self, bake: Bake) -> None:
        state.note(bake)


def _prepare(engine, depsgraph, obj, passes, size: tuple[int, int]) -> list[Bake]:
    """A bake for each material of the object that has its node and that the image shows."""
    try:
        settings, targets = depsgraph.scene.beamspread.for_bake(), _targets_in(obj, passes, *size)
        for target in targets:
            check_active_image(target, settings, is_running=True)
        check = partial(Progress(lambda _: not engine.test_break()).check, 0.0)
        arguments = None, None, size, fillings.copy, None, check
        plans = read_plans(depsgraph, [target.name for target in targets], *arguments)
        plans = _in_map_of_blender(plans, depsgraph, obj, _baked_maps(obj, passes, *size), arguments)
        bakes = [plan.bake(settings) for plan in plans] or find_misplaced([obj])
    except Exception as error:  # noqa: BLE001 - Blender would swallow it
        return [Bake(Target(obj.name), error=error)]
    return bakes or [Bake(Target(obj.name), error=NOTHING_FOUND)]


def _in_map_of_blender(plans: list[Plan], depsgraph, obj, uv_maps: list[str], arguments: tuple) -> list[Plan]:
    """Plans of bakes in the UV map that Blender's Bake fills; of failures where the node shows its image by another."""
    result = []
    for plan in plans:
        has_failed = isinstance(plan, FailedPlan)  # perhaps by the node's map, which another image does not use
        own = "" if has_failed else plan.mesh.uv_map or _rendered_map(obj)
        if not uv_maps or own in uv_maps or not (own or has_failed):
            result.append(plan)
        elif image_of(plan.target) == active_image(bpy.data.materials[plan.target.material_name]):
            result.append(plan if has_failed else FailedPlan(plan.target, other_map(uv_maps[0], own)))
        else:
            result += read_plans(depsgraph, [plan.target], *arguments, uv_map=uv_maps[0])
    return result


def _rendered_map(obj) -> str:
    """Name of the UV map of an evaluated object that renders."""
    return next((layer.name for layer in getattr(obj.data, "uv_layers", ()) if layer.active_render), "")


def _baked_maps(obj, passes, width: int, height: int) -> list[str]:
    """Name of the UV map that Blender's Bake fills, the active one or an argument's, as its texels tell.

    Maps with the same UVs come together; no texels of the object tell nothing.
    """
    triangles, weights = compat.baked_points(passes, width, height)
    rows, columns = np.nonzero(triangles >= 0)
    step = max(len(rows) // MAX_PROBED, 1)
    rows, columns = rows[::step], columns[::step]
    mesh = obj.to_mesh()
    try:
        mesh.calc_loop_triangles()
        loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("loops", loops)
        chosen = triangles[rows, columns]
        if not len(chosen) or chosen.max() >= len(mesh.loop_triangles):
            return []
        corners, (u, v) = loops.reshape(-1, 3)[chosen], weights[rows, columns].T
        at = np.column_stack([(columns + 0.5) / width, (rows + 0.5) / height])
        distances = {}
        for layer in sorted(mesh.uv_layers, key=lambda layer: not layer.active_render):
            uvs = np.empty((len(mesh.loops), 2), np.float32)
            layer.data.foreach_get("uv", uvs.ravel())
            shown = np.einsum("nc,nck->nk", np.column_stack([u, v, 1 - u - v]), uvs[corners])
            distances[layer.name] = float(np.median(np.abs((shown - at + 0.5) % 1 - 0.5)))
    finally:
        obj.to_mesh_clear()
    nearest = min(distances.values(), default=1.0)
    return [name for name, distance in distances.items() if distance == nearest < 1 / min(width, height)]


def _fills_own_image(bake: Bake) -> bool:
    """True if the image that Blender bakes to is the one that the node shows as luminance."""
    active = active_image(bpy.data.materials[bake.target.material_name])
    return bake.job.settings.layer == COMBINED and image_of(bake.target) == active


class _Fillings:
    """Bakes whose pixels Blender is about to put into images of nodes, and the digests for them.

    The window calls `begin` and `end` in the main thread around its bake; between them the engine adds bakes in
    another thread. Scripts call neither, and bake in the main thread.

    Attributes
    ----------
    copy : copy of the scene for Cycles; the engine's thread can make none.
    """

    def __init__(self) -> None:
        self._parts: dict[Target, Parts] | None = None
        self.copy: CopyForCycles | None = None

    def begin(self) -> None:
        targets = find_targets(bpy.context.selected_objects)
        self._parts = stale.parts_of(bpy.context, targets) if targets else {}
        self.copy = CopyForCycles(bpy.context.scene, bpy.context.view_layer) if targets else None

    def add(self, bakes: list[Bake]) -> None:
        parts = self._parts
        if bakes and parts is None and threading.current_thread() is threading.main_thread():
            parts = stale.parts_of(bpy.context, [bake.target for bake in bakes])
        for bake in bakes:
            stale.keep_later(bake, (parts or {}).get(bake.target))

    def end(self) -> None:
        self._parts = self.copy = None
        stale.scan_soon()


fillings = _Fillings()


@persistent
def _before_bake(*_arguments) -> None:
    if bpy.context.scene.render.engine == BeamspreadEngine.bl_idname:
        fillings.begin()


@persistent
def _after_bake(*_arguments) -> None:
    fillings.end()


def _step(engine, fraction: float) -> bool:
    engine.update_progress(fraction)
    return not engine.test_break()


def _targets_in(obj, passes, width: int, height: int) -> list[BakeTarget]:
    """Targets among the materials of the triangles that the image shows (Blender bakes one image at a time)."""
    shown = compat.baked_triangles(passes, width, height)
    triangles = np.unique(shown[shown >= 0])
    mesh = obj.to_mesh()
    try:
        mesh.calc_loop_triangles()
        slots = np.empty(len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("material_index", slots)
    finally:
        obj.to_mesh_clear()
    used = {int(slot) for slot in np.unique(slots[triangles[triangles < len(slots)]])}
    materials = {slot.material for index, slot in enumerate(obj.material_slots) if index in used}
    return [target for target in targets_of(obj) if target.material in materials and _is_of_active_image(target)]


def _is_of_active_image(target: BakeTarget) -> bool:
    """True if Blender's Bake fills the side: the back if the active image is the node's of it, else the first side."""
    sides, active = target.node.sides(), active_image(target.material)
    is_back = active is not None and active == image_of_side(target.node, BACK)
    return target.side == (BACK if is_back and BACK in sides else sides[0])


# Panels of Blender that suit this engine: those for any engine, and EEVEE's panels for features of any engine.
HIDDEN_PANEL_PREFIXES = ("RENDER_PT_freestyle", "VIEWLAYER_PT_layer_passes", "WORLD_PT_viewport")
EEVEE_PANELS = {
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "MATERIAL_PT_preview",
}


def _compatible_panels() -> list:
    return [panel for panel in bpy.types.Panel.__subclasses__() if _is_compatible(panel)]


def _is_compatible(panel) -> bool:
    if panel.__name__ in EEVEE_PANELS:
        return hasattr(panel, "COMPAT_ENGINES")
    any_engine = "BLENDER_RENDER" in getattr(panel, "COMPAT_ENGINES", ())
    return any_engine and not panel.__name__.startswith(HIDDEN_PANEL_PREFIXES)


def _use_panels() -> None:
    for panel in _compatible_panels():
        panel.COMPAT_ENGINES.add(BeamspreadEngine.bl_idname)


def _leave_panels() -> None:
    for panel in bpy.types.Panel.__subclasses__():
        if BeamspreadEngine.bl_idname in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.remove(BeamspreadEngine.bl_idname)


register, unregister = all_or_nothing(
    *classes(BeamspreadEngine),
    (_use_panels, _leave_panels),
    *handlers(object_bake_pre=_before_bake, object_bake_complete=_after_bake, object_bake_cancel=_after_bake),
)
