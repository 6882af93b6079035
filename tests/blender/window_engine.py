"""Scenario of test_window_engine.py: F12, viewports, and nodes by copy and paste."""

import sys
from pathlib import Path

import bpy
import scenes
from beamspread.blender import popup
from beamspread.blender.cycles import cycles_light
from beamspread.blender.jobs.run import render_copy
from beamspread.core.bake import bounced
from nodes import Nodes
from scenario_player import in_window, is_over

results = {"popups": []}
ended = []


def window():
    return bpy.context.window_manager.windows[0]


def area_of(kind: str):
    return next(area for area in window().screen.areas if area.type == kind)


def in_editor(operator, **options):
    """Call an operator as the Shader Editor does."""
    area = area_of("NODE_EDITOR")
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=region):
        return operator(**options)


def add_scene():
    """A plane that shows a known image, from above."""
    scene = bpy.context.scene
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    plane = scenes.add_plane(size=(9, 9), material=scenes.add_material(image=scenes.known_image(), linked=True))
    scenes.add_camera()
    scene.world = None
    scene.render.engine = "BEAMSPREAD"
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.samples, scene.cycles.use_denoising = 4, True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scenes.select(plane)
    return plane


def blender_s_own_bake(plane):
    """Irradiance baked into another image, before a white wall in the sun; sums with and without bounced light, and
    with a lamp that only Cycles can evaluate, at few nodes and with noise of 2 %.
    """
    cycles_light.NODES = bounced.NODES = 16
    settings = bpy.context.scene.beamspread
    settings.quality, settings.output = "preview", "IRRADIANCE"
    wall = scenes.add_mesh("Wall", [(-4, 2, 0), (4, 2, 0), (4, 2, 4), (-4, 2, 4)], [(0, 1, 2, 3)])
    wall.data.materials.append(bpy.data.materials.new("White"))
    sun = scenes.add_sun(60, 90, 3.0)
    scenes.select(plane)
    tree = plane.data.materials[0].node_tree
    image = bpy.data.images.new("Own", 16, 16, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.nodes.active = texture
    over = []
    for handlers in (bpy.app.handlers.object_bake_complete, bpy.app.handlers.object_bake_cancel):
        handlers.append(lambda *_: over.append(1))
    lamp = None
    for name, indirect in [("plain", False), ("bounced", True), ("lamp", False)]:
        settings.use_indirect = indirect
        if name == "lamp":
            lamp = add_checkered_lamp()
        over.clear()
        in_window(bpy.ops.object.bake, "INVOKE_DEFAULT", type="COMBINED", margin=0)
        yield lambda: over
        yield lambda: not bpy.app.is_job_running("OBJECT_BAKE")
        results[f"own bake, {name}"] = scenes.pixels(image)[..., :3].sum(axis=(0, 1)).tolist()
    tree.nodes.remove(texture)
    for obj in (wall, sun, lamp):
        bpy.data.objects.remove(obj)
    scenes.select(plane)


def bake_into_texture(plane, clear: bool):
    """Blender's own operator on a gray texture of the node, also one that it clears: pixels and popups afterwards."""
    bpy.context.scene.render.bake.use_clear = clear
    material = plane.data.materials[0]
    texture = bpy.data.images.new("Texture", 16, 16, float_buffer=True)
    texture.pixels.foreach_set([0.5] * len(texture.pixels))
    source = material.node_tree.nodes.new("ShaderNodeTexImage")
    source.image = texture
    link = material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], source.outputs["Color"])
    material.node_tree.nodes.active = source
    over = []
    for handlers in (bpy.app.handlers.object_bake_complete, bpy.app.handlers.object_bake_cancel):
        handlers.append(lambda *_: over.append(1))
    results["popups"].clear()
    # It raises if the engine has refused before the call returns.
    scenes.messages_of(lambda: in_window(bpy.ops.object.bake, "INVOKE_DEFAULT", type="COMBINED", margin=0))
    yield lambda: over
    yield lambda: not bpy.app.is_job_running("OBJECT_BAKE")
    results[f"texture, {clear}"] = sorted({*scenes.pixels(texture).ravel().tolist()})
    results[f"popups of the texture, {clear}"] = list(results["popups"])
    material.node_tree.links.remove(link)
    material.node_tree.nodes.remove(source)
    bpy.data.images.remove(texture)


class Broken:
    """A copy of the scene that can't be made."""

    def __init__(self, *_arguments):
        raise OSError("No space left on device")


def fail_to_render():
    """F12 on a full disk."""
    render_copy.SceneCopy, works = Broken, render_copy.SceneCopy
    results["popups"].clear()
    # The job of the last picture ends after its handlers have run; until then Blender refuses another one.
    yield lambda: not bpy.app.is_job_running("RENDER")
    in_window(bpy.ops.render.render, "INVOKE_DEFAULT")
    yield lambda: results["popups"]
    yield lambda: not bpy.app.is_job_running("RENDER")
    results["popups of a failure"] = list(results["popups"])
    render_copy.SceneCopy = works


def add_checkered_lamp():
    lamp = scenes.add_lamp((0, 0, 1))
    nodes = Nodes(lamp.data)
    checker = nodes.add("TexChecker", {"Color1": (1, 0, 0, 1), "Color2": (0.5, 0, 0, 1)})
    nodes.set(nodes.of_type("EMISSION").inputs["Color"], checker.outputs["Color"])
    return lamp


def scenario():
    bpy.context.preferences.view.render_display_type = "NONE"
    bpy.app.handlers.render_complete.append(lambda *_: ended.append("complete"))
    show_soon = popup.show_soon

    def note(title, sentences):
        results["popups"].append([title, sentences])
        show_soon(title, sentences)

    popup.show_soon = note
    plane = add_scene()
    area_of("DOPESHEET_EDITOR").ui_type = "ShaderNodeTree"
    viewport = area_of("VIEW_3D").spaces.active.shading
    viewport.type = "RENDERED"
    yield lambda: viewport.type == "MATERIAL"
    results["scene light"] = viewport.use_scene_lights and viewport.use_scene_world

    in_window(bpy.ops.render.render, "INVOKE_DEFAULT")
    yield lambda: ended
    results["f12"] = list(ended)
    results["popups of f12"] = list(results["popups"])
    path = str(Path(sys.argv[-1]).with_name("f12.exr"))
    bpy.data.images["Render Result"].save_render(path)
    results["picture"] = scenes.pixels(bpy.data.images.load(path))[8, 8].tolist()

    yield from fail_to_render()
    yield from blender_s_own_bake(plane)
    for clear in (False, True):
        yield from bake_into_texture(plane, clear)

    tree = plane.data.materials[0].node_tree
    for node in tree.nodes:
        node.select = node.bl_idname == "BeamspreadNode"
    in_editor(bpy.ops.node.clipboard_copy)
    in_editor(bpy.ops.node.clipboard_paste)
    bpy.ops.ed.undo_push(message="pasted")
    pasted = [node for node in tree.nodes if node.bl_idname == "BeamspreadNode"][-1]
    pasted.ior = 1.7
    bpy.ops.ed.undo_push(message="changed")
    yield lambda: True
    iors = lambda: sorted(  # noqa: E731
        round(node.node_tree.nodes["Fresnel"].inputs["IOR"].default_value, 3)
        for node in bpy.data.materials["Medium"].node_tree.nodes
        if node.bl_idname == "BeamspreadNode"
    )
    results["pasted"] = iors()
    for name in ("undo", "undo", "redo", "redo"):
        in_window(getattr(bpy.ops.ed, name))
        yield lambda: True
    results["after undo and redo"] = iors()
    yield is_over(1.0)
