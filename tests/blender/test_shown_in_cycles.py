"""After a bake, a Cycles render of the scene shows the baked luminance on the plane."""

import bpy
import numpy as np
import pytest
from beamspread.core.native import native
from scenes import add_blocker, add_material, add_plane, add_sun, add_world, bake, node_of, reopen


def render(path, size):
    """Render the 2 x 2 plane at the origin from straight above; float32 (size, size, 3), row 0 at the bottom."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", 2.0, 5.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0
    scene.cycles.filter_width = 0.01
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.filepath = str(path)
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    bpy.ops.render.render(write_still=True)
    pixels, channels, _ = native.read_exr(str(path))
    return pixels[..., [channels.index(name) for name in "RGB"]]


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
    shown = render(tmp_path / "render.exr", 32)
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
    assert render(tmp_path / "plain.exr", 8) == pytest.approx(0, abs=1e-6)
    node_of(material).ior = 1.5
    bpy.context.scene.cycles.max_bounces = 1
    bpy.context.scene.cycles.samples = 64
    bpy.context.scene.camera = None
    assert render_with_bounce(tmp_path / "coated.exr").mean() == pytest.approx(0.04, rel=0.05)


def render_with_bounce(path):
    """Image of `render` with one reflection."""
    scene = bpy.context.scene
    scene.cycles.max_bounces = 1
    scene.camera = bpy.data.objects["Camera"]
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return native.read_exr(str(path))[0]
