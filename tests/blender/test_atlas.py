"""One Atlas for the Selection: objects side by side in one image, which bakes fill."""

import subprocess

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.state import state
from beamspread.blender.read.geometry import OWN_MAP, read_polygons
from beamspread.core.native import native
from mathutils import Matrix

SIDE, MARGIN = 128, 3


@pytest.fixture(autouse=True)
def light():
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.resolution, settings.margin = False, SIDE, MARGIN
    scenes.add_world((0.3, 0.4, 0.2, 1))
    scenes.add_lamp((0.4, -0.6, 4.0), power=500)


def add_box(name, x, material=None, size=1.0):
    bpy.ops.mesh.primitive_cube_add(size=size, location=(x, 0, 0))
    box = bpy.context.object
    box.name = name
    box.data.materials.append(material or scenes.add_material(f"M {name}", linked=True))
    return box


def make_atlas(*objects):
    scenes.select(*objects)
    assert bpy.ops.beamspread.make_atlas() == {"FINISHED"}
    bpy.context.view_layer.update()
    return scenes.image_of(objects[0])


def polygons_of(obj, number=0):
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return read_polygons(evaluated, obj.data.materials[number].name, None, OWN_MAP)


def coverage_of(polygons, side=SIDE):
    return native.coverage(np.ascontiguousarray(polygons.uvs * side), polygons.sizes.astype(np.uint32), side, side)


def check_places(objects, side=SIDE):
    """Each face has a place of its own in the square, at one density; objects keep a distance."""
    faces = [polygons_of(obj, number) for obj in objects for number in range(len(obj.data.materials))]
    density = np.concatenate([part.uv_areas / part.areas for part in faces])
    # UVs are float32.
    np.testing.assert_allclose(density, density[0], rtol=1e-4)
    covered = np.sum([coverage_of(part) for part in faces], axis=0)
    assert covered.max() < 1 + 1e-3
    total = sum(part.uv_areas.sum() for part in faces)
    assert total * side**2 == pytest.approx(covered.sum(), rel=1e-3)
    return total


def test_objects_lie_side_by_side_in_one_image_that_a_bake_fills():
    boxes = [add_box("A", 0), add_box("B", 2.5, size=0.5), add_box("C", 5)]
    plane = scenes.add_plane("Floor", (3, 3), Matrix.Translation((0, 0, -1)), material=scenes.add_material("Ground"))
    objects = [*boxes, plane]
    image = make_atlas(*objects)
    assert (image.name, tuple(image.size)) == ("Atlas", (SIDE, SIDE))
    assert all(scenes.image_of(obj) == image for obj in objects)
    assert check_places(objects) > 0.6
    assert [layer.name for layer in boxes[0].data.uv_layers] == ["UVMap", OWN_MAP]
    assert boxes[0].data.uv_layers["UVMap"].active_render
    pixels = scenes.bake(*objects)[0]
    assert not any(name in line for line in state.lines() for name in ("overlap", OWN_MAP))
    for obj in objects:
        node = scenes.node_of(obj.data.materials[0])
        assert node.image == image
        inside = coverage_of(polygons_of(obj)) > 0.99
        # The sky lights all but the faces that stand on the floor.
        assert (pixels[inside] > 0).all(axis=-1).mean() > 0.99


def test_an_object_that_has_lost_its_map_is_sent_to_a_new_atlas():
    boxes = [add_box("A", 0), add_box("B", 2.5)]
    make_atlas(*boxes)
    scenes.bake(*boxes)
    layers = boxes[1].data.uv_layers
    layers.remove(layers[OWN_MAP])
    boxes[1].data.update()  # scripts tag no change in Blender 4, as the button does
    scenes.select(*boxes)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "select all objects of the atlas, and make One Atlas for the Selection again" in message
    image = make_atlas(*boxes)
    scenes.bake(*boxes)
    assert scenes.image_of(boxes[1]) == image
    check_places(boxes)


def test_each_object_is_baked_as_if_it_were_alone():
    """The texels of a box in the atlas are those of the same box with the same map in an image of its own."""
    boxes = [add_box("A", 0), add_box("B", 2.5)]
    image = make_atlas(*boxes)
    together = scenes.bake(*boxes)[0].copy()
    for box in boxes:
        node = scenes.node_of(box.data.materials[0])
        node.image = bpy.data.images.new("Alone", SIDE, SIDE, float_buffer=True, alpha=False)
        inside = coverage_of(polygons_of(box)) > 0
        np.testing.assert_array_equal(scenes.bake(box)[0][inside], together[inside])
        node.image = image


