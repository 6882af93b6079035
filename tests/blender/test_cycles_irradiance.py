"""Irradiance against Cycles: a white diffuse plane baked with DIFFUSE / DIRECT shows E / pi."""

import math

import bpy
import numpy as np
import pytest
import scenes
from beamspread.core.native import native
from cycles_truth import (
    CYCLES_SAMPLES,
    PLANES,
    TEXELS,
    add_receiver,
    around,
    cycles_irradiance,
    frame_of,
    lamp_over,
    our_irradiance,
)
from mathutils import Matrix

TOLERANCE = 0.01

SQUARE = np.array(scenes.SQUARE_UVS, float)
UVS = {
    "square": SQUARE,
    "turned": np.roll(SQUARE, 1, axis=0),
    "mirrored": SQUARE * [-1, 1] + [1, 0],
    "part": SQUARE * [0.5, 0.7] + [0.2, 0.1],
    "oblique": (SQUARE - 0.5) @ [[0.5, 0.3], [-0.3, 0.5]] + 0.5,
}
# Lamps stand in the frame of the plane, whose unit is half its side.
ABOVE = {"straight": (0.0, 0.0, 0.0), "oblique": (0.35, 0.25, 0.4)}


def add_lamp(kind, plane, euler=(0, 0, 0), power=10, **options):
    size = {"angle": 0} if kind == "SUN" else {}
    return lamp_over(plane, kind, euler, power=power, **size | options)


def inside_one_triangle(plane):
    """Texels that with their neighbours lie in one triangle: at its border Cycles samples only a part of a texel."""
    plane.data.calc_loop_triangles()
    corners = np.array([plane.data.uv_layers[0].data[i].uv for t in plane.data.loop_triangles for i in t.loops])
    triangles = corners.astype(float).reshape(-1, 3, 2) * TEXELS
    counts = np.array([3], np.uint32)
    whole = np.max([native.coverage(triangle, counts, TEXELS, TEXELS) for triangle in triangles], axis=0) > 0.999
    whole[[0, -1]], whole[:, [0, -1]] = False, False
    return around(whole).all(axis=0)


def near_a_border(values):
    """True for texels whose surroundings vary by more than a fifth: at the border of a shadow or a cone."""
    return np.ptp(around(values), axis=0) > 0.2 * values


def assert_agree(plane, image, least_lit=0.1):
    """Every lit texel within 1 %, the total within 0.3 %, the dark ones dark."""
    cycles = cycles_irradiance(plane, image)
    ours, coverage = our_irradiance(plane)
    whole = inside_one_triangle(plane)
    assert (coverage[whole] > 0.999).all()
    # On the very border of a hard cone Cycles (4.2 on) may divide zero by zero.
    undefined = np.isnan(cycles).any(axis=2)
    assert undefined.sum() <= 4
    whole &= ~undefined
    strength = ours.max(axis=2)
    lit = whole & (strength > 0.01 * strength.max()) & ~near_a_border(strength)
    assert lit.sum() > least_lit * whole.sum()
    np.testing.assert_allclose(cycles[lit], ours[lit], rtol=TOLERANCE)
    # Borders too, although Cycles weighs a texel there by its pixel filter and we by area.
    assert np.abs(cycles - ours)[whole].sum() < 0.015 * ours[whole].sum()
    np.testing.assert_allclose(cycles[whole].sum(axis=0), ours[whole].sum(axis=0), rtol=3e-3)
    dark = whole & (strength == 0) & ~near_a_border(strength)
    assert cycles[dark].max(initial=0) == 0


@pytest.mark.parametrize("world", PLANES.values(), ids=PLANES.keys())
@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT"])
def test_planes(kind, world):
    plane, image = add_receiver(world)
    options = {"spot_size": 1.6, "spot_blend": 0.3} if kind == "SPOT" else {}
    add_lamp(kind, plane, ABOVE["oblique"], power=70, **options)
    assert_agree(plane, image)


@pytest.mark.parametrize("uvs", UVS.values(), ids=UVS.keys())
def test_uv_layouts(uvs):
    plane, image = add_receiver(PLANES["stretched"], uvs)
    add_lamp("POINT", plane, power=20)
    assert_agree(plane, image)


@pytest.mark.parametrize("angle", [0, 30, 60, 80, 89])
def test_sun_angles(angle):
    plane, image = add_receiver(Matrix())
    add_lamp("SUN", plane, (math.radians(angle), 0, 0.3), power=3)
    assert_agree(plane, image)


