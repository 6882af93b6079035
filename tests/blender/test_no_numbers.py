"""Vertices and transforms that are infinite or no numbers fail the objects that have them; all else is baked."""

import bpy
import numpy as np
import panel_layout
import pytest
import scenes
from beamspread.blender.jobs.state import state
from live_scenes import live_lines, live_pixels, switch_off
from mathutils import Matrix

SIDE = 32
VALUES = {"NaN": np.nan, "infinite": np.inf, "huge": 1e30}


@pytest.fixture(autouse=True)
def light():
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.resolution, settings.margin = False, SIDE, 0
    scenes.add_lamp((0.3, -0.2, 3.0), power=200)
    scenes.add_world((0.3, 0.3, 0.3, 1))


def add_wall(material=None, location=(0.3, 0.0, 1.0)):
    """A quad of two triangles above the receiver, and one apart that throws no shadow."""
    vertices = [(-0.4, -0.4, 0), (0.4, -0.4, 0), (0.4, 0.4, 0), (-0.4, 0.4, 0), (9, 9, 0), (9.1, 9, 0), (9.1, 9.1, 0)]
    wall = scenes.add_mesh("Wall", vertices, [(0, 1, 2, 3), (4, 5, 6)], Matrix.Translation(location))
    wall.data.materials.append(material or scenes.diffuse_material((0.5, 0.5, 0.5)))
    return wall


def baked(*objects):
    scenes.select(*objects)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    return [scenes.pixels(scenes.image_of(obj)) for obj in objects]


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
@pytest.mark.parametrize("is_glowing", [False, True])
def test_triangles_at_no_position_are_left_out_and_named(value, is_glowing):
    """The rest of their object throws its shadow and light as before."""
    plane = scenes.add_plane(material=scenes.add_material())
    wall = add_wall(scenes.glowing_material() if is_glowing else None)
    (before,) = baked(plane)
    assert not any("Wall" in line for line in state.lines())
    wall.data.vertices[4].co.z = value
    wall.data.update()
    (after,) = baked(plane)
    (line,) = [line for line in state.lines() if "Wall" in line]
    assert line.startswith("1 triangle is left out of 'Wall': the positions of vertices are infinite or not numbers.")
    # Glowing triangles are sampled by area: noise of the small one, which is gone, is the only difference.
    np.testing.assert_allclose(after, before, atol=(2e-2 if is_glowing else 1e-6) * before.max())


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
@pytest.mark.parametrize("is_glowing", [False, True])
def test_objects_at_no_position_are_left_out_and_named(value, is_glowing):
    plane = scenes.add_plane(material=scenes.add_material())
    (expected,) = baked(plane)
    wall = add_wall(scenes.glowing_material() if is_glowing else None)
    wall.scale.y = value
    (pixels,) = baked(plane)
    (line,) = [line for line in state.lines() if "Wall" in line]
    assert line.startswith("'Wall' is left out. Its location, rotation or scale is infinite or not a number.")
    np.testing.assert_array_equal(pixels, expected)


@pytest.mark.parametrize("part", ["vertex", "scale", "location"])
@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_receivers_at_no_position_fail_alone(part, value):
    plane = scenes.add_plane(material=scenes.add_material("Good"))
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, 1.5), calc_uvs=False)
    box = bpy.context.object
    box.data.materials.append(scenes.add_material("Bad"))
    if part == "vertex":
        box.data.vertices[0].co.x = value
        box.data.update()
    elif part == "scale":
        box.scale.x = value
    else:
        box.location.x = value
    scenes.select(plane, box)
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.beamspread.bake()
    reason = "positions of faces 0, 3 and 4 are" if part == "vertex" else "location, rotation or scale is"
    assert "Cube" in str(caught.value)
    assert reason in str(caught.value)
    assert scenes.pixels(scenes.image_of(plane)).max() > 0
    assert not any("Plane" in line for line in state.lines())


@pytest.mark.parametrize("part", ["vertex", "scale"])
def test_live_names_them(part):
    plane = scenes.add_plane(material=scenes.add_material("Good"))
    bad = scenes.add_plane("Broken", matrix=Matrix.Translation((5, 0, 0)), material=scenes.add_material("Bad"))
    if part == "vertex":
        bad.data.vertices[0].co.x = np.nan
        bad.data.update()
    else:
        bad.scale.x = np.inf
    with pytest.raises(RuntimeError):
        baked(plane, bad)
    bpy.context.scene.beamspread.use_live = True
    plane.location.x = 0.1
    assert live_pixels(plane.data.materials[0]).max() > 0
    reason = "positions of face 0 are" if part == "vertex" else "location, rotation or scale is"
    assert any("Broken" in line and reason in line for line in live_lines())
    switch_off()


def test_a_mesh_is_mended_by_the_advice():
    plane = scenes.add_plane(material=scenes.add_material())
    wall = add_wall()
    wall.data.vertices[4].co.z = np.nan
    wall.data.validate()
    wall.data.update()
    baked(plane)
    assert not any("Wall" in line for line in state.lines())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_scale_of_zero_along_one_axis_leaves_what_is_flat(axis):
    """Two faces of the box lie on each other and look away from each other; the others have no area."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    box = bpy.context.object
    box.data.materials.append(scenes.add_material())
    box.scale[axis] = 0
    box.rotation_euler = (0.3, 0.2, 0.1)
    (pixels,) = baked(box)
    assert (pixels > 0).any(axis=2).mean() == pytest.approx(2 / 16)


def test_a_scale_of_zero_along_two_axes_is_named():
    bpy.ops.mesh.primitive_cube_add(size=1)
    box = bpy.context.object
    box.data.materials.append(scenes.add_material())
    box.scale = (1, 0, 0)
    scenes.select(box)
    with pytest.raises(RuntimeError, match="zero along more than one axis"):
        bpy.ops.beamspread.bake()


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES)
def test_the_panel_names_faces_at_no_position_before_the_bake(value):
    wall = add_wall(scenes.add_material())
    wall.data.vertices[4].co.z = value
    wall.data.update()
    said = panel_layout.panel()
    assert "The positions of face 1 are infinite or not numbers." in said
    scenes.select(wall)
    assert "The positions of face 1 are" in scenes.messages_of(bpy.ops.beamspread.bake)
    wall.data.vertices[4].co.z = 0.0  # moved, as the sentence says
    wall.data.update()
    assert baked(wall)[0].any()
