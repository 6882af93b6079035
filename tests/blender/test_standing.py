"""Status of targets: never baked, baked, out of date and why, failed; panels and Bake Out of Date use it."""

from dataclasses import replace

import bpy
import pytest
from beamspread.blender.images.facts import facts_of, note_bake
from beamspread.blender.jobs.out_of_date import object_digests, stale
from beamspread.blender.jobs.run import batch_run
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.node.node import upgrade_nodes
from beamspread.blender.read.scene_cache import scene_cache
from beamspread.core.bake.runner import Bake
from beamspread.core.batch import batch_options
from beamspread.core.target import Target
from mathutils import Matrix
from scenes import (
    add_blocker,
    add_material,
    add_mesh,
    add_plane,
    add_sun,
    bake,
    messages_of,
    node_of,
    pixels,
    select,
)
from standings import PLANE, baked_plane, row, update


@pytest.fixture
def plane():
    return baked_plane()


def test_a_script_that_removes_objects_is_no_obstacle(plane):
    """Beside an instance, for which all objects are looked at."""
    collection = bpy.data.collections.new("Shown")
    collection.objects.link(bpy.data.objects["Wall"].copy())
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection, instance.location.x = "COLLECTION", collection, 0.1
    bpy.context.collection.objects.link(instance)
    update()
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    assert row().status == Status.STALE
    bpy.data.objects.remove(add_blocker(2.0))
    assert bpy.ops.beamspread.bake(objects="ALL") == {"FINISHED"}
    assert row().status == Status.BAKED


def remove_inputs(tree):
    """Nodes of the first version."""
    if hasattr(tree, "interface"):
        for item in [item for item in tree.interface.items_tree if getattr(item, "in_out", "") == "INPUT"]:
            tree.interface.remove(item)
    else:
        tree.inputs.clear()


def test_inputs_that_an_older_node_gets_late_are_no_change():
    """Switched on in a window, the add-on finds no nodes yet: one of an older file may be baked without inputs."""
    bpy.context.scene.beamspread.resolution = 32
    material = add_material()
    plane, node = add_plane(material=material), node_of(material)
    add_sun(20)
    remove_inputs(node.node_tree)
    assert list(node.inputs) == []
    bake(plane)
    assert row().status == Status.BAKED
    upgrade_nodes()
    assert len(node.inputs) == 3
    scene_cache.forget()
    assert row().status == Status.BAKED


def vertex(_plane):
    mesh = bpy.data.objects["Wall"].data
    mesh.vertices[2].co.z = 3
    mesh.update()


def test_another_output_of_the_node_before_it(plane):
    node = node_of(plane.data.materials[0])
    place = node.id_data.nodes.new("ShaderNodeTexCoord")
    node.id_data.links.new(node.inputs["Base Color"], place.outputs["UV"])
    bake(plane)
    node.id_data.links.new(node.inputs["Roughness"], place.outputs["Object"])
    update()
    assert row().status == Status.BAKED
    node.id_data.links.new(node.inputs["Base Color"], place.outputs["Object"])
    update()
    assert "material" in row().messages[0].text


def said():
    """Words of the row of the plane for what has changed."""
    update()
    return row().messages[0].text


def of_two_materials(*materials):
    """A plane whose left and right halves have a material each."""
    vertices = [(x, y, 0) for y in (-1, 1) for x in (-1, 0, 1)]
    uvs = [(0, 0), (0.5, 0), (0.5, 1), (0, 1), (0.5, 0), (1, 0), (1, 1), (0.5, 1)]
    plane = add_mesh("Plane", vertices, [(0, 1, 4, 3), (1, 2, 5, 4)], None, uvs)
    for material in materials:
        plane.data.materials.append(material)
    plane.data.polygons[1].material_index = 1
    return plane


