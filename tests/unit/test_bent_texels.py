"""Texels of bent meshes against clipping each triangle at each texel."""

import time

import numpy as np
import pytest
from beamspread.core.native import native

from clipping import area, clip

# Rounding of float32 results, relative to values around 1.
FLOAT32 = 3e-7


def ball(rings, columns, radius=1.0):
    """Triangles of a ball, mapped by longitude and sine of the latitude: corners (M, 3, 3), UVs (M, 3, 2), normals."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rings + 1))
    azimuth, height = 2 * np.pi * u, 2 * v - 1
    across = np.sqrt(np.maximum(1 - height**2, 0))
    points = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), height], -1)
    uvs = np.stack([u, v], -1)

    def triangles(values):
        a, b, c, d = values[:-1, :-1], values[:-1, 1:], values[1:, 1:], values[1:, :-1]
        return np.concatenate([np.stack([a, b, c], -2), np.stack([a, c, d], -2)]).reshape(-1, 3, values.shape[-1])

    return radius * triangles(points), triangles(uvs), triangles(points)


def texels_of(positions, uvs, normals, width, height, **options):
    flat = [np.ascontiguousarray(values.reshape(-1, values.shape[-1])) for values in (uvs, positions)]
    normals = None if normals is None else np.ascontiguousarray(normals.reshape(-1, 3), np.float32)
    return native.bent_texels(*flat, normals, width, height, **options)


def parts(triangle, x, y):
    """Area and centroid of the part of a triangle (3, 2) in a texel."""
    polygon = [np.asarray(corner, float) for corner in triangle]
    for axis, bound, sign in ((0, x, 1), (0, x + 1, -1), (1, y, 1), (1, y + 1, -1)):
        polygon = clip(polygon, axis, bound, sign)
    if len(polygon) < 3:
        return 0.0, np.zeros(2)
    total, first = 0.0, np.zeros(2)
    for a, b in zip(polygon[1:], polygon[2:]):
        piece = abs(area([polygon[0], a, b]))
        total, first = total + piece, first + piece * (polygon[0] + a + b) / 3
    return total, first / total if total else first


def test_each_texel_has_the_area_and_the_centroid_of_an_independent_clip():
    rng = np.random.default_rng(3)
    width, height = 9, 7
    uvs = rng.uniform(-1.5, 1.5, (12, 3, 2)) + rng.uniform(0, 8, (12, 1, 2))
    positions = rng.normal(size=(12, 3, 3))
    result = texels_of(positions, uvs, None, width, height)
    sides = positions[:, 1:] - positions[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1])
    ratios = 0.5 * np.linalg.norm(normals, axis=1) / [abs(area(uv)) for uv in uvs]
    for y in range(height):
        for x in range(width):
            pieces = [parts(uv, x, y) for uv in uvs]
            fractions = np.array([piece for piece, _ in pieces])
            assert result["covered"][y, x] == pytest.approx(fractions.sum(), abs=1e-6)
            assert result["areas"][y, x] == pytest.approx(fractions @ ratios, rel=1e-6, abs=1e-12)
            number = result["triangles"][y, x]
            if not fractions.any():
                assert number == -1
                continue
            centroid = sum(piece * at for piece, at in pieces) / fractions.sum()
            weights = np.linalg.solve(np.vstack([uvs[number].T, np.ones(3)]), [*centroid, 1])
            if weights.min() < 0:  # it lies in no triangle
                assert number == fractions.argmax()
                weights = np.linalg.solve(np.vstack([uvs[number].T, np.ones(3)]), [*pieces[number][1], 1])
            np.testing.assert_allclose(result["positions"][y, x], weights @ positions[number], atol=1e-7)
            np.testing.assert_allclose(
                result["normals"][y, x], normals[number] / np.linalg.norm(normals[number]), atol=FLOAT32
            )


def test_areas_add_up_to_that_of_the_mesh_at_any_resolution():
    positions, uvs, normals = ball(40, 80)
    sides = positions[:, 1:] - positions[:, :1]
    whole = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    for width, height in ((1, 1), (7, 5), (64, 32), (500, 260)):
        result = texels_of(positions, uvs * (width, height), normals, width, height)
        assert result["areas"].sum(dtype=float) == pytest.approx(whole, rel=1e-6)
        # At both poles every second triangle has no area: it covers nothing.
        assert result["covered"].sum(dtype=float) == pytest.approx((1 - 1 / 40) * width * height, rel=1e-6)


@pytest.mark.parametrize("mirrored", [False, True])
def test_positions_normals_and_tangents_are_those_of_a_ball(mirrored):
    """Within the distance of facets from the ball: 1 - cos(pi / 400) = 3e-5 along the equator."""
    positions, uvs, normals = ball(200, 400)
    if mirrored:
        uvs = uvs * (-1, 1) + (1, 0)
    height, width = 100, 200
    result = texels_of(positions, uvs * (width, height), normals, width, height)
    inner = slice(10, -10)
    shown = {name: values[inner] for name, values in result.items()}
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5)[inner] / height)
    azimuth, z = 2 * np.pi * (1 - u if mirrored else u), 2 * v - 1
    across = np.sqrt(1 - z**2)
    exact = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), z], -1)
    np.testing.assert_allclose(shown["positions"], exact, atol=3e-4)
    np.testing.assert_allclose(shown["normals"], exact, atol=3e-4)
    turn = np.stack([-np.sin(azimuth), np.cos(azimuth), 0 * z], -1) * (-1 if mirrored else 1)
    np.testing.assert_allclose(shown["tangents"], turn, atol=1e-2)
    np.testing.assert_allclose(np.einsum("hwc,hwc->hw", shown["tangents"], shown["normals"]), 0, atol=FLOAT32)
    np.testing.assert_allclose(
        shown["steps_x"], turn * (2 * np.pi / width * across)[..., None], atol=6e-4
    )  # of a row of facets
    spanned = np.linalg.norm(np.cross(shown["steps_x"], shown["steps_y"]), axis=-1)
    np.testing.assert_allclose(spanned, shown["areas"], rtol=2e-2)  # the same


def test_steps_of_a_texel_at_the_rim_span_its_area():
    triangle = np.array([[(0, 0, 0), (2, 0, 0), (0, 2, 0)]], float)
    result = texels_of(triangle, triangle[..., :2] * 2.3, None, 5, 5)
    shown = result["triangles"] == 0
    spanned = np.linalg.norm(np.cross(result["steps_x"], result["steps_y"]), axis=-1)
    np.testing.assert_allclose(spanned[shown], result["areas"][shown], rtol=1e-6)
    assert 0 < result["covered"][shown].min() < 0.2
    # Centroids lie on the triangle.
    x, y, z = result["positions"][shown].T
    assert min(x.min(), y.min()) >= 0
    assert (x + y).max() <= 2
    assert not z.any()


def test_edges_that_run_between_texels_leave_no_slivers():
    """A grid of UVs on texels' borders but for rounding: 48 columns on 192 texels."""
    positions, uvs, normals = ball(24, 48)
    result = texels_of(positions, uvs * (192, 96), normals, 192, 96)
    assert result["covered"][result["covered"] > 0].min() > 0.49  # triangles at the poles
    for name in ("steps_x", "steps_y", "normals", "tangents"):
        assert np.isfinite(result[name]).all()
    for shift in (1e-13, 1e-9, 1e-7, 1e-5):
        moved = texels_of(positions, uvs * (192, 96) + shift, normals, 192, 96)
        shown = moved["covered"] > 0
        faces = np.cross(moved["steps_x"], moved["steps_y"])[shown]
        assert np.linalg.norm(faces.astype(float), axis=-1).min() > 0
        np.testing.assert_allclose(moved["areas"].sum(), result["areas"].sum(), rtol=1e-4)


