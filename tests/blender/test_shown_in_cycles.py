"""After a bake, a Cycles render of the scene shows the baked luminance on the plane."""

import bpy
import numpy as np
import pytest
from scenes import add_blocker, add_camera, add_material, add_plane, add_sun, add_world, bake, node_of, render, reopen


def render_from_above(path, size, samples=16):
    """Render the 2 x 2 plane at the origin; float32 (size, size, 3)."""
    scene = bpy.context.scene
    if scene.camera is None:
        add_camera(2.0)
        scene.cycles.max_bounces, scene.cycles.filter_width = 0, 0.01
    return render(path, size, samples)


@pytest.mark.parametrize("reopened", [False, True])
def test_render_shows_the_bake(tmp_path, reopened):
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material(albedo=(0.99, 0.9, 0.5)))
    wall, sun = add_blocker(0.4), add_sun(45, 25, strength=5.0)
    (texture,) = bake(plane)
    # Light that Cycles would add: the wall in front of the camera, and the coat's reflection of the sun.
    wall.hide_render = sun.hide_render = True
    if reopened:
        reopen(tmp_path)
    shown = render_from_above(tmp_path / "render.exr", 32)
    assert texture.max() > 0.3
    assert np.abs(shown - texture).mean() < 0.01 * texture.mean()
    assert np.corrcoef(shown.ravel(), texture.ravel())[0, 1] > 0.999


def test_coat_reflects_only_with_an_ior_above_one(tmp_path):
    """A white world over a black medium: 0.04 at normal incidence for an ior of 1.5, nothing for 1."""
    bpy.context.scene.beamspread.resolution = 8
    add_world()
    material = add_material(albedo=(0, 0, 0))
    plane = add_plane(material=material)
    add_sun(0).hide_render = True
    bake(plane)
    assert render_from_above(tmp_path / "plain.exr", 8) == pytest.approx(0, abs=1e-6)
    node_of(material).ior = 1.5
    bpy.context.scene.cycles.max_bounces = 1
    assert render_from_above(tmp_path / "coated.exr", 8, 64).mean() == pytest.approx(0.04, rel=0.05)
