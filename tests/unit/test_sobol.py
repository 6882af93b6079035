"""Sobol points of grids' cells, from which rays come."""

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
