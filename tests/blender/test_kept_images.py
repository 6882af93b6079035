"""Images belong to one target, or to targets with charts side by side; storage of new images; undo."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images import files
from beamspread.blender.images.facts import KEY, facts_of
from beamspread.blender.images.results import Results
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.blender.jobs.state import state
from beamspread.blender.node.find import find_targets
from beamspread.blender.ui.panels import draw_image_buttons
from beamspread.core.native import native
from beamspread.core.target import Target
from mathutils import Matrix

HALVES = {"Left": [(0, 0), (0.5, 0), (0.5, 1), (0, 1)], "Right": [(0.5, 0), (1, 0), (1, 1), (0.5, 1)]}


@pytest.fixture(autouse=True)
def settings():
    bpy.context.scene.beamspread.resolution = 32
    return bpy.context.scene.beamspread


def duplicate(obj, own_material, turned=0.8):
    """Duplicate as Shift+D does, and turn the copy. With `own_material`, its material becomes single-user."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    copy.matrix_world = Matrix.Translation((9, 0, 0)) @ Matrix.Rotation(turned, 4, "X")
    bpy.context.collection.objects.link(copy)
    if own_material:
        copy.data.materials[0] = obj.data.materials[0].copy()
    return copy


def warnings_of(obj):
    """Messages of the last bake about the object."""
    return [line for line in state.lines() if f"'{obj.name}" in line]


def test_a_copy_with_its_own_material_gets_its_own_image():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    (before,) = scenes.bake(plane)
    copy = duplicate(plane, own_material=True)
    assert scenes.image_of(copy) == scenes.image_of(plane)
    (other,) = scenes.bake(copy)
    assert scenes.image_of(copy) != scenes.image_of(plane)
    assert np.array_equal(scenes.pixels(scenes.image_of(plane)), before)
    assert not np.allclose(other, before)
    (sentence,) = warnings_of(copy)
    assert sentence.startswith(f"The image '{scenes.image_of(plane).name}' belongs to 'Plane / Medium': ")
    # From now on each target has its own image, in any order and in one run.
    assert np.array_equal(scenes.bake(plane)[0], before)
    assert np.array_equal(scenes.bake(copy)[0], other)
    assert [*map(np.ndarray.tolist, scenes.bake(copy, plane))] == [other.tolist(), before.tolist()]
    assert len(bpy.data.images) == 2
    assert not warnings_of(copy)


def test_copies_that_are_baked_in_one_run_get_an_image_each():
    image = bpy.data.images.new("Own", 16, 16, float_buffer=True)
    plane = scenes.add_plane(material=scenes.add_material(image=image))
    copy = duplicate(plane, own_material=True)
    scenes.add_sun(0)
    first, second = scenes.bake(plane, copy)
    assert scenes.image_of(plane) == image
    assert scenes.image_of(copy) != image
    assert not np.allclose(first, second)


@pytest.mark.parametrize("rename", ["objects", "materials"])
def test_owners_are_known_by_their_new_names(rename, tmp_path):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    (before,) = scenes.bake(plane)
    copy = duplicate(plane, own_material=True)
    (plane if rename == "objects" else plane.data.materials[0]).name = "Renamed"
    names = plane.name, copy.name
    scenes.reopen(tmp_path)
    plane, copy = (bpy.data.objects[name] for name in names)
    scenes.bake(copy)
    assert scenes.image_of(copy) != scenes.image_of(plane)
    assert scenes.pixels(scenes.image_of(plane)) == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("removed", [True, False])
def test_a_removed_owners_image_is_free(removed):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    scenes.bake(plane)
    copy = duplicate(plane, own_material=False)
    image = scenes.image_of(plane)
    if removed:
        bpy.data.objects.remove(plane)
    else:
        bpy.context.collection.objects.unlink(plane)
    scenes.bake(copy)
    assert scenes.image_of(copy) == image
    assert [*facts_of(image).bakes] == [Target("Plane.001", "Medium")]


def test_a_shared_material_is_refused_before_the_bake_with_a_remedy():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    (before,) = scenes.bake(plane)
    copy = duplicate(plane, own_material=False)
    scenes.select(copy)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "'Plane' is baked to the same part of the image" in message
    assert "Give 'Plane.001' a material of its own" in message
    assert np.array_equal(scenes.pixels(scenes.image_of(plane)), before)
    assert np.array_equal(scenes.bake(plane)[0], before)


