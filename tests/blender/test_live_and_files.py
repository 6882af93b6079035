"""Previews of Live stay out of files, of undo and of the images that artists paint on. The tests take Live's steps."""

import json

import beamspread
import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import preview, timer
from beamspread.blender.node import output
from live_scenes import (
    hidden_images,
    live_pixels,
    make_scene,
    save,
    settle,
    shown_image,
    shown_pixels,
    shows_own_image,
    switch_off,
)

pytestmark = pytest.mark.usefixtures("live_switched_off")

STROKE = np.s_[10:20, 30:40]


def draw(image, value=0.5):
    """Change some pixels, as a stroke does."""
    values = np.empty((image.size[1], image.size[0], image.channels), np.float32)
    image.pixels.foreach_get(values.ravel())
    values[STROKE] = value
    image.pixels.foreach_set(values.ravel())
    image.update()


def reopen(folder, name="scene.blend"):
    """Open a saved file; its material."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / name))
    return bpy.data.materials["Medium"]


def all_spaces():
    return [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces]


def make_baked_scene():
    """A baked plane whose light has changed since, so that Live shows something else."""
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0].copy()
    lamp.data.energy = 500
    assert live_pixels(material).mean() > 2 * baked.mean()
    return plane, lamp, material, baked


@pytest.mark.parametrize("has_image", [True, False])
def test_a_saved_file_has_no_preview_and_live_goes_on(tmp_path, has_image):
    _plane, _lamp, material, baked = make_baked_scene()
    if not has_image:
        scenes.node_of(material).image = None
    live = live_pixels(material).copy()
    save(tmp_path)
    np.testing.assert_array_equal(shown_pixels(material), live)
    np.testing.assert_array_equal(live_pixels(material), live)
    bpy.context.scene.beamspread.use_live = False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "off.blend"), copy=True)
    material = reopen(tmp_path)
    assert bpy.context.scene.beamspread.use_live
    assert shows_own_image(material)
    if has_image:
        np.testing.assert_array_equal(shown_pixels(material), baked)
    assert (shown_image(material) is not None) == has_image
    assert np.abs(live_pixels(material)).max() > 0


def test_blender_does_not_ask_to_save_a_preview_at_rest():
    """Blender 5 asks for each changed image at every save, all versions when they quit."""
    _plane, lamp, material, _baked = make_baked_scene()
    for energy in (500, 50):
        lamp.data.energy = energy
        live = live_pixels(material).copy()
        settle(lambda: not shown_image(material).is_dirty)
        np.testing.assert_array_equal(shown_pixels(material), live)
    shown_image(material).reload()  # Blender frees pixels that it takes for saved if memory runs short
    np.testing.assert_array_equal(live_pixels(material), live)


@pytest.mark.filterwarnings("ignore")  # of Blender's exporter
def test_gltf_files_get_the_bake(tmp_path):
    """Blender's exporter calls functions of each add-on by their names."""
    _plane, _lamp, material, _baked = make_baked_scene()
    live = live_pixels(material).copy()
    output.make_plain(scenes.node_of(material))
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    addon = bpy.context.preferences.addons.new()
    addon.module = beamspread.__name__
    try:
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / "scene.gltf"), export_format="GLTF_SEPARATE")
    finally:
        bpy.context.preferences.addons.remove(addon)
    images = [image["name"] for image in json.loads((tmp_path / "scene.gltf").read_text()).get("images", ())]
    assert images == [f"{scenes.node_of(material).image.name} 8 bit"]
    np.testing.assert_array_equal(shown_pixels(material), live)


def test_paint_is_saved_with_the_image_and_stays_through_live(tmp_path):
    """Blender saves all changed images, as it offers when a file is closed."""
    _plane, lamp, material, baked = make_baked_scene()
    image = scenes.node_of(material).image
    draw(image)
    lamp.location.x = -0.4
    settle()
    assert (scenes.pixels(image)[STROKE] == 0.5).all()
    bpy.ops.image.save_all_modified()
    save(tmp_path)
    material = reopen(tmp_path)
    assert shows_own_image(material)
    expected = baked.copy()
    expected[STROKE] = 0.5
    np.testing.assert_array_equal(shown_pixels(material), expected)