@pytest.mark.parametrize("indirect", [True, False], ids=["bounced light", "direct light"])
def test_a_change_of_its_material_is_no_change_of_objects_that_have_the_material(indirect):
    bpy.context.scene.beamspread.resolution, bpy.context.scene.beamspread.use_indirect = 16, indirect
    material, second = add_material(), add_material("Second", albedo=(0.2, 0.2, 0.2))
    plane = of_two_materials(material, second)
    add_plane("Other", matrix=Matrix.Translation((5, 0, 0)), material=material)
    add_sun(20)
    bake(plane)
    node_of(material).albedo = (0.5, 0.5, 0.5)
    assert said() == "Changed since its bake: material."
    bake(plane)
    tree = material.node_tree
    glow, output = tree.nodes.new("ShaderNodeEmission"), tree.get_output_node("ALL")
    add = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(add.inputs[0], glow.outputs[0])
    tree.links.new(add.inputs[1], node_of(material).outputs["BSDF"])
    tree.links.new(output.inputs["Surface"], add.outputs[0])
    if not indirect:  # bounced light takes the light of such a material from its node alone
        assert said() == "Changed since its bake: material."
        bake(plane)
    plane.material_slots[0].material, plane.material_slots[1].material = second, material
    assert row(Target("Plane", "Medium")).messages[0].text == "Changed since its bake: other materials of the object."


def test_a_change_of_another_material_of_its_object():
    second, bpy.context.scene.beamspread.use_indirect = add_material("Second"), True
    plane = of_two_materials(add_material(), second)
    add_sun(20)
    bake(plane)
    node_of(second).albedo = (0.5, 0.5, 0.5)
    assert said() == "Changed since its bake: other materials of the object."


@pytest.mark.parametrize("is_empty", [True, False], ids=["empty", "of a material"])
def test_a_slot_counts_once_a_face_has_it(is_empty):
    bpy.context.scene.beamspread.use_indirect = True
    plane = of_two_materials(add_material(), add_material("Second"))
    add_sun(20)
    wall = add_plane("Bare wall", matrix=Matrix.Translation((3, 0, 1)))
    bake(plane)
    # The first slot of the wall would show its material.
    for obj in (plane, wall) if is_empty else (plane,):
        obj.data.materials.append(None if is_empty else bpy.data.materials.new("Third"))
    update()
    assert row(Target("Plane", "Medium")).status == Status.BAKED
    plane.data.polygons[1].material_index = 2
    update()
    assert row(Target("Plane", "Medium")).status == Status.STALE


def test_edit_mode_is_no_change_of_an_object_with_an_empty_slot():
    """The evaluated mesh has no polygons then."""
    bpy.context.scene.beamspread.use_indirect = True
    plane = add_plane("Plane", material=add_material())
    add_sun(20)
    wall = add_plane("Wall of an empty slot", matrix=Matrix.Translation((3, 0, 1)))
    for material in (add_material("Second"), None):
        wall.data.materials.append(material)
    wall.data.polygons[0].material_index = 1
    bake(plane)
    bpy.context.view_layer.objects.active = wall
    for mode in ("EDIT", "OBJECT"):
        bpy.ops.object.mode_set(mode=mode)
        update()
        assert row(Target("Plane", "Medium")).status == Status.BAKED


def test_a_change_of_other_data_does_not(plane):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    camera.location = 1, 2, 3
    select(bpy.data.objects["Wall"])
    scene = bpy.context.scene
    scene.render.resolution_x, scene.frame_current = 100, 5
    scene.beamspread.resolution = 64  # of images that are still to be made
    plane.data.materials[0].node_tree.nodes.new("ShaderNodeValue")
    node_of(plane.data.materials[0]).location.x = 9
    bpy.data.objects["Wall"].name = "Pane"
    update()
    assert row().status == Status.BAKED
    plane.location.x = 1
    update()
    assert row().is_stale
    plane.location.x = 0
    update()
    assert not row().is_stale


@pytest.mark.parametrize("indirect", [False, True])
def test_an_object_without_faces_does_not_but_its_first_face_does(indirect):
    bpy.context.scene.beamspread.resolution, bpy.context.scene.beamspread.use_indirect = 32, indirect
    plane = add_plane(material=add_material())
    add_sun(20)
    bake(plane)
    path = bpy.data.curves.new("Rail", "CURVE")
    path.dimensions = "3D"
    path.splines.new("POLY").points.add(3)
    for number, point in enumerate(path.splines[0].points):
        point.co = number / 4, 0, 0.1, 1
    mesh = bpy.data.meshes.new("Points")
    mesh.from_pydata([(0, 0, 1), (1, 0, 1), (0, 1, 1)], [(0, 1)], [])
    for data in (path, mesh):
        bpy.context.collection.objects.link(bpy.data.objects.new(data.name, data))
    update()
    assert not row().is_stale
    path.bevel_depth = 0.01
    update()
    assert row().is_stale
    path.bevel_depth = 0
    update()
    assert not row().is_stale
    solid = bpy.data.objects["Points"].modifiers.new("Skin", "SOLIDIFY")
    update()
    assert row().is_stale
    bpy.data.objects["Points"].modifiers.remove(solid)
    mesh.clear_geometry()
    mesh.from_pydata([(0, 0, 1), (1, 0, 1), (0, 1, 1)], [], [(0, 1, 2)])
    update()
    assert row().is_stale


