"""The node's property Edges: light leaves a plane through them, or returns as from mirrors."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.target import Target
from live_scenes import live_lines, live_pixels, switch_off

SIDE = 32


@pytest.fixture
def plane():
    """A plane under a sun, whose medium spreads light over a third of it."""
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin = False, 0
    image = bpy.data.images.new("Target", SIDE, SIDE, float_buffer=True, alpha=False)
    plane = scenes.add_plane(material=scenes.add_material(image=image, linked=True))
    scenes.node_of(plane.data.materials[0]).mean_free_path = (0.1, 0.1, 0.1)
    scenes.add_sun(0)
    bpy.context.view_layer.update()
    return plane


def node_of(plane):
    return scenes.node_of(plane.data.materials[0])


def status():
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    return state.rows[Target("Plane", "Medium")].status


def test_mirrors_make_an_evenly_lit_plane_even(plane):
    """The exact brightness is that of tests/unit/test_mirrored_edges.py."""
    open_pixels = scenes.bake(plane)[0].copy()
    assert open_pixels[0].max() < 0.9 * open_pixels[SIDE // 2].max()
    node_of(plane).edges = "MIRROR"
    assert status() == Status.STALE
    pixels = scenes.bake(plane)[0]
    assert np.ptp(pixels[..., 0]) < 1e-2 * pixels[..., 0].max()
    assert pixels[..., 0].min() > 0.99 * open_pixels[..., 0].max()
    node_of(plane).edges = "OPEN"
    assert status() == Status.STALE


def test_a_plane_that_is_no_rectangle_is_named(plane):
    node_of(plane).edges = "MIRROR"
    plane.data.vertices[3].co = (0.2, -0.3, 0)  # a triangle is left, about
    plane.data.update()
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    (line,) = [line for line in state.lines() if "rectangular" in line]
    assert "'Plane' is not rectangular, so light leaves through the edges." in line


@pytest.mark.usefixtures("live_switched_off")
def test_live_comes_to_rest_with_the_bake(plane):
    node_of(plane).edges = "MIRROR"
    baked = scenes.bake(plane)[0].copy()
    bpy.context.scene.beamspread.use_live = True
    shown = live_pixels(plane.data.materials[0])
    switch_off()
    assert not live_lines()
    np.testing.assert_array_equal(shown, baked)