def test_live_rests_while_textures_are_painted_and_shows_the_own_image():
    """Strokes go to the image that the node's inner tree shows, and Blender gives that to Image Editors."""
    plane, lamp, material, baked = make_baked_scene()
    image = scenes.node_of(material).image
    editor = next(space for space in all_spaces() if space.type == "IMAGE_EDITOR")
    editor.image = shown_image(material)
    scenes.select(plane)
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    lamp.data.energy = 5
    for _ in range(3):
        timer.step(bpy.context)
        bpy.context.view_layer.update()
    assert list(material.texture_paint_images) == [image]
    assert editor.image == image
    assert not any(image.is_dirty for image in bpy.data.images)
    assert shown_image(material) == image
    np.testing.assert_array_equal(shown_pixels(material), baked)
    draw(image)
    bpy.ops.object.mode_set(mode="OBJECT")
    assert live_pixels(material).mean() < 0.5 * baked.mean()
    assert (scenes.pixels(image)[STROKE] == 0.5).all()


def test_paint_outside_of_all_objects_shows_in_the_preview():
    plane, _lamp, material = make_scene()
    bpy.context.scene.beamspread.margin = 0
    plane.data.uv_layers.active.data.foreach_set("uv", np.ravel([(0.5, 0.5), (1, 0.5), (1, 1), (0.5, 1)]))
    settle()
    draw(scenes.node_of(material).image)
    scenes.select(plane)
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    timer.step(bpy.context)
    bpy.ops.object.mode_set(mode="OBJECT")
    live = live_pixels(material)
    assert (live[10:20, 30:32] == 0.5).all()
    assert live[40:, 40:].min() > 0


@pytest.mark.parametrize("steps", [["undo"], ["undo", "redo"], ["undo", "undo"], ["undo", "undo", "redo", "redo"]])
def test_undo_and_redo_in_the_middle_of_live(steps):
    make_baked_scene()
    bpy.ops.ed.undo_push(message="before")
    for energy in (1, 2):
        bpy.data.lights["Lamp"].energy = energy
        settle()
        bpy.ops.ed.undo_push(message=f"energy {energy}")
    for step in steps:
        getattr(bpy.ops.ed, step)()
        material = bpy.data.materials["Medium"]
        assert shown_image(material).name in hidden_images()
        assert shown_pixels(material).max() > 0
    material, plane = bpy.data.materials["Medium"], bpy.data.objects["Plane"]
    live = live_pixels(material).copy()
    assert len(hidden_images()) == 1
    switch_off()
    assert shows_own_image(material)
    np.testing.assert_allclose(live, scenes.bake(plane)[0], rtol=1e-4)


@pytest.mark.parametrize("step", ["undo", "redo"])
def test_undo_and_redo_bring_no_preview_back_after_live(step):
    make_baked_scene()
    for message in ("on", "still on"):
        bpy.ops.ed.undo_push(message=message)
        bpy.data.lights["Lamp"].energy *= 2
        settle()
    if step == "redo":
        bpy.ops.ed.undo_push(message="the last one")
        bpy.ops.ed.undo()
        settle()
    # Undo of the switch itself would switch Live on.
    timer.end()
    bpy.context.scene.beamspread.use_live = False
    getattr(bpy.ops.ed, step)()
    assert shows_own_image(bpy.data.materials["Medium"])


@pytest.mark.parametrize("is_on", [True, False])
def test_trees_show_no_image_while_undo_works(is_on):
    """Undo may free images of Live and keep the trees that show them, which crashes Blender 5.2."""
    make_baked_scene()
    seen = []

    def look(*_arguments):
        seen.append(shown_image(bpy.data.materials["Medium"]))

    for message in ("before", "after"):
        bpy.ops.ed.undo_push(message=message)
        settle()
    if not is_on:
        switch_off()
    bpy.app.handlers.undo_pre.append(look)
    try:
        bpy.ops.ed.undo()
    finally:
        bpy.app.handlers.undo_pre.remove(look)
    assert seen == [None]
    assert shown_image(bpy.data.materials["Medium"]) is not None


@pytest.mark.parametrize("is_on", [True, False])
def test_previews_in_files_that_blender_saves_by_itself_go(tmp_path, is_on):
    """Handlers are not told of automatic saving, copied objects and written libraries."""
    _plane, lamp, material, _baked = make_baked_scene()
    bpy.data.libraries.write(str(tmp_path / "auto.blend"), {bpy.context.scene})
    if not is_on:
        switch_off()
    with bpy.data.libraries.load(str(tmp_path / "auto.blend")) as (_there, wanted):
        wanted.objects = ["Plane"]
    pasted = wanted.objects[0]
    pasted.location.x = 3
    bpy.context.collection.objects.link(pasted)
    own = scenes.node_of(pasted.data.materials[0]).image
    timer.step(bpy.context)
    if is_on:
        settle()
        assert len(hidden_images()) == 2
        lamp.location.x = 3
        assert live_pixels(pasted.data.materials[0]).mean() > 2 * shown_pixels(material).mean() > 0
        switch_off()
    assert shows_own_image(material)
    assert shows_own_image(pasted.data.materials[0])
    assert shown_image(pasted.data.materials[0]) == own
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "auto.blend"))
    assert shows_own_image(bpy.data.materials["Medium"])


