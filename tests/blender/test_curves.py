"""Text, curves and NURBS surfaces are baked as their meshes, and stay what they are."""

import subprocess

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import state
from beamspread.blender.node.uv_maps import objects_with_maps
from beamspread.blender.read.geometry import OWN_MAP, read_polygons
from beamspread.blender.read.visibility import as_rendered
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.islands import check_map
from live_scenes import live_lines, live_pixels, settle, switch_off
from nodes import Nodes

SIDE = 64

MODIFIER = "Beamspread UV Map"


@pytest.fixture(autouse=True)
def light():
    scenes.add_lamp_and_sky(SIDE)


def add_text(body="Ab", **options):
    text = bpy.data.curves.new("Text", "FONT")
    text.body = body
    for name, value in options.items():
        setattr(text, name, value)
    return with_material(bpy.data.objects.new("Text", text))


def add_ring(**options):
    bpy.ops.curve.primitive_bezier_circle_add(radius=0.5)
    ring = bpy.context.object
    for name, value in options.items():
        setattr(ring.data, name, value)
    return with_material(ring)


def add_patch():
    bpy.ops.surface.primitive_nurbs_surface_surface_add(radius=0.5)
    return with_material(bpy.context.object)


def with_material(obj):
    obj.data.materials.append(scenes.add_material(linked=True, mean_free_path=(0.02,) * 3))
    if obj.name not in bpy.context.collection.objects:
        bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    return obj


def test_slivers_of_a_text_are_not_said_to_look_to_opposite_sides():
    """Blender fills letters with triangles some of which have no area."""
    text = add_text("Text", extrude=0.05)
    polygons = read_polygons(evaluated(text), "Medium")
    assert (polygons.areas == 0).sum() > 4
    mesh = flatten(polygons, 0.02, "Text", spread=1.0)
    assert mesh.is_bent
    assert not any("opposite sides" in message.text for message in mesh.messages)


def test_remedies_in_edit_mode_ask_for_a_mesh_first():
    text = add_text("Hey", extrude=0.05)
    scenes.bake(text)
    (line,) = [line for line in state.lines() if "loose parts" in line]
    assert line.split(". ", 1)[0].endswith("as if they touched")
    assert "Convert it to a mesh first (Object > Convert > Mesh). Separate them (Edit Mode: P, By Loose Parts)" in line
    bpy.ops.object.convert(target="MESH")
    scenes.bake(bpy.context.object)
    (line,) = [line for line in state.lines() if "loose parts" in line]
    assert "Convert" not in line


def test_lives_refusal_of_a_text_names_a_way_out_for_a_text():
    add_text("Hey")
    bpy.context.scene.beamspread.use_live = True
    settle()
    (line,) = [line for line in live_lines() if "UV map" in line]
    switch_off()
    assert "Convert it to a mesh first (Object > Convert > Mesh). Unwrap the mesh" in line
    assert "Bake makes a map" in line


def evaluated(obj):
    return obj.evaluated_get(bpy.context.evaluated_depsgraph_get())


OBJECTS = {
    "bevelled text": lambda: add_text(extrude=0.1, bevel_depth=0.02),
    "flat text": add_text,
    "pipe": lambda: add_ring(bevel_depth=0.1),
    "disk": lambda: add_ring(dimensions="2D", fill_mode="BOTH"),
    "patch": add_patch,
}


