"""Lamps without a size against a ray caster in numpy, and against geometry."""

import math

import numpy as np
import pytest
from beamspread.core.native import native
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import gather_beams, travel

PI = math.pi


def rotation(seed):
    """A random rotation: rows are three axes."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def make_grid(width=8, height=6, size=(2.0, 1.5), axes=None, centre=(0, 0, 0)):
    """Arguments of a ReceiverGrid for a rectangle around `centre`."""
    axes = np.eye(3) if axes is None else axes
    pitch = size[0] / width, size[1] / height
    return {
        "origin": np.asarray(centre) - axes[0] * size[0] / 2 - axes[1] * size[1] / 2,
        "x_axis": axes[0],
        "y_axis": axes[1],
        "normal": axes[2],
        "pitch_x": pitch[0],
        "pitch_y": pitch[1],
        "width": width,
        "height": height,
    }


def gather(grid, light, occluders=None, **options):
    """Irradiance and direction."""
    return gather_beams(native.ReceiverGrid(**grid), light, occluders, **options)


def points_of(grid, samples):
    """World positions (H, W, samples^2, 3) of the points where the light is sampled."""
    j, i = np.divmod(np.arange(samples**2), samples)
    sub_x, sub_y = (i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples
    x = (np.arange(grid["width"])[None, :, None] + sub_x) * grid["pitch_x"]
    y = (np.arange(grid["height"])[:, None, None] + sub_y) * grid["pitch_y"]
    return grid["origin"] + x[..., None] * grid["x_axis"] + y[..., None] * grid["y_axis"]


def cast(origins, directions, distances, vertices, triangles):
    """Whether a triangle lies on each ray, by Moeller and Trumbore; and how near to an edge of one the ray passes."""
    blocked, doubt = np.zeros(origins.shape[:-1], bool), np.full(origins.shape[:-1], np.inf)
    for a, b, c in vertices.astype(float)[triangles]:
        p = np.cross(directions, c - a)
        det = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((origins - a) * p).sum(-1) / det
            q = np.cross(origins - a, b - a)
            v = (q * directions).sum(-1) / det
            t = q @ (c - a) / det
        inside = np.minimum(np.minimum(u, v), 1 - u - v)
        ahead = np.minimum(t, distances - t)
        blocked |= (inside > 0) & (ahead > 0)
        doubt = np.fmin(doubt, np.maximum(np.abs(np.fmin(inside, ahead)), 0))
    return blocked, doubt


def lamp_at(points, position):
    """Direction of travel, flux on a facing square metre for 1 W, distance."""
    way = points - position
    distance = np.linalg.norm(way, axis=-1)
    return way / distance[..., None], 1 / (4 * PI * distance**2), distance


def expected_beams(grid, samples, travel, flux, distance, vertices, triangles):
    """Irradiance, direction and how many points of each texel are in doubt."""
    points = points_of(grid, samples)
    axes = np.array([grid["x_axis"], grid["y_axis"], grid["normal"]])
    cosine = np.maximum(0, -travel @ axes[2])
    blocked, doubt = cast(points, -travel, distance, vertices, triangles)
    light = np.where(blocked, 0, flux * cosine)
    flow = (light[..., None] * travel).sum(2) @ axes.T
    with np.errstate(invalid="ignore"):
        direction = flow / np.linalg.norm(flow, axis=-1, keepdims=True)
    doubtful = (doubt < 1e-4).any(2)
    assert doubtful.mean() < 0.2
    return light.mean(2), direction, doubtful


def random_triangles(seed, count, axes, centre):
    """Triangles above a plane."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform([-1.2, -1, 0.1], [1.2, 1, 1.5], (count, 1, 3))
    local = middle + rng.normal(0, 0.3, (count, 3, 3))
    local[..., 2] = np.abs(local[..., 2]) + 0.02
    vertices = local.reshape(-1, 3) @ axes + centre
    return vertices, np.arange(3 * count, dtype=np.uint32).reshape(count, 3)


def assert_close(got, wanted, doubtful):
    """Equal to single precision wherever no ray passes an edge within rounding."""
    np.testing.assert_allclose(got[~doubtful], wanted[~doubtful], rtol=2e-6, atol=1e-7)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), samples=st.integers(1, 4), count=st.integers(0, 12))