def test_linked_materials_are_left_alone(tmp_path):
    """They can't show a preview, and the message says how they could."""
    make_baked_scene()
    save(tmp_path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "scene.blend"), link=True) as (_there, wanted):
        wanted.objects = ["Plane", "Lamp"]
    for obj in wanted.objects:
        bpy.context.collection.objects.link(obj)
    scenes.node_of(bpy.data.materials["Medium"])
    bpy.context.scene.beamspread.use_live = True
    settle()
    assert not hidden_images()
    assert not timer.live.failure


def test_a_copied_node_and_a_copied_material_show_their_own_image_after_live():
    _plane, lamp, material, _baked = make_baked_scene()
    node = scenes.node_of(material)
    duplicate = material.node_tree.nodes.new(node.bl_idname)
    duplicate.image, duplicate.node_tree = node.image, node.node_tree  # as Shift D has it
    copy = material.copy()
    scenes.node_of(copy).image = bpy.data.images.new("Another", 8, 8, float_buffer=True)
    lamp.location.x = -0.4
    settle()
    assert scenes.node_of(copy).node_tree.nodes["Image"].image.name == "Another"
    switch_off()
    assert shows_own_image(material)
    assert shows_own_image(copy)
    assert duplicate.node_tree.nodes["Image"].image == duplicate.image


def test_an_ior_under_a_slider_leaves_the_preview_in_place():
    _plane, _lamp, material, _baked = make_baked_scene()
    scenes.node_of(material).ior = 1.3
    assert shown_image(material).name in hidden_images()
    assert scenes.node_of(material).node_tree.nodes["Fresnel"].inputs["IOR"].default_value == pytest.approx(1.3)


@pytest.mark.parametrize("gone", ["material", "node", "object"])
def test_a_preview_goes_with_its_material_node_or_object(gone):
    plane, _lamp, material, _baked = make_baked_scene()
    if gone == "object":
        bpy.data.objects.remove(plane)
    elif gone == "node":
        material.node_tree.nodes.remove(scenes.node_of(material))
    else:
        bpy.data.materials.remove(material)
    settle()
    assert not hidden_images()
    if gone == "object":
        assert shows_own_image(material)


def test_an_object_that_is_hidden_for_a_while_follows_again():
    plane, _lamp, material, _baked = make_baked_scene()
    live = live_pixels(material).copy()
    plane.hide_set(True)
    settle()
    assert shows_own_image(material)
    plane.hide_set(False)
    np.testing.assert_allclose(live_pixels(material), live, rtol=1e-4)


def test_a_renamed_image_stays_the_own_one():
    _plane, lamp, material, baked = make_baked_scene()
    scenes.node_of(material).image.name = "Renamed"
    lamp.location.y = 0.4
    assert live_pixels(material).mean() > 2 * baked.mean()
    switch_off()
    np.testing.assert_array_equal(scenes.pixels(bpy.data.images["Renamed"]), baked)


def test_a_hidden_image_that_somebody_removes_or_renames_comes_back():
    _plane, _lamp, material, _baked = make_baked_scene()
    live = live_pixels(material).copy()
    bpy.data.images.remove(shown_image(material))
    np.testing.assert_array_equal(live_pixels(material), live)
    shown_image(material).name = f"{preview.NAME} renamed"
    np.testing.assert_array_equal(live_pixels(material), live)
    timer.step(bpy.context)
    assert len(hidden_images()) == 1


def test_a_file_that_cannot_be_opened_leaves_nothing_of_live(tmp_path):
    _plane, _lamp, material, _baked = make_baked_scene()
    (tmp_path / "broken.blend").write_bytes(b"BLENDER-v304RENDH")
    with pytest.raises(RuntimeError):
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "broken.blend"))
    material = bpy.data.materials["Medium"]
    switch_off()
    assert shows_own_image(material)


def test_unregistering_the_add_on_leaves_nothing_of_live():
    _plane, _lamp, material, _baked = make_baked_scene()
    own = scenes.node_of(material).image.name
    inner = scenes.node_of(material).node_tree.name
    beamspread.unregister()
    try:
        assert bpy.data.node_groups[inner].nodes["Image"].image.name == own
        assert not hidden_images()
    finally:
        beamspread.register()
