"""Data of other .blend files: bakes that could not be stored are refused, all others are stored."""

import bpy
import scenes
from beamspread.blender.images.facts import facts_of
from beamspread.blender.images.results import Results
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.blender.node.find import find_targets
from beamspread.blender.ui.bake_panel import problems_of
from beamspread.core.target import Target
from mathutils import Matrix


def link_from_library(folder, uvs=scenes.SQUARE_UVS):
    """Link a plane with a material, and a sun, from another file; the plane."""
    scenes.add_plane(uvs=uvs, material=scenes.add_material())
    scenes.add_sun(0)
    path = scenes.save_scene(folder)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.beamspread.quality, bpy.context.scene.beamspread.use_indirect = "preview", False
    bpy.context.scene.beamspread.resolution = 32
    plane, sun = scenes.load_data(path, link=True, objects=["Plane", "Sun"])
    for obj in (plane, sun):
        bpy.context.collection.objects.link(obj)
    return plane


def test_a_linked_material_is_refused_before_the_bake(tmp_path):
    plane = link_from_library(tmp_path)
    scenes.select(plane)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "The material 'Medium' belongs to another .blend file" in message
    assert scenes.image_of(plane) is None
    (late,) = prepare_scene(bpy.context, find_targets([plane]), bpy.context.scene.beamspread.for_bake())
    late.run()
    late.keep(Results().store)
    assert "belongs to another .blend file" in late.error
    # A batch changes nothing in it.
    report = scenes.run_batch("--output", tmp_path / "out")
    assert [one.status for one in report.bakes] == ["written"]
    # Made local, as the sentence says, it keeps its result.
    bpy.ops.object.make_local(type="SELECT_OBDATA_MATERIAL")
    plane = bpy.data.objects["Plane"]
    scenes.bake(plane)
    scenes.reopen(tmp_path, "user.blend")
    assert scenes.pixels(scenes.image_of(bpy.data.objects["Plane"])).any()


def test_a_linked_object_without_a_uv_map_is_refused_and_the_sentence_helps(tmp_path):
    plane = link_from_library(tmp_path, None)
    scenes.select(plane)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "The mesh has no UV map. 'Plane' belongs to another .blend file" in message
    assert "Make Local > Selected Objects, Data and Materials" in message
    bpy.ops.object.make_local(type="SELECT_OBDATA_MATERIAL")
    (texture,) = scenes.bake(bpy.data.objects["Plane"])
    assert texture.any()


def test_an_overridden_material_is_refused_and_the_sentence_helps(tmp_path):
    linked = link_from_library(tmp_path)
    plane = linked.override_create(remap_local_usages=True)
    plane.data.override_create(remap_local_usages=True)
    material = plane.material_slots[0].material.override_create(remap_local_usages=True)
    assert plane.material_slots[0].material == material
    assert material.override_library is not None
    scenes.select(plane)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "The material 'Medium' belongs to another .blend file" in message
    assert "Make Local > Selected Objects, Data and Materials" in message
    said = " ".join(map(str, problems_of(plane, {"Plane": 1})))
    assert "belongs to another .blend file" in said  # before the bake, in the panel
    assert scenes.image_of(plane) is None
    bpy.ops.object.make_local(type="SELECT_OBDATA_MATERIAL")
    plane = next(obj for obj in bpy.context.scene.objects if obj.type == "MESH")
    assert not problems_of(plane, {plane.name: 1})
    scenes.bake(plane)
    scenes.reopen(tmp_path, "user.blend")
    plane = next(obj for obj in bpy.context.scene.objects if obj.type == "MESH")
    assert scenes.pixels(scenes.image_of(plane)).any()


def test_a_linked_object_with_a_local_material_is_baked(tmp_path):
    linked = link_from_library(tmp_path)
    plane = linked.override_create()
    bpy.context.collection.objects.link(plane)
    bpy.context.collection.objects.unlink(linked)
    plane.material_slots[0].link = "OBJECT"
    plane.material_slots[0].material = scenes.add_material("Own")
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert scenes.pixels(scenes.image_of(plane)).any()


def test_an_appended_image_is_no_ones(tmp_path):
    bpy.context.scene.beamspread.resolution = 32
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    scenes.bake(plane)
    path = str(tmp_path / "copy.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
    (material,) = scenes.load_data(path, materials=["Medium"])
    other = scenes.add_plane("Other", matrix=Matrix.Translation((5, 0, 0)), material=material)
    image = scenes.image_of(other)
    assert image != scenes.image_of(plane)
    assert [*facts_of(image).bakes] == [Target("Plane", "Medium")]
    scenes.bake(other)
    assert scenes.image_of(other) == image


def test_frames_are_not_shown_in_linked_materials_and_the_operator_says_so(tmp_path):
    link_from_library(tmp_path)
    assert "There are no frames: Bake Animation makes them" in scenes.messages_of(bpy.ops.beamspread.show_frames)