def test_steps_of_a_cut_texel_have_the_shape_of_its_part():
    """Rows of points, 256 x 256 in each texel, tell area and covariance: rounding of a row is .4 % of a side."""
    triangle = np.array([(0.3, 0.2), (4.6, 1.7), (1.4, 3.8)])
    side = 256
    result = texels_of(np.pad(triangle, ((0, 0), (0, 1)))[None], triangle[None], None, 5, 4)
    places = (np.stack(np.meshgrid(*[np.arange(side)] * 2), -1).reshape(-1, 2) + 0.5) / side
    cut = 0
    for y, x in np.argwhere(result["covered"] > 0.05):
        edges = np.roll(triangle, -1, 0) - triangle
        ways = places[:, None] + (x, y) - triangle
        inside = (edges[:, 0] * ways[..., 1] - edges[:, 1] * ways[..., 0] >= 0).all(1)
        variance = 12 * np.cov(places[inside].T, bias=True)
        area = inside.mean()
        expected = variance * area / np.sqrt(np.linalg.det(variance))
        steps = np.stack([result["steps_x"][y, x, :2], result["steps_y"][y, x, :2]], 1)
        np.testing.assert_allclose(steps @ steps.T, expected, atol=0.02 * expected.max())
        cut += area < 0.99
    assert cut > 5


def test_shading_normals_point_outward():
    triangle = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)]], float)
    for normal in ((0, 0, -1), (0.6, 0, -0.8), (0, 0, 0)):
        normals = np.tile(np.array(normal, float), (1, 3, 1))
        result = texels_of(triangle, triangle[..., :2] * 4, normals, 4, 4)
        shown = result["triangles"] == 0
        np.testing.assert_allclose(np.linalg.norm(result["normals"][shown], axis=-1), 1, atol=FLOAT32)
        assert result["normals"][shown][:, 2].min() >= 0.0999


def test_results_are_the_same_for_any_number_of_threads():
    positions, uvs, normals = ball(30, 60)
    first, second = (texels_of(positions, uvs * (301, 200), normals, 301, 200, threads=count) for count in (1, 3))
    for name, values in first.items():
        np.testing.assert_array_equal(values, second[name], err_msg=name)


def test_triangles_without_an_area_cover_nothing():
    flat = np.array([[(0, 0, 0), (1, 0, 0), (2, 0, 0)]], float)
    assert not texels_of(flat, flat[..., :2], None, 2, 2)["covered"].any()
    assert (texels_of(np.zeros((0, 3, 3)), np.zeros((0, 3, 2)), None, 2, 2)["triangles"] == -1).all()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"width": 0}, "width"),
        ({"uvs": np.full((1, 3, 2), np.nan)}, "texels"),
        ({"positions": np.full((1, 3, 3), np.inf)}, "positions"),
        ({"positions": np.zeros((2, 3, 3))}, "positions"),
        ({"normals": np.full((1, 3, 3), np.nan)}, "normals"),
    ],
)
def test_bad_arguments_are_named(changes, said):
    values = {
        "positions": np.eye(3)[None],
        "uvs": np.array([[(0, 0), (1, 0), (0, 1)]], float),
        "normals": np.ones((1, 3, 3)),
        "width": 2,
        "height": 2,
    }
    with pytest.raises(ValueError, match=said):
        texels_of(**values | changes)


def test_a_million_texels_of_a_hundred_thousand_triangles_take_less_than_a_second():
    positions, uvs, normals = ball(224, 224)
    began = time.process_time()
    texels_of(positions, uvs * 1000, normals, 1000, 1000, threads=1)
    assert time.process_time() - began < 1.0