def test_bakes_of_other_objects_do_not(plane):
    """Each other's images and links don't count, nor does a bake of one undo the other's."""
    other = add_plane("Other", matrix=Matrix.Translation((5, 0, 0)), material=add_material("Second"))
    update()
    assert row().status == Status.STALE
    bake(plane)
    before = node_of(other.data.materials[0]).image
    bake(other)
    assert (before, row().status) == (None, Status.BAKED)
    assert row(Target("Other", "Second")).status == Status.BAKED


def test_only_stale_targets_are_baked_again(plane):
    other = add_plane("Other", matrix=Matrix.Translation((0, 0, -5)), material=add_material("Second"))
    bake(plane, other)
    assert "Nothing is out of date" in messages_of(lambda: bpy.ops.beamspread.bake(objects="STALE"))
    node_of(other.data.materials[0]).albedo = (0.2, 0.2, 0.2)
    images = [node_of(obj.data.materials[0]).image for obj in (plane, other)]
    for image in images:
        values = [0.5] * len(image.pixels)
        image.pixels.foreach_set(values)
        image.pack()
    assert bpy.ops.beamspread.bake(objects="STALE") == {"FINISHED"}
    assert (pixels(images[0]) == 0.5).all()
    assert not (pixels(images[1]) == 0.5).any()
    assert not row(Target("Other", "Second")).is_stale


def test_it_is_known_after_loading_and_undo(plane, tmp_path):
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.data.lights["Sun"].energy = 5.0
    update()
    assert row().is_stale
    bpy.ops.wm.open_mainfile(filepath=path)
    assert row().status == Status.BAKED
    bpy.data.lights["Sun"].energy = 5.0
    update()
    assert [*map(str, row().messages)] == ["Changed since its bake: lights."]


def test_changes_since_a_bake_of_an_earlier_version_are_not_known(plane):
    image = node_of(plane.data.materials[0]).image
    record = facts_of(image).bakes[PLANE]
    note_bake(image, PLANE, replace(record, scheme=1, parts=record.parts | {"lights": "0"}))
    assert (row().status, row().is_stale) == (Status.BAKED, False)
    assert str(row().messages[0]).startswith("Changes since its bake are not known")
    bake(plane)
    assert (row().status, row().messages) == (Status.BAKED, ())


def test_painting_in_the_image(plane):
    image = node_of(plane.data.materials[0]).image
    image.pixels.foreach_set([0.5] * len(image.pixels))
    image.update()
    assert "pixels of the image" in row().messages[0].text


def test_a_copy_with_the_same_image_was_never_baked(plane):
    copy = plane.copy()
    copy.location.x = 9
    bpy.context.collection.objects.link(copy)
    assert row(Target(copy.name, "Medium")).status == Status.NEVER


def test_dark_is_a_warning_that_stays_with_the_image(tmp_path):
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material())
    add_sun(180)
    bake(plane)
    assert row().status == Status.WARNED
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert row().status == Status.WARNED
    assert "All lights are behind 'Plane'" in row().messages[0].text


def test_paths_of_textures_that_saving_makes_relative_change_nothing(plane, tmp_path):
    image = bpy.data.images.new("Sky", 4, 2, float_buffer=True)
    image.filepath_raw, image.file_format = str(tmp_path / "sky.hdr"), "HDR"
    image.save()
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.load(image.filepath_raw)
    tree.links.new(tree.nodes["Background"].inputs["Color"], sky.outputs["Color"])
    bake(plane)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert sky.image.filepath == "//sky.hdr"
    scene_cache.forget()
    assert row().status == Status.BAKED


