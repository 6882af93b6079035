"""Progress of a job, of its parts and stages, and its cancellation."""

import numpy as np
import pytest
from beamspread import Cancelled, Medium, simulate
from beamspread.core.progress import Progress
from beamspread.core.time_left import FOLLOWING


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


@pytest.fixture
def clock(monkeypatch):
    """A list with the time in seconds, which the test moves on."""
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    return now


def test_stages_have_a_fraction():
    whole = Progress()
    first, second = whole.split([1, 3])
    first.begin("Simulating")
    first(1.0)
    second.begin("Baking")
    assert (whole.stage, whole.stage_fraction) == ("Baking", 0)
    second(0.25)
    second.begin("Baking")  # goes on
    assert whole.stage_fraction == pytest.approx(0.25)


def test_without_an_estimate_the_time_left_is_unknown():
    whole = Progress()
    whole.split([1, 1])[0](0.5)
    assert whole.seconds_left() is None
    assert whole.time_fraction() == pytest.approx(0.25)


def played(clock, planned, lasting, progress_of=lambda fraction: fraction, tick=0.1):
    """(time, seconds left, fraction of the time) of a run whose stages last other times than planned.

    Later stages are expected at the pace of those before. `progress_of` gives what a stage reports at a fraction of its
    time.
    """
    whole = Progress()
    begin, shown, parts, pace = clock[0], [], whole.split(planned), [0.0, 0.0]
    for part, seconds in zip(parts, planned):
        part.expect(lambda seconds=seconds: seconds * (pace[0] + 1) / (pace[1] + 1))
    for part, expected, seconds in zip(parts, planned, lasting):
        part.begin(f"Stage of {seconds} s")
        for step in range(round(seconds / tick)):
            part(progress_of(step * tick / seconds))
            shown.append((clock[0] - begin, whole.seconds_left(), whole.time_fraction()))
            clock[0] += tick
        part(1.0)
        pace[0], pace[1] = pace[0] + seconds, pace[1] + expected
    shown.append((clock[0] - begin, whole.seconds_left(), whole.time_fraction()))
    return shown


def test_the_time_left_is_exact_where_the_plan_is(clock):
    for now, left, fraction in played(clock, [4, 1, 15], [4, 1, 15]):
        assert left == pytest.approx(20 - now, abs=0.1)
        assert fraction == pytest.approx(now / 20, abs=0.01)


def test_parts_of_a_part_share_its_estimate(clock):
    """The media that a step simulates report their own stages."""
    whole = Progress()
    simulation, solution = whole.split([40, 10])
    simulation.expect(lambda: 40.0)
    solution.expect(lambda: 10.0)
    first, second = simulation.split([1, 3])
    first.begin("First medium")
    assert whole.seconds_left() == pytest.approx(50)
    clock[0] += 10
    first(1.0)
    second.begin("Second medium")
    assert whole.seconds_left() == pytest.approx(40)


@pytest.mark.parametrize("uneven", [lambda f: f, lambda f: f**0.5, lambda f: f**2, lambda f: 0.0])
@pytest.mark.parametrize(
    ("planned", "lasting"), [([10, 10, 10], [20, 20, 20]), ([10, 10, 10], [5, 5, 5]), ([2, 20], [0.3, 30]), ([9], [27])]
)
def test_the_bar_never_falls_and_the_time_left_never_jumps(clock, planned, lasting, uneven):
    shown = played(clock, planned, lasting, uneven)
    fractions = [fraction for *_, fraction in shown]
    assert fractions == sorted(fractions)
    assert all(0 <= fraction <= 1 for fraction in fractions)
    for (_, before, _), (_, after, _) in zip(shown, shown[1:]):
        # A jump passes within `FOLLOWING` of the run's time, which it can't exceed by much.
        assert abs(after - before) < 0.1 + 1.5 * 0.1 / FOLLOWING


def test_a_run_that_is_slower_than_planned_says_so_after_its_first_stages(clock):
    shown = played(clock, [5] * 8, [10] * 8)
    for now, left, _ in shown:
        if now > 20:
            assert left == pytest.approx(80 - now, rel=0.35, abs=2)


def test_an_early_end_of_a_stage_takes_its_time_away(clock):
    """Cycles ends once its noise is low: the stage jumps to its end."""
    shown = played(clock, [40, 10], [4, 10], lambda fraction: 0.1 * fraction)
    left_at = {round(now, 1): left for now, left, _ in shown}
    assert left_at[3.9] > 40
    assert left_at[7.0] < 0.6 * left_at[3.9]
