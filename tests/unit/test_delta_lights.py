"""Lamps without a size against a ray caster in numpy, and against geometry."""

import math

import numpy as np
import pytest
from beamspread.core.native import native
from hypothesis import example, given, settings
from hypothesis import strategies as st

from helpers import gather_beams
from shapes import FACES, box, cast, make_grid, occluders, points_of, rotation, soup

PI = math.pi


def gather(grid, light, casters=None, **options):
    """Irradiance and direction."""
    return gather_beams(native.ReceiverGrid(**grid), light, casters, **options)


def lamp_at(points, position):
    """Direction of travel, flux on a facing square metre for 1 W, distance."""
    way = points - position
    distance = np.linalg.norm(way, axis=-1)
    return way / distance[..., None], 1 / (4 * PI * distance**2), distance


@settings(max_examples=50, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    samples=st.integers(1, 4),
    count=st.integers(0, 12),
    is_mirrored=st.booleans(),
    is_sun=st.booleans(),
)
def test_irradiance_and_direction_equal_brute_force(seed, samples, count, is_mirrored, is_sun):
    """In single precision, wherever no ray passes an edge within rounding."""
    axes, centre, rng = rotation(seed), np.array([-0.4, 0.9, 2.0]), np.random.default_rng(seed)
    if is_mirrored:
        axes[0] *= -1
    grid = make_grid(8, 6, (2.0, 1.5), axes, centre)
    middle = rng.uniform([-1.2, -1, 0.1], [1.2, 1, 1.5], (count, 1, 3))
    local = middle + rng.normal(0, 0.3, (count, 3, 3))
    local[..., 2] = np.abs(local[..., 2]) + 0.02
    mesh = soup(local.reshape(-1, 3) @ axes + centre)
    points = points_of(grid, samples)
    if is_sun:
        way = np.array([0.5, -0.4, -1.0]) @ axes
        light = native.SunLight(3 * way)
        travel, flux, distance = np.broadcast_to(way / np.linalg.norm(way), points.shape), 1.0, np.inf
    else:
        position = np.array([0.2, -0.3, 0.8]) @ axes + centre
        light = native.PointLight(position)
        travel, flux, distance = lamp_at(points, position)
    irradiance, direction = gather(grid, light, occluders(mesh), samples=samples)
    crossed, doubt = cast(points, -travel, distance, *mesh)
    arriving = np.where(crossed.any(0), 0, flux * np.maximum(0, -travel @ axes[2]))
    flow = (arriving[..., None] * travel).sum(2) @ axes.T
    sure = ~(doubt < 1e-4).any(2)
    assert sure.mean() > 0.8
    assert irradiance.dtype == np.float32
    np.testing.assert_allclose(irradiance[sure], arriving.mean(2)[sure], rtol=2e-6, atol=1e-7)
    lit = sure & arriving.any(2)
    expected = flow[lit] / np.linalg.norm(flow[lit], axis=-1, keepdims=True)
    np.testing.assert_allclose(direction[lit], expected, rtol=2e-6, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1, atol=1e-6)
    assert (direction[..., 2] < 0).all()


@pytest.mark.parametrize("sun", [(1, 0, -1), (-1, 0, -1), (0, 1, -1), (0, -1, -1), None])
def test_rays_keep_clear_of_the_plane_and_of_the_lamp(sun):
    clearance, lamp = 0.05, np.array([0.0, 0.0, 1.0])
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0.1]])
    grid = make_grid(150, 110, (2.0, 1.5))
    # Rays to a lamp end 0.05 from it, so that of two squares the nearer one, though it is wide, blocks none.
    near_lamp = [square * (2, 2, 0) - (1, 1, -0.97), 0.3 * square - (0.2, 0.3, -0.5)]
    corners = [square - (0.5, 0.4, -0.5)] if sun else near_lamp
    vertices = np.concatenate(corners)
    triangles = (np.array([[0, 1, 2], [0, 2, 3]]) + np.arange(0, len(vertices), 4)[:, None, None]).reshape(-1, 3)
    mesh = vertices, triangles.astype(np.uint32)
    light = native.SunLight(sun) if sun else native.PointLight(lamp)
    got, _ = gather(grid, light, occluders(mesh), samples=1, clearance=clearance)
    points = points_of(grid, 1)[:, :, 0] + (0, 0, clearance)
    if sun:
        travel, distance = np.broadcast_to(sun, points.shape) / math.sqrt(2), np.full(points.shape[:2], 1e3)
    else:
        travel, _, distance = lamp_at(points, lamp)
    crossed, doubt = cast(points, -travel, distance - clearance, *mesh)
    blocked = crossed.any(0)
    assert (doubt > 1e-3).mean() > 0.95
    assert 0.05 < blocked.mean() < 0.5
    np.testing.assert_array_equal((got == 0)[doubt > 1e-3], blocked[doubt > 1e-3])


