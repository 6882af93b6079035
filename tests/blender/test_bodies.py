"""Bodies of all kinds are baked: balls, heads, bowls, cylinders and boxes with bevels, by lamps of any size."""

import json
import subprocess

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.state import state
from beamspread.blender.read.geometry import read_polygons
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from mathutils import Vector

PATH = 0.01  # mean free path, metres; bodies are about 2 m across
SIZE = 128, 64


def add_image(name="Baked", size=SIZE):
    image = bpy.data.images.new(name, *size, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    return image


def finished(is_smooth=True, size=SIZE, **properties):
    """The active object, smooth and with a node of marble's mean free path."""
    body = bpy.context.object
    body.data.polygons.foreach_set("use_smooth", [is_smooth] * len(body.data.polygons))
    values = {"albedo": (0.95, 0.9, 0.6), "mean_free_path": (PATH,) * 3, "ior": 1.0, "anisotropy": 0.8}
    material = scenes.add_material(body.name, image=add_image(body.name, size), **(values | properties))
    body.data.materials.append(material)
    return body


def add_ball(**options):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    return finished(**options)


def add_ico_ball():
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4)
    return finished(size=(96, 96))


def add_head():
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Fine", "SUBSURF").render_levels = 2
    return finished(size=(192, 192))


def add_cylinder():
    bpy.ops.mesh.primitive_cylinder_add(vertices=48)
    return finished(is_smooth=False, size=(96, 96))


def add_bowl():
    """The lower half of a ball, which is open, with light on its inner side."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    bowl = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0, 0, 0.001), plane_no=(0, 0, 1), clear_outer=True)
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = bowl
    return finished(size=(96, 96))


def add_soap():
    """A box with round edges."""
    bpy.ops.mesh.primitive_cube_add()
    bevel = bpy.context.object.modifiers.new("Round", "BEVEL")
    bevel.width, bevel.segments = 0.3, 6
    return finished(size=(128, 128))


def add_area_lamp():
    lamp = bpy.data.objects.new("Area", bpy.data.lights.new("Area", "AREA"))
    bpy.context.collection.objects.link(lamp)
    lamp.data.energy, lamp.data.size, lamp.location = 300, 2.0, (3, 0, 2)
    lamp.rotation_euler = (Vector((0, 0, 0)) - lamp.location).to_track_quat("-Z", "Y").to_euler()
    return lamp


def grid_of(body):
    evaluated = body.evaluated_get(bpy.context.evaluated_depsgraph_get())
    image = scenes.image_of(body)
    polygons = read_polygons(evaluated, body.data.materials[0].name)
    return build_receiver(flatten(polygons, PATH, body.name), *image.size, body.name)


def reflected(body, texture):
    """Exitance over the surface, W, of each channel."""
    receiver = grid_of(body)
    (chart,) = receiver.charts
    part = chart.islands[0].part_of(texture[..., :3])
    return np.pi * np.einsum("hw,hwc->c", chart.grid.areas, part, dtype=float)


@pytest.mark.parametrize("add_body", [add_ball, add_ico_ball, add_head, add_cylinder, add_bowl, add_soap])
def test_bodies_are_baked_by_a_sun_and_a_lamp_of_a_size(add_body):
    body = add_body()
    scenes.add_sun(0)
    add_area_lamp()
    (texture,) = scenes.bake(body)
    receiver = grid_of(body)
    assert receiver.is_bent
    inside = receiver.coverage > 0.5
    assert np.isfinite(texture).all()
    assert (texture[inside] > 0).any(axis=-1).mean() > 0.4
    # Both lamps shine from above: texels that look up are brighter than those that look down.
    (chart,) = receiver.charts
    height, part = chart.grid.normals[..., 2], chart.islands[0].part_of(texture)
    if add_body is not add_bowl:
        assert part[height > 0.7].mean() > 2 * part[height < -0.7].mean()
    assert not [line for line in state.lines() if "black" in line]


def test_a_ball_returns_as_much_as_a_ball_of_its_medium():
    """A sun of irradiance 1 sends pi r^2 to a ball of 30 mean free paths, more of which returns than from a plane.

    Expected: means of `ball_reflectance.csv` over its angles, of which the last is 75 degrees: too low by about a
    hundredth, and by several at albedo .6.
    """
    ball = add_ball(mean_free_path=(1 / 30,) * 3)
    scenes.add_sun(0)
    (texture,) = scenes.bake(ball)
    power = reflected(ball, texture) / np.pi
    assert power == pytest.approx([0.4044, 0.2601, 0.0587], rel=0.025, abs=0.003)


def test_a_ball_looks_the_same_from_all_sides_of_the_sun():
    """The luminance depends on the angle to the sun alone, within a texel's step."""
    ball = add_ball()
    scenes.add_sun(40)
    (texture,) = scenes.bake(ball)
    (chart,) = grid_of(ball).charts
    direction = np.array(bpy.data.objects["Sun"].matrix_world.to_3x3() @ Vector((0, 0, 1)))
    shown = chart.grid.coverage > 0.99
    cosines = chart.grid.normals[shown] @ direction
    values = chart.islands[0].part_of(texture)[shown][:, 0]
    for low in np.arange(0.3, 0.95, 0.05):
        among = values[(cosines > low) & (cosines < low + 0.05)]
        assert len(among) > 20
        assert among.std() < 0.05 * among.mean(), low


