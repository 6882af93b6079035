"""Receivers: any flat placement and any affine UV map give the right grid; everything else a clear sentence."""

import numpy as np
import pytest
from beamspread.core.errors import ReceiverError
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver, texture_size
from hypothesis import given, settings
from hypothesis import strategies as st

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)


def quad(p_u, p_v, p_0=(0, 0, 0), uvs=SQUARE, flip=False):
    """A face whose corner at `uvs` lies at p_0 + u p_u + v p_v, with its normal along p_u x p_v unless flipped."""
    p_u, p_v = np.asarray(p_u, float), np.asarray(p_v, float)
    uvs = np.asarray(uvs, float)
    normal = np.cross(p_u, p_v)
    normal /= np.linalg.norm(normal) * (-1 if flip else 1)
    corners = np.asarray(p_0) + uvs[:, :1] * p_u + uvs[:, 1:] * p_v
    return Polygons(corners, uvs, np.array([0, len(uvs)]), normal[None])


def together(*parts):
    """The faces of all parts."""
    sizes = np.concatenate([part.sizes for part in parts])
    corners, uvs, normals = (np.concatenate([getattr(p, n) for p in parts]) for n in ("corners", "uvs", "normals"))
    return Polygons(corners, uvs, np.concatenate([[0], np.cumsum(sizes)]), normals)


def receiver_of(polygons, width, height):
    return build_receiver(flatten(polygons), width, height)


def texel_position(grid, column, row):
    """World position of (column, row) in texels of the grid."""
    step = column * grid.pitch_x * np.array(grid.x_axis) + row * grid.pitch_y * np.array(grid.y_axis)
    return np.array(grid.origin) + step


def check_frame(grid):
    frame = np.array([grid.x_axis, grid.y_axis, grid.normal])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-9)


vectors = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array)
scales = st.floats(0.01, 100)


@settings(max_examples=60, deadline=None)
@given(axis=vectors, other=vectors, origin=vectors, scale_u=scales, scale_v=scales, flip=st.booleans())
def test_any_rotation_mirroring_and_scale(axis, other, origin, scale_u, scale_v, flip):
    across = np.cross(axis, other)
    if np.linalg.norm(across) < 1e-2:
        return
    p_u = scale_u * axis / np.linalg.norm(axis)
    p_v = scale_v * across / np.linalg.norm(across)
    polygons = quad(p_u, p_v, 10 * origin, flip=flip)
    (chart,) = receiver_of(polygons, 8, 5).charts
    grid = chart.grid
    check_frame(grid)
    assert (grid.width, grid.height) == (8, 5)
    assert (grid.pitch_x, grid.pitch_y) == pytest.approx((scale_u / 8, scale_v / 5))
    assert np.array(grid.normal) == pytest.approx(polygons.normals[0], abs=1e-6)
    assert texel_position(grid, 8, 5) == pytest.approx(10 * origin + p_u + p_v, abs=1e-6 * max(scale_u, scale_v, 10))
    assert grid.coverage == pytest.approx(np.ones((5, 8)))


@pytest.mark.parametrize("turn", range(4))
@pytest.mark.parametrize("mirror", [False, True])
def test_turned_and_mirrored_uvs(turn, mirror):
    """The plane stays, its UVs turn: texel corners must stay where the UV map puts them."""
    positions = SQUARE * [4, 2]
    uvs = np.roll(SQUARE, turn, axis=0)
    uvs = uvs * [-1, 1] + [1, 0] if mirror else uvs
    corners = np.column_stack([positions, np.full(4, 3.0)])
    polygons = Polygons(corners, uvs, np.array([0, 4]), np.array([[0.0, 0, 1]]))
    width, height = texture_size(flatten(polygons), 12)
    assert (width, height) == ((12, 6) if turn % 2 == 0 else (6, 12))
    grid = receiver_of(polygons, width, height).charts[0].grid
    check_frame(grid)
    for uv, corner in zip(uvs, corners):
        assert texel_position(grid, uv[0] * width, uv[1] * height) == pytest.approx(corner, abs=1e-9)


def test_grid_is_the_chart_alone():
    """A chart in a corner of an atlas: the grid is cut to it and lands back in its place."""
    uvs = SQUARE * [0.25, 0.5] + [0.5, 0.25]
    receiver = receiver_of(quad((8, 0, 0), (0, 8, 0), uvs=uvs), 16, 16)
    (chart,) = receiver.charts
    assert (chart.grid.width, chart.grid.height, chart.islands[0].offset) == (4, 8, (8, 4))
    assert np.array(chart.grid.origin) == pytest.approx([4, 2, 0])
    values = np.arange(32, dtype=np.float32).reshape(8, 4, 1)
    texture = receiver.to_texture([values])
    np.testing.assert_array_equal(receiver.charts[0].read(texture), values)
    assert np.array_equal(texture[4:12, 8:12], values)
    assert texture.sum() == values.sum()
    assert receiver.inside().sum() == 32


def test_no_texel_is_inside_that_no_grid_fills():
    """A chart that enters the next column and row by rounding of its UVs alone does not own them."""
    uvs = SQUARE * (0.5 + 1e-6)
    receiver = receiver_of(quad((8, 0, 0), (0, 8, 0), uvs=uvs), 16, 16)
    filled = receiver.to_texture([np.ones((8, 8, 1), np.float32)])[..., 0] > 0
    assert filled.sum() == 64
    assert np.array_equal(receiver.inside(), filled)


