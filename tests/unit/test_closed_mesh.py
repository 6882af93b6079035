"""Meshes whose fronts hide their backs, and their light: as that of both sides with the mesh in its own way."""

import numpy as np
import pytest
from _native_test import irradiance, sample
from beamspread.core.native import native
from beamspread.core.scene.lights import STRATA
from hypothesis import given, settings
from hypothesis import strategies as st

from shapes import FACES, SQUARE, box, make_grid, occluders, rotation, sphere

UP = (0.0, 0.0, 1.0)
CUBE = box((-1, -1, -1), (1, 1, 1))


def is_closed(vertices, triangles):
    return native.is_closed(np.ascontiguousarray(vertices, float), np.ascontiguousarray(triangles, np.uint32))


def joined(*meshes):
    """One mesh of several."""
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    triangles = [triangles + np.uint32(start) for (_, triangles), start in zip(meshes, starts)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(triangles)


def moved(mesh, shift, scale=1.0):
    vertices, triangles = mesh
    return scale * vertices + shift, triangles


def prism(outline, height=1.0):
    """A body over an outline (N, 2), counterclockwise; its caps are fans."""
    count = len(outline)
    low = np.column_stack([outline, np.zeros(count)])
    around = np.arange(count)
    after = (around + 1) % count
    fan = np.array([(0, k, k + 1) for k in range(1, count - 1)])
    sides = [np.stack([around, after, after + count], 1), np.stack([around, after + count, around + count], 1)]
    return np.concatenate([low, low + (0, 0, height)]), np.concatenate([fan[:, ::-1], fan + count, *sides])


BODIES = {
    "cube": CUBE,
    "ball": (np.round(sphere()[0], 9), sphere()[1]),  # seam and poles at the same positions
    "cut into single triangles": (CUBE[0][CUBE[1].ravel()], np.arange(36).reshape(-1, 3)),
    "two apart": joined(CUBE, moved(CUBE, (5, 0, 0))),
    "two that cross": joined(CUBE, moved(CUBE, (0.7, 0.6, 0.5))),
    "a shell": joined(CUBE, (0.5 * CUBE[0], CUBE[1][:, ::-1])),
    "far from the origin": moved(CUBE, (1e4, -2e4, 3e3)),
    "tiny": moved(CUBE, 0, 1e-6),
}
OTHERS = {
    "a square": (SQUARE, FACES),
    "an open box": (CUBE[0], CUBE[1][2:]),
    "a box with a hole of one triangle": (CUBE[0], CUBE[1][1:]),
    "inside out": (CUBE[0], CUBE[1][:, ::-1]),
    "one triangle turned": (CUBE[0], np.concatenate([CUBE[1][:1, ::-1], CUBE[1][1:]])),
    "one body of two inside out": joined(CUBE, (CUBE[0] + 5.0, CUBE[1][:, ::-1])),
    "flat text, which has each triangle twice": joined((SQUARE, FACES), (SQUARE, FACES[:, ::-1])),
    "a bow tie, one half of which is inside out": prism(np.array([(0, 0), (2, 1), (2, 0), (0, 1)], float)),
    "no triangles": (np.zeros((0, 3)), np.zeros((0, 3), int)),
    "a line": (np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], float), np.array([(0, 1, 1), (1, 2, 2)])),
}


@pytest.mark.parametrize("name", BODIES)
def test_bodies_are_closed(name):
    assert is_closed(*BODIES[name])


@pytest.mark.parametrize("name", OTHERS)
def test_others_are_not(name):
    assert not is_closed(*OTHERS[name])


def test_only_backs_that_glow_have_to_be_hidden():
    """A lamp that is inside out is found, however large the dark rest of the mesh is."""
    vertices, triangles = joined(box((-10, -10, -1), (10, 10, 0)), moved((CUBE[0], CUBE[1][:, ::-1]), (0, 0, 1), 0.05))
    dark, lamp = np.arange(24, dtype=np.uint32).reshape(2, 12, 1)
    assert native.is_closed(vertices, triangles, dark)
    assert not native.is_closed(vertices, triangles, lamp)
    with pytest.raises(ValueError, match="glowing"):
        native.is_closed(vertices, triangles, lamp + np.uint32(1))


@given(st.integers(0, 2**31), st.integers(4, 12))
@settings(max_examples=40, deadline=None)
def test_prisms_over_stars_are_closed_in_any_frame(seed, corners):
    random = np.random.default_rng(seed)
    angles = (np.arange(corners) + 0.8 * random.random(corners)) / corners * 2 * np.pi
    radii = random.uniform(0.2, 1.0, corners)
    outline = radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    vertices, triangles = prism(outline)
    centre = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    around = np.arange(corners)
    after = (around + 1) % corners
    caps = [
        np.stack([after, around, np.full(corners, 2 * corners)], 1),
        np.stack([around + corners, after + corners, np.full(corners, 2 * corners + 1)], 1),
    ]
    triangles = np.concatenate([*caps, triangles[-2 * corners :]])
    vertices = np.concatenate([vertices, centre]) @ rotation(seed) + random.uniform(-3, 3, 3)
    assert is_closed(vertices, triangles)


