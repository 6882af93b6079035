"""What Live shows is never kept, written or taken for a result. No timer runs here: the tests take its steps."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images import previews
from beamspread.blender.images.files import from_srgb
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.live import session
from live_scenes import live_lines, live_pixels, make_scene, save, settle, switch_off

pytestmark = pytest.mark.usefixtures("live_switched_off")

QUARTER = [(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)]


def stored_in_file(plane, folder):
    """Bake the plane into a new image with a file, with Live still off; the file."""
    bpy.context.scene.beamspread.image_storage = "FILES"
    save(folder)
    scenes.node_of(plane.data.materials[0]).image = None
    scenes.bake(plane)
    return next((folder / "textures").iterdir())


def row(plane):
    stale.refresh(bpy.context)
    return next(row for row in state.rows.values() if row.target.object_name == plane.name)


def make_atlas():
    """Two planes side by side in one image, baked; Live is on."""
    bpy.context.scene.beamspread.margin = 0
    plane, lamp, material = make_scene()
    plane.data.uv_layers.active.data.foreach_set("uv", np.ravel(QUARTER))
    other = scenes.add_plane("Other", material=scenes.add_material("Second"), uvs=np.add(QUARTER, 0.5))
    other.location.x = 2.5
    scenes.node_of(other.data.materials[0]).image = scenes.node_of(material).image
    bpy.context.view_layer.update()
    return plane, other, lamp, scenes.bake(plane, other)[0].copy()


def test_a_bake_into_an_atlas_leaves_the_others_result_and_not_its_preview():
    plane, _other, lamp, before = make_atlas()
    material = plane.data.materials[0]
    lamp.data.energy = 500
    assert live_pixels(material)[32:, 32:].mean() > 2 * before[32:, 32:].mean()
    after = scenes.bake(plane)[0]
    assert after[:32, :32].mean() > 2 * before[:32, :32].mean()
    np.testing.assert_array_equal(after[32:, 32:], before[32:, 32:])
    assert not scenes.node_of(material).image.is_dirty


def test_a_failed_bake_leaves_no_gap_in_what_live_shows():
    plane, _other, lamp, before = make_atlas()
    lamp.data.energy = 500
    shown = live_pixels(plane.data.materials[0]).copy()
    previews.give_back()
    np.testing.assert_array_equal(scenes.pixels(scenes.node_of(plane.data.materials[0]).image), before)
    np.testing.assert_array_equal(live_pixels(plane.data.materials[0]), shown)


def test_a_picture_that_undo_brings_back_in_mid_bake_is_not_the_images_own():
    plane, lamp, material = make_scene()
    before = scenes.bake(plane)[0].copy()
    lamp.data.energy = 500
    settle()
    previews.give_back()
    image = scenes.node_of(material).image
    image.pixels.foreach_set(np.full(len(image.pixels), 0.5, np.float32))  # as undo in Blender 5.2 was seen to do
    session.live.session.forget()
    np.testing.assert_array_equal(scenes.pixels(image), before)
    settle()
    switch_off()
    np.testing.assert_array_equal(scenes.pixels(scenes.node_of(material).image), before)


def test_what_live_shows_is_not_taken_for_painted():
    plane, lamp, material = make_scene()
    scenes.bake(plane)
    settle()
    lamp.location.x = -0.4
    live_pixels(material)
    lamp.location.x = 0.3
    live_pixels(material)
    assert scenes.node_of(material).image.is_dirty
    assert row(plane).status == Status.BAKED
    assert not row(plane).is_stale


@pytest.mark.parametrize("storage", ["FILES", "PACKED"])
def test_blender_saves_changed_images_as_it_closes(tmp_path, storage):
    """Its dialog does so by itself, before it saves the file; the results are there again."""
    plane, lamp, material = make_scene()
    bpy.context.scene.beamspread.use_live = False
    if storage == "FILES":
        path = stored_in_file(plane, tmp_path)
        before = path.read_bytes()
    else:
        scenes.bake(plane)
    image = scenes.node_of(material).image
    baked = scenes.pixels(image)
    bpy.context.scene.beamspread.use_live = True
    lamp.data.energy = 500
    live_pixels(material)
    bpy.ops.image.save_all_modified()
    assert not image.is_dirty
    save(tmp_path)
    image.buffers_free()
    np.testing.assert_array_equal(scenes.pixels(image), baked)
    if storage == "FILES":
        assert path.read_bytes() == before


def test_what_is_saved_has_no_preview_and_live_goes_on(tmp_path):
    _plane, _lamp, material = make_scene()
    scenes.node_of(material).image = None
    live_pixels(material)
    save(tmp_path)
    assert scenes.node_of(material).image is None
    assert live_pixels(material).max() > 0
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert scenes.node_of(bpy.data.materials["Medium"]).image is None
    assert not [image for image in bpy.data.images if image.source == "GENERATED"]


@pytest.mark.parametrize("is_on", [True, False])
def test_an_image_that_live_has_made_does_not_decide_where_results_are_kept(tmp_path, is_on):
    plane, _lamp, material = make_scene()
    bpy.context.scene.beamspread.image_storage = "FILES"
    save(tmp_path)
    scenes.node_of(material).image = None
    live_pixels(material)
    if not is_on:
        switch_off()
        assert scenes.node_of(material).image is None
    scenes.bake(plane)
    image = scenes.node_of(material).image
    assert image.packed_file is None
    assert (tmp_path / "textures" / "Plane_Medium.exr").is_file()
    assert image.name == "Plane_Medium"


def test_undo_brings_no_image_back_that_live_has_made():
    _plane, _lamp, material = make_scene()
    scenes.node_of(material).image = None
    live_pixels(material)
    bpy.ops.ed.undo_push(message="while it is shown")
    switch_off()
    bpy.ops.ed.undo_push(message="off")
    bpy.ops.ed.undo()
    assert not bpy.data.images.get("Plane_Medium")


def test_an_image_that_is_renamed_gets_its_pixels_back():
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0].copy()
    lamp.location.x = -0.4
    live_pixels(material)
    scenes.node_of(material).image.name = "Renamed"
    lamp.location.y = 0.4
    live_pixels(material)
    switch_off()
    np.testing.assert_array_equal(scenes.pixels(bpy.data.images["Renamed"]), baked)


def test_make_float_and_resize_copy_no_preview():
    plane, lamp, material = make_scene()
    node = scenes.node_of(material)
    node.image = bpy.data.images.new("Bytes", 64, 64, alpha=False)
    settle()
    baked = from_srgb(scenes.bake(plane)[0])
    lamp.data.energy = 5
    assert from_srgb(live_pixels(material)).mean() < 0.5 * baked.mean()
    bpy.ops.beamspread.make_float()
    assert node.image.is_float
    np.testing.assert_allclose(scenes.pixels(node.image), baked, atol=1e-6)
    lamp.data.energy = 6
    assert live_pixels(material).mean() < 0.5 * baked.mean()
    bpy.context.scene.beamspread.resolution = 32
    bpy.ops.beamspread.resize_image()
    assert scenes.pixels(node.image).mean() == pytest.approx(baked.mean(), rel=0.1)


def test_a_change_during_a_bake_is_shown_after_it():
    """The bake has read the light of before."""
    plane, lamp, material = make_scene()
    live_pixels(material)
    baked = scenes.bake(plane)[0].copy()
    lamp.data.energy = 5
    assert live_pixels(material).mean() < 0.5 * baked.mean()


@pytest.mark.parametrize("has_own_material", [False, True])
def test_a_copy_leaves_the_image_to_the_original_and_live_says_so(has_own_material):
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0].copy()
    copy = plane.copy()
    copy.name, copy.location.x = "A copy", 2.5
    bpy.context.collection.objects.link(copy)
    if has_own_material:
        copy.data = plane.data.copy()
        copy.data.materials[0] = material.copy()
    lamp.location.x = 0.29
    for _ in range(3):
        live = live_pixels(material)
    assert live.mean() == pytest.approx(baked.mean(), rel=0.1)
    assert [said for said in live_lines() if "A copy" in said and "of its own" in said]