def test_an_atlas_is_baked_part_by_part():
    image = bpy.data.images.new("Atlas", 32, 16, float_buffer=True)
    material = scenes.add_material(image=image)
    planes = [scenes.add_plane(name, uvs=uvs, material=material) for name, uvs in HALVES.items()]
    planes[1].location.x = 5
    sun = scenes.add_sun(0)
    (together,) = scenes.bake(*planes)[:1]
    image.pixels.foreach_set(np.zeros(32 * 16 * 4, np.float32))
    del image[KEY]
    for plane in planes:
        scenes.bake(plane)
    assert scenes.pixels(image) == pytest.approx(together, abs=1e-5)
    sun.data.energy = 2.0
    scenes.bake(planes[1])
    assert scenes.pixels(image)[:, 16:] == pytest.approx(2 * together[:, 16:], rel=1e-4)
    assert scenes.pixels(image)[:, :16] == pytest.approx(together[:, :16], abs=1e-5)


def test_a_batch_leaves_the_file_of_an_image_to_its_owner(tmp_path):
    path = tmp_path / "own.exr"
    plane = scenes.add_plane(material=scenes.add_material(image=scenes.file_image(path, 16, 16)))
    scenes.add_sun(0)
    scenes.bake(plane)
    before = path.read_bytes()
    duplicate(plane, own_material=True)
    scenes.save_scene(tmp_path)
    own, other = scenes.run_batch("--object", "Plane", "Plane.001").bakes
    assert (own.path, other.path) == (str(path), str(tmp_path / "beamspread" / "Plane.001_Medium.001.exr"))
    assert "belongs to another" in other.message
    assert path.read_bytes() == before


def test_a_batch_fills_an_atlas_together(tmp_path):
    path = tmp_path / "atlas.exr"
    material = scenes.add_material(image=scenes.file_image(path, 32, 16))
    for number, (name, uvs) in enumerate(HALVES.items()):
        scenes.add_plane(name, matrix=Matrix.Translation((5 * number, 0, 0)), uvs=uvs, material=material)
    scenes.add_sun(0)
    scenes.save_scene(tmp_path)
    report = scenes.run_batch()
    assert [one.path for one in report.bakes] == [str(path)] * 2
    assert (native.read_exr(str(path))[0] > 0).all()


def test_new_images_are_float_files_beside_a_saved_scene(tmp_path, settings):
    plane = scenes.add_plane("A/b", material=scenes.add_material("M"))
    scenes.add_sun(0, strength=100.0)
    scenes.save_scene(tmp_path)
    (shown,) = scenes.bake(plane)
    image, path = scenes.image_of(plane), tmp_path / "textures" / "A_b_M.exr"
    assert image.name == "A/b_M"
    assert image.is_float
    assert (image.filepath, image.packed_file) == ("//textures/A_b_M.exr", None)
    assert native.read_exr(str(path))[0] == pytest.approx(shown)
    assert shown.max() > 1
    # After undo, the next bake writes the same file. A file of another program stays.
    scenes.node_of(plane.data.materials[0]).image = None
    bpy.data.images.remove(image)
    scenes.bake(plane)
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    native.write_exr(str(path), np.zeros((4, 4, 3), np.float32), ["R", "G", "B"])
    scenes.node_of(plane.data.materials[0]).image = None
    before = path.read_bytes()
    scenes.bake(plane)
    assert path.read_bytes() == before
    assert scenes.image_of(plane).filepath == "//textures/A_b_M_2.exr"
    assert scenes.image_of(plane).name == "A/b_M.001"


def test_a_node_whose_image_was_cleared_gets_its_file_again(tmp_path):
    """A file whose image is in use, or was painted on, stays."""
    plane = scenes.add_plane(material=scenes.add_material())
    sun = scenes.add_sun(0)
    scenes.save_scene(tmp_path)
    scenes.bake(plane)
    first = scenes.image_of(plane)
    scenes.node_of(plane.data.materials[0]).image = None
    sun.data.energy = 3
    scenes.bake(plane)
    assert [one.name for one in (tmp_path / "textures").iterdir()] == ["Plane_Medium.exr"]
    assert [one.name for one in bpy.data.images] == ["Plane_Medium"]
    first = scenes.image_of(plane)
    first.use_fake_user = True
    scenes.node_of(plane.data.materials[0]).image = None
    before = scenes.pixels(first)
    sun.data.energy = 1
    scenes.bake(plane)
    assert scenes.image_of(plane) != first
    assert sorted(one.name for one in (tmp_path / "textures").iterdir()) == ["Plane_Medium.exr", "Plane_Medium_2.exr"]
    np.testing.assert_array_equal(scenes.pixels(first), before)