@pytest.mark.parametrize("vertices", [[(0, 0, np.nan)] * 3, [(0, 0, np.inf)] * 3])
def test_positions_are_finite(vertices):
    with pytest.raises(ValueError, match="vertices"):
        is_closed(vertices, [(0, 1, 2)])


def test_indices_are_in_range():
    with pytest.raises(ValueError, match="triangles"):
        is_closed(SQUARE, [(0, 1, 4)])


GLOW = np.random.default_rng(3).uniform(0.5, 2.0, (12, 3)).astype(np.float32)
LAMP = moved(CUBE, (0.1, 0.2, 0.5), 0.2)


def lamps(glow=GLOW):
    """The lamp as a light of both sides, and as one of fronts alone."""
    vertices, triangles = np.ascontiguousarray(LAMP[0]), LAMP[1]
    return [native.MeshLight(vertices, triangles, glow, is_closed=closed) for closed in (False, True)]


def test_fronts_alone_bring_what_comes_through_the_mesh_s_own_shadow():
    """Standard errors of 4096 rays in all texels are .01 %; both have as many."""
    both_sides, fronts = lamps()
    grid = native.ReceiverGrid(**make_grid(24))
    shaded = native.gather_rays(grid, both_sides, occluders(LAMP), rays=4096)[0]
    alone = native.gather_rays(grid, fronts, rays=64)[0]
    assert alone.mean() == pytest.approx(shaded.mean(), rel=5e-4)
    np.testing.assert_allclose(alone, shaded, rtol=0.02, atol=2e-3 * shaded.max())
    itself = native.gather_rays(grid, fronts, occluders(LAMP), rays=64, even_rays=8)[0]
    np.testing.assert_allclose(itself, alone, rtol=1e-5)


