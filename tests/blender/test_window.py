"""The operator and the panels in a window: started, watched, cancelled and undone by events, drawn for real."""

import bpy
import pytest
from beamspread.blender import compat
from beamspread.blender.node import buttons
from beamspread.blender.ui import panels
from scenario_player import results_of


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of window.py."""
    return results_of("window", tmp_path_factory.mktemp("window"))


def test_every_panel_the_node_and_its_menu_are_drawn(seen):
    assert set(seen["drawn"]) == {panel.__name__ for panel in panels._classes} | {"draw", "buttons"}


def test_appended_nodes_of_older_files_are_upgraded(seen):
    assert seen["upgraded"] == [False, True]


def test_a_bake_runs_beside_the_user_and_one_at_a_time(seen):
    assert seen["returned"] == ["RUNNING_MODAL"]
    assert seen["running"] == "First / First"
    assert not seen["can start another"]
    first, second = seen["baked"]
    # The same plane under the same sun twice.
    assert first == second > 0


def test_a_bake_is_one_step_of_undo(seen):
    assert seen["after undo"] == [-1, -1]
    assert seen["after redo"] == seen["baked"]


def test_escape_ends_a_bake_of_minutes_and_keeps_the_images(seen):
    own, everything, stage, position = seen["progress"]
    assert 0 < own < 1
    assert (stage, position) == ("Baking", "1 of 2")
    assert everything == pytest.approx(own / 2, rel=0.1)
    # CPU time. The window is drawn by software; test_queue.py times the bake alone.
    assert seen["seconds to cancel"] < 10
    assert seen["kept by cancel"]
    assert seen["standing after cancel"] == "Cancelled"
    assert seen["messages of cancel"] == []  # the standing says it


def test_escape_ends_the_last_opened_tool(seen):
    assert seen["goes on behind a menu"]


def test_a_first_look_is_there_before_the_simulation_and_stays_if_that_is_cancelled(seen):
    steps = [step for step in seen["steps"] if step != "Baking"]  # which may be over before anyone looks
    assert steps == ["Simulating the material (quick preview)", "Simulating the material (only the first time)"]
    assert seen["first look"][0]
    assert "Quick preview" in seen["first look"][1]
    assert seen["out of date"]


def test_failures_are_shown_in_the_panels_and_the_others_are_baked(seen):
    sentence = "First / First: The material or its Beamspread node was removed or renamed during the bake. Bake again."
    assert sentence in seen["messages of removal"]
    assert sentence.partition(": ")[2] in seen["shown"]
    assert any(sentence in sentences for _, sentences in seen["popups"])
    # The sun became 100 times as strong; 512 instead of 32 texels see the border a little differently.
    assert seen["baked after removal"] == pytest.approx(100, rel=0.05)


def test_bakes_that_cannot_start_are_named_in_one_popup(seen):
    assert seen["refused"] == ["CANCELLED"]
    ((title, (sentence,)),) = seen["popups of refusal"]
    assert title == "Beamspread: nothing was baked"
    assert "albedo's red is 1" in sentence


def test_an_error_ends_the_run_is_said_and_the_next_bake_works(seen):
    why = "An error of the add-on has ended the bake: what went wrong"
    popup = ["Beamspread: nothing was baked", [why]]
    assert [(popups, timers) for popups, _, timers in seen["of errors"]] == [([popup], 0)] * 2
    assert [messages for _, messages, _ in seen["of errors"]] == [[], [f"Second / Second: {why}"]]
    assert seen["after errors"] == [["RUNNING_MODAL"], []]


def test_a_bake_that_ends_at_once_ends_its_run(seen):
    assert seen["ends at once"] == ["RUNNING_MODAL"]


def test_disabling_the_add_on_ends_the_bake_and_its_timer(seen):
    assert seen["ticks when disabled"] == 0
    assert not seen["runs on when disabled"]


def test_loading_another_file_ends_the_bake(seen):
    assert not seen["runs on in the next file"]


def test_the_node_is_added_under_shader():
    shader_menu = compat.shader_menu()
    assert shader_menu.__name__ in compat.SHADER_MENUS
    assert buttons._draw_menu in shader_menu.draw._draw_funcs
    assert buttons._draw_menu not in getattr(bpy.types.NODE_MT_add.draw, "_draw_funcs", [])
