"""What the panels show about the running bake and about the native module."""

from __future__ import annotations

import sys

_running = {"subject": "", "own": 0.0, "all": 0.0}


def native_problem() -> str:
    """One sentence if the native module could not be loaded, else an empty string."""
    return getattr(sys.modules[__package__], "NATIVE_PROBLEM", "")


def is_running() -> bool:
    """Whether a bake runs in the window."""
    return bool(_running["subject"])


def start(subject: str) -> None:
    """Note that a bake of `subject` has begun."""
    _running.update(subject=subject, own=0.0)


def update(own: float, everything: float) -> None:
    """Note how far this bake and all bakes of the run are, 0..1."""
    _running.update(own=own, all=everything)


def stop() -> None:
    """Note that no bake runs."""
    _running.update(subject="", own=0.0, all=0.0)


def lines() -> tuple[str, str]:
    """What is running, and how far it is."""
    return f"Baking {_running['subject']}", f"{_running['own']:.0%}, all {_running['all']:.0%} (Esc cancels)"


def redraw(context) -> None:
    """Have every area that shows the state show the new one."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "NODE_EDITOR"}:
                area.tag_redraw()
