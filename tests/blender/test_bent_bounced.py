"""Bounced light on a mesh that bends, in Blender."""

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from indirect_scenes import GREY as ALBEDO
from indirect_scenes import add_ball, baked


@pytest.mark.parametrize("output", ["IRRADIANCE", "LUMINANCE"])
def test_a_floor_lights_a_ball_from_below(output):
    """A normal at an angle b from downward sees (1 + cos b) / 2 of a wide floor. The ball's shadow takes light from
    below, and 4 % from the sides, which are compared.
    """
    ball = add_ball()
    floor = scenes.add_plane("Floor", size=(400.0, 400.0))
    floor.data.materials.clear()
    floor.data.materials.append(scenes.diffuse_material((ALBEDO,) * 3))
    scenes.add_sun(0, 0, 2.0)
    direct, all_light = (baked(ball, indirect, output) for indirect in (False, True))
    bounced = np.nan_to_num(all_light - direct)[..., :3].mean((1, 2))  # [row], from the bottom up
    rows = len(bounced)
    downward = np.cos(np.pi * (np.arange(rows) + 0.5) / rows)
    exact = 2.0 * ALBEDO * (1 + downward) / 2
    sides = slice(rows * 3 // 8, rows * 5 // 8)
    if output == "IRRADIANCE":
        np.testing.assert_allclose(bounced[sides], exact[sides], rtol=0.08)
    assert bounced[rows // 8] > 2 * bounced[-rows // 8] >= 0


def test_a_bowl_lights_itself():
    """A point of a hemisphere sees all others by the same form factor. Light that bounces is even there: with the mean
    M = E / 2 / (1 - reflectance / 2) of all irradiance under a sun E overhead, it is reflectance / 2 M.
    """
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48)
    bowl = bpy.context.object
    shape = bmesh.new()
    shape.from_mesh(bowl.data)
    bmesh.ops.delete(shape, geom=[vertex for vertex in shape.verts if vertex.co.z > 1e-4], context="VERTS")
    bmesh.ops.reverse_faces(shape, faces=shape.faces)
    shape.to_mesh(bowl.data)
    bpy.ops.object.shade_smooth()
    reflectance = 0.6
    bowl.data.materials.append(scenes.add_material(color_mode="BASE_COLOR", base_color=(reflectance,) * 3))
    scenes.add_sun(0, 0, 2.0)
    direct, all_light = (baked(bowl, indirect, "IRRADIANCE") for indirect in (False, True))
    bounced = np.nan_to_num(all_light - direct)[..., :3]
    rows = bounced.shape[0]
    inside = bounced[rows // 8 : rows * 3 // 8].mean()  # the lower half of the map shows the bowl
    mean = 2.0 / 2 / (1 - reflectance / 2)
    assert inside == pytest.approx(reflectance / 2 * mean, rel=0.05)
