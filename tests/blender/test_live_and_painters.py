"""What others draw into images while Live shows them, and images that Live has made, are never lost."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images.previews import MADE_FOR_PREVIEWS
from beamspread.blender.live import session
from live_scenes import live_lines, live_pixels, make_scene, save, settle, switch_off

pytestmark = pytest.mark.usefixtures("live_switched_off")

STROKE = np.s_[10:20, 30:40]


def draw(image, value=0.5):
    """What a script or another add-on does."""
    values = np.empty((image.size[1], image.size[0], image.channels), np.float32)
    image.pixels.foreach_get(values.ravel())
    values[STROKE] = value
    image.pixels.foreach_set(values.ravel())
    image.update()


def made_by_live():
    """A scene whose node had no image, and the one that Live has made."""
    _plane, lamp, material = make_scene()
    scenes.node_of(material).image = None
    bpy.context.scene.beamspread.resolution = 64
    live_pixels(material)
    return lamp, material, scenes.node_of(material).image


@pytest.mark.parametrize("is_float", [True, False])
def test_what_is_drawn_into_a_picture_is_the_images_own(is_float):
    plane, lamp, material = make_scene()
    node = scenes.node_of(material)
    node.image = bpy.data.images.new("Drawn", 64, 64, alpha=False, float_buffer=is_float)
    baked = scenes.bake(plane)[0].copy()
    lamp.location.x = -0.4
    live_pixels(material)
    draw(node.image)
    lamp.location.x = -0.2
    assert not (live_pixels(material)[STROKE] == 0.5).any()
    assert "keeps the change" in " ".join(live_lines())
    switch_off()
    assert "keeps the change" in " ".join(live_lines())
    after = scenes.pixels(node.image)
    np.testing.assert_allclose(after[STROKE], 0.5, atol=1 / 255)
    after[STROKE] = baked[STROKE]
    np.testing.assert_array_equal(after, baked)
    assert node.image.is_dirty


def test_what_is_drawn_last_is_not_lost_when_live_is_switched_off():
    plane, lamp, material = make_scene()
    scenes.bake(plane)
    lamp.location.x = -0.4
    live_pixels(material)
    image = scenes.node_of(material).image
    draw(image)
    switch_off()
    assert (scenes.pixels(image)[STROKE] == 0.5).all()


@pytest.mark.parametrize("kind", ["paint mode", "image editor"])
def test_live_waits_while_its_image_can_be_painted_on(kind, monkeypatch):
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0].copy()
    image = scenes.node_of(material).image
    lamp.location.x = -0.4
    assert np.abs(live_pixels(material) - baked).max() > 0
    if kind == "paint mode":
        paint = bpy.context.scene.tool_settings.image_paint
        paint.mode, paint.canvas = "IMAGE", image
        bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    else:
        monkeypatch.setattr("beamspread.blender.live.painting._painted", lambda _context: [image])
    session.step(bpy.context)
    np.testing.assert_array_equal(scenes.pixels(image), baked)
    assert f"Live waits while the image '{image.name}' can be painted on." in [
        message.line() for message in session.messages()
    ]
    draw(image)
    for _ in range(3):
        session.step(bpy.context)
    assert (scenes.pixels(image)[STROKE] == 0.5).all()
    if kind == "paint mode":
        bpy.ops.object.mode_set(mode="OBJECT")
    else:
        monkeypatch.undo()
    assert not (live_pixels(material)[STROKE] == 0.5).any()
    switch_off()
    after = scenes.pixels(image)
    assert (after[STROKE] == 0.5).all()
    after[STROKE] = baked[STROKE]
    np.testing.assert_array_equal(after, baked)


def test_an_image_of_another_material_can_be_painted_on():
    """Live follows meanwhile."""
    plane, lamp, material = make_scene()
    before = live_pixels(material).copy()
    scenes.select(plane)
    paint = bpy.context.scene.tool_settings.image_paint
    paint.mode, paint.canvas = "IMAGE", bpy.data.images.new("Other", 8, 8)
    bpy.ops.object.mode_set(mode="TEXTURE_PAINT")
    lamp.data.energy = 500
    assert live_pixels(material).mean() > 2 * before.mean()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_painting_on_an_image_that_live_has_made(monkeypatch):
    _lamp, material, image = made_by_live()
    monkeypatch.setattr("beamspread.blender.live.painting._painted", lambda _context: [image])
    session.step(bpy.context)
    draw(image)
    monkeypatch.undo()
    settle()
    switch_off()
    assert scenes.node_of(material).image == image
    assert (scenes.pixels(image)[STROKE] == 0.5).all()
    assert "which Live has made, stays" in " ".join(live_lines())


USES = {
    "drawn": draw,
    "packed": lambda image: image.pack(),
    "kept": lambda image: setattr(image, "use_fake_user", True),
    "used": lambda image: setattr(add_texture_node(), "image", image),
    "shown": lambda image: setattr(bpy.data.objects.new("Empty", None), "data", image),
}


def add_texture_node():
    material = bpy.data.materials.new("Another")
    material.use_nodes = True
    return material.node_tree.nodes.new("ShaderNodeTexImage")


@pytest.mark.parametrize("use", USES.values(), ids=USES)
def test_an_image_that_live_has_made_stays_once_it_is_used(use):
    _lamp, material, image = made_by_live()
    use(image)
    switch_off()
    assert scenes.node_of(material).image == image
    assert MADE_FOR_PREVIEWS not in image
    assert scenes.pixels(image).max() > 0
    assert "which Live has made, stays" in " ".join(live_lines())


def test_one_that_is_saved_to_a_file_stays(tmp_path):
    _lamp, material, image = made_by_live()
    image.filepath_raw, image.file_format = str(tmp_path / "mine.exr"), "OPEN_EXR"
    image.save()
    image.source = "FILE"
    switch_off()
    assert scenes.node_of(material).image == image
    assert MADE_FOR_PREVIEWS not in image


def test_undo_and_files_leave_an_image_that_was_packed(tmp_path):
    """As a file of another version has it: the mark alone, with Live off."""
    _lamp, _material, image = made_by_live()
    image.pack()
    switch_off()
    image[MADE_FOR_PREVIEWS] = True
    save(tmp_path)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert scenes.pixels(bpy.data.images["Plane_Medium"]).max() > 0
    bpy.ops.ed.undo_push(message="one")
    bpy.data.images["Plane_Medium"][MADE_FOR_PREVIEWS] = True
    bpy.ops.ed.undo_push(message="two")
    bpy.ops.ed.undo_push(message="three")
    bpy.ops.ed.undo()
    assert scenes.pixels(bpy.data.images["Plane_Medium"]).max() > 0


def test_one_that_nobody_used_goes():
    _lamp, material, _image = made_by_live()
    switch_off()
    assert scenes.node_of(material).image is None
    assert not bpy.data.images.get("Plane_Medium")
    assert not live_lines()


def test_what_was_painted_and_saved_in_a_pause_is_what_images_are_saved_with(monkeypatch, tmp_path):
    """And not what the file held before."""
    plane, lamp, material = make_scene()
    bpy.context.scene.beamspread.use_live = False
    bpy.context.scene.beamspread.image_storage = "FILES"
    save(tmp_path)
    scenes.node_of(material).image = None
    scenes.bake(plane)
    image = scenes.node_of(material).image
    bpy.context.scene.beamspread.use_live = True
    lamp.location.x = -0.4
    live_pixels(material)
    monkeypatch.setattr("beamspread.blender.live.painting._painted", lambda _context: [image])
    session.step(bpy.context)
    draw(image)
    image.save()
    monkeypatch.undo()
    lamp.location.x = 0.1
    live_pixels(material)
    bpy.ops.image.save_all_modified()  # as Blender does when it closes a file
    save(tmp_path)
    image.reload()
    assert (scenes.pixels(image)[STROKE] == 0.5).all()