def spot_falloff(travel, frame, size, blend, falloff):
    """Falloff of Cycles in Blender 3.4 ("legacy") and in 4.2 to 5.0 ("scaled")."""
    frame = np.asarray(frame, float)
    if falloff == "legacy":
        cosine = -travel @ (frame[2] / np.linalg.norm(frame[2]))
    else:
        local = travel @ np.linalg.inv(frame)
        cosine = -local[..., 2] / np.linalg.norm(local, axis=-1)
    border = (1 - math.cos(size / 2)) * blend
    t = (cosine - math.cos(size / 2)) / border if border else np.where(cosine > math.cos(size / 2), 1.0, 0.0)
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t) * (cosine if falloff == "legacy" else 1)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    scale=st.tuples(*[st.floats(0.3, 3)] * 3),
    shear=st.booleans(),
    size=st.floats(0.2, PI),
    blend=st.sampled_from([0.0, 0.15, 0.5, 1.0]),
    falloff=st.sampled_from(["scaled", "legacy"]),
)
@example(seed=0, scale=(1, 1, 1), shear=False, size=PI, blend=0.0, falloff="scaled")  # all of the half space
def test_spot_follows_its_formula(seed, scale, shear, size, blend, falloff):
    frame = np.diag(scale) @ rotation(seed)
    if shear:
        frame = frame @ np.array([[1, 0.3, 0], [0, 1, 0], [0.2, 0, 1]])
    grid = make_grid(20, size=(3, 3))
    position = np.array([0.1, 0.2, 1.0])
    irradiance, direction = gather(grid, native.SpotLight(position, frame, size, blend, falloff), samples=1)
    points = points_of(grid, 1)
    travel, flux, _ = lamp_at(points, position)
    factor = spot_falloff(travel, frame, size, blend, falloff)
    np.testing.assert_allclose(irradiance, (flux * factor * -travel[..., 2])[..., 0], rtol=1e-5, atol=1e-8)
    lit = irradiance > 0
    np.testing.assert_allclose(direction[lit], travel[:, :, 0][lit], atol=1e-6)


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 7])
def test_light_is_sampled_without_bias(samples):
    # The mean over a texel of a function linear in position is its value at the centre.
    wall = occluders((np.array([[0, -9, 1], [9, -9, 1], [9, 9, 1], [0, 9, 1]], float), FACES))
    grid = make_grid(1, size=(1, 1))
    for shift in np.linspace(-0.45, 0.45, 10):
        lit = gather(grid, native.SunLight((-shift, 0, -1)), wall, samples=samples)[0][0, 0]
        visible = lit * math.hypot(shift, 1)
        assert visible == pytest.approx(0.5 - shift, abs=0.5 / samples**2 + 1e-5)


@pytest.mark.parametrize(("height", "is_blocked"), [(0.5, False), (1.0, False), (1.5, True)])
def test_a_ceiling_blocks_only_lamps_above_it(height, is_blocked):
    """A lamp that touches the ceiling from below is not blocked."""
    grid, lamp = make_grid(), native.PointLight((0, 0, height))
    below, bare = (gather(grid, lamp, casters)[0] for casters in (occluders(box((-5, -5, 1.0), (5, 5, 1.1))), None))
    np.testing.assert_array_equal(below, 0 * bare if is_blocked else bare)


