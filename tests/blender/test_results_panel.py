"""Messages about bakes in panels."""

from beamspread.blender.jobs.state import Row, Status, state
from beamspread.blender.live import timer
from beamspread.blender.ui import bake_panel
from beamspread.core.messages import Level, Message, Messages, note, warning
from beamspread.core.target import Target
from panel_layout import Layout, context


def test_each_row_says_why_it_is_out_of_date_and_other_messages_come_once():
    layout = Layout()
    why, left_out = "Changed since its bake: lights.", "A lamp was left out."
    targets = [Target("First", "One"), Target("Second", "Two")]
    state.rows = {
        target: Row(target, Status.STALE, (warning(str(target), why), warning("", left_out)), True)
        for target in targets
    }
    bake_panel.draw_results(layout, context(), "", Messages())
    assert layout.said.count(why) == 2
    assert layout.said.count(left_out) == 1


def test_the_reason_of_a_failure_is_shown_once():
    layout, why, target = Layout(), "The albedo's red is 1.", Target("First", "One")
    message = Message(Level.ERROR, str(target), why)
    state.rows = {target: Row(target, Status.FAILED, (message,), is_stale=True)}
    bake_panel.draw_results(layout, context(), "", Messages([message]))
    assert "First: Failed" in layout.said
    assert why not in layout.said


def test_the_obstacle_of_live_is_shown_once(monkeypatch):
    layout, why = Layout(), "It is not flat."
    target = Target("First", "One")
    message = Message(Level.ERROR, str(target), why)
    state.rows = {target: Row(target, Status.FAILED, (message,))}
    monkeypatch.setattr(timer, "messages", lambda: [message, note("", "Live leaves out light of 'Lamp'.")])
    bake_panel.draw_bake(layout, context())
    assert layout.said.count(why) == 1
    assert "light of 'Lamp'" in layout.said


def test_what_live_and_a_bake_say_is_shown_once(monkeypatch):
    """A bake keeps the words alone."""
    layout, what, remedy = Layout(), "3 loose parts of 'First' are near to others.", "Separate them."
    target = Target("First", "One")
    state.rows = {target: Row(target, Status.BAKED, (note("", f"{what} {remedy}"),))}
    monkeypatch.setattr(timer, "messages", lambda: [note(str(target), what, remedy)])
    bake_panel.draw_bake(layout, context())
    assert layout.said.count(what) == 1
