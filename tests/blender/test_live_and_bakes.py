"""Live and bakes: a result shows as soon as it is there, and until the scene changes. The tests take Live's steps."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images.files import from_srgb
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.live import timer
from beamspread.blender.node import output
from live_scenes import (
    live_lines,
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

QUARTER = [(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)]


def row(plane):
    stale.refresh(bpy.context)
    return next(row for row in state.rows.values() if row.target.object_name == plane.name)


def make_atlas():
    """Two planes side by side in one image, baked; Live is on."""
    bpy.context.scene.beamspread.margin = 0
    plane, lamp, material = make_scene()
    plane.data.uv_layers.active.data.foreach_set("uv", np.ravel(QUARTER))
    other = scenes.add_plane("Other", material=scenes.add_material("Second", linked=True), uvs=np.add(QUARTER, 0.5))
    other.location.x = 2.5
    scenes.node_of(other.data.materials[0]).image = scenes.node_of(material).image
    bpy.context.view_layer.update()
    return plane, other, lamp, scenes.bake(plane, other)[0].copy()


def test_a_bake_is_shown_until_something_changes():
    plane, lamp, material = make_scene()
    scenes.add_blocker(0.3)
    live_pixels(material)
    baked = scenes.bake(plane)[0]
    for _ in range(5):
        live_pixels(material)
        bpy.context.view_layer.update()
    assert shown_image(material) == scenes.node_of(material).image
    np.testing.assert_array_equal(shown_pixels(material), baked)
    lamp.location.x = -0.4
    assert np.abs(live_pixels(material) - baked).max() > 0.1 * baked.max()


def test_a_change_right_before_a_bake_is_in_it_and_the_bake_is_shown():
    plane, lamp, material = make_scene()
    scenes.bake(plane)
    settle()
    lamp.data.energy = 5
    baked = scenes.bake(plane)[0]
    np.testing.assert_array_equal(live_pixels(material), baked)
    assert shown_image(material) == scenes.node_of(material).image


def test_a_change_after_a_bake_is_shown():
    plane, lamp, material = make_scene()
    live_pixels(material)
    baked = scenes.bake(plane)[0].copy()
    timer.step(bpy.context)
    lamp.data.energy = 5
    assert live_pixels(material).mean() < 0.5 * baked.mean()


def test_live_rests_while_a_bake_runs_and_shows_a_change_in_that_time_after_it(monkeypatch):
    """A bake reads the scene when it starts. The window test has a bake that runs beside Live."""
    plane, lamp, material = make_scene()
    first = live_pixels(material).copy()
    with monkeypatch.context() as running:
        running.setattr(state, "is_running", lambda: True)
        timer.step(bpy.context)
        timer.step(bpy.context)
    np.testing.assert_array_equal(shown_pixels(material), first)
    baked = scenes.bake(plane)[0].copy()
    lamp.data.energy = 5
    assert live_pixels(material).mean() < 0.5 * baked.mean()


def test_a_bake_into_an_atlas_keeps_the_result_of_the_other_object():
    plane, other, lamp, before = make_atlas()
    materials = plane.data.materials[0], other.data.materials[0]
    lamp.data.energy = 500
    assert live_pixels(materials[1])[32:, 32:].mean() > 2 * before[32:, 32:].mean()
    after = scenes.bake(plane)[0]
    assert after[:32, :32].mean() > 2 * before[:32, :32].mean()
    np.testing.assert_array_equal(after[32:, 32:], before[32:, 32:])
    settle()
    np.testing.assert_array_equal(shown_pixels(materials[0]), after)
    assert shown_pixels(materials[1])[32:, 32:].mean() > 2 * before[32:, 32:].mean()


def test_objects_with_copies_of_a_material_and_one_image_follow_each_on_its_own():
    plane, lamp, material = make_scene()
    copy = plane.copy()
    copy.name, copy.location.x, copy.data = "A copy", 2.5, plane.data.copy()
    copy.data.materials[0] = material.copy()
    bpy.context.collection.objects.link(copy)
    near, far = live_pixels(material).mean(), shown_pixels(copy.data.materials[0]).mean()
    assert near > 2 * far > 0
    lamp.location.x = 2.8
    near, far = live_pixels(material).mean(), shown_pixels(copy.data.materials[0]).mean()
    assert far > 2 * near > 0
    assert not live_lines()
    switch_off()
    assert shows_own_image(material)
    assert shows_own_image(copy.data.materials[0])


def test_a_copy_with_the_same_material_leaves_the_preview_to_the_original():
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0].copy()
    copy = plane.copy()
    copy.name, copy.location.x = "A copy", 2.5
    bpy.context.collection.objects.link(copy)
    lamp.location.x = 0.29
    for _ in range(3):
        live = live_pixels(material)
    assert live.mean() == pytest.approx(baked.mean(), rel=0.1)
    assert [message for message in live_lines() if "A copy" in message and "of its own" in message]


def test_live_makes_no_bake_out_of_date():
    plane, lamp, material = make_scene()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Gray", 4, 4)
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], texture.outputs["Color"])
    output.make_plain(scenes.node_of(material))
    scenes.bake(plane)
    before = row(plane)
    for x in (-0.4, 0.3):
        lamp.location.x = x
        live_pixels(material)
    assert shown_image(material) != scenes.node_of(material).image
    assert row(plane) == before
    assert before.status == Status.BAKED


@pytest.mark.parametrize("is_on", [True, False])
def test_a_bake_makes_the_image_of_a_node_without_one(tmp_path, is_on):
    plane, _lamp, material = make_scene()
    bpy.context.scene.beamspread.image_storage = "FILES"
    save(tmp_path)
    scenes.node_of(material).image = None
    live_pixels(material)
    if not is_on:
        switch_off()
    scenes.bake(plane)
    image = scenes.node_of(material).image
    assert image.packed_file is None
    assert (tmp_path / "textures" / "Plane_Medium.exr").is_file()
    assert image.name == "Plane_Medium"
    assert shown_image(material) == image


def test_undo_of_a_bake_has_live_go_on():
    plane, lamp, material = make_scene()
    scenes.bake(plane)
    lamp.data.energy = 5
    bpy.ops.ed.undo_push(message="light")
    live = live_pixels(material).copy()
    scenes.bake(plane)
    bpy.ops.ed.undo_push(message="bake")
    settle()
    bpy.ops.ed.undo()
    material = bpy.data.materials["Medium"]
    np.testing.assert_allclose(live_pixels(material), live, rtol=1e-4)
    assert shown_image(material) != scenes.node_of(material).image


def test_make_float_and_resize_change_the_own_image_and_live_follows():
    plane, lamp, material = make_scene()
    node = scenes.node_of(material)
    node.image = bpy.data.images.new("Bytes", 64, 64, alpha=False)
    settle()
    baked = from_srgb(scenes.bake(plane)[0])
    timer.step(bpy.context)
    lamp.data.energy = 5
    assert live_pixels(material).mean() < 0.5 * baked.mean()
    bpy.ops.beamspread.make_float()
    assert node.image.is_float
    np.testing.assert_allclose(scenes.pixels(node.image), baked, atol=1e-6)
    lamp.data.energy = 6
    assert live_pixels(material).mean() < 0.5 * baked.mean()
    bpy.context.scene.beamspread.resolution = 32
    bpy.ops.beamspread.resize_image()
    assert scenes.pixels(node.image).mean() == pytest.approx(baked.mean(), rel=0.1)
    assert live_pixels(material).shape == (32, 32, 3)
    assert shown_pixels(material).mean() < 0.5 * baked.mean()
