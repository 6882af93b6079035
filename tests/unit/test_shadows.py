"""Shadows of opaque, see-through and instanced meshes: texels that need no rays, planes among their occluders."""

import numpy as np
import pytest
from _native_test import instance_count
from beamspread.core.native import native
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import gather_beams, travel
from shapes import FACES, SQUARE, make_grid, net, occluders, rotation, soup, sphere

MANY = settings(max_examples=50, deadline=None)
SEEDS = st.integers(0, 10**6)


def placements(rng, count, stretch, size=1.0):
    """Turns of a mesh with scales up to `stretch` over the smallest, mirrored ones too: (K, 3, 4)."""
    rows = []
    for _ in range(count):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        place = rng.uniform((-1, -1, -0.1), (1, 1, 1))
        rows.append(np.column_stack([turn * 0.15 * size * rng.uniform(1 / stretch, 1, 3), place]))
    return np.array(rows)


def see_through(rng):
    """Opaque, grey and colored."""
    return [native.ColorTexture(color) for color in ((0, 0, 0), (rng.random(),) * 3, rng.random(3), rng.random(3))]


def random_mesh(rng, kind, count, size, slant, axes, centre):
    """Triangles that may cut the plane, lie behind it or beyond the lamp; and one far away, rounded by more than the
    grid's own: its shadow's border is known less well.
    """
    if kind == "instances":
        vertices, triangles, uvs = sphere(6)
        places = placements(rng, 3, 3.0, {0.01: 0.3, 0.1: 1.0, 1.0: 6.0}[size])
        places = np.concatenate([axes.T @ places[..., :3], (places[..., 3] @ axes + centre)[..., None]], -1)
        materials = rng.integers(0, 2, (len(triangles), 1)).astype(np.uint32)
        return native.OccluderMesh(vertices, triangles, places.reshape(-1, 12), see_through(rng), materials, uvs)
    middle = rng.uniform([-1.5, -1.2, -0.3], [1.5, 1.2, 1.5], (count, 1, 3))
    offset = rng.normal(0, size, (count, 3, 3))
    middle[::3, :, 2], offset[::3, :, 2] = 0.1 * middle[::3, :, 2], 0.05 * offset[::3, :, 2]  # at the start of rays
    local = (middle + offset).reshape(-1, 3)
    beyond = 3000 * (np.array([slant, 0.3, 1.0]) + [(0, 0, 0), (0.0003, 0, 0), (0, 0.0003, 0)])
    mesh = soup(np.concatenate([local, beyond]) @ axes + centre)
    if kind == "opaque":
        return native.OccluderMesh(*mesh)
    materials = rng.integers(0, 4, (count + 1, 1)).astype(np.uint32)
    return native.OccluderMesh(*mesh, None, see_through(rng), materials)


@pytest.mark.parametrize("kind", ["opaque", "see-through", "instances"])
@MANY
@given(
    seed=SEEDS,
    count=st.integers(1, 40),
    size=st.sampled_from([0.01, 0.1, 1.0]),
    slant=st.sampled_from([-1.0, 0.0, 1.0, 30.0]),
    lamp_height=st.sampled_from([None, 0.1, 0.3, 1.0, 5.0]),
    clearance=st.sampled_from([0.0, 0.05]),
    samples=st.sampled_from([1, 4]),
    at_origin=st.booleans(),
    far=st.sampled_from([0, 1, 1e4]),
)
def test_texels_that_need_no_rays_are_as_if_traced(
    kind, seed, count, size, slant, lamp_height, clearance, samples, at_origin, far
):
    """Bit by bit, and for any number of threads. A lamp or all of the receiver may lie within an instance's box."""
    axes, centre, rng = rotation(seed), far * np.array([30.0, -20.0, 10.0]), np.random.default_rng(seed)
    grid = native.ReceiverGrid(**make_grid(150, 110, (2.0, 1.5), axes, centre))
    mesh = random_mesh(rng, kind, count, size, slant, axes, centre)
    casters = native.Occluders([mesh], (0, 0, 0) if at_origin else centre, max_copied=0)
    assert instance_count(casters) == 3 * (kind == "instances")
    if lamp_height is None:
        light = native.SunLight(np.array([-slant, -0.3, -1.0]) @ axes)
    else:
        light = native.PointLight(np.array([0.1 * slant, 0.2, lamp_height]) @ axes + centre)
    options = {"samples": samples, "clearance": clearance}
    traced, *others = (
        gather_beams(grid, light, casters, find_shadows=find, threads=threads, **options)
        for find, threads in ((False, 1), (True, 1), (True, 3), (True, 0))
    )
    for searched in others:
        np.testing.assert_array_equal(searched[0], traced[0])
        np.testing.assert_array_equal(searched[1], traced[1])


def sized_light(kind, slant, height, axes, centre):
    """A light whose rays reach the receiver from within a small part of the sky."""
    place = np.array([0.1 * slant, 0.2, height]) @ axes + centre
    if kind == "sun":
        return native.SunLight(np.array([-slant, -0.3, -1.0]) @ axes, 0.1)
    if kind == "ball":
        return native.PointLight(place, 0.1)
    if kind == "area":
        return native.AreaLight(place, axes, 0.3, 0.1)
    return native.MeshLight(0.1 * SQUARE @ axes + place, FACES, np.ones((len(FACES), 3), np.float32))


