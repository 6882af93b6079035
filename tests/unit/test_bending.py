"""How much meshes bend, by which the time of bakes on bodies is estimated."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.scene.bending import OF_BALL, SMALL_TURN, Bending, bending_of
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver

from mesh_shapes import SQUARE, box, heights, mesh_of
from mesh_shapes import smooth_ball as ball


def prism(sides, height=2.0):
    """The side faces of a prism whose edges have the length 1."""
    angles = 2 * np.pi * np.arange(sides + 1) / sides
    x, y = np.cos(angles) / (2 * np.sin(np.pi / sides)), np.sin(angles) / (2 * np.sin(np.pi / sides))
    low, high = (np.stack([x, y, np.full(sides + 1, z)], 1) for z in (0.0, height))
    return mesh_of([np.stack([low[n], low[n + 1], high[n + 1], high[n]]) for n in range(sides)])


@pytest.mark.parametrize("sides", [3, 6, 40, 90])
def test_edges_count_by_their_length_and_turn(sides):
    """A prism: edges of length 2, each of which turns by a part of the circle, over the root of 2 x 1 for each side."""
    bending, length = bending_of(prism(sides)), 2 * sides / np.sqrt(2 * sides)
    assert bending.turning == pytest.approx(length * 2 * np.pi / sides / OF_BALL)
    turn = np.sin(min(2 * np.pi / sides, np.pi / 2)) - SMALL_TURN
    assert bending.creases == pytest.approx(length * max(turn, 0))


def test_a_cube_has_twelve_edges_at_right_angles_whatever_its_size():
    for size in (1.0, 1e-3, 1e4):
        bending = bending_of(mesh_of(box((size,) * 3)))
        assert bending.creases == pytest.approx(12 * (1 - SMALL_TURN) / np.sqrt(6))
        assert bending.turning == pytest.approx(12 * np.pi / 2 / np.sqrt(6) / OF_BALL)


def test_a_ball_turns_by_one_however_many_faces_it_has():
    for columns in (24, 96):
        assert bending_of(ball(columns, columns // 2)).turning == pytest.approx(1, abs=0.04)


def test_smooth_shading_and_flat_surfaces_have_no_creases():
    smooth = ball(24, 12)
    flat = replace(smooth, corner_normals=None)
    assert bending_of(smooth).creases == 0 < bending_of(flat).creases
    assert bending_of(smooth).turning == bending_of(flat).turning
    assert bending_of(mesh_of(*heights(lambda x, y: 0 * x))) == Bending(0, 0)
    assert bending_of(mesh_of([np.column_stack([SQUARE, np.zeros(4)])])) == Bending(0, 0)


def test_the_texels_of_a_mesh_know_its_bending():
    flat = replace(ball(24, 12), corner_normals=None)
    (chart,) = build_receiver(flatten(flat, name="Ball"), 64, 32, "Ball").charts
    found, expected = chart.grid.bending, bending_of(flat)
    assert (found.turning, found.creases) == pytest.approx((expected.turning, expected.creases))
