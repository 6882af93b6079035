"""Progress of a job, of its parts and stages, and its cancellation."""

import numpy as np
import pytest
from beamspread import Cancelled, Medium, simulate
from beamspread.core.progress import Progress


def test_parts_join_to_one_range():
    seen = []
    for part in Progress(seen.append).split([1, 3]):
        part(0.0)
        part(1.0)
    assert seen == pytest.approx([0, 0.25, 0.25, 1])


STOPS = [False, np.False_]
GOES_ON = [None, 0, True, 1, np.True_, np.array(False), np.array([0, 0]), "", "no", []]


@pytest.mark.parametrize("answer", STOPS + GOES_ON, ids=repr)
def test_false_stops_and_any_other_answer_goes_on(answer):
    """The same if the callback is called directly and if a part of its progress is."""
    for progress in (lambda fraction: answer, Progress(lambda fraction: answer).split([1, 2])[0]):
        if any(answer is stop for stop in STOPS):
            with pytest.raises(Cancelled):
                simulate(Medium(), [0], 1, progress=progress)
        else:
            assert simulate(Medium(), [0], 1, progress=progress).photons == 1


@pytest.mark.parametrize("progress", [5, "bar", False])
def test_an_object_that_is_no_function_is_named(progress):
    for call in (lambda: simulate(Medium(), [0], 1, progress=progress), lambda: Progress(progress)):
        with pytest.raises(ValueError, match=f"'progress' is {progress!r}; allowed: a function"):
            call()


def test_rounding_never_passes_one():
    seen = []
    for part in Progress(seen.append).split([0.1] * 3):
        part(1.0)
    assert max(seen) <= 1


def test_a_part_of_a_part_reports_to_the_whole():
    whole = Progress()
    first, second = whole.split([1, 1])
    first(1.0)
    second.split([1, 3])[0](1.0)
    assert whole.fraction == pytest.approx(0.625)
    second(0.0)
    assert whole.fraction == pytest.approx(0.625)  # it never falls


def test_cancelling_the_whole_stops_its_parts():
    whole = Progress()
    part = whole.split([1, 1])[1]
    part.check(0.1)
    whole.cancel()
    assert not part(0.2)
    with pytest.raises(Cancelled):
        part.check(0.3)
    assert part.is_cancelled


def test_an_answer_cancels_the_other_parts_too():
    first, second = Progress(lambda fraction: fraction < 0.5).split([1, 1])
    assert first(0.5)
    assert not first(1.0)
    assert second.is_cancelled


def test_stages_have_a_fraction_and_the_time_that_they_still_take(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    whole = Progress()
    first, second = whole.split([1, 3])
    first.begin("Simulating")
    first(1.0)
    second.begin("Baking")
    assert (whole.stage, whole.stage_fraction) == ("Baking", 0)
    now[0] += 2
    second(0.25)
    assert whole.seconds_left() is None  # too early to tell
    now[0] += 8
    second.begin("Baking")  # goes on
    assert whole.stage_fraction == pytest.approx(0.25)
    assert whole.seconds_left() == pytest.approx(30)