def test_sun_equals_brute_force(seed, samples, count):
    axes, centre = rotation(seed), np.array([0.3, -0.2, 0.1])
    grid = make_grid(axes=axes, centre=centre)
    vertices, triangles = random_triangles(seed, count, axes, centre)
    travel = np.array([0.5, -0.4, -1.0]) @ axes
    got, direction = gather(
        grid, native.SunLight(3 * travel), native.Occluders([native.OccluderMesh(vertices, triangles)]), samples=samples
    )
    lit = got > 0
    expected = np.broadcast_to(axes @ travel / np.linalg.norm(travel), direction.shape)
    np.testing.assert_allclose(direction[lit], expected[lit], rtol=2e-6)
    travel = np.broadcast_to(travel / np.linalg.norm(travel), (*got.shape, samples**2, 3))
    wanted, _, doubtful = expected_beams(grid, samples, travel, 1.0, np.inf, vertices, triangles)
    assert got.dtype == np.float32
    assert_close(got, wanted, doubtful)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), samples=st.integers(1, 4), count=st.integers(0, 12), mirrored=st.booleans())
def test_point_equals_brute_force(seed, samples, count, mirrored):
    axes, centre = rotation(seed), np.array([-0.4, 0.9, 2.0])
    if mirrored:
        axes[0] *= -1
    grid = make_grid(axes=axes, centre=centre)
    vertices, triangles = random_triangles(seed, count, axes, centre)
    position = np.array([0.2, -0.3, 0.8]) @ axes + centre
    irradiance, direction = gather(
        grid, native.PointLight(position), native.Occluders([native.OccluderMesh(vertices, triangles)]), samples=samples
    )
    light = lamp_at(points_of(grid, samples), position)
    wanted, wanted_direction, doubtful = expected_beams(grid, samples, *light, vertices, triangles)
    assert_close(irradiance, wanted, doubtful)
    dark = wanted == 0
    assert_close(direction, wanted_direction, doubtful | dark)
    np.testing.assert_allclose(np.linalg.norm(direction, axis=-1), 1, atol=1e-6)
    assert (direction[..., 2] < 0).all()


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    count=st.integers(1, 40),
    size=st.sampled_from([0.01, 0.1, 1.0]),
    slant=st.sampled_from([-1.0, 0.0, 1.0, 30.0]),
    lamp_height=st.sampled_from([None, 0.1, 1.0, 5.0]),
    clearance=st.sampled_from([0.0, 0.05]),
    samples=st.sampled_from([1, 4]),
    at_origin=st.booleans(),
    far=st.sampled_from([1, 1e4]),
)
def test_texels_that_need_no_rays_are_as_if_traced(
    seed, count, size, slant, lamp_height, clearance, samples, at_origin, far
):
    axes, centre, rng = rotation(seed), far * np.array([30.0, -20.0, 10.0]), np.random.default_rng(seed)
    origin = (0, 0, 0) if at_origin else centre
    grid = make_grid(width=150, height=110, axes=axes, centre=centre)
    # Some triangles cut the plane, lie behind it, or beyond the lamp.
    middle = rng.uniform([-1.5, -1.2, -0.3], [1.5, 1.2, 1.5], (count, 1, 3))
    local = (middle + rng.normal(0, size, (count, 3, 3))).reshape(-1, 3)
    # Rounded by more than the grid's own triangles: its shadow's border is known less well.
    beyond = 3000 * (np.array([slant, 0.3, 1.0]) + [(0, 0, 0), (0.0003, 0, 0), (0, 0.0003, 0)])
    vertices = np.concatenate([local, beyond]) @ axes + centre
    occluders = native.Occluders(
        [native.OccluderMesh(vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3))], origin
    )
    if lamp_height is None:
        light = native.SunLight(np.array([-slant, -0.3, -1.0]) @ axes)
    else:
        light = native.PointLight(np.array([0.1 * slant, 0.2, lamp_height]) @ axes + centre)
    options = {"samples": samples, "clearance": clearance}
    found, traced = (gather(grid, light, occluders, find_shadows=find, **options) for find in (True, False))
    np.testing.assert_array_equal(found[0], traced[0])
    np.testing.assert_array_equal(found[1], traced[1])


