"""Bounced light on a mesh that bends, in Blender."""

import bpy
import numpy as np
import pytest
import scenes
from indirect_scenes import baked

ALBEDO = 0.5


def add_ball():
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, location=(0, 0, 1.5))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(scenes.add_material())
    return ball


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
