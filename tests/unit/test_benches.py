"""The measurements of tests/bench run: small ones as a whole, long ones as far as their options."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

BENCHES = Path(__file__).parents[1] / "bench"

SMALL = {
    "adaptive": ["--size", "24"],
    "gather": ["--sizes", "16"],
    "room": ["32"],
    "stripes": ["2000"],
    "terms": ["24"],
}
"""Arguments with which a bench takes seconds."""

LONG = {"cycles", "fft", "lights", "live", "occluders", "whole_bake"}
"""Benches that take minutes or need a window or Blender: they import what they measure there, and print their help."""

IN_BLENDER = {"bounced"}
"""Benches that only start a Blender."""


def test_every_bench_is_listed():
    assert {path.stem for path in BENCHES.glob("*.py")} == {*SMALL, *LONG, *IN_BLENDER}


@pytest.mark.parametrize("name", [*SMALL, *sorted(LONG)])
def test_a_bench_runs(name):
    options = SMALL.get(name, ["--help"])
    command = [sys.executable, str(BENCHES / f"{name}.py"), *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert not re.search(r"\bnan\b|Warning", done.stdout + done.stderr)