def blocks(irradiance, side=4):
    """Means over blocks of texels."""
    rows, columns, channels = irradiance.shape
    return irradiance.reshape(rows // side, side, columns // side, side, channels).mean(axis=(1, 3))


def test_another_body_in_the_way():
    both_sides, fronts = lamps()
    grid = native.ReceiverGrid(**make_grid(24))
    casters = occluders(LAMP, box((-0.6, 0.1, 0.1), (0.1, 0.3, 0.25)))
    found, expected = (native.gather_rays(grid, light, casters, rays=2048)[0] for light in (fronts, both_sides))
    assert found.mean() == pytest.approx(expected.mean(), rel=1e-3)
    np.testing.assert_allclose(blocks(found), blocks(expected), rtol=0.02, atol=2e-3 * expected.max())


def test_inside_both_sides_are_seen():
    both_sides, fronts = lamps()
    inside, outside = (0.1, 0.2, 0.45), (0.1, 0.2, 0.1)
    assert irradiance(fronts, inside, UP) == irradiance(both_sides, inside, UP)
    assert irradiance(fronts, outside, UP)[0] < 0.7 * irradiance(both_sides, outside, UP)[0]
    places = np.random.default_rng(1).random((512, 2))
    for point in (inside, outside):
        travel, _, flux = sample(fronts, point, UP, places)
        mean = (flux * np.maximum(-travel[:, 2:], 0)).mean(axis=0)
        # Random places: one standard error is 5 %.
        np.testing.assert_allclose(mean, irradiance(fronts, point, UP), rtol=0.15)


def test_a_plane_through_the_lamp_sees_its_inside():
    """Texels within the lamp have the light of all faces, those beside it of the fronts that stand above the plane."""
    _, fronts = lamps(np.ones((12, 3), np.float32))
    grid = native.ReceiverGrid(**make_grid(40, centre=(0.1, 0.2, 0.5)))
    found = native.gather_rays(grid, fronts, occluders(LAMP), rays=1024)[0][..., 0]
    assert found[20, 20] == pytest.approx(np.pi, rel=1e-3)
    beside = native.gather_rays(grid, lamps(np.ones((12, 3), np.float32))[0], occluders(LAMP), rays=4096)[0][..., 0]
    assert found[:, :15].mean() == pytest.approx(beside[:, :15].mean(), rel=2e-3)


def test_faces_that_do_not_glow_close_a_mesh():
    """A room whose ceiling alone glows: its backs light the floor, and nothing outside."""
    vertices, triangles = np.ascontiguousarray(CUBE[0], float), CUBE[1]
    ceiling = triangles[(vertices[triangles][..., 2] == 1).all(axis=1)]
    glow = np.ones((len(ceiling), 3), np.float32)
    closed, open_light = (native.MeshLight(vertices, ceiling, glow, is_closed=value) for value in (True, False))
    assert irradiance(closed, (0.2, 0.1, -0.5), UP) == irradiance(open_light, (0.2, 0.1, -0.5), UP)
    assert irradiance(closed, (0.2, 0.1, -1.5), UP) == (0, 0, 0)
    floor = native.ReceiverGrid(**make_grid(8, size=(1.0, 1.0), centre=(0, 0, -0.9)))
    found, expected = (native.gather_rays(floor, light, rays=256)[0] for light in (closed, open_light))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


ROOM = box((-1.4, -0.7, 0.3), (1.6, 2.3, 2.8))


def ceilings():
    """The ceiling of the room as a light of both sides, and as one of a closed mesh."""
    vertices, triangles = np.ascontiguousarray(ROOM[0]), ROOM[1]
    ceiling = triangles[(vertices[triangles][..., 2] == vertices[:, 2].max()).all(axis=1)]
    glow = np.ones((len(ceiling), 3), np.float32)
    return [native.MeshLight(vertices, ceiling, glow, is_closed=value) for value in (False, True)]


def test_light_bounces_in_a_room_whose_ceiling_glows():
    """Its walls are the bounds of the closed mesh; single precision moves points on them to either side."""
    white = native.Reflector(native.ColorTexture((0.8,) * 3))
    scene = native.Occluders([native.OccluderMesh(*ROOM, reflectors=[white])])
    floor = {
        "corner": (-0.4, 0.3, 0.301),
        "x_axis": (1.0, 0.0, 0.0),
        "y_axis": (0.0, 1.0, 0.0),
        "normal": (0.0, 0.0, 1.0),
        "size": (1.0, 1.0),
        "nodes": (8, 8),
    }
    options = {"direct": 1.0, "max_bounces": 20, "max_samples": 256, "tolerance": 4e-3}
    both, closed = (
        native.bounced_light([floor], STRATA, [(light, (1.0,) * 3, scene)], scene, **options) for light in ceilings()
    )
    noise = 3 * np.hypot(both["noise"], closed["noise"]) * (1 + both["irradiance"])
    assert closed["irradiance"] == pytest.approx(both["irradiance"], abs=noise)


@pytest.mark.parametrize("beyond", [0.0, 1e-12, -1e-12])
def test_a_receiver_on_the_room_s_own_wall_sees_its_ceiling(beyond):
    """From inside, also where rounding sets it beside the wall."""
    axes = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
    grid = native.ReceiverGrid(**make_grid(8, size=(1.0, 1.0), axes=axes, centre=(-1.4 - beyond, 0.8, 1.5)))
    both, closed = (native.gather_rays(grid, light, rays=256)[0] for light in ceilings())
    assert both.min() > 0.1
    np.testing.assert_allclose(closed, both, rtol=1e-6)


def test_a_floor_through_the_walls_of_a_room():
    """Direct light in texels beside the bounds, where backs begin to count, is that of both sides with shadows."""
    grid = native.ReceiverGrid(**make_grid(200, size=(4.0, 4.0), centre=(0.1, 0.8, 0.4)))
    casters = occluders(ROOM)
    both, closed = (native.gather_rays(grid, light, casters, rays=256, even_rays=16)[0] for light in ceilings())
    assert closed.mean() == pytest.approx(both.mean(), rel=2e-3)
    np.testing.assert_allclose(blocks(closed), blocks(both), rtol=0.02, atol=2e-3 * both.max())


@pytest.mark.parametrize("closed", [False, True])
def test_rays_choose_faces_by_the_light_that_they_bring(closed):
    """A bright lamp at the other end of a hall takes few rays from a dim one near the floor: its noise is low."""
    near, far = moved(CUBE, (0, 0, 0.4), 0.05), moved(CUBE, (300, 0, 10.0), 3.0)
    vertices, triangles = joined(near, far)
    glow = np.ones((24, 3), np.float32)
    light = native.MeshLight(np.ascontiguousarray(vertices), triangles, glow, is_closed=closed)
    grid = native.ReceiverGrid(**make_grid(16))
    casters = occluders(near, far, moved(CUBE, (0.5, 0, 0.1), 0.1))
    few, many = (native.gather_rays(grid, light, casters, rays=rays)[0][..., 0] for rays in (64, 4096))
    assert few.mean() == pytest.approx(many.mean(), rel=5e-3)
    # Rays by power alone, 3600 of the far lamp for each of the near one, leave .11.
    assert np.abs(few / many - 1).mean() < 0.08