def test_folder_name_and_storage_are_settings(tmp_path, settings):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    settings.image_dir, settings.image_name = str(tmp_path / "mine"), "light of {object}"
    scenes.bake(plane)
    assert (scenes.image_of(plane).name, scenes.image_of(plane).packed_file) == ("light of Plane", None)
    assert (tmp_path / "mine" / "light_of_Plane.exr").exists()
    scenes.node_of(plane.data.materials[0]).image = None
    scenes.save_scene(tmp_path)
    settings.image_storage = "PACKED"
    scenes.bake(plane)
    assert scenes.image_of(plane).packed_file is not None
    scenes.node_of(plane.data.materials[0]).image = None
    settings.image_storage, settings.image_dir = "FILES", str(tmp_path / "mine" / "light_of_Plane.exr")
    scenes.bake(plane)
    assert scenes.image_of(plane).packed_file is not None
    assert any("packed into the .blend file instead" in line for line in state.lines())


def test_an_exr_file_that_was_read_as_srgb_is_read_as_linear(tmp_path):
    path = tmp_path / "own.exr"
    native.write_exr(str(path), np.ones((16, 16, 3), np.float32), ["R", "G", "B"])
    image = bpy.data.images.load(str(path))
    plane = scenes.add_plane(material=scenes.add_material(image=image))
    scenes.add_sun(0)
    (expected,) = scenes.bake(plane)
    image.colorspace_settings.name = "sRGB"
    assert scenes.bake(plane)[0] == pytest.approx(expected, abs=1e-6)
    image.colorspace_settings.is_data = True
    assert scenes.bake(plane)[0] == pytest.approx(expected, abs=1e-6)
    assert image.colorspace_settings.is_data


def test_half_floats_stay_half_where_the_values_fit(tmp_path):
    path = tmp_path / "half.exr"
    native.write_exr(str(path), np.ones((16, 16, 3), np.float32), ["R", "G", "B"], compression="none", half=True)
    size = path.stat().st_size
    plane = scenes.add_plane(material=scenes.add_material(image=bpy.data.images.load(str(path))))
    sun = scenes.add_sun(0)
    (shown,) = scenes.bake(plane)
    assert path.stat().st_size == size
    assert np.array_equal(native.read_exr(str(path))[0], shown)
    assert np.array_equal(shown, shown.astype(np.float16))
    sun.data.energy = 1e7
    (shown,) = scenes.bake(plane)
    assert shown.max() > 65504
    assert path.stat().st_size > 1.5 * size


def test_an_image_that_clips_gives_a_warning_and_make_float_mends_it(tmp_path):
    image = bpy.data.images.new("Bytes", 16, 16)
    plane = scenes.add_plane(material=scenes.add_material(image=image))
    sun = scenes.add_sun(0)
    scenes.bake(plane)
    assert not any("clips" in line for line in state.lines())
    linear = files.linear_pixels(image)
    sun.data.energy = 100.0
    scenes.bake(plane)
    assert any("'Bytes' clips values above 1. Make Float" in line for line in state.lines())
    sun.data.energy = 1.0
    scenes.bake(plane)
    scenes.select(plane)
    assert bpy.ops.beamspread.make_float() == {"FINISHED"}
    image = scenes.image_of(plane)
    assert image.name == "Bytes"
    assert image.is_float
    assert scenes.node_of(plane.data.materials[0]).node_tree.nodes["Image"].image == image
    assert scenes.pixels(image) == pytest.approx(linear, abs=1e-5)
    assert [*facts_of(image).bakes] == [Target("Plane", "Medium")]
    sun.data.energy = 100.0
    assert scenes.bake(plane)[0].max() > 1
    assert not any("clips" in line for line in state.lines())
    assert not bpy.ops.beamspread.make_float.poll()


def test_an_image_is_resized_only_when_asked(tmp_path, settings, monkeypatch):
    plane = scenes.add_plane(size=(2, 1), material=scenes.add_material())
    scenes.add_sun(0)
    scenes.save_scene(tmp_path)
    scenes.select(plane)
    assert scenes.bake(plane)[0].shape == (16, 32, 3)
    assert not bpy.ops.beamspread.resize_image.poll()
    settings.resolution = 64
    assert scenes.bake(plane)[0].shape == (16, 32, 3)
    asked = []
    in_render_properties = SimpleNamespace(object=None, view_layer=bpy.context.view_layer, scene=bpy.context.scene)
    draw_image_buttons(SimpleNamespace(operator=lambda name, **_: asked.append(name)), in_render_properties)
    assert asked == ["beamspread.resize_image"]
    bpy.context.view_layer.update()
    looks = []
    monkeypatch.setattr(stale, "scan_soon", lambda: looks.append(1))
    with bpy.context.temp_override(object=None):
        assert bpy.ops.beamspread.resize_image() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert looks
    stale.refresh(bpy.context)
    assert state.rows[Target("Plane", "Medium")].is_stale
    assert scenes.bake(plane)[0].shape == (32, 64, 3)
    assert native.read_exr(str(tmp_path / "textures" / "Plane_Medium.exr"))[0].shape == (32, 64, 3)


