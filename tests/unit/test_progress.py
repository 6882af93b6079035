"""Progress of a job, of its parts and stages, and its cancellation."""

import numpy as np
import pytest
from beamspread import Cancelled, Medium, simulate
from beamspread.core.progress import Progress
from beamspread.core.time_left import FOLLOWING, MARGIN, rounded_up


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
    """(time, seconds left, fraction of the time, words) of a run whose stages last other times than planned.

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
            shown.append((clock[0] - begin, whole.seconds_left(), whole.time_fraction(), whole.words_left()))
            clock[0] += tick
        part(1.0)
        pace[0], pace[1] = pace[0] + seconds, pace[1] + expected
    shown.append((clock[0] - begin, whole.seconds_left(), whole.time_fraction(), whole.words_left()))
    return shown


def words(clock, planned, lasting, progress_of):
    """(seconds left in truth, words of a window) of such a run."""
    return [(sum(lasting) - now, said) for now, _, _, said in played(clock, planned, lasting, progress_of)]


def seconds_in(said):
    """The number of such words, in seconds."""
    _, number, unit, _ = said.split()
    return float(number) * {"s": 1, "min": 60, "h": 3600}[unit]


def test_the_time_left_is_exact_where_the_plan_is(clock):
    for now, left, fraction, _ in played(clock, [4, 1, 15], [4, 1, 15]):
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
    fractions = [fraction for *_, fraction, _ in shown]
    assert fractions == sorted(fractions)
    assert all(0 <= fraction <= 1 for fraction in fractions)
    for (_, before, *_), (_, after, *_) in zip(shown, shown[1:]):
        # A jump passes within `FOLLOWING` of the run's time, which it can't exceed by much.
        assert abs(after - before) < 0.1 + 1.5 * 0.1 / FOLLOWING


def test_a_run_that_is_slower_than_planned_says_so_after_its_first_stages(clock):
    shown = played(clock, [5] * 8, [10] * 8)
    for now, left, *_ in shown:
        if now > 20:
            assert left == pytest.approx(80 - now, rel=0.35, abs=2)


def test_an_early_end_of_a_stage_takes_its_time_away(clock):
    """Cycles ends once its noise is low: the stage jumps to its end."""
    shown = played(clock, [40, 10], [4, 10], lambda fraction: 0.1 * fraction)
    left_at = {round(now, 1): left for now, left, *_ in shown}
    assert left_at[3.9] > 40
    assert left_at[7.0] < 0.6 * left_at[3.9]


SHAPES = [lambda f: f, lambda f: f**0.5, lambda f: f**2, lambda f: 0.0]
PLANS = [[10], [3, 12], [5] * 6, [60, 20], [0.5, 0.2, 2]]
FACTORS = [[0.3], [1], [2], [4], [0.3, 4], [4, 0.3], [1, 3, 0.5]]


@pytest.mark.parametrize("factors", FACTORS)
@pytest.mark.parametrize("planned", PLANS)
@pytest.mark.parametrize("uneven", SHAPES)
def test_the_time_that_a_window_shows_never_grows(clock, planned, factors, uneven):
    """Stages take .3 to 4 times their estimates, and report at even and uneven speed or not at all."""
    lasting = [seconds * factors[number % len(factors)] for number, seconds in enumerate(planned)]
    numbers = [seconds_in(said) for _, said in words(clock, planned, lasting, uneven)]
    assert numbers == sorted(numbers, reverse=True)
    assert numbers[0] >= sum(planned)


@pytest.mark.parametrize("planned", PLANS)
def test_a_run_as_planned_has_its_time_and_a_margin(clock, planned):
    """The number is the time left, by a quarter longer at most and rounded up; an end of a stage costs a twentieth."""
    for left, said in words(clock, planned, planned, lambda f: f):
        assert said.startswith("about")
        assert left - 0.1 <= seconds_in(said) <= rounded_up((1 + MARGIN) * (1.05 * left + 0.1))


def test_a_run_that_is_late_says_so(clock):
    """It stands at its last number, as the least that is left, until that holds again."""
    said = words(clock, [10], [40], lambda f: f)
    assert said[0][1] == "about 15 s left"
    assert sum(words.startswith("over") for _, words in said) > 0.3 * len(said)
    # Words without a warning are not too short by more than the slack once the speed is known.
    late = [(left, seconds_in(words)) for left, words in said if words.startswith("about") and left < 25]
    assert late
    assert all(left <= 1.5 * number + 1.5 for left, number in late)
    # A stage that reports nothing shows by its time alone that it is late.
    silent = [words for _, words in words(clock, [10], [40], lambda f: 0.0)]
    assert sum(words.startswith("over") for words in silent) > 0.4 * len(silent)


def test_times_are_rounded_up_to_what_is_worth_a_look():
    rounded = [rounded_up(seconds) for seconds in (0, 0.4, 3.2, 10, 11, 59, 61, 119, 121, 3599, 3601, 1e5)]
    assert rounded == [1, 1, 4, 10, 15, 60, 75, 120, 180, 3600, 7200, 100800]
