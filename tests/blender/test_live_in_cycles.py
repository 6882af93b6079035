"""Live in Rendered views of Cycles, which reads an image once: nodes show it a new one whenever things come to rest."""

import time

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import session, stand_ins
from live_scenes import live_pixels, make_scene, settle

pytestmark = pytest.mark.usefixtures("live_switched_off")

REST_SECONDS = session.CALM_SECONDS + stand_ins.PAUSE_SECONDS + 0.1


def views():
    areas = [area for window in bpy.context.window_manager.windows for area in window.screen.areas]
    return [area.spaces.active for area in areas if area.type == "VIEW_3D"]


def look(shading):
    for view in views():
        view.shading.type = shading


@pytest.fixture
def scene():
    if not views():
        pytest.skip("this Blender starts without a 3D View")
    plane, lamp, material = make_scene()
    bpy.context.scene.render.engine = "CYCLES"
    look("RENDERED")
    return plane, lamp, material


def seen(material):
    """What renderers see, once things rest."""
    settle()
    end = time.monotonic() + REST_SECONDS
    while time.monotonic() < end:
        session.step(bpy.context)
        bpy.context.view_layer.update()
        time.sleep(0.01)
    return scenes.node_of(material).node_tree.nodes["Image"].image


def left_behind():
    return [image.name for image in bpy.data.images if image.name.startswith(stand_ins.NAME)]


def test_it_gets_a_new_image_whenever_things_come_to_rest(scene):
    _plane, lamp, material = scene
    own = scenes.node_of(material).image
    first = seen(material)
    assert first != own
    assert np.array_equal(scenes.pixels(first), scenes.pixels(own))
    identity, before = first.as_pointer(), scenes.pixels(first).copy()
    assert seen(material).as_pointer() == identity  # nothing has changed
    lamp.location.x = -0.3
    second = seen(material)
    assert second.as_pointer() != identity  # by which Cycles knows it, also after a quick picture and an exact one
    assert np.array_equal(scenes.pixels(second), scenes.pixels(own))
    assert not np.allclose(scenes.pixels(second), before)
    assert len(left_behind()) == 2  # the one before keeps its address


@pytest.mark.parametrize("end", ["off", "another view", "save", "bake"])
def test_then_nodes_show_their_own_image_again(scene, end, tmp_path):
    plane, _lamp, material = scene
    node = scenes.node_of(material)
    assert seen(material) != node.image
    if end == "off":
        bpy.context.scene.beamspread.use_live = False
        session.step(bpy.context)
    elif end == "another view":
        look("MATERIAL")
        session.step(bpy.context)
    elif end == "save":
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    else:
        scenes.bake(plane)
    assert node.node_tree.nodes["Image"].image == node.image
    assert left_behind() == []


def test_a_file_that_has_kept_one_shows_the_nodes_own_image(scene, tmp_path):
    """As Blender's own automatic saving does, of which nobody is told."""
    _plane, _lamp, material = scene
    own = scenes.node_of(material).image
    own.pack()
    stand_in = bpy.data.images.new(stand_ins.NAME, 4, 4)
    scenes.node_of(material).node_tree.nodes["Image"].image = stand_in
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    node = scenes.node_of(bpy.data.materials["Medium"])
    assert node.node_tree.nodes["Image"].image == node.image == bpy.data.images["Target"]


def test_others_follow_between_two_looks(scene):
    _plane, lamp, material = scene
    before = scenes.pixels(seen(material)).copy()
    lamp.location.x = -0.3
    own = live_pixels(material)  # the exact picture comes last
    assert np.array_equal(scenes.pixels(scenes.node_of(material).node_tree.nodes["Image"].image), own)
    assert np.abs(own - before).max() > 0.1 * before.max()