@pytest.mark.parametrize("sun", [(1, 0, -1), (-1, 0, -1), (0, 1, -1), (0, -1, -1), None])
def test_rays_keep_clear_of_the_plane_and_of_the_lamp(sun):
    clearance, lamp = 0.05, np.array([0.0, 0.0, 1.0])
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0.1]])
    grid = make_grid(150, 110)
    # Rays to a lamp end 0.05 from it, so that of two squares the nearer one, though it is wide, blocks none.
    near_lamp = [square * (2, 2, 0) - (1, 1, -0.97), 0.3 * square - (0.2, 0.3, -0.5)]
    corners = [square - (0.5, 0.4, -0.5)] if sun else near_lamp
    vertices = np.concatenate(corners)
    triangles = (np.array([[0, 1, 2], [0, 2, 3]]) + np.arange(0, len(vertices), 4)[:, None, None]).reshape(-1, 3)
    triangles = triangles.astype(np.uint32)
    light = native.SunLight(sun) if sun else native.PointLight(lamp)
    got, _ = gather(
        grid, light, native.Occluders([native.OccluderMesh(vertices, triangles)]), samples=1, clearance=clearance
    )
    points = points_of(grid, 1)[:, :, 0] + (0, 0, clearance)
    if sun:
        travel, distance = np.broadcast_to(sun, points.shape) / math.sqrt(2), np.full(points.shape[:2], 1e3)
    else:
        travel, _, distance = lamp_at(points, lamp)
    blocked, doubt = cast(points, -travel, distance - clearance, vertices, triangles)
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
def test_spot_follows_its_formula(seed, scale, shear, size, blend, falloff):
    frame = np.diag(scale) @ rotation(seed)
    if shear:
        frame = frame @ np.array([[1, 0.3, 0], [0, 1, 0], [0.2, 0, 1]])
    grid = make_grid(20, 20, (3, 3))
    position = np.array([0.1, 0.2, 1.0])
    irradiance, direction = gather(grid, native.SpotLight(position, frame, size, blend, falloff), samples=1)
    points = points_of(grid, 1)
    travel, flux, _ = lamp_at(points, position)
    factor = spot_falloff(travel, frame, size, blend, falloff)
    np.testing.assert_allclose(irradiance, (flux * factor * -travel[..., 2])[..., 0], rtol=1e-5, atol=1e-8)
    lit = irradiance > 0
    np.testing.assert_allclose(direction[lit], travel[:, :, 0][lit], atol=1e-6)


def test_spot_with_a_full_half_space_is_a_point_light_in_front():
    grid = make_grid()
    place = (0.3, 0.2, 0.9)
    spot, direction = gather(grid, native.SpotLight(place, np.eye(3), PI, 0.0))
    point, point_direction = gather(grid, native.PointLight(place))
    np.testing.assert_array_equal(spot, point)
    np.testing.assert_array_equal(direction, point_direction)
    away, _ = gather(grid, native.SpotLight(place, np.diag([1, 1, -1]), PI, 0.0))
    assert not away.any()


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 7])
def test_light_is_sampled_without_bias(samples):
    # The mean over a texel of a function linear in position is its value at the centre.
    vertices = np.array([[0, -9, 1], [9, -9, 1], [9, 9, 1], [0, 9, 1]], float)
    occluders = native.Occluders([native.OccluderMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))])
    grid = make_grid(1, 1, (1, 1))
    for shift in np.linspace(-0.45, 0.45, 10):
        lit = gather(grid, native.SunLight((-shift, 0, -1)), occluders, samples=samples)[0][0, 0]
        visible = lit * math.hypot(shift, 1)
        assert visible == pytest.approx(0.5 - shift, abs=0.5 / samples**2 + 1e-5)


