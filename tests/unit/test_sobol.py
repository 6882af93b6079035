"""Points from which rays come: Sobol's in grids' cells, and those of a circle."""

import _native_test
import numpy as np
import pytest

SIDE, POINTS = 32, 64


def intervals(count):
    """Which of 64 intervals each point lies in, by cell, point and dimension."""
    return (_native_test.sobol_points(SIDE, POINTS, count) * POINTS).astype(int)


def test_all_points_of_a_cell_are_one_in_each_interval():
    assert (np.sort(intervals(POINTS), axis=1) == np.arange(POINTS)[None, :, None]).all()


@pytest.mark.parametrize("count", [4, 16, 32])
def test_powers_of_two_are_spread_evenly(count):
    """The first points of a cell have one in each interval of theirs."""
    coarse = np.sort(intervals(count) * count // POINTS, axis=1)
    assert (coarse == np.arange(count)[None, :, None]).all()


@pytest.mark.parametrize("count", [3, 16, 19, 48])
def test_a_part_of_the_points_leaves_no_interval_out(count):
    """Over all cells each interval has as many points, within 5 standard deviations of independent choices. If cells
    began with the same point, some intervals would have none: light there would be lost, and other light count twice.
    """
    found = intervals(count)
    cells, part = SIDE * SIDE, count / POINTS
    bound = 5 * np.sqrt(cells * part * (1 - part))
    for dimension in range(4):
        hits = np.bincount(found[..., dimension].ravel(), minlength=POINTS)
        assert np.abs(hits - cells * part).max() < bound


def test_points_of_the_circle():
    """Turns around it several times as well; 6e-11 is the first term that is left out."""
    turns = np.concatenate([np.linspace(0, 3, 30_001), np.arange(513) / 512])
    np.testing.assert_allclose(_native_test.on_circle(turns), np.cos(2 * np.pi * turns), rtol=0, atol=1e-10)
    np.testing.assert_allclose(_native_test.on_circle_up(turns), np.sin(2 * np.pi * turns), rtol=0, atol=1e-10)
