"""Coverage of outlines with holes and slivers, through planes, islands and grids, against clipping at each texel."""

import time

import numpy as np
import pytest
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.planes import find_planes
from beamspread.core.scene.receiver import build_receiver
from scipy.stats import special_ortho_group

from mesh_shapes import heights, mesh_of

SIDE = 48

# Coverage is stored with 24 bits; corners are rounded to 2^-52 of their size, and turned.
TOLERANCE = 1e-6


def circle(corners, radius, middle=(0.5, 0.5)):
    angles = 2 * np.pi * np.arange(corners) / corners + 0.1
    return np.asarray(middle) + radius * np.stack([np.cos(angles), np.sin(angles)], 1)


def ring(corners, inner, outer, middle=(0.5, 0.5)):
    """Quads around a hole."""
    small, large = circle(corners, inner, middle), circle(corners, outer, middle)
    return [np.array([small[i - 1], large[i - 1], large[i], small[i]]) for i in range(corners)]


def keyholes(outline, *holes):
    """One outline that enters each hole by a bridge, as faces with holes are stored."""
    for hole in holes:
        gaps = np.linalg.norm(outline[:, None] - hole[None], axis=2)
        here, there = np.unravel_index(gaps.argmin(), gaps.shape)
        inside = np.roll(hole[::-1], there + 1, axis=0)
        outline = np.concatenate([outline[: here + 1], inside, inside[:1], outline[here:]])
    return outline


def box_outline(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], float)


def slivers(count):
    """Triangles of a width of 1e-4, a fan that fills nothing but its blades."""
    rng = np.random.default_rng(3)
    blades = []
    for angle in 2 * np.pi * np.arange(count) / count:
        along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
        root = 0.5 + 0.05 * along
        blades.append(np.array([root, root + 0.4 * along, root + rng.uniform(0.1, 0.4) * along + 1e-4 * across]))
    return blades


BACK = [(0.6, 0.05), (0.9, 0.2), (0.9, 0.4), (0.75, 0.5), (0.85, 0.6), (0.85, 0.8), (0.6, 0.95)]

LETTER_B = keyholes(
    np.array([(0.1, 0.05), *BACK, (0.1, 0.95)]),
    box_outline(0.3, 0.15, 0.65, 0.4),
    circle(24, 0.14, (0.5, 0.72)),
)

OUTLINES = {
    "ring": ring(40, 0.25, 0.45),
    "thin ring": ring(64, 0.45, 0.452),
    "letter B": [LETTER_B],
    "letter i": [box_outline(0.45, 0.1, 0.55, 0.6), circle(32, 0.07, (0.5, 0.8))],
    "disk": [circle(200, 0.45)],
    "slivers": slivers(24),
    "frame of slivers": [keyholes(box_outline(0.1, 0.1, 0.9, 0.9), box_outline(0.1003, 0.1003, 0.8997, 0.8997))],
}


def half_plane(polygon, axis, bound, sign):
    """The part of a polygon (N, 2) where sign * (coordinate - bound) >= 0 (Sutherland and Hodgman 1974)."""
    if not len(polygon):
        return polygon
    depth = sign * (polygon[:, axis] - bound)
    following, next_depth = np.roll(polygon, -1, axis=0), np.roll(depth, -1)
    result = []
    for p, q, a, b in zip(polygon, following, depth, next_depth):
        if a >= 0:
            result.append(p)
        if (a > 0 > b) or (a < 0 < b):
            result.append(p + (q - p) * (a / (a - b)))
    return np.array(result).reshape(-1, 2)


def area(polygon):
    x, y = (polygon - polygon[:1]).T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def clipped(polygons, width, height):
    covered = np.zeros((height, width))
    for polygon in polygons:
        low = np.maximum(np.floor(polygon.min(axis=0)), 0).astype(int)
        high = np.minimum(np.ceil(polygon.max(axis=0)), (width, height)).astype(int)
        for row in range(low[1], high[1]):
            strip = half_plane(half_plane(polygon, 1, row, 1), 1, row + 1, -1)
            for column in range(low[0], high[0]):
                covered[row, column] += area(half_plane(half_plane(strip, 0, column, 1), 0, column + 1, -1))
    return covered


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("name", OUTLINES)
def test_coverage_is_that_of_clipping(name, turn):
    """In space the outline is turned at random; in the UV map it lies as it is, or turned and mirrored."""
    outline = OUTLINES[name]
    matrix = special_ortho_group.rvs(3, random_state=np.random.default_rng(5))
    faces = [np.pad(face, ((0, 0), (0, 1))) @ matrix.T * 3 for face in outline]
    rotation = np.array([(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))])
    uvs = [((face - 0.5) @ rotation.T * (0.7 if turn else 1)) * [1, -1 if turn else 1] + 0.5 for face in outline]
    mesh = flatten(mesh_of(faces, uvs))
    for part, chart in zip(mesh.parts, build_receiver(mesh, SIDE, SIDE).charts):
        (island,) = chart.islands
        shown = [uvs[face] * SIDE - island.offset for face in part.plane.faces]
        expected = clipped(shown, *island.coverage.shape[::-1])
        assert np.abs(island.coverage - expected).max() <= TOLERANCE
        assert expected.sum() == pytest.approx(sum(map(area, shown)), rel=1e-3)


def test_an_outline_of_many_corners_takes_a_moment():
    """Two seconds are allowed; it takes a twentieth of that."""
    rng = np.random.default_rng(2)
    angles = 2 * np.pi * np.arange(100_000) / 100_000
    outline = 0.5 + (0.4 + 0.05 * rng.random(100_000))[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    polygons = mesh_of([np.pad(outline, ((0, 0), (0, 1)))], [outline])
    start = time.process_time()
    (chart,) = build_receiver(flatten(polygons), 1024, 1024).charts
    assert time.process_time() - start < 2
    # Coverage may round up to 2^-31 for each edge through a texel, 300 here.
    assert chart.grid.coverage.sum(dtype=float) == pytest.approx(area(outline) * 1024**2, rel=1e-6)


def test_many_faces_of_many_planes_take_a_moment():
    """A second is allowed for 10,000 faces; they take a twentieth of that."""
    faces = []
    for number in range(100):
        quads, _ = heights(lambda x, _y: 0 * x, 10)
        faces += [quad + (2 * (number % 10), 2 * (number // 10), 0.1 * number) for quad in quads]
    polygons = mesh_of(faces)
    start = time.process_time()
    planes, _ = find_planes(polygons, 1e-6)
    assert time.process_time() - start < 1
    assert len(planes) == 100