def plane_triangles(grid, margin=1.0):
    """The receiver itself as an occluder, larger than the grid by a factor."""
    size = np.array([grid["width"] * grid["pitch_x"], grid["height"] * grid["pitch_y"]])
    x, y = np.asarray(grid["x_axis"]) * size[0], np.asarray(grid["y_axis"]) * size[1]
    low, high = (1 - margin) / 2, (1 + margin) / 2
    corners = [grid["origin"] + a * x + b * y for a, b in ((low, low), (high, low), (high, high), (low, high))]
    return np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    size=st.sampled_from([1e-3, 0.1, 1.0, 30.0, 1e4]),
    distance=st.sampled_from([0.0, 1.0, 100.0, 1e4]),
    angle=st.sampled_from([0.0, 45.0, 80.0, 89.0, 89.9]),
    margin=st.sampled_from([1.0, 3.0]),
)
def test_a_plane_does_not_shadow_itself(seed, size, distance, angle, margin):
    axes = rotation(seed)
    centre = distance * size * np.random.default_rng(seed).normal(size=3)
    grid = make_grid(16, 16, (size, 0.7 * size), axes, centre)
    occluders = native.Occluders([native.OccluderMesh(*plane_triangles(grid, margin))])
    local = travel(angle, seed % 360)
    lit, _ = gather(grid, native.SunLight(local @ axes), occluders, samples=2)
    np.testing.assert_allclose(lit, -local[2], rtol=1e-6)
    position = centre - local @ axes * 3 * size
    _, flux, _ = lamp_at(points_of(grid, 2), position)
    got, _ = gather(grid, native.PointLight(position), occluders, samples=2)
    unblocked, _ = gather(grid, native.PointLight(position), samples=2)
    np.testing.assert_array_equal(got, unblocked)
    assert flux.min() > 0


def test_clearance_keeps_an_uneven_plane_from_shadowing_itself():
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1, 9))
    z = 1e-4 * np.random.default_rng(1).uniform(-1, 1, x.shape)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = [(corner, corner + 1, corner + 10), (corner, corner + 10, corner + 9)]
    occluders = native.Occluders(
        [
            native.OccluderMesh(
                np.stack([x, y, z], -1).reshape(-1, 3),
                np.concatenate([np.stack(face, 1) for face in faces]).astype(np.uint32),
            )
        ]
    )
    arguments = make_grid(30, 30, (1.9, 1.9)), native.SunLight((1, 0, -1)), occluders
    assert (gather(*arguments)[0] == 0).any()
    np.testing.assert_allclose(gather(*arguments, clearance=1.1e-4)[0], math.sqrt(0.5), rtol=1e-6)


