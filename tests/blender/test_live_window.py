"""Live in a window, by its own timer; see live_window.py."""

import json
import subprocess
from pathlib import Path

import bpy
import pytest


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of live_window.py."""
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


def test_previews_follow_lamps_that_are_dragged_where_a_view_shows_materials(seen):
    assert seen["shown in solid view"] == 0
    assert seen["shown while dragged"] > 3


def test_live_rests_beside_a_bake_whose_result_stays(seen):
    assert seen["bake"] == ["RUNNING_MODAL"]
    assert seen["shown beside the bake"]
    assert seen["shown during the bake"] == 0
    assert seen["a change during the bake is shown"]
    assert seen["shown after the bake"] == 0
    assert seen["the bake stays"]


def test_strokes_go_to_the_own_image(seen):
    assert seen["slots while painting"] == ["Plane_Medium"]


def test_no_image_goes_while_blender_draws_an_icon_with_it(seen):
    """Blender draws icons in a thread, which crashed."""
    assert seen["icons are drawn"] == [True, False]


def test_undo_shows_the_preview_at_once_and_live_goes_on(seen):
    assert seen["shown right after undo"]
    assert seen["still on after undo"]


def test_only_its_switch_ends_live_and_nothing_stays_behind(seen):
    assert seen["failure"] == ""
    assert seen["threads"] == []
