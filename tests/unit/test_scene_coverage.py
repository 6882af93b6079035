"""Coverage against clipping each polygon at each texel."""

import numpy as np
import pytest
from beamspread.core.native import native
from hypothesis import given, settings
from hypothesis import strategies as st

from clipping import area, clip

# Depth, in texels, below which an edge that enters a texel adds nothing: less than half of coverage's unit, 2^-31.
ENTERED = 3e-10


def clipped_coverage(polygons, width, height):
    covered = np.zeros((height, width))
    for polygon in polygons:
        for y in range(height):
            for x in range(width):
                part = [np.asarray(p, float) for p in polygon]
                for axis, bound, sign in ((0, x, 1), (0, x + 1, -1), (1, y, 1), (1, y + 1, -1)):
                    part = clip(part, axis, bound, sign)
                covered[y, x] += area(part) * np.sign(area(polygon)) if part else 0
    return np.clip(covered, 0, 1)


def coverage(polygons, width, height, **options):
    corners = np.concatenate([np.asarray(p, np.float64).reshape(-1, 2) for p in polygons])
    counts = np.array([len(p) for p in polygons], np.uint32)
    return native.coverage(corners, counts, width, height, **options)


def star(rng, width, height, corners):
    """A simple polygon, mostly concave, partly outside the grid."""
    angles = np.zeros(corners)
    while np.diff(angles, append=angles[0] + 2 * np.pi).max() > 3.1:  # sides would cross
        angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radii = rng.uniform(0.2, 0.9, corners) * max(width, height)
    middle = rng.uniform(0, 1, 2) * (width, height)
    points = middle + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    return points[::-1] if rng.random() < 0.5 else points


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 10**6), width=st.integers(1, 7), height=st.integers(1, 7), corners=st.integers(3, 9))
def test_equals_clipping(seed, width, height, corners):
    rng = np.random.default_rng(seed)
    polygons = [star(rng, width, height, corners)]
    if seed % 3 == 0:  # corners on the lines between texels
        polygons = [np.round(polygons[0])]
    if abs(area(polygons[0])) < 1e-9:
        return
    np.testing.assert_allclose(coverage(polygons, width, height), clipped_coverage(polygons, width, height), atol=2e-6)


def crossed_and_inside(polygon, width, height):
    """Which texels an edge enters, by separating axes, and which have their centre inside, by counting crossings."""
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    crossed, inside = np.zeros((height, width), bool), np.zeros((height, width), bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        normal = np.array([ay - by, bx - ax]) / np.hypot(bx - ax, by - ay)
        gap = np.abs((x - ax) * normal[0] + (y - ay) * normal[1]) - 0.5 * np.abs(normal).sum()
        gap = np.maximum(gap, np.maximum(x - 0.5 - max(ax, bx), min(ax, bx) - x - 0.5))
        gap = np.maximum(gap, np.maximum(y - 0.5 - max(ay, by), min(ay, by) - y - 0.5))
        crossed |= gap < -ENTERED
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= ((ay > y) != (by > y)) & (x < ax + (y - ay) / (by - ay) * (bx - ax))
    return crossed, inside


def disk(corners, middle, radius):
    """A regular polygon."""
    angles = 2 * np.pi * np.arange(corners) / corners
    return middle + radius * np.stack([np.cos(angles), np.sin(angles)], 1)


@pytest.mark.parametrize("polygon", [disk(4, 128, 115.2), disk(64, 128, 115.2), disk(64, 128, 115.2)[::-1]])
@pytest.mark.parametrize("bits", [24, 53])
def test_a_turned_square_and_a_disk_cover_nothing_outside_and_all_inside(polygon, bits):
    polygon = (polygon / 256).astype(np.float32).astype(float) * 256 if bits == 24 else polygon
    covered, (crossed, inside) = coverage([polygon], 256, 256), crossed_and_inside(polygon, 256, 256)
    assert 500 < crossed.sum() < 1100
    np.testing.assert_array_equal(covered[~crossed], inside[~crossed])


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), width=st.integers(1, 40), height=st.integers(1, 40), corners=st.integers(3, 12))
def test_texels_that_no_edge_enters_are_exactly_in_or_out(seed, width, height, corners):
    rng = np.random.default_rng(seed)
    polygon = star(rng, width, height, corners)
    crossed, inside = crossed_and_inside(polygon, width, height)
    covered = coverage([polygon], width, height)
    np.testing.assert_array_equal(covered[~crossed], inside[~crossed])


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.sampled_from([7, 40, 90]), corners=st.integers(3, 12))
def test_triangles_of_a_polygon_cover_its_inside_exactly(seed, size, corners):
    rng = np.random.default_rng(seed)
    middle = rng.uniform(0.3, 0.7, 2) * size
    angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.9, corners)) / corners
    radii = rng.uniform(0.2, 0.9, corners) * size
    polygon = middle + radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    # Only with all angles below 180 degrees do the triangles around the middle not overlap.
    if corners == 3 and (np.diff(angles, append=angles[0] + 2 * np.pi) > 3.1).any():
        return
    fan = [(a, b, middle) for a, b in zip(polygon, np.roll(polygon, -1, axis=0))]
    covered, (crossed, inside) = coverage(fan, size, size), crossed_and_inside(polygon, size, size)
    np.testing.assert_array_equal(covered[~crossed], inside[~crossed])


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_triangles_of_a_rectangle_cover_it_exactly_once(seed):
    rng = np.random.default_rng(seed)
    low, high = rng.uniform(0, 3, 2), rng.uniform(5, 9, 2)
    middle = low + rng.uniform(0.1, 0.9, 2) * (high - low)
    corners = [low, (high[0], low[1]), high, (low[0], high[1])]
    triangles = [(corners[i], corners[(i + 1) % 4], middle) for i in range(4)]
    triangles = [t[::-1] if rng.random() < 0.5 else t for t in triangles]
    part = [np.clip(np.minimum(np.arange(1, 10), high[i]) - np.maximum(np.arange(9), low[i]), 0, 1) for i in (0, 1)]
    np.testing.assert_allclose(coverage(triangles, 9, 9), np.outer(part[1], part[0]), atol=1e-6)


