"""Instances against copied triangles, at the scene's origin and far from it."""

import math
import time

import numpy as np
import pytest
from _native_test import instance_count
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight
from beamspread.core.scene.occluders import Mesh, Occluder
from hypothesis import given, settings
from hypothesis import strategies as st

from bakes import square
from helpers import gather_beams
from shapes import make_grid, occluders, sphere


def placements(rng, count, stretch, shift=(0, 0, 0)):
    """Rotations with random scale up to `stretch` over the smallest, mirrored ones too; rows of (K, 12)."""
    rows = []
    for _ in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        scale = 0.15 * rng.uniform(1 / stretch, 1, 3)
        place = rng.uniform((-1, -1, -0.1), (1, 1, 1)) + shift
        rows.append(np.column_stack([turn * scale, place]).ravel())
    return np.array(rows)


def floor(shift=(0, 0, 0)):
    return native.ReceiverGrid(**make_grid(96, centre=shift))


def see_through(kind):
    if kind == "opaque":
        return [], None
    rng = np.random.default_rng(1)
    if kind == "color":
        return [native.ColorTexture((0.9, 0.5, 0.2)), native.ColorTexture((0, 0, 0))], [0, 1]
    texels = np.round(rng.random((8, 8, 1))).astype(np.float32)
    return [native.ColorTexture.from_image(texels, is_smooth=False)], [0]


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    stretch=st.sampled_from([1.0, 3.0, 10.0]),
    kind=st.sampled_from(["opaque", "color", "image"]),
    far=st.sampled_from([0.0, 1e4]),
    is_sun=st.booleans(),
)
def test_instances_shade_as_copies_do(seed, stretch, kind, far, is_sun):
    """Single rays pass an edge within the rounding of either, some 1e-6 of the scene: on 96 x 96 texels with 16 rays,
    a 200th of a texel apart at 1e-4, one in 1e4 at most. All others find the same bits."""
    rng = np.random.default_rng(seed)
    shift = far * np.array([0.6, -0.64, 0.48])
    vertices, triangles, uvs = sphere()
    transmittances, numbers = see_through(kind)
    materials = None if numbers is None else rng.choice(numbers, (len(triangles), 1)).astype(np.uint32)
    places = placements(rng, 12, stretch, shift)
    # The mesh lies off its own origin; its placement compensates.
    off = places.reshape(-1, 3, 4).copy()
    off[:, :, 3] -= off[:, :, :3] @ (5, 3, -4)
    mesh = native.OccluderMesh(vertices + (5, 3, -4), triangles, off.reshape(-1, 12), transmittances, materials, uvs)
    copied = native.Occluders([mesh], shift)
    shared = native.Occluders([mesh], shift, max_copied=0)
    assert (instance_count(copied), instance_count(shared)) == (0, 12)
    assert copied.triangle_count == shared.triangle_count == 12 * len(triangles)
    assert copied.is_opaque == shared.is_opaque == (kind == "opaque")
    light = native.SunLight((0.3, 0.2, -1)) if is_sun else native.PointLight(shift + (0.2, 0.1, 1.5))
    one, other = (gather_beams(floor(shift), light, casters)[0] for casters in (copied, shared))
    assert (one < 0.9 * one.max()).mean() > 0.01
    differs = np.abs(one - other) > 1e-6 * one.max()
    assert differs.mean() < 2e-3
    np.testing.assert_allclose(one.sum(), other.sum(), rtol=1e-4)


def test_flat_and_small_ones_are_copied():
    """A matrix without inverse leads no ray into a mesh's frame, and a mesh of few triangles is cheaper copied."""
    vertices, triangles, _ = sphere()
    flat = np.tile(np.eye(4)[:3], (3, 1, 1))
    flat[:, 2, :] = (0, 0, 0, 1)
    flat[:, 0, 3] = (-0.5, 0.0, 0.5)
    flat[1:, :, :3] *= 0.25
    disks = vertices, triangles, flat.reshape(-1, 12)
    small = vertices, triangles[:15].copy(), placements(np.random.default_rng(1), 9, 1.0)
    assert instance_count(occluders(disks, small, max_copied=0)) == 0
    lit, _ = gather_beams(floor(), native.SunLight((0, 0, -1)), occluders(disks))
    # A disk of radius 1 around x = -.5, a polygon of 24 corners, and two of a quarter: one in it, one in part.
    x, y = np.meshgrid(*[(np.arange(96) + 0.5) / 48 - 1] * 2)
    distance = np.min([np.hypot(x + 0.5, y), 4 * np.hypot(x, y), 4 * np.hypot(x - 0.5, y)], axis=0)
    assert not lit[distance < math.cos(math.pi / 24) - 0.13].any()
    assert (lit[distance > 1.13] == 1).all()


def test_ten_million_triangles_of_instances_cost_no_seconds_per_light():
    """A thousand spheres of ten thousand triangles; two cores under load took .1 s."""
    vertices, triangles, _ = sphere(72)
    rng = np.random.default_rng(2)
    places = placements(rng, 1000, 1.0).reshape(-1, 3, 4)
    places[..., :3] *= 0.2
    scene = Illumination([], [Occluder("Spheres", Mesh(vertices, triangles), places)])
    grid = square(64, 2.0)
    start = time.process_time()
    caster = scene.caster(grid)
    assert (instance_count(caster), caster.triangle_count) == (1000, 1000 * len(triangles))
    assert caster.triangle_count > 10**7
    for light in (
        SunLight("Sun", 1.0, (1.0, 1.0, 1.0), True, (0.3, 0.0, -1.0)),
        PointLight("Lamp", 1.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 3.0)),
    ):
        lit, _ = gather_beams(grid.native(), light.native(), caster, samples=2)
        assert 0.1 < (lit == 0).mean() < 0.999
    assert time.process_time() - start < 3


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_placements_that_are_no_numbers_are_named(bad):
    vertices, triangles, _ = sphere()
    places = placements(np.random.default_rng(3), 2, 1.0)
    places[1, 3] = bad
    with pytest.raises(ValueError, match=f"placements.*{bad}.*finite"):
        occluders((vertices, triangles, places))
