"""Undo in a window: picture and packed data go back and forth together, and a running bake keeps its result."""

import json
import subprocess
from pathlib import Path

import bpy
import pytest


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """What kept_window.py noted: brightness of what is shown and of what is packed."""
    if not bpy.app.binary_path:
        pytest.skip("the bpy module opens no window")
    path = tmp_path_factory.mktemp("window") / "results.json"
    screen = ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24 +extension GLX"]
    script = ["--python-exit-code", "1", "--python", str(Path(__file__).with_name("kept_window.py")), "--", str(path)]
    options = ["--factory-startup", "--window-geometry", "0", "0", "1600", "1000", *script]
    done = subprocess.run([*screen, bpy.app.binary_path, *options], capture_output=True, text=True, timeout=300)
    assert path.exists(), done.stdout + done.stderr
    results = json.loads(path.read_text())
    assert "error" not in results, results["error"]
    assert results["complete"]
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    return results


def test_picture_and_packed_data_are_undone_together(seen):
    first, second = seen["baked 1"], seen["baked 3"]
    assert first[0] == first[1] > 0
    assert second == pytest.approx([3 * first[0]] * 2, rel=1e-3)
    assert seen["undone"] == seen["undone light"] == first
    assert seen["undone all"] == [-1, -1]  # no image
    assert seen["redone"] == seen["redone light"] == first
    assert seen["redone all"] == second


def test_a_running_bake_survives_undo_and_keeps_its_result(seen):
    assert seen["runs"]
    assert seen["still runs"]
    # Of more texels, which see the border a little differently.
    assert seen["baked across undo"] == pytest.approx([7 * seen["baked 1"][0]] * 2, rel=0.05)
    assert not seen["said"]
    assert seen["undone at last"] == seen["baked 3"]