def test_area_is_kept_in_a_large_grid():
    rng = np.random.default_rng(0)
    polygon = rng.uniform(0, 1, (3, 2)) * (900, 700)
    covered = coverage([polygon], 900, 700)
    assert covered.sum(dtype=float) == pytest.approx(abs(area(polygon)), rel=1e-6)
    np.testing.assert_array_equal(covered, coverage([polygon], 900, 700, threads=1))


def test_a_polygon_larger_than_the_grid_covers_all_of_it():
    for polygon in ([(-1e6, -2e6), (3e6, -1e6), (1e6, 3e6)], [(0, 0), (5, 0), (5, 4), (0, 4)]):
        np.testing.assert_array_equal(coverage([polygon], 5, 4), np.ones((4, 5), np.float32))


def test_outside_and_degenerate_polygons_cover_nothing():
    for polygon in ([(9, 0), (12, 0), (9, 3)], [(-3, 0), (-1, 0), (-3, 3)], [(0, 9), (3, 9), (3, 12)], [(1, 1)] * 3):
        assert not coverage([polygon], 5, 5).any()
    assert not native.coverage(np.zeros((0, 2)), np.zeros(0, np.uint32), 3, 2).any()


def test_overlap_is_cut_at_one():
    square = [(0, 0), (2, 0), (2, 2), (0, 2)]
    np.testing.assert_array_equal(coverage([square, square], 2, 2), np.ones((2, 2), np.float32))


def test_overlap_can_be_counted():
    square, half = [(0, 0), (2, 0), (2, 2), (0, 2)], [(0, 0), (2, 0), (2, 1), (0, 1)]
    np.testing.assert_array_equal(coverage([square, half, half], 2, 2, is_cut=False), [(3, 3), (1, 1)])


@pytest.mark.parametrize("step", [2, 7, 100])
def test_a_probe_has_one_texel_row_of_each_step(step):
    polygons = [[(1, 0), (59, 700), (60, 700), (60, 0)]]  # no two rows are alike
    full, probed = coverage(polygons, 60, 700), coverage(polygons, 60, 700 // step, row_step=step)
    rows = [int(np.abs(full[i * step : (i + 1) * step] - row).sum(axis=1).argmin()) for i, row in enumerate(probed)]
    for i, (row, offset) in enumerate(zip(probed, rows)):
        np.testing.assert_allclose(row, full[i * step + offset], atol=1e-6)
    assert len(set(rows)) == min(step, len(rows))  # no regular pattern of a map lies between all of them


@pytest.mark.parametrize(
    ("corners", "counts", "size", "message"),
    [
        (np.zeros((3, 2), np.float32), np.array([3], np.uint32), (2, 2), "corners.*float32"),
        (np.zeros((3, 3)), np.array([3], np.uint32), (2, 2), r"corners.*\(3, 3\)"),
        (np.full((3, 2), np.nan), np.array([3], np.uint32), (2, 2), "corners.*finite"),
        (np.zeros((3, 2)), np.array([3]), (2, 2), "corner_counts.*int64"),
        (np.zeros((3, 2)), np.array([2], np.uint32), (2, 2), "corner_counts.*2.*3 or more"),
        (np.zeros((3, 2)), np.array([4], np.uint32), (2, 2), "corner_counts.*4"),
        (np.zeros((7, 2)), np.array([3, 3], np.uint32), (2, 2), "corner_counts.*sum of 6"),
        (np.zeros((3, 2)), np.array([3], np.uint32), (0, 2), "width.*0"),
        (np.zeros((3, 2)), np.array([3], np.uint32), (2, -5), "height.*-5"),
    ],
)
def test_bad_arguments_are_named(corners, counts, size, message):
    with pytest.raises(ValueError, match=message):
        native.coverage(corners, counts, *size)


def test_a_row_step_below_one_is_refused():
    with pytest.raises(ValueError, match=r"row_step.*0.*1 or more"):
        coverage([[(0, 0), (5, 0), (5, 4)]], 5, 4, row_step=0)
