"""Light at the texels of meshes that bend: as on planes if they are flat, closed forms on balls, no acne, no leaks."""

import functools

import numpy as np
import pytest
from beamspread.core.native import native

from bent_shapes import Texels, ball, cube, flat, ico_ball, texels_of, unit
from shapes import FACES, SQUARE, box, make_grid, occluders, rotation

FRAME = np.eye(3)
IMAGE = np.random.default_rng(5).random((16, 32, 3)).astype(np.float32)
SUN = unit(np.array((0.3, 0.2, -1)))
LIGHTS = {
    "sun": native.SunLight((0.3, 0.2, -1), 0.0),
    "wide sun": native.SunLight((0.3, 0.2, -1), 0.2),
    "point": native.PointLight((0.3, 0.2, 1.0), 0.0, "sphere"),
    "sphere": native.PointLight((0.3, 0.2, 1.0), 0.2, "sphere"),
    "spot": native.SpotLight((0.3, 0.2, 1.0), FRAME, 1.2, 0.5, "scaled", 0.2, "disk"),
    "area": native.AreaLight((0.3, 0.2, 1.0), FRAME, 0.6, 0.4),
    "environment": native.EnvironmentLight(IMAGE, FRAME),
    "mesh": native.MeshLight(0.3 * SQUARE + (0.1, 0, 1), FACES, np.array([(1, 2, 3), (3, 1, 0)], np.float32)),
}
# Lights that the rays of planes are drawn by the cosine of, or by area in place of solid angle.
OTHER_RAYS = ("environment", "mesh")
BALLS = {
    "fine": ball(128, 64),
    "coarse": ball(32, 16),
    "very coarse": ball(8, 4),
    "ico": ico_ball(3),
    "coarse ico": ico_ball(1),
    "flat ico": ico_ball(2, smooth=False),
    "cube": cube(),
}
WORLD = native.EnvironmentLight(np.ones((1, 2, 3), np.float32), FRAME)


def both(light, casters, grid, **options):
    """Irradiance and flow on a plane, and on the same texels as a mesh."""
    return [
        native.gather_rays(receiver, light, casters, seed=1, **options)
        for receiver in (native.ReceiverGrid(**grid), flat(grid).native())
    ]


@pytest.mark.parametrize("name", LIGHTS)
def test_a_flat_mesh_is_lit_as_a_plane(name):
    """Single precision apart; the irradiance of a world is a sum over parts of the sky, right to 5e-4, and its flow has
    the noise of 64 rays, .8 % measured on average.
    """
    grid = make_grid(24, 18, axes=rotation(2), centre=(3, 2, 1))
    (plane, flow), (bent, bent_flow) = both(LIGHTS[name], None, grid, rays=64)
    np.testing.assert_allclose(bent, plane, rtol=6e-4 if name in OTHER_RAYS else 1e-6, atol=1e-6 * plane.max())
    scale = np.linalg.norm(flow, axis=-1).max()
    np.testing.assert_allclose(bent_flow, flow, atol=scale * (0.15 if name in OTHER_RAYS else 1e-5))


@pytest.mark.parametrize("name", LIGHTS)
def test_occluders_shade_a_flat_mesh_as_a_plane(name):
    """Rays start a thousandth of a texel higher: the penumbra of a card moves by less than its noise, 1.3 % of the mean
    for a world and .5 % for others.
    """
    grid = make_grid(32)
    card = occluders((0.25 * SQUARE + (0, 0, 0.4), FACES))
    (plane, _), (bent, _) = both(LIGHTS[name], card, grid, rays=256, even_rays=16)
    assert bent.mean() == pytest.approx(plane.mean(), rel=4e-3)
    assert np.abs(bent - plane).mean() < (0.03 if name in OTHER_RAYS else 3e-3) * plane.mean()


