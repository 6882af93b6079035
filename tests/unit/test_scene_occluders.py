"""Occluders accept valid arguments and reject others."""

import math

import numpy as np
import pytest
from beamspread.core.native import native

from helpers import gather_beams
from shapes import FACES, SQUARE, make_grid, net, occluders

ABOVE = SQUARE + (0, 0, 1)
DOWN = native.SunLight((0, 0, -1))


def light_past(casters, light=DOWN, texels=4, samples=4):
    """Irradiance."""
    return gather_beams(native.ReceiverGrid(**make_grid(texels)), light, casters, samples)[0]


def test_no_triangles_block_nothing():
    for vertices in (np.zeros((0, 3)), ABOVE):
        none = occluders((vertices, np.zeros((0, 3), np.uint32)))
        assert none.triangle_count == 0
        assert (light_past(none) == 1).all()


def test_both_sides_of_a_triangle_block():
    for faces in (FACES, FACES[:, ::-1].copy()):
        assert not light_past(occluders((ABOVE, faces))).any()


def test_arrays_are_copied():
    vertices, faces = ABOVE.copy(), FACES.copy()
    square = occluders((vertices, faces))
    vertices[:], faces[:] = 1e9, 7
    del vertices, faces
    assert not light_past(square).any()


def test_no_light_leaks_through_shared_edges():
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.linspace(-1.1, 1.1, 24), np.linspace(-1.1, 1.1, 24))
    vertices = np.stack([x, y, 1 + 0.2 * rng.random(x.shape)], -1).reshape(-1, 3)
    assert not light_past(occluders((vertices, net(23, 23))), texels=96, samples=16).any()


def test_degenerate_triangles_are_harmless():
    faces = np.array([[0, 0, 0], [0, 1, 1]], np.uint32)
    assert (light_past(occluders((ABOVE, faces)), native.SunLight((0.1, 0.2, -1))) > 0).all()


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (ABOVE.astype(np.float32), FACES, "vertices.*float32"),
        (ABOVE[:, :2].copy(), FACES, r"vertices.*\(4, 2\)"),
        (ABOVE.ravel(), FACES, "vertices"),
        (ABOVE[::2], FACES, "vertices"),
        (ABOVE, FACES.astype(np.int32), "triangles.*int32"),
        (ABOVE, FACES + np.uint32(1), "triangles.*4.*below the number of vertices, 4"),
        (ABOVE * math.nan, FACES, "vertices.*nan"),
        (ABOVE * math.inf, FACES, "vertices"),
        (ABOVE * 1e20, FACES, "vertices.*1e18"),
    ],
)
def test_bad_arrays_are_named(vertices, triangles, message):
    with pytest.raises(ValueError, match=message):
        occluders((vertices, triangles))


def test_an_origin_without_numbers_is_named():
    with pytest.raises(ValueError, match=r"origin.*nan.*finite"):
        occluders((SQUARE, FACES), origin=(0, math.nan, 0))
