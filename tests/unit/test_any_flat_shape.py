"""Random flat shapes: charts cover exactly the area of their faces. Bad input raises BakeError alone."""

import contextlib
import warnings
from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.errors import BakeError
from beamspread.core.scene.ears import triangulated
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.islands import check_map
from beamspread.core.scene.receiver import EDGE_TOLERANCE, build_receiver
from beamspread.core.scene.unwrap import unwrap
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import special_ortho_group

from mesh_shapes import SQUARE, box, mesh_of


def star(rng, corners, sharp):
    """Corners (N, 2) of a polygon around the origin, anticlockwise; with `sharp` it has notches."""
    angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.5, corners)) / corners
    radii = rng.uniform(0.4, 1.0, corners) if sharp else np.ones(corners)
    return radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)


def prism(outline, height):
    low, high = (np.column_stack([outline, np.full(len(outline), z)]) for z in (0.0, height))
    sides = [np.array([low[i], low[i - len(low) + 1], high[i - len(low) + 1], high[i]]) for i in range(len(low))]
    return [low[::-1], high, *sides]


def planks(rng, count):
    """Quads beside each other on a plane, trapezoids among them."""
    cuts = np.cumsum(np.concatenate([[0], rng.uniform(0.2, 1.0, count)]))
    slants = rng.uniform(-0.08, 0.08, count + 1)
    ends = [(np.array([x - slant, 0, 0]), np.array([x + slant, 1, 0])) for x, slant in zip(cuts, slants)]
    return [np.array([a, c, d, b]) for (a, b), (c, d) in zip(ends, ends[1:])]


def trapezoids(rng, count):
    inset = rng.uniform(0, 0.45, (count, 2))
    return [np.array([(0, 0, z), (1, 0, z), (1 - b, 1, z), (a, 1, z)]) for z, (a, b) in enumerate(inset)]


SHAPES = {
    "box": lambda rng: box(rng.uniform(0.01, 1, 3)),
    "prism": lambda rng: prism(star(rng, rng.integers(3, 12), False), rng.uniform(0.05, 2)),
    "star": lambda rng: prism(star(rng, 2 * rng.integers(3, 9), True), rng.uniform(0.05, 2)),
    "planks": lambda rng: planks(rng, rng.integers(1, 9)),
    "trapezoids": lambda rng: trapezoids(rng, rng.integers(1, 5)),
    "n-gon": lambda rng: [np.pad(star(rng, rng.integers(5, 40), True), ((0, 0), (0, 1)))],
}


def island(rng, face):
    """UVs of a face in the unit square: an affine picture or, whatever the shape, the square or a regular polygon."""
    if rng.random() < 0.4:
        regular = SQUARE if len(face) == 4 else 0.5 + 0.5 * star(rng, len(face), False)
        return np.roll(regular, rng.integers(len(face)), axis=0)[:: rng.choice([-1, 1])]
    edges = np.linalg.svd(face - face.mean(axis=0))[2][:2]
    flat = (face - face.mean(axis=0)) @ edges.T @ rng.normal(size=(2, 2)) @ np.diag(rng.uniform(0.2, 1, 2))
    return (flat - flat.min(axis=0)) / max(np.ptp(flat, axis=0).max(), 1e-9)


def shape(rng):
    kind = rng.choice(list(SHAPES))
    faces = SHAPES[kind](rng)
    cells = int(np.ceil(np.sqrt(len(faces))))
    places = [np.array(divmod(number, cells)) for number in rng.permutation(cells**2)[: len(faces)]]
    uvs = [(place + 0.05 + 0.9 * island(rng, face)) / cells for place, face in zip(places, faces)]
    matrix = special_ortho_group.rvs(3, random_state=rng) * 10.0 ** rng.uniform(-3, 3)
    return mesh_of([face @ matrix.T + rng.normal(size=3) for face in faces], uvs)


