"""Live in a window, by its own timer; see live_window.py."""

import pytest
from scenario_player import results_of


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of live_window.py."""
    return results_of("live_window", tmp_path_factory.mktemp("window"), size=(640, 480))


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