@pytest.mark.parametrize("name", ["wide sun", "area", "mesh", "environment"])
def test_guided_rays_find_a_window(name):
    """Means over a few seeds agree to 4 standard errors, which are below 3 %."""
    walls = [box((-2, -2, 0.3), (-0.06, 2, 0.32)), box((0.02, -2, 0.3), (2, 2, 0.32))]
    walls += [box((-0.06, -2, 0.3), (0.02, -0.1, 0.32)), box((-0.06, 0, 0.3), (0.02, 2, 0.32))]
    grid, casters = make_grid(32, 24), occluders(*walls)
    means = [
        [native.gather_rays(r, LIGHTS[name], casters, rays=128, even_rays=16, seed=s)[0].mean() for s in range(8)]
        for r in (native.ReceiverGrid(**grid), flat(grid).native())
    ]
    error = np.hypot(*np.std(means, axis=1, ddof=1)) / np.sqrt(8)
    plane, bent = np.mean(means, axis=1)
    assert error < 0.03 * plane
    assert abs(bent - plane) < 4 * error


def faces_of(texels):
    face = unit(np.cross(texels.steps_x, texels.steps_y))
    return face * np.sign((face * texels.normals).sum(-1, keepdims=True))


@pytest.mark.parametrize("name", BALLS)
def test_a_ball_under_a_sun_has_its_terminator_and_no_acne(name):
    """E cos(theta) by the shading normal, and nothing from behind the face: exact, so that no ray is lost or gained."""
    texels = texels_of(BALLS[name], 128)
    irradiance, flow = native.gather_rays(texels.native(), LIGHTS["sun"], BALLS[name].occluders())
    cosine = -(texels.normals @ SUN)
    lit = (cosine > 0) & (faces_of(texels) @ SUN < 0)
    np.testing.assert_allclose(irradiance[..., 0], np.where(lit, cosine, 0), atol=1e-6)
    # Light travels along the sun in the frame of each texel.
    up = np.cross(texels.normals, texels.tangents)
    travel = np.stack([texels.tangents @ SUN, up @ SUN, -cosine], -1)
    np.testing.assert_allclose(flow[lit], (cosine[..., None] * travel)[lit], atol=1e-5)
    assert not irradiance[~texels.inside].any()


@pytest.mark.parametrize(("difference", "error"), [(0, 1e-6), (1e-6, 6e-4)])
@pytest.mark.parametrize("name", BALLS)
def test_a_ball_in_an_even_world_receives_pi_everywhere(name, difference, error):
    """pi L less what lies between the horizons of face and shading normal.

    A world of one radiance has pi L to the rounding of floats; of others, a sum over parts of the sky is right to 5e-4.
    """
    texels = texels_of(BALLS[name], 64)
    radiance = np.ones((2, 4, 3), np.float32)
    radiance[0, 0] += difference
    world = native.EnvironmentLight(radiance, FRAME)
    irradiance = native.gather_rays(texels.native(), world, BALLS[name].occluders(), rays=128)[0]
    part = irradiance[texels.inside] / np.pi
    # The cosine-weighted part of a hemisphere above a plane tilted by an angle a: (1 + cos a) / 2.
    above = (1 + (faces_of(texels) * texels.normals).sum(-1)[texels.inside]) / 2
    np.testing.assert_allclose(part.mean(), above.mean(), atol=1e-3)
    assert part.max() < 1 + error
    assert np.abs(part.mean(axis=-1) - above).max() < 0.06  # noise of 128 rays where the face cuts some off