def test_mirrored_and_inside_out_bodies_are_baked_as_whole_ones():
    ball = add_ball()
    scenes.add_sun(0)
    first = reflected(ball, scenes.bake(ball)[0])
    ball.scale.x = -1
    bpy.context.view_layer.update()
    np.testing.assert_allclose(reflected(ball, scenes.bake(ball)[0]), first, rtol=0.01)
    ball.data.flip_normals()
    bpy.context.view_layer.update()
    np.testing.assert_allclose(reflected(ball, scenes.bake(ball)[0]), first, rtol=0.01)
    assert any("point inward; it is baked as if they pointed outward" in line for line in state.lines())


def test_an_inside_out_body_of_two_materials_is_baked_as_a_whole_one():
    ball = add_ball()
    ball.data.materials.append(bpy.data.materials.new("Plain"))
    for polygon in ball.data.polygons:
        polygon.material_index = int(polygon.center.x > 0.1)
    scenes.add_sun(0)
    first = scenes.bake(ball)[0].copy()
    ball.data.flip_normals()
    bpy.context.view_layer.update()
    # The other diagonals of flipped quads change light that grazes the surface by up to .0025.
    np.testing.assert_allclose(scenes.bake(ball)[0], first, rtol=0.01, atol=0.005)
    assert first.max() > 0.07
    assert any("point inward; it is baked as if they pointed outward" in line for line in state.lines())


def test_a_bent_and_a_flat_object_share_an_image():
    ball = add_ball()
    plane = scenes.add_plane("Plane", material=None)
    plane.location = (0, 0, -1.5)
    material = ball.data.materials[0]
    plane.data.materials.append(material)
    for obj, first in ((ball, 0.0), (plane, 0.55)):
        uvs = np.empty(len(obj.data.loops) * 2, np.float32)
        layer = obj.data.uv_layers.active.data
        layer.foreach_get("uv", uvs)
        layer.foreach_set("uv", (uvs.reshape(-1, 2) * (0.45, 1) + (first, 0)).ravel().astype(np.float32))
    scenes.add_sun(0)
    scenes.select(ball, plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    texture = scenes.pixels(scenes.image_of(ball))
    width = texture.shape[1]
    assert texture[:, : int(0.4 * width)].max() > 0.05
    assert texture[:, int(0.6 * width) :].max() > 0.05


def test_a_batch_bakes_bodies_and_resumes(tmp_path):
    add_ball(size=(48, 24))
    add_cylinder().location.x = 4
    scenes.add_sun(0)
    path = scenes.save_scene(tmp_path)
    report = tmp_path / "report.json"
    for expected, options in (("written", ()), ("skipped", ("--resume",))):
        run = subprocess.run(
            scenes.batch_command(path, "--output", tmp_path / "out", "--report", report, *options),
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stdout + run.stderr
        bakes = json.loads(report.read_text(encoding="utf-8"))["bakes"]
        assert [one["status"] for one in bakes] == [expected] * 2
