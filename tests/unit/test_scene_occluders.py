"""Occluders accept valid arguments and reject others."""

import math

import numpy as np
import pytest
from beamspread.core.native import native

from helpers import gather_beams

GRID = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 0.5, 0.5, 4, 4)
SQUARE = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
DOWN = native.SunLight((0, 0, -1))


def light_past(occluders, light=DOWN, grid=GRID, samples=4):
    """Irradiance."""
    return gather_beams(grid, light, occluders, samples)[0]


def test_no_triangles_block_nothing():
    for vertices in (np.zeros((0, 3)), SQUARE):
        occluders = native.Occluders([native.OccluderMesh(vertices, np.zeros((0, 3), np.uint32))])
        assert occluders.triangle_count == 0
        assert (light_past(occluders) == 1).all()


def test_both_sides_of_a_triangle_block():
    for faces in (FACES, FACES[:, ::-1].copy()):
        occluders = native.Occluders([native.OccluderMesh(SQUARE, faces)])
        assert occluders.triangle_count == 2
        assert not light_past(occluders).any()


def test_arrays_are_copied():
    vertices, faces = SQUARE.copy(), FACES.copy()
    occluders = native.Occluders([native.OccluderMesh(vertices, faces)])
    vertices[:], faces[:] = 1e9, 7
    del vertices, faces
    assert not light_past(occluders).any()


def test_no_light_leaks_through_shared_edges():
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-1.1, 1.1, 24), np.linspace(-1.1, 1.1, 24))
    vertices = np.stack([x, y, 1 + 0.2 * rng.random(x.shape)], -1).reshape(-1, 3)
    corner = (np.arange(23)[:, None] * 24 + np.arange(23)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + 25], 1), np.stack([corner, corner + 25, corner + 24], 1)]
    )
    occluders = native.Occluders([native.OccluderMesh(vertices, faces.astype(np.uint32))])
    grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2 / 96, 2 / 96, 96, 96)
    assert not light_past(occluders, grid=grid, samples=16).any()


def test_degenerate_triangles_are_harmless():
    faces = np.array([[0, 0, 0], [0, 1, 1]], np.uint32)
    assert (
        light_past(native.Occluders([native.OccluderMesh(SQUARE, faces)]), native.SunLight((0.1, 0.2, -1))) > 0
    ).all()


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (SQUARE.astype(np.float32), FACES, "vertices.*float32"),
        (SQUARE[:, :2].copy(), FACES, r"vertices.*\(4, 2\)"),
        (SQUARE.ravel(), FACES, "vertices"),
        (SQUARE[::2], FACES, "vertices"),
        (SQUARE, FACES.astype(np.int32), "triangles.*int32"),
        (SQUARE, FACES + np.uint32(1), "triangles.*4.*below the number of vertices, 4"),
        (SQUARE * math.nan, FACES, "vertices.*nan"),
        (SQUARE * math.inf, FACES, "vertices"),
        (SQUARE * 1e20, FACES, "vertices.*1e18"),
    ],
)
def test_bad_arrays_are_named(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        native.Occluders([native.OccluderMesh(vertices, triangles)])


def test_an_origin_without_numbers_is_named():
    with pytest.raises(ValueError, match=r"origin.*nan.*finite"):
        native.Occluders([native.OccluderMesh(SQUARE, FACES)], (0, math.nan, 0))