@functools.cache
def bowl_with_texels(columns, size):
    """A half ball that opens downward, and its texels."""
    bowl = ball(columns, columns // 2, inward=True, zenith=np.pi / 2)
    return bowl, texels_of(bowl, size)


@pytest.mark.parametrize(("columns", "size"), [(128, 128), (64, 256), (32, 192), (128, 48)])
@pytest.mark.parametrize("zenith", [0, 40, 70])
def test_a_bowl_shades_itself(columns, size, zenith):
    """Light through the opening of a half ball reaches points whose chord toward the sun leaves the ball above the rim.

    The shadow's border is uncertain by a texel and by the facets of the bowl: 1 % of the light at most.
    """
    bowl, texels = bowl_with_texels(columns, size)
    travel = np.array((np.sin(np.radians(zenith)), 0, np.cos(np.radians(zenith))))
    light = native.gather_rays(texels.native(), native.SunLight(travel, 0.0), bowl.occluders())[0][..., 0]
    entry = texels.positions - 2 * (texels.positions @ travel)[..., None] * travel
    exact = np.where(entry[..., 2] < 0, np.maximum(-(texels.normals @ travel), 0), 0)
    error = (light - exact) * texels.areas
    assert np.abs(error).sum() < 0.015 * (exact * texels.areas).sum()
    assert abs(error.sum()) < 4e-3 * (exact * texels.areas).sum()


def test_a_bowl_in_an_even_world_is_lit_evenly():
    """The opening of a half ball has half of each point's light, exactly: on a ball all form factors are equal."""
    bowl = ball(64, 32, inward=True, zenith=np.pi / 2)
    texels = texels_of(bowl, 64)
    part = native.gather_rays(texels.native(), WORLD, bowl.occluders(), rays=256)[0][texels.inside] / np.pi
    assert part.mean() == pytest.approx(0.5, rel=2e-3)
    assert part.std() < 0.02  # 1.3 % measured, noise of 256 rays


def test_no_light_leaks_into_a_closed_ball():
    room = ball(48, 24, inward=True)
    texels = texels_of(room, 96)
    for light in (LIGHTS["sun"], LIGHTS["wide sun"], native.AreaLight((0, 0, 2.0), FRAME, 1, 1), WORLD):
        assert not native.gather_rays(texels.native(), light, room.occluders(), rays=64)[0].any()


def test_texels_across_a_crease_start_no_ray_behind_the_other_wall():
    """Two walls at right angles: texels that reach through a wall see as much of a sun as the rest."""
    floor = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    wall = np.array([(-1, 1, 0), (1, 1, 0), (1, 1, 1), (-1, 1, 1)], float)
    texels = flat(make_grid(8, 9, size=(2.0, 2.25), centre=(0, 0.125, 0)))  # the last row reaches past the wall
    texels.positions[-1, :, 1] = 0.95
    casters = native.Occluders([native.OccluderMesh(corners, FACES, owners=[1]) for corners in (floor, wall)])
    sun = native.SunLight((0, 0.5, -1), 0.0)  # shines onto the wall
    light = native.gather_rays(texels.native(), sun, casters)[0][..., 0]
    np.testing.assert_allclose(light, light[0, 0], rtol=1e-6)


def test_area_lamps_on_balls_agree_with_rays_one_by_one():
    """Irradiance by a lamp that nothing blocks but the ball itself; 1024 even rays as truth."""
    mesh = ball(64, 32)
    texels = texels_of(mesh, 48)
    lamp = native.AreaLight((0.5, 0.4, 2.0), FRAME, 1.0, 0.5)
    few = native.gather_rays(texels.native(), lamp, mesh.occluders(), rays=128, even_rays=16)[0]
    many = native.gather_rays(texels.native(), lamp, mesh.occluders(), rays=1024, seed=5)[0]
    assert np.abs(few - many).mean() < 2e-3 * many.mean()


def test_same_bits_for_any_number_of_threads():
    texels = texels_of(BALLS["coarse"], 40)
    casters = BALLS["coarse"].occluders(box((1.1, -1, -1), (1.2, 1, 1)))
    for light in LIGHTS.values():
        one, three = (
            native.gather_rays(texels.native(), light, casters, rays=24, even_rays=8, threads=threads)
            for threads in (1, 3)
        )
        for a, b in zip(one, three):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("positions", np.zeros((2, 3, 2))),
        ("positions", np.full((2, 3, 3), np.inf)),
        ("steps_x", np.zeros((2, 3, 3), np.float32)),
        ("steps_y", np.zeros((2, 3, 3))),
        ("normals", np.full((2, 3, 3), 2, np.float32)),
        ("normals", np.zeros((2, 2, 3), np.float32)),
        ("tangents", np.broadcast_to(np.float32((0, 0, 1)), (2, 3, 3)).copy()),
        ("areas", np.full((2, 3), -1, np.float32)),
    ],
)
def test_bad_arguments_are_named(name, values):
    texels = Texels(**{**vars(flat(make_grid(3, 2))), name: values})
    with pytest.raises(ValueError, match=f"'?{name}"):
        texels.native()