@pytest.mark.parametrize("light", ["sun", "ball", "area", "mesh"])
@pytest.mark.parametrize("kind", ["opaque", "see-through", "instances"])
@settings(max_examples=12, deadline=None)
@given(
    seed=SEEDS,
    count=st.integers(1, 6),
    slant=st.sampled_from([-1.0, 0.0, 1.0, 10.0]),
    lamp_height=st.sampled_from([0.3, 1.0, 5.0]),
    clearance=st.sampled_from([0.0, 0.05]),
    far=st.sampled_from([0, 1e4]),
    even_rays=st.sampled_from([0, 4]),
)
def test_tiles_that_no_light_of_a_size_shades_are_as_if_traced(
    light, kind, seed, count, slant, lamp_height, clearance, far, even_rays
):
    """Bit by bit, and for any number of threads."""
    axes, centre, rng = rotation(seed), far * np.array([30.0, -20.0, 10.0]), np.random.default_rng(seed)
    grid = native.ReceiverGrid(**make_grid(150, 110, (2.0, 1.5), axes, centre))
    mesh = random_mesh(rng, kind, count, 0.1, slant, axes, centre)
    casters = native.Occluders([mesh], centre, max_copied=0)
    lamp = sized_light(light, slant, lamp_height, axes, centre)
    assert gather_beams(grid, lamp, None)[0].max() > 0
    options = {"rays": 32, "even_rays": even_rays, "clearance": clearance}
    traced, *others = (
        gather_beams(grid, lamp, casters, find_shadows=find, threads=threads, **options)
        for find, threads in ((False, 0), (True, 1), (True, 3))
    )
    for searched in others:
        np.testing.assert_array_equal(searched[0], traced[0])
        np.testing.assert_array_equal(searched[1], traced[1])


@MANY
@given(
    seed=SEEDS,
    size=st.sampled_from([1e-3, 0.1, 1.0, 30.0, 1e4]),
    distance=st.sampled_from([0.0, 1.0, 100.0, 1e4]),
    angle=st.sampled_from([0.0, 45.0, 80.0, 89.0, 89.9]),
    margin=st.sampled_from([1.0, 3.0]),
)
def test_a_plane_does_not_shadow_itself(seed, size, distance, angle, margin):
    """The receiver's own rectangle, larger than the grid by the margin, is among the occluders."""
    axes = rotation(seed)
    centre = distance * size * np.random.default_rng(seed).normal(size=3)
    grid = native.ReceiverGrid(**make_grid(16, 16, (size, 0.7 * size), axes, centre))
    plane = occluders((0.5 * margin * size * SQUARE * (1, 0.7, 1) @ axes + centre, FACES))
    local = travel(angle, seed % 360)
    lit, _ = gather_beams(grid, native.SunLight(local @ axes), plane, samples=2)
    np.testing.assert_allclose(lit, -local[2], rtol=1e-6)
    lamp = native.PointLight(centre - local @ axes * 3 * size)
    shadowed, bare = (gather_beams(grid, lamp, casters, samples=2)[0] for casters in (plane, None))
    np.testing.assert_array_equal(shadowed, bare)
    assert bare.min() > 0


@MANY
@given(
    seed=SEEDS,
    far=st.sampled_from([0.0, 1e4]),
    angle=st.sampled_from([0.0, 60.0, 89.0]),
    stretch=st.sampled_from([1.0, 30.0]),
    size=st.sampled_from([1.0, 3000.0]),
)
def test_an_instanced_receiver_does_not_shadow_itself(seed, far, angle, stretch, size):
    """The receiver is a part of an instance of a tessellated card, in a random plane, stretched along itself."""
    rng = np.random.default_rng(seed)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    centre = far * rng.normal(size=3)
    x, y = np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-1, 1, 5))
    vertices = np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3)
    linear = axes.T * (size, size / stretch, 0.7 * size)
    places = [np.column_stack([linear, centre]), np.column_stack([linear, centre - 5 * size * axes[2]])]
    # The add-on has an origin near the receiver, too, not at it.
    middle = centre + linear @ (*rng.uniform(-0.5, 0.5, 2), 0) * (size > 1)
    casters = occluders(
        (vertices, net(4, 4), np.reshape(places, (2, 12))), origin=np.round(middle / 8) * 8, max_copied=0
    )
    assert instance_count(casters) == 2
    grid = native.ReceiverGrid(**make_grid(16, 16, (1.8, 1.8 / stretch), axes, middle))
    local = travel(angle, seed % 360)
    lit, _ = gather_beams(grid, native.SunLight(local @ axes), casters)
    np.testing.assert_allclose(lit, -local[2], rtol=1e-6)


def test_clearance_keeps_an_uneven_plane_from_shadowing_itself():
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    z = 1e-4 * np.random.default_rng(1).uniform(-1, 1, x.shape)
    plane = occluders((np.stack([x, y, z], -1).reshape(-1, 3), net(8, 8)))
    arguments = native.ReceiverGrid(**make_grid(30, size=(1.9, 1.9))), native.SunLight((1, 0, -1)), plane
    assert (gather_beams(*arguments)[0] == 0).any()
    np.testing.assert_allclose(gather_beams(*arguments, clearance=1.1e-4)[0], np.sqrt(0.5), rtol=1e-6)