@pytest.mark.parametrize("height", [0.0, -1.0])
def test_light_from_behind_or_within_the_plane_is_none(height):
    grid = make_grid()
    assert not gather(grid, native.PointLight((0.01, 0.02, height)))[0].any()
    assert not gather(grid, native.SunLight((0, 0.1, -height)))[0].any()


@pytest.mark.parametrize("lamp", [native.PointLight((0.5, 0.5, 0)), native.SpotLight((0.5, 0.5, 0), np.eye(3), 1, 0)])
def test_a_lamp_exactly_at_a_sampled_point_gives_numbers(lamp):
    assert all(np.isfinite(values).all() for values in gather(make_grid(2), lamp, samples=1))


@pytest.mark.parametrize("stop_at", [0.0, 0.3, 1.0])
def test_cancel_at_start_middle_and_end_then_run_again(stop_at):
    grid, seen = make_grid(256), []
    cube = occluders(box((-0.1, -0.1, 0.3), (0.1, 0.1, 0.5)))

    def progress(fraction):
        seen.append(fraction)
        return fraction < stop_at

    arguments, options = (grid, native.SunLight((0.2, 0, -1)), cube), {"samples": 16, "threads": 1}
    with pytest.raises(native.Cancelled):
        gather(*arguments, **options, progress=progress)
    assert seen == sorted(seen)
    assert 0 <= seen[-1] <= 1
    assert all(fraction < stop_at for fraction in seen[:-1])
    again, _ = gather(*arguments, **options, progress=lambda fraction: True)
    np.testing.assert_array_equal(again, gather(*arguments, **options)[0])


def test_errors_in_the_callback_reach_the_caller():
    def progress(fraction):
        raise KeyError("from the callback")

    with pytest.raises(KeyError, match="from the callback"):
        gather(make_grid(), native.SunLight((0, 0, -1)), progress=progress)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"origin": (0, math.nan, 0)}, "origin.*nan"),
        ({"origin": (0, 0)}, r"origin.*\(2,\).*3 numbers"),
        ({"x_axis": (2, 0, 0)}, r"x_axis.*\(2, 0, 0\).*unit vector"),
        ({"y_axis": (1, 0, 0)}, "y_axis.*right angles"),
        ({"normal": (0, 0.6, 0.8)}, "normal.*right angles"),
        ({"pitch_x": 0.0}, "pitch_x.*0.*> 0"),
        ({"pitch_y": math.inf}, "pitch_y"),
        ({"width": 0}, "width.*1 to 65536"),
        ({"height": -1}, "height"),
        ({"width": 65537}, "width.*65537"),
        ({"samples": 0}, "samples.*0.*1 to 64"),
        ({"samples": 65}, "samples.*65"),
        ({"threads": -1}, "threads.*-1"),
        ({"clearance": -1.0}, "clearance.*-1.*>= 0"),
        ({"clearance": math.inf}, "clearance"),
    ],
)
def test_bad_arguments_are_named(change, message):
    grid, options = make_grid(), {"samples": 4, "threads": 0, "clearance": 0.0}
    with pytest.raises(ValueError, match=message):
        gather(
            {name: change.get(name, value) for name, value in grid.items()},
            native.SunLight((0, 0, -1)),
            **{name: change.get(name, value) for name, value in options.items()},
        )


@pytest.mark.parametrize("place", [(4.0, 4.0, 17.0), (0.2, 7.7, 17.0)])
def test_few_points_tell_the_mean_of_a_lamp_far_away(place):
    """From 16 texels on: the Gauss rule against the mean of 64 x 64 points, known to (1 / 64 / 17)^2 = 1e-6."""
    grid = native.ReceiverGrid((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 1.0, 1.0, 40, 8)
    irradiance, _ = gather_beams(grid, native.PointLight(place))
    x, y = ((np.arange(64 * count) + 0.5) / 64 for count in (40, 8))
    distance = np.sqrt((x - place[0]) ** 2 + (y[:, None] - place[1]) ** 2 + place[2] ** 2)
    mean = (place[2] / (4 * np.pi * distance**3)).reshape(8, 64, 40, 64).mean((1, 3))
    np.testing.assert_allclose(irradiance, mean, rtol=2e-6)
