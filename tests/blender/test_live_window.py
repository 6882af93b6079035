"""Live in a window, by its own timer; see live_window.py."""

import json
import subprocess
from pathlib import Path

import bpy
import pytest


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """What live_window.py noted."""
    if not bpy.app.binary_path:
        pytest.skip("the bpy module opens no window")
    path = tmp_path_factory.mktemp("window") / "results.json"
    screen = ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24 +extension GLX"]
    options = ["--factory-startup", "--window-geometry", "0", "0", "640", "480"]
    script = ["--python-exit-code", "1", "--python", str(Path(__file__).with_name("live_window.py")), "--", str(path)]
    command = [*screen, bpy.app.binary_path, *options, *script]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert path.exists(), done.stdout + done.stderr
    results = json.loads(path.read_text())
    assert "error" not in results, results["error"]
    assert results["complete"]
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    return results


def test_pictures_come_while_lamps_are_dragged_and_where_somebody_looks(seen):
    assert seen["painted in solid view"] == 0
    assert seen["painted while dragged"] > 3


def test_a_bake_has_the_images_to_itself_and_stays(seen):
    assert seen["bake"] == ["RUNNING_MODAL"]
    assert seen["painted during the bake"] == 0
    assert seen["painted after the bake"] == 0
    assert seen["the bake stays"]


def test_no_image_goes_while_blender_draws_an_icon_with_it(seen):
    """In a thread, which crashed."""
    assert seen["icons are drawn"] == [True, False]


def test_nothing_ends_it_but_its_switch_and_it_leaves_nothing_behind(seen):
    assert seen["still on after undo"]
    assert seen["failure"] == ""
    assert seen["threads"] == []