def test_materials_of_one_mesh_and_of_several_objects():
    shared, single = scenes.add_material("Shared"), scenes.add_material("Single")
    first, second = add_box("First", 0, shared), add_box("Second", 2.5, shared)
    first.data.materials.append(single)
    first.data.polygons[0].material_index = 1
    image = make_atlas(first, second)
    check_places([first, second])
    pixels = scenes.bake(first, second)[0]
    assert scenes.node_of(single).image == scenes.node_of(shared).image == image
    assert not any("overlap" in line or "different UV maps" in line for line in state.lines())
    faces = polygons_of(first, 1)
    assert faces.count == 1
    assert (pixels[coverage_of(faces) > 0.99] > 0).all()


@pytest.mark.parametrize("kind", ["ARRAY", "SHARED MESH"])
def test_a_modifier_makes_the_map_where_one_mesh_has_several_places(kind):
    box = add_box("A", 0)
    objects = [box, add_box("B", 4.0)]
    if kind == "ARRAY":
        box.modifiers.new("Array", "ARRAY").count = 2
    else:
        copy = bpy.data.objects.new("Copy", box.data)
        copy.location.y = 2.5
        bpy.context.collection.objects.link(copy)
        objects.append(copy)
    bpy.context.view_layer.update()
    image = make_atlas(*objects)
    check_places(objects)
    assert box.modifiers[-1].name == "Beamspread UV Map"
    assert OWN_MAP not in box.data.uv_layers
    assert OWN_MAP in objects[1].data.uv_layers
    pixels = scenes.bake(*objects)[0]
    assert scenes.image_of(box) == image
    for obj in objects:
        assert (pixels[coverage_of(polygons_of(obj)) > 0.99] > 0).all(axis=-1).mean() > 0.9
    # A second atlas takes the place of the first.
    assert make_atlas(*objects) != image
    assert [modifier.type for modifier in box.modifiers].count("NODES") == 1
    check_places(objects)


def test_objects_without_a_place_are_named(capfd):
    box = add_box("Box", 0)
    bare = scenes.add_plane("Bare")
    common = scenes.add_material("Common")
    seen = scenes.add_plane("Seen", material=common)
    scenes.add_plane("Unseen", material=common)
    lamp = bpy.data.objects["Lamp"]
    make_atlas(box, bare, seen, lamp)
    said = capfd.readouterr().out
    assert "'Bare' is left out: it is no mesh with a Beamspread node." in said
    assert "'Lamp' is left out: it is no mesh with a Beamspread node." in said
    assert "'Seen / Common' is left out: 'Unseen' has the same material, and would show the atlas." in said
    assert "1 object has its place in the image 'Atlas' of 128 x 128 texels: Bake fills it." in said
    assert scenes.image_of(box).name == "Atlas"
    assert scenes.node_of(common).image is None
    assert not scenes.node_of(common).uv_map
    assert OWN_MAP not in seen.data.uv_layers
    scenes.select(bare)
    assert "No selected object can have a place" in scenes.messages_of(bpy.ops.beamspread.make_atlas)


def test_a_new_image_goes_to_a_file_beside_a_saved_scene_and_batches_fill_it(tmp_path):
    boxes = [add_box("A", 0), add_box("B", 2.5)]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    image = make_atlas(*boxes)
    path = tmp_path / "textures" / "Atlas.exr"
    assert bpy.path.abspath(image.filepath) == str(path)
    here = scenes.bake(*boxes)[0].copy()
    image.pixels.foreach_set(np.zeros(len(image.pixels), np.float32))
    bpy.ops.wm.save_mainfile()
    native.write_exr(str(path), np.zeros((SIDE, SIDE, 3), np.float32), ["R", "G", "B"])
    done = subprocess.run(scenes.batch_command(tmp_path / "scene.blend"), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr + done.stdout
    np.testing.assert_allclose(native.read_exr(str(path))[0][..., :3], here, rtol=1e-5, atol=1e-7)


def test_undo_takes_maps_and_image_away():
    boxes = [add_box("A", 0), add_box("B", 2.5)]
    bpy.context.preferences.edit.use_global_undo = True
    scenes.select(*boxes)
    bpy.ops.ed.undo_push(message="Before")
    assert bpy.ops.beamspread.make_atlas() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="After")
    assert scenes.image_of(boxes[0]).name == "Atlas"
    bpy.ops.ed.undo()
    box = bpy.data.objects["A"]
    assert scenes.image_of(box) is None
    assert not scenes.node_of(box.data.materials[0]).uv_map
    assert OWN_MAP not in box.data.uv_layers
    bpy.ops.ed.redo()
    box = bpy.data.objects["A"]
    assert OWN_MAP in box.data.uv_layers
    assert scenes.bake(box)[0].any()


def test_the_resolution_follows_all_objects():
    """The scene sets no resolution. The texel density of the scene then gives the side of the image."""
    settings = bpy.context.scene.beamspread
    settings.property_unset("resolution")
    settings.texel_density = 150
    small = make_atlas(add_box("A", 0)).size[0]
    boxes = [add_box(f"B{number}", 3 * number, size=2) for number in range(9)]
    large = make_atlas(*boxes).size[0]
    assert large > small