def box(low, high):
    """Vertices and triangles of an axis-aligned box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    vertices = np.asarray(low) + corners * (np.asarray(high) - low)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)


@pytest.mark.parametrize("bottom", [0.0, -0.1])
def test_no_light_leaks_under_a_box_on_the_plane(bottom):
    grid = make_grid(40, 40, (2, 2))
    occluders = native.Occluders([native.OccluderMesh(*box((-0.5, -0.5, bottom), (0.5, 0.5, 0.4)))])
    lit, _ = gather(grid, native.SunLight((1, 0, -0.5)), occluders, samples=4)
    # The box spans texels 10 to 29 in both directions; its shadow reaches 0.8 further, beyond the grid's border.
    shadow = np.zeros((40, 40), bool)
    shadow[10:30, 10:] = True
    assert not lit[shadow].any()
    np.testing.assert_allclose(lit[~shadow], 0.5 / math.hypot(1, 0.5), rtol=1e-6)


def test_shadow_falls_the_way_the_light_travels():
    grid = make_grid(64, 64, (2, 2))
    occluders = native.Occluders([native.OccluderMesh(*box((-0.1, -0.1, 0.3), (0.1, 0.1, 0.5)))])
    x, y = (np.arange(64) + 0.5) / 32 - 1, (np.arange(64)[:, None] + 0.5) / 32 - 1
    for direction in ((1, 0, -1), (0, 1, -1), (-1, 0.5, -1)):
        lit, _ = gather(grid, native.SunLight(direction), occluders)
        dark = lit.max() - lit
        middle = (dark * x).sum() / dark.sum(), (dark * y).sum() / dark.sum()
        np.testing.assert_allclose(middle, 0.4 * np.array(direction[:2]), atol=0.02)


def test_lamp_between_the_plane_and_an_occluder_is_not_blocked():
    grid = make_grid()
    ceiling = box((-5, -5, 1.0), (5, 5, 1.1))
    lamp, _ = gather(grid, native.PointLight((0, 0, 0.5)), native.Occluders([native.OccluderMesh(*ceiling)]))
    bare, _ = gather(grid, native.PointLight((0, 0, 0.5)))
    np.testing.assert_array_equal(lamp, bare)
    touching, _ = gather(grid, native.PointLight((0, 0, 1.0)), native.Occluders([native.OccluderMesh(*ceiling)]))
    np.testing.assert_array_equal(touching, gather(grid, native.PointLight((0, 0, 1.0)))[0])
    above, _ = gather(grid, native.PointLight((0, 0, 1.5)), native.Occluders([native.OccluderMesh(*ceiling)]))
    assert not above.any()


@pytest.mark.parametrize("height", [0.0, -1.0])
def test_light_from_behind_or_within_the_plane_is_none(height):
    grid = make_grid()
    assert not gather(grid, native.PointLight((0.01, 0.02, height)))[0].any()
    assert not gather(grid, native.SunLight((0, 0.1, -height)))[0].any()


def test_lamp_exactly_at_a_sampled_point_gives_numbers():
    grid = make_grid(2, 2, (2, 2))
    irradiance, direction = gather(grid, native.PointLight((0.5, 0.5, 0.0)), samples=1)
    assert np.isfinite(irradiance).all()
    assert np.isfinite(direction).all()
    spot, _ = gather(grid, native.SpotLight((0.5, 0.5, 0.0), np.eye(3), 1, 0), samples=1)
    assert np.isfinite(spot).all()


def test_every_number_of_threads_gives_the_same_bits():
    axes = rotation(5)
    grid = make_grid(37, 41, axes=axes)
    occluders = native.Occluders([native.OccluderMesh(*random_triangles(5, 40, axes, 0))])
    position = np.array([0.2, 0.1, 1.0]) @ axes
    one, *more = [gather(grid, native.PointLight(position), occluders, threads=n) for n in (1, 2, 7, 0)]
    for other in more:
        np.testing.assert_array_equal(one[0].view(np.uint32), other[0].view(np.uint32))
        np.testing.assert_array_equal(one[1].view(np.uint32), other[1].view(np.uint32))


@pytest.mark.parametrize("stop_at", [0.0, 0.3, 1.0])
def test_cancel_at_start_middle_and_end_then_run_again(stop_at):
    grid = make_grid(256, 256)
    occluders = native.Occluders([native.OccluderMesh(*box((-0.1, -0.1, 0.3), (0.1, 0.1, 0.5)))])
    seen = []

    def progress(fraction):
        seen.append(fraction)
        return fraction < stop_at

    arguments, options = (grid, native.SunLight((0.2, 0, -1)), occluders), {"samples": 16, "threads": 1}
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
        ({"position": (0, math.inf, 1)}, "position"),
        ({"frame": np.zeros((3, 3))}, "frame.*singular"),
        ({"frame": np.eye(2)}, r"frame.*3 x 3"),
        ({"spot_size": 0.0}, "spot_size"),
        ({"spot_size": 3.2}, "spot_size.*3.2.*pi"),
        ({"blend": 1.1}, "blend.*1.1.*0 to 1"),
        ({"falloff": "eevee"}, "falloff.*'eevee'.*'scaled', 'legacy'"),
    ],
)
def test_bad_arguments_are_named(change, message):
    def chosen(**values):
        return {name: change.get(name, value) for name, value in values.items()}

    lamp = {"position": (0, 0, 1), "frame": np.eye(3), "spot_size": 1.0, "blend": 0.1, "falloff": "scaled"}
    with pytest.raises(ValueError, match=message):
        gather(chosen(**make_grid()), native.SpotLight(**chosen(**lamp)), **chosen(samples=4, threads=0, clearance=0.0))


@pytest.mark.parametrize("direction", [(0, 0, 0), (0, 0, math.inf), (math.nan, 0, 1)])
def test_bad_sun_directions(direction):
    with pytest.raises(ValueError, match="direction"):
        native.SunLight(direction)


@pytest.mark.parametrize("place", [(4.0, 4.0, 17.0), (0.2, 7.7, 17.0)])
def test_few_points_tell_the_mean_of_a_lamp_far_away(place):
    """From 16 texels on: the Gauss rule against the mean of 64 x 64 points, known to (1 / 64 / 17)^2 = 1e-6."""
    grid = native.ReceiverGrid((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 1.0, 1.0, 40, 8)
    irradiance, _ = gather_beams(grid, native.PointLight(place))
    x, y = ((np.arange(64 * count) + 0.5) / 64 for count in (40, 8))
    distance = np.sqrt((x - place[0]) ** 2 + (y[:, None] - place[1]) ** 2 + place[2] ** 2)
    mean = (place[2] / (4 * np.pi * distance**3)).reshape(8, 64, 40, 64).mean((1, 3))
    np.testing.assert_allclose(irradiance, mean, rtol=2e-6)