@pytest.mark.parametrize("file_format", ["FFMPEG", "OPEN_EXR"])
def test_a_png_has_the_view_transform_where_that_is_asked_for(tmp_path, settings, file_format):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0, strength=5.0)
    (linear,) = scenes.bake(plane)
    scene = bpy.context.scene
    scene.view_settings.view_transform, scene.view_settings.exposure = "Standard", 1.0
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "VIDEO" if file_format == "FFMPEG" else "IMAGE"
    scene.render.image_settings.file_format = file_format
    shown = {}
    for use in (False, True):
        settings.use_view_transform = use
        (record,) = scenes.run_batch("--format", "PNG", "--output", tmp_path / str(use)).bakes
        image = bpy.data.images.load(record.path)
        image.colorspace_settings.is_data = True
        shown[use] = scenes.pixels(image)
    assert shown[False] == pytest.approx(files.to_srgb(linear), abs=0.005)
    assert shown[True] == pytest.approx(files.to_srgb(2 * linear), abs=0.005)
    assert scene.render.image_settings.file_format == file_format
    scene.view_settings.view_transform = "Filmic"
    scenes.run_batch("--format", "PNG", "--output", tmp_path / "filmic")
    filmic = bpy.data.images.load(str(tmp_path / "filmic" / "Plane_Medium.png"))
    assert np.abs(scenes.pixels(filmic) - shown[True]).max() > 0.03


def test_a_part_of_another_target_is_not_overwritten():
    """Such as after UVs were moved during the bake."""
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    (before,) = scenes.bake(plane)
    copy = duplicate(plane, own_material=False)
    (refused,) = (Results().admit(one) for one in prepare_scene(bpy.context, find_targets([copy]), for_bake()))
    assert refused.job is None
    (late,) = prepare_scene(bpy.context, find_targets([copy]), for_bake())
    late.run()
    late.keep(Results().store)
    assert late.status == "failed"
    assert "same part" in late.error
    assert np.array_equal(scenes.pixels(scenes.image_of(plane)), before)


def test_undo_keeps_strokes_on_an_older_bake(tmp_path):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    scenes.bake(plane)
    name = scenes.image_of(plane).name
    scenes.reopen(tmp_path)
    bpy.ops.ed.undo_push(message="before")
    bpy.data.images[name].pixels[0] = 9.0
    bpy.data.objects["Sun"].data.energy = 3.0
    bpy.ops.ed.undo_push(message="light")
    bpy.ops.ed.undo()
    assert bpy.data.objects["Sun"].data.energy == 1
    assert bpy.data.images[name].pixels[0] == 9


def test_an_image_that_was_resized_during_the_bake_is_filled():
    """Undo can do that."""
    plane = scenes.add_plane(material=scenes.add_material(image=bpy.data.images.new("Own", 16, 16, float_buffer=True)))
    scenes.add_sun(0)
    (one,) = prepare_scene(bpy.context, find_targets([plane]), for_bake())
    one.run()
    scenes.image_of(plane).scale(8, 4)
    one.keep(Results().store)
    assert one.status == "written"
    assert "was resized during the bake" in str(list(one.messages)[-1])
    assert scenes.pixels(scenes.image_of(plane)).shape == (16, 16, 3)


def for_bake():
    return bpy.context.scene.beamspread.for_bake()


@pytest.mark.parametrize("has_file", [False, True])
def test_undo_in_background_shows_the_packed_pixels(has_file, tmp_path):
    """The file of a packed image stays as it is."""
    image = None
    if has_file:
        native.write_exr(str(tmp_path / "a.exr"), np.zeros((16, 16, 3), np.float32), ["R", "G", "B"])
        image = bpy.data.images.load(str(tmp_path / "a.exr"))
        image.pack()
    plane = scenes.add_plane(material=scenes.add_material(image=image))
    sun = scenes.add_sun(0)
    scenes.bake(plane)
    name = scenes.image_of(plane).name
    bpy.ops.ed.undo_push(message="first")
    first = scenes.pixels(scenes.image_of(plane))
    sun.data.energy = 3.0
    scenes.bake(plane)
    bpy.ops.ed.undo_push(message="second")
    second = scenes.pixels(scenes.image_of(plane))
    for operator, expected in ((bpy.ops.ed.undo, first), (bpy.ops.ed.redo, second)):
        operator()
        image = bpy.data.images[name]
        assert scenes.pixels(image) == pytest.approx(expected, rel=2**-10)
        image.buffers_free()
        assert scenes.pixels(image) == pytest.approx(expected, rel=2**-10)
        assert expected.any()
