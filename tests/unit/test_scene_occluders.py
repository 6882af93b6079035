"""What occluders accept and refuse."""

import math

import numpy as np
import pytest
from beamspread.core.native import native

GRID = ((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 0.5, 0.5, 4, 4)
SQUARE = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
DOWN = (0, 0, -1)


def test_no_triangles_block_nothing():
    for vertices in (np.zeros((0, 3), np.float32), SQUARE):
        occluders = native.Occluders(vertices, np.zeros((0, 3), np.uint32))
        assert occluders.triangle_count == 0
        assert (native.sun_beams(*GRID, DOWN, occluders) == 1).all()


def test_both_sides_of_a_triangle_block():
    for faces in (FACES, FACES[:, ::-1].copy()):
        occluders = native.Occluders(SQUARE, faces)
        assert occluders.triangle_count == 2
        assert not native.sun_beams(*GRID, DOWN, occluders).any()


def test_arrays_are_copied():
    vertices, faces = SQUARE.copy(), FACES.copy()
    occluders = native.Occluders(vertices, faces)
    vertices[:], faces[:] = 1e9, 7
    del vertices, faces
    assert not native.sun_beams(*GRID, DOWN, occluders).any()


def test_no_light_leaks_through_shared_edges():
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-1.1, 1.1, 24), np.linspace(-1.1, 1.1, 24))
    vertices = np.stack([x, y, 1 + 0.2 * rng.random(x.shape)], -1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(23)[:, None] * 24 + np.arange(23)).ravel()
    faces = np.concatenate(
        [np.stack([corner, corner + 1, corner + 25], 1), np.stack([corner, corner + 25, corner + 24], 1)]
    )
    occluders = native.Occluders(vertices, faces.astype(np.uint32))
    grid = (*GRID[:4], 2 / 96, 2 / 96, 96, 96)
    assert not native.sun_beams(*grid, DOWN, occluders, samples=16).any()


def test_degenerate_triangles_are_harmless():
    faces = np.array([[0, 0, 0], [0, 1, 1]], np.uint32)
    assert (native.sun_beams(*GRID, (0.1, 0.2, -1), native.Occluders(SQUARE, faces)) > 0).all()


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (SQUARE.astype(float), FACES, "vertices.*float64"),
        (SQUARE[:, :2].copy(), FACES, r"vertices.*\(4, 2\)"),
        (SQUARE.ravel(), FACES, "vertices"),
        (SQUARE[::2], FACES, "vertices"),
        (SQUARE, FACES.astype(np.int32), "triangles.*int32"),
        (SQUARE, FACES + np.uint32(1), "triangles.*4.*below the number of vertices, 4"),
        (SQUARE * np.float32(math.nan), FACES, "vertices.*nan"),
        (SQUARE * np.float32(math.inf), FACES, "vertices"),
        (SQUARE * np.float32(1e20), FACES, "vertices.*1e18"),
    ],
)
def test_bad_arrays_are_named(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        native.Occluders(vertices, triangles)