def check_areas(mesh, receiver, polygons):
    """The sum of coverage is the area in texels, but for strips at the borders that are narrower than EDGE_TOLERANCE.

    Coverage itself is exact to 2^-24 in each texel.
    """
    for part, chart in zip(mesh.parts, receiver.charts):
        grid = chart.grid
        texels = polygons.areas[part.plane.faces].sum() / (grid.pitch_x * grid.pitch_y)
        strips = EDGE_TOLERANCE * 2 * (grid.width + grid.height)
        assert abs(grid.coverage.sum(dtype=float) - texels) <= strips + 1e-5 * texels


@settings(max_examples=500, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), side=st.sampled_from([16, 64, 200]))
def test_charts_cover_the_area_of_their_faces(seed, side):
    polygons = shape(np.random.default_rng(seed))
    mesh = flatten(polygons)
    assert not any("black" in message.text for message in mesh.messages)
    assert sum(len(part.plane.faces) for part in mesh.parts) == polygons.count
    check_areas(mesh, build_receiver(mesh, side, side), polygons)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_maps_of_our_own_cover_the_area_of_all_faces(seed):
    polygons = shape(np.random.default_rng(seed))
    polygons = replace(polygons, uvs=unwrap(polygons))
    check_map(polygons)
    mesh = flatten(polygons)
    assert sum(len(part.plane.faces) for part in mesh.parts) == polygons.count
    check_areas(mesh, build_receiver(mesh, 512, 512), polygons)


def spoiled(rng, polygons):
    """The polygons with some of their numbers, faces or UVs made bad."""
    corners, uvs, starts, normals = (
        np.copy(part) for part in (polygons.corners, polygons.uvs, polygons.starts, polygons.normals)
    )
    for _ in range(rng.integers(1, 4)):
        which = rng.integers(len(corners), size=rng.integers(1, 4))
        kind = rng.integers(9)
        if kind == 0:
            corners[which] = rng.choice([np.nan, np.inf, -np.inf, 1e30, 1e-30, 1e17])
        elif kind == 1:
            corners[which] = corners[which[0]]
        elif kind == 2:
            uvs[which] = rng.choice([np.nan, np.inf, 1e30, -1.0, 2.0])
        elif kind == 3:
            uvs[which] = uvs[which[0]]
        elif kind == 4:
            corners *= rng.choice([0.0, 1e-20, 1e12], size=3)
        elif kind == 5:
            uvs *= rng.choice([0.0, 1e-9, 0.5], size=2)
        elif kind == 6:
            normals[rng.integers(len(normals))] *= rng.choice([-1.0, 0.0, np.nan])
        elif kind == 7:
            corners += rng.normal(size=corners.shape) * rng.choice([1e-6, 1e-2, 1.0])
        else:
            uvs += rng.normal(size=uvs.shape) * 1e-2
    return replace(polygons, corners=corners, uvs=uvs, starts=starts, normals=normals)


@settings(max_examples=500, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_bad_shapes_raise_nothing_but_errors_for_the_artist(seed):
    rng = np.random.default_rng(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        polygons = spoiled(rng, shape(rng))
        for uvs in (polygons.uvs, unwrap(polygons)):
            with contextlib.suppress(BakeError):
                mesh = flatten(replace(polygons, uvs=uvs), rng.choice([0.0, 1e-3, 1.0]), "Shape")
                receiver = build_receiver(mesh, 32, 48)
                assert all(np.isfinite(chart.grid.positions()).all() for chart in receiver.charts)
                receiver.messages("Shape")


@settings(max_examples=100, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_triangles_of_a_polygon_with_notches_make_up_its_area(seed):
    """Each lies inside, so that the sum of their areas, without signs, is that of the polygon."""
    rng = np.random.default_rng(seed)
    points = star(rng, rng.integers(4, 30), True)[:: rng.choice([-1, 1])]
    a, b, c = points[triangulated(points)].transpose(1, 0, 2)
    doubled = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    x, y = points.T
    assert np.abs(doubled).sum() == pytest.approx(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))), rel=1e-9)