def test_light_from_behind_is_none():
    plane, image = add_receiver(PLANES["mirrored"])
    add_lamp("SUN", plane, (2.0, 0, 0))
    add_lamp("POINT", plane, place=(0.1, 0.2, -0.5))
    assert our_irradiance(plane)[0].max() == 0
    assert cycles_irradiance(plane, image).max() == 0


@pytest.mark.parametrize("blend", [0, 0.15, 1])
@pytest.mark.parametrize("size", [50, 110, 180])
@pytest.mark.parametrize("euler", ABOVE.values(), ids=ABOVE.keys())
def test_spot_falloff(euler, size, blend):
    plane, image = add_receiver(Matrix())
    add_lamp("SPOT", plane, euler, power=100, spot_size=math.radians(size), spot_blend=blend)
    assert_agree(plane, image, least_lit=0.03)


@pytest.mark.parametrize(
    "scale",
    [(2, 2, 2), (2, 1, 1), (1, 1, 0.6), (0.7, 1.5, 1.2), (-1.3, 0.8, 1)],
    ids=lambda scale: "_".join(map(str, scale)),
)
@pytest.mark.parametrize("blend", [0.15, 1])
def test_scaled_spot(scale, blend):
    plane, image = add_receiver(Matrix())
    add_lamp("SPOT", plane, ABOVE["oblique"], scale=scale, power=100, spot_size=1.0, spot_blend=blend)
    assert_agree(plane, image, least_lit=0.03)


def test_spot_below_a_mirroring_parent():
    plane, image = add_receiver(Matrix())
    lamp = add_lamp("SPOT", plane, (math.pi - 0.35, 0.25, 0.4), power=100, spot_size=1.2, spot_blend=0.5)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.matrix_world = Matrix.Translation((0, 0, 2.2)) @ Matrix.Diagonal((1, 1, -1, 1))
    lamp.parent = parent
    assert_agree(plane, image)


def test_lights_of_several_colors_add_up():
    plane, image = add_receiver(PLANES["tilted"])
    add_lamp("SUN", plane, (0.4, 0, 0), color=(1, 0.2, 0.1), power=2)
    add_lamp("POINT", plane, color=(0.1, 1, 0.3), power=30)
    add_lamp("SPOT", plane, color=(0.2, 0.1, 1), power=200, spot_size=1.2, spot_blend=1)
    # Cycles picks one of the lights for each sample: only means over many texels are free of noise.
    blocks = TEXELS // 8, 8, TEXELS // 8, 8, 3
    cycles = cycles_irradiance(plane, image, 4 * CYCLES_SAMPLES).reshape(blocks).mean(axis=(1, 3))
    ours = our_irradiance(plane)[0].reshape(blocks).mean(axis=(1, 3))
    np.testing.assert_allclose(cycles, ours, rtol=TOLERANCE)


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT"])
@pytest.mark.parametrize("world", ["plain", "mirrored"])
def test_shadow(kind, world):
    plane, image = add_receiver(PLANES[world])
    wall = scenes.add_blocker(0.5)
    wall.matrix_world = frame_of(plane)
    options = {"spot_size": 2.0, "spot_blend": 0.2} if kind == "SPOT" else {}
    add_lamp(kind, plane, (0.2, 0.6, 0.4), place=(0.7, -0.3, 1.1), power=50, **options)
    assert (our_irradiance(plane)[0].max(axis=2) == 0).sum() > 100
    assert_agree(plane, image)


@pytest.mark.parametrize("distance", [10_000, 1_000_000])
def test_shadows_do_not_drift_far_from_the_world_origin(distance):
    """Blender's own matrices hold these positions exactly: multiples of an eighth, its spacing at 1000 km."""
    plane, _ = add_receiver(Matrix())
    wall = scenes.add_blocker(0.5)
    lamp = add_lamp("POINT", plane, place=(0.75, -0.25, 1.125), power=50)
    here, _ = our_irradiance(plane)
    for obj in (plane, wall, lamp):
        obj.matrix_world = Matrix.Translation((distance, -distance // 2, distance // 4)) @ obj.matrix_world
    bpy.context.view_layer.update()
    there, _ = our_irradiance(plane)
    assert (here.max(axis=2) == 0).sum() > 100
    # Single rays of a texel's 64 pass an edge within rounding, 2^-11 of a texel: in 3 % of the texels along edges.
    np.testing.assert_allclose(there, here, rtol=1e-5, atol=0.02 * here.max())
    assert np.abs(there - here).sum() < 2e-4 * here.sum()