def test_parts_become_charts_of_one_texture():
    """Two squares at right angles, side by side in the image, in texels of different sizes."""
    floor = quad((8, 0, 0), (0, 8, 0), uvs=SQUARE * 0.5)
    wall = quad((0, 4, 0), (0, 0, 4), uvs=SQUARE * 0.5 + [0.5, 0])
    mesh = flatten(together(floor, wall))
    assert texture_size(mesh, 32) == (32, 32)
    receiver = build_receiver(mesh, 16, 16)
    assert [chart.islands[0].offset for chart in receiver.charts] == [(0, 0), (8, 0)]
    assert np.array([chart.grid.normal for chart in receiver.charts]) == pytest.approx(np.eye(3)[[2, 0]], abs=1e-12)
    assert [chart.grid.pitch_x for chart in receiver.charts] == pytest.approx([0.5, 0.25])
    texture = receiver.to_texture([np.full((8, 8, 1), value, np.float32) for value in (1, 2)])[..., 0]
    assert np.array_equal(texture[:8], np.repeat([[1, 2]], 8, axis=1).repeat(8, axis=0))
    assert not texture[8:].any()
    assert np.array_equal(receiver.inside(), texture > 0)


def test_partial_coverage_at_the_border():
    receiver = receiver_of(quad((1, 0, 0), (0, 1, 0), uvs=SQUARE * 0.625), 4, 4)
    assert receiver.charts[0].grid.coverage == pytest.approx(np.outer([1, 1, 0.5], [1, 1, 0.5]))


def test_faces_that_join_to_one_plane():
    left, right = (
        quad((1, 0, 0), (0, 1, 0), uvs=SQUARE * [0.5, 1]),
        quad((1, 0, 0), (0, 1, 0), uvs=SQUARE * [0.5, 1] + [0.5, 0]),
    )
    assert receiver_of(together(left, right), 6, 6).charts[0].grid.coverage == pytest.approx(np.ones((6, 6)))


@pytest.mark.parametrize("shear", [-0.7, 0.3, 2.0])
def test_sheared_uvs_are_resampled(shear):
    """A field that is linear on the plane comes back linear in the texture, and from there the same on the grid."""
    p_u, p_v = np.array([3.0, 0, 0]), np.array([shear, 2.0, 0])
    receiver = receiver_of(quad(p_u, p_v, (1, 1, 0)), 30, 20)
    grid = receiver.charts[0].grid
    check_frame(grid)
    assert (grid.pitch_x, grid.pitch_y) == pytest.approx((0.1, 0.1))
    assert grid.coverage.sum() * grid.pitch_x * grid.pitch_y == pytest.approx(6.0, rel=1e-4)
    rows, columns = np.mgrid[: grid.height, : grid.width] + 0.5
    points = (
        np.array(grid.origin)
        + columns[..., None] * 0.1 * np.array(grid.x_axis)
        + rows[..., None] * 0.1 * np.array(grid.y_axis)
    )
    slope = np.array([2.0, -1.0, 0.5])
    on_grid = (points @ slope)[..., None].astype(np.float32)
    texture = receiver.to_texture([on_grid])[..., 0]
    v, u = (np.mgrid[:20, :30] + 0.5) / [[[20]], [[30]]]
    expected = (np.array([1, 1, 0]) + u[..., None] * p_u + v[..., None] * p_v) @ slope
    inside = (slice(1, -1), slice(1, -1))
    assert texture[inside] == pytest.approx(expected[inside], abs=1e-4)
    (chart,) = receiver.charts
    is_inside = (np.abs(chart.uvs(30, 20) - 0.5) < 0.5 - 1 / 20).all(axis=2)
    assert is_inside.mean() > 0.3
    assert chart.read(np.float32(expected[..., None]))[is_inside] == pytest.approx(on_grid[is_inside], abs=1e-4)


def test_texture_size_keeps_texels_square():
    assert texture_size(flatten(quad((4, 0, 0), (0, 1, 0))), 1024) == (1024, 256)
    assert texture_size(flatten(quad((1, 0, 0), (0, 1000, 0))), 100) == (1, 100)


def replaced(**changes):
    polygons = quad((1, 0, 0), (0, 1, 0))
    values = {name: getattr(polygons, name) for name in ("corners", "uvs", "starts", "normals")}
    return Polygons(**(values | changes))


@pytest.mark.parametrize(
    ("polygons", "words"),
    [
        (replaced(uvs=None), "no UV map"),
        (replaced(uvs=SQUARE * 2), "outside the image"),
        (replaced(uvs=SQUARE - [0.5, 0]), "outside the image"),
        (replaced(uvs=SQUARE * [1, 0]), "no area"),
        (replaced(uvs=np.zeros((4, 2))), "no area"),
        (replaced(uvs=SQUARE * np.nan), "not numbers"),
        (replaced(corners=np.zeros((4, 3))), "The corners of face 0 lie on a line: no face has an area"),
        (
            replaced(corners=np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3.0, 0, 0]])),
            "The corners of face 0 lie on a line: no face has an area",
        ),
        (replaced(corners=np.full((4, 3), np.inf)), "The positions of face 0 are infinite"),
        (replaced(starts=np.array([0]), corners=np.zeros((0, 3)), normals=np.zeros((0, 3))), "No face"),
    ],
)
def test_a_surface_that_cannot_be_baked_gets_a_reason(polygons, words):
    with pytest.raises(ReceiverError, match=words):
        flatten(polygons)


def test_a_chart_smaller_than_rounding_is_refused():
    polygons = quad((1, 0, 0), (0, 1, 0), uvs=SQUARE * 1e-12 + 0.5)
    with pytest.raises(ReceiverError, match="no area"):
        flatten(polygons)


def test_non_planar_within_rounding_is_accepted():
    rng = np.random.default_rng(3)
    polygons = quad((1, 0, 0), (0, 1, 0))
    flatten(replaced(corners=polygons.corners + rng.normal(scale=1e-7, size=(4, 3))))
