"""Progress of stages."""

import numpy as np
import pytest
from beamspread import Cancelled, Medium, simulate
from beamspread.core.progress import say, stages


def test_stages_join_to_one_range():
    seen = []
    for stage in stages(seen.append, [1, 3]):
        stage(0.0)
        stage(1.0)
    assert seen == pytest.approx([0, 0.25, 0.25, 1])


STOPS = [False, np.False_]
GOES_ON = [None, 0, True, 1, np.True_, np.array(False), np.array([0, 0]), "", "no", []]


@pytest.mark.parametrize("answer", STOPS + GOES_ON, ids=repr)
def test_false_stops_and_any_other_answer_goes_on(answer):
    """The same where the callback is called straight and where it is one of several stages."""
    for progress in (lambda fraction: answer, next(stages(lambda fraction: answer, [1, 2]))):
        if any(answer is stop for stop in STOPS):
            with pytest.raises(Cancelled):
                simulate(Medium(), [0], 1, progress=progress)
        else:
            assert simulate(Medium(), [0], 1, progress=progress).photons == 1


@pytest.mark.parametrize("progress", [5, "bar", False])
def test_what_is_no_function_is_named(progress):
    for call in (lambda: simulate(Medium(), [0], 1, progress=progress), lambda: next(stages(progress, [1]))):
        with pytest.raises(ValueError, match=f"'progress' is {progress!r}; allowed: a function"):
            call()


def test_no_progress_wanted():
    assert list(stages(None, [1, 2])) == [None, None]


def test_rounding_never_passes_one():
    seen = []
    for stage in stages(seen.append, [0.1] * 3):
        stage(1.0)
    assert max(seen) <= 1


def test_stages_pass_on_what_is_said_to_whoever_listens():
    class Listener:
        def __init__(self):
            self.said, self.fractions = [], []

        def __call__(self, fraction):
            self.fractions.append(fraction)

        def say(self, words):
            self.said.append(words)

    listener = Listener()
    _, second = stages(listener, [1.0, 1.0])
    (inner,) = stages(second, [1.0])
    say(inner, "Baking")
    inner(0.5)
    assert (listener.said, listener.fractions) == (["Baking"], [0.75])
    # Whoever only wants the fraction hears nothing, and nobody need listen.
    (plain,) = stages(lambda fraction: True, [1.0])
    say(plain, "Baking")
    say(None, "Baking")