def test_failures_of_a_material_that_another_has_replaced_are_no_rows(plane):
    other = add_plane("Other", material=plane.data.materials[0])
    select(other)
    assert "to the same part of the image" in messages_of(bpy.ops.beamspread.bake)
    assert row(Target("Other", "Medium")).status == Status.FAILED
    other.data.materials[0] = other.data.materials[0].copy()
    stale.refresh(bpy.context)
    assert {str(target) for target in state.rows} == {"Plane / Medium", "Other / Medium.001"}


def test_failures_of_an_object_that_is_gone_are_no_rows(plane):
    other = add_plane("Other", material=plane.data.materials[0])
    select(other)
    assert "to the same part of the image" in messages_of(bpy.ops.beamspread.bake)
    assert row(Target("Other", "Medium")).status == Status.FAILED
    bpy.data.objects.remove(other)
    stale.refresh(bpy.context)
    assert {str(target) for target in state.rows} == {"Plane / Medium"}


def test_failures_stand_beside_earlier_bakes(plane):
    plane.hide_render = True
    select(plane)
    assert "hidden from render" in messages_of(bpy.ops.beamspread.bake)
    assert row().status == Status.FAILED
    assert "hidden from render" in row().messages[0].text
    plane.hide_render = False
    bake(plane)
    assert row().status == Status.BAKED


def test_a_scan_reads_only_meshes_that_have_changed(plane, monkeypatch):
    names, digest_of_mesh = [], object_digests.digest_of_mesh
    monkeypatch.setattr(object_digests, "digest_of_mesh", lambda obj: names.append(obj.name) or digest_of_mesh(obj))
    row()
    names.clear()
    bpy.data.objects["Sun"].location.x = 3
    bpy.data.objects["Wall"].location.x = 3
    update()
    row()
    assert names == []
    vertex(plane)
    update()
    row()
    assert names == ["Wall"]


def test_how_often_light_may_bounce_counts_where_it_may(plane):
    cycles = bpy.context.scene.cycles
    cycles.diffuse_bounces += 1
    assert row().status == Status.BAKED  # without indirect light
    bpy.context.scene.beamspread.use_indirect = True
    stale.keep(Bake(PLANE), stale.parts_of(bpy.context, [PLANE])[PLANE])
    assert row().status == Status.BAKED
    cycles.diffuse_bounces += 1
    assert "settings" in row().messages[0].text


@pytest.mark.parametrize("arguments", [[], ["--solver", "direct"], ["--pass", "IRRADIANCE"]])
def test_a_batch_that_fills_the_nodes_image_is_a_bake(arguments, tmp_path):
    bpy.context.scene.beamspread.resolution, bpy.context.scene.beamspread.image_storage = 16, "FILES"
    plane = add_plane(material=add_material())
    add_sun(20)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bake(plane)
    del node_of(plane.data.materials[0]).image["beamspread"]
    state.forget()
    assert row().status == Status.NEVER
    assert batch_run.bake_all(batch_options.parse(arguments)).all_written()
    expected = Status.NEVER if "--pass" in arguments else Status.STALE if arguments else Status.BAKED
    assert row().status == expected
    if expected == Status.STALE:
        assert row().messages[0].text == "Changed since its bake: settings."


def test_looks_follow_a_change_at_once_and_take_at_most_a_tenth_of_the_time(monkeypatch):
    """But one alone that takes long, as the first after a file was opened, keeps nobody waiting for the next."""
    if not bpy.context.window_manager.windows:
        pytest.skip("without a window there are no looks")
    now, seconds, looked = [1e6], [0.0], []

    def refresh(_context):
        looked.append(now[0])
        now[0] += seconds[0]

    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr(stale, "refresh", refresh)
    monkeypatch.setitem(stale._last, "took", 0.0)
    for change, took, look in ((0, 0.8, 0.3), (1.2, 0.8, 1.5), (2.4, 0.01, 2.3 + 8), (10.5, 0.8, 10.8), (11.7, 0, 12)):
        now[0], seconds[0] = 1e6 + change, took
        stale.scan_soon()
        while (rest := stale._scan()) is not None:
            now[0] += rest
        assert looked.pop() == pytest.approx(1e6 + look, abs=1e-3)
    monkeypatch.undo()
    stale._last["next"] = 0.0
