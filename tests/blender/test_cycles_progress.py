"""What is said of Cycles' process, which itself seldom says how far it is."""

import bpy
import pytest
from beamspread.blender.cycles import process
from beamspread.blender.cycles.scene_copy import SceneCopy

CHILD = """
import json, sys, time
import numpy as np
request = json.load(open(sys.argv[-1]))
time.sleep(0.6)
print(request["mark"], 0.0, flush=True)
time.sleep(0.6)
np.savez(request["output"], done=np.ones(1))
"""


class Listener:
    def __init__(self):
        self.words, self.fractions = [], []

    def __call__(self, fraction):
        self.fractions.append(fraction)
        return True

    def say(self, words):
        if words not in self.words:
            self.words.append(words)


def test_it_says_that_cycles_starts_and_moves_before_it_answers(monkeypatch, tmp_path):
    child, heard = tmp_path / "child.py", Listener()
    child.write_text(CHILD)
    monkeypatch.setattr(process, "CHILD", child)
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy:
        assert process.run(copy, "any", {}, heard, "Looking", 10.0)["done"] == 1
    assert heard.words == ["Looking (Cycles starts)", "Looking"]
    assert heard.fractions == sorted(set(heard.fractions))
    assert 0 < heard.fractions[0] < 0.1


def test_the_pace_follows_the_estimate_and_the_process_and_never_ends_by_itself(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    pace = process._Pace(10.0)

    def at(seconds, told=0.0):
        now[0] = 100.0 + seconds
        return pace.fraction(told)

    assert at(2) == pytest.approx(0.2)
    assert at(3, 0.4) == pytest.approx(0.4)
    assert at(3.5, 0.1) == pytest.approx(0.4)
    assert at(5, 0.1) == pytest.approx(0.5)
    assert at(10, 0.1) == pytest.approx(0.75)
    assert at(10000, 0.1) < 1
    assert at(10000, 1.0) == 1


def test_without_an_estimate_only_what_the_process_says_counts():
    pace = process._Pace(0.0)
    assert [pace.fraction(told) for told in (0.0, 0.3)] == [0, 0.3]
