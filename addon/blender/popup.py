"""Popups with important messages. Blender hides the reports of a modal operator in the Info editor."""

from __future__ import annotations

import textwrap

import bpy

MAX_LETTERS = 80
"""Letters in a line."""

MAX_MESSAGES = 8
"""Messages in a popup."""

DELAY_SECONDS = 0.05
"""Time until a popup opens. Blender shows none while the operator that asks for it still runs."""


def wrap(text: str, width: int) -> list[str]:
    """Lines of at most `width` letters; longer words, as names of objects, are broken."""
    return textwrap.wrap(text, width, break_on_hyphens=False) or [""]


def show_soon(title: str, messages: list[str]) -> None:
    """Open a popup at the mouse once the running operator has ended."""

    def draw(menu, _context) -> None:
        for message in messages[:MAX_MESSAGES]:
            for number, line in enumerate(wrap(message, MAX_LETTERS)):
                menu.layout.label(text=line, icon="BLANK1" if number else "ERROR")
        if len(messages) > MAX_MESSAGES:
            menu.layout.label(text=f"And {len(messages) - MAX_MESSAGES} more, in the panel.", icon="BLANK1")

    def show() -> None:
        manager = bpy.context.window_manager
        if manager.windows:
            with bpy.context.temp_override(window=bpy.context.window or manager.windows[0]):
                bpy.context.window_manager.popup_menu(draw, title=title, icon="INFO")

    bpy.app.timers.register(show, first_interval=DELAY_SECONDS)