def picture(path):
    """A picture by Cycles, float32 (64, 64, 3)."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    if scene.camera is None:
        scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.camera.location, scene.camera.rotation_euler = (0.4, -1.5, 1.4), (0.83, 0, 0)
        bpy.context.collection.objects.link(scene.camera)
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.cycles.samples, scene.cycles.use_denoising = 8, False
    scene.render.filepath, scene.render.image_settings.file_format = str(path), "OPEN_EXR"
    bpy.ops.render.render(write_still=True)
    return scenes.pixels(bpy.data.images.load(str(path)))


@pytest.mark.parametrize("kind", OBJECTS)
def test_the_bake_and_its_picture_are_those_of_the_mesh(kind, tmp_path):
    """The object keeps its type. Converted to a mesh, whose map Blender copies, it has the same bake and picture."""
    obj = OBJECTS[kind]()
    former = obj.type
    first = scenes.bake(obj)[0]
    assert obj.type == former
    assert (first > 0).any(axis=2).mean() > 0.25
    shown = picture(tmp_path / "curve.exr")
    assert shown.max() > 0
    bpy.ops.object.convert(target="MESH")
    mesh = bpy.context.object
    assert mesh.type == "MESH"
    if OWN_MAP in mesh.data.attributes and OWN_MAP not in mesh.data.uv_layers:  # Blender 3.4 keeps vectors
        uvs = np.empty(3 * len(mesh.data.loops), np.float32)
        mesh.data.attributes[OWN_MAP].data.foreach_get("vector", uvs)
        mesh.data.attributes.remove(mesh.data.attributes[OWN_MAP])
        layer = mesh.data.uv_layers.new(name=OWN_MAP, do_init=False)
        layer.data.foreach_set("uv", np.ascontiguousarray(uvs.reshape(-1, 3)[:, :2]).ravel())
    again = scenes.bake(mesh)[0]
    # Blender rounds positions when it converts.
    np.testing.assert_allclose(again, first, rtol=1e-3, atol=1e-4 * first.max())
    # Eight samples of the coat and of the sky: the same seed in both.
    np.testing.assert_allclose(picture(tmp_path / "mesh.exr"), shown, atol=1e-3 * shown.max())


def test_the_map_of_a_modifier_fits_and_the_note_names_it():
    text = OBJECTS["bevelled text"]()
    scenes.bake(text)
    assert [modifier.name for modifier in text.modifiers] == [MODIFIER]
    assert objects_with_maps() == {"Text"}
    assert any(f"'Text' has a new modifier '{MODIFIER}'" in line for line in state.lines())
    polygons = read_polygons(evaluated(text), text.data.materials[0].name)
    assert polygons.uv_map == OWN_MAP
    check_map(polygons)
    assert np.ptp(polygons.corners[:, 2]) == pytest.approx(0.24, abs=1e-5)  # extrusion and bevel
    stale.refresh(bpy.context)
    assert not any(row.is_stale for row in state.rows.values())
    text.data.body = "Longer"
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    assert all(row.is_stale for row in state.rows.values())
    scenes.bake(text)
    check_map(read_polygons(evaluated(text), text.data.materials[0].name))
    assert [modifier.name for modifier in text.modifiers] == [MODIFIER]


def test_other_modifiers_come_first():
    text = add_text(extrude=0.1)
    text.modifiers.new("Row", "ARRAY").count = 2
    scenes.bake(text)
    assert [modifier.name for modifier in text.modifiers] == ["Row", MODIFIER]
    check_map(read_polygons(evaluated(text), text.data.materials[0].name))


def test_a_curve_has_the_resolution_of_renders():
    """Its mesh in renders has other faces than in the window; the map is that of renders."""
    ring = add_ring(bevel_depth=0.1, resolution_u=4, render_resolution_u=16)
    ring.modifiers.new("Row", "ARRAY").count = 2

    def faces():
        return len(evaluated(ring).to_mesh().polygons)

    in_window = faces()
    with as_rendered(bpy.context.view_layer):
        assert faces() == 4 * in_window
    assert faces() == in_window
    assert (ring.data.resolution_u, ring.data.splines[0].resolution_u) == (4, 4)


def test_text_shadows_others_and_not_itself():
    floor = scenes.add_plane("Floor", size=(4, 4), material=scenes.add_material("Floor"))
    free = scenes.bake(floor)[0]
    text = add_text(extrude=0.1)
    text.location.z = 0.3
    assert scenes.bake(floor)[0].sum() < free.sum()
    bpy.data.objects.remove(floor)
    assert scenes.bake(text)[0].max() > 0.1


def test_a_curve_without_faces_is_named():
    scenes.select(add_ring())
    with pytest.raises(RuntimeError, match=r"'B.zierCircle' has no faces\. Fill it, or give it depth"):
        bpy.ops.beamspread.bake()


def test_an_instance_of_text_is_baked():
    text = add_text(extrude=0.1)
    bpy.context.collection.objects.unlink(text)
    scenes.add_instancer(scenes.new_collection("Inner", text), name="Shown")
    assert bpy.ops.beamspread.bake(objects="ALL") == {"FINISHED"}
    assert scenes.pixels(scenes.image_of(text)).max() > 0


def test_a_batch_bakes_text_and_saves_its_map(tmp_path):
    add_text(extrude=0.1)
    path = scenes.save_scene(tmp_path)
    options = "--output", tmp_path, "--save"
    done = subprocess.run(scenes.batch_command(path, *options), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    bpy.ops.wm.open_mainfile(filepath=str(path))
    text = bpy.data.objects["Text"]
    assert text.type == "FONT"
    assert [modifier.name for modifier in text.modifiers] == [MODIFIER]


def test_live_follows_text():
    text = add_text()
    scenes.bake(text)
    bpy.context.scene.beamspread.use_live = True
    settle()
    assert "UV map" not in str(live_lines())
    text.location.x = 0.2
    live = live_pixels(text.data.materials[0])
    switch_off()
    # Live gathers fewer rays of the sky.
    np.testing.assert_allclose(live.mean(axis=(0, 1)), scenes.bake(text)[0].mean(axis=(0, 1)), rtol=0.03)


def test_cycles_evaluates_a_base_color_on_text():
    """A checker in the text's own coordinates, which Cycles alone evaluates."""
    bpy.context.scene.render.engine = "CYCLES"
    text = add_text()
    material = text.data.materials[0]
    node = scenes.node_of(material)
    node.color_mode = "BASE_COLOR"
    nodes = Nodes(material)
    checker = nodes.tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (
        (0.8, 0.1, 0.1, 1),
        (0.1, 0.1, 0.8, 1),
    )
    checker.inputs["Scale"].default_value = 3.0
    nodes.tree.links.new(checker.inputs["Vector"], nodes.tree.nodes.new("ShaderNodeTexCoord").outputs["Object"])
    nodes.tree.links.new(node.inputs["Base Color"], checker.outputs["Color"])
    pixels = scenes.bake(text)[0]
    lit = pixels[pixels.max(axis=2) > 0.05]
    is_red = lit[:, 0] > lit[:, 2]
    assert 0.2 < is_red.mean() < 0.8
    assert not any("Cycles" in line for line in state.lines())
    assert text.type == "FONT"
    assert not text.hide_render
