"""The render engine: Blender's own Bake fills the active image through it."""

from __future__ import annotations

import itertools

import bpy
import numpy as np

from . import bakes, compat, extract
from .core.errors import BakeError

# By object and materials: an exception in `bake` reaches nobody, and Blender reports success all the same.
_errors: dict[tuple[str, ...], str] = {}
_calls = itertools.count()


class BeamspreadEngine(bpy.types.RenderEngine):
    """Bakes translucent surfaces; pictures are for Cycles and EEVEE."""

    bl_idname = "BEAMSPREAD"
    bl_label = "Beamspread"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def render(self, depsgraph) -> None:
        show_nothing(self, depsgraph)

    def bake(self, depsgraph, obj, _pass_type, _pass_filter, width, height) -> None:
        bake_active_image(self, depsgraph, obj, width, height)


def show_nothing(engine, depsgraph) -> None:
    """F12: an empty picture and a sentence that says what to do."""
    scene = depsgraph.scene
    scale = scene.render.resolution_percentage / 100
    size = (max(1, int(scene.render.resolution_x * scale)), max(1, int(scene.render.resolution_y * scale)))
    engine.end_result(engine.begin_result(0, 0, *size))
    engine.report({"WARNING"}, "Beamspread bakes textures: press Bake, then render with Cycles or EEVEE")


def last_errors() -> list[str]:
    """What kept images from being filled since they were last baked with success."""
    return list(_errors.values())


def bake_active_image(engine, depsgraph, obj, width: int, height: int) -> None:
    """Fill the image that Blender bakes to; failures are reported and kept for `last_errors`."""
    # A layer name of its own per call: results of the same layer overwrite each other.
    result = engine.begin_result(0, 0, width, height, layer=f"Beamspread {next(_calls)}")
    passes = result.layers[0].passes
    key, filled = (obj.name,), False
    try:
        names = _materials_in(obj, passes, width, height)
        key += tuple(names)
        _errors.pop(key, None)
        compat.write_pass(passes["Combined"], _bake_materials(engine, depsgraph, obj, names, width, height))
        filled = True
    except Exception as error:  # noqa: BLE001 - Blender would swallow it
        _errors[key] = f"{obj.name}: {bakes.sentence(error)}"
        engine.report({"ERROR"}, _errors[key])
    finally:
        engine.end_result(result, cancel=not filled)


def _bake_materials(engine, depsgraph, obj, names: list[str], width: int, height: int) -> np.ndarray:
    """RGBA float32 (height, width, 4) of the object's materials, each on its own part of the image."""
    if not names:
        raise BakeError("No material of this object has a Beamspread node: add one in the Shader Editor.")
    scene = depsgraph.scene
    settings = bakes.core_settings(scene.beamspread)
    light = extract.read_scene_light(depsgraph)
    pixels = np.zeros((height, width, 4), np.float32)
    for number, name in enumerate(names):
        job = bakes.make_job(obj, name, light, settings, None, scene.beamspread.resolution, size=(width, height))
        texture = job.run(lambda fraction, done=number: _step(engine, (done + fraction) / len(names)))
        covered = job.receiver.coverage > 0
        pixels[covered] = np.dstack([texture, np.ones((height, width), np.float32)])[covered]
        for warning in job.warnings:
            engine.report({"WARNING"}, warning)
    return pixels


def _step(engine, fraction: float) -> bool:
    engine.update_progress(fraction)
    return not engine.test_break()


def _materials_in(obj, passes, width: int, height: int) -> list[str]:
    """Beamspread materials of the triangles that this image shows (Blender bakes one image at a time)."""
    wanted = {material.name for material in bakes.materials_of(obj)}
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
    names = [slot.material.name for index, slot in enumerate(obj.material_slots) if index in used and slot.material]
    return [name for name in dict.fromkeys(names) if name in wanted]


# Panels of Blender that make sense with this engine: those for any engine, and EEVEE's for what any engine has.
HIDDEN_PANEL_PREFIXES = ("RENDER_PT_", "VIEWLAYER_PT_layer_passes", "WORLD_PT_viewport")
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


def register() -> None:
    bpy.utils.register_class(BeamspreadEngine)
    for panel in _compatible_panels():
        panel.COMPAT_ENGINES.add(BeamspreadEngine.bl_idname)


def unregister() -> None:
    for panel in bpy.types.Panel.__subclasses__():
        if BeamspreadEngine.bl_idname in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.remove(BeamspreadEngine.bl_idname)
    bpy.utils.unregister_class(BeamspreadEngine)
