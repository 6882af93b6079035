"""Progress of stages."""

import pytest
from beamspread.core.progress import stages


def test_stages_join_to_one_range():
    seen = []
    for stage in stages(seen.append, [1, 3]):
        stage(0.0)
        stage(1.0)
    assert seen == pytest.approx([0, 0.25, 0.25, 1])


def test_stop_passes_through_and_anything_else_goes_on():
    assert next(stages(lambda fraction: False, [1]))(0.5) is False
    assert next(stages(lambda fraction: None, [1]))(0.5) is True


def test_no_progress_wanted():
    assert list(stages(None, [1, 2])) == [None, None]


def test_rounding_never_passes_one():
    seen = []
    for stage in stages(seen.append, [0.1] * 3):
        stage(1.0)
    assert max(seen) <= 1
