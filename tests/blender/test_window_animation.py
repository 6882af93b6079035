"""Bake Animation in a window, cancelled and begun again, and the warning of a rendered animation."""

import pytest
from scenario_player import results_of


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of window_animation.py."""
    return results_of("window_animation", tmp_path_factory.mktemp("window"), size=(800, 600))


def test_escape_keeps_the_frames_that_are_done_and_shows_them(seen):
    assert seen["started"] == ["RUNNING_MODAL"]
    names, frame, is_sequence = seen["after esc"]
    assert 2 <= len(names) < 6
    assert frame == 2  # as before the bake
    assert is_sequence


def test_the_next_run_bakes_the_others(seen):
    assert seen["kept"]
    assert seen["files"] == [f"Plane_Medium_{number:04d}.exr" for number in range(1, 7)]
    assert seen["frames"] == [1, 6]


def test_the_status_bar_names_the_frame(seen):
    assert any("(frame 2, 2 of 6)" in line for line in seen["lines"])


def test_a_rendered_animation_of_one_bake_says_so_and_no_other_render_does(seen):
    of_sequence, of_one_frame, of_one_bake = seen["popups by render"]
    assert of_sequence == of_one_frame == []
    ((title, (sentence,)),) = of_one_bake
    assert title == "Beamspread: the bake stands still in this animation"
    assert "'Light' changes with time, but 'Plane' shows one bake in all frames." in sentence
