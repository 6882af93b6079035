"""Sentences that nobody should miss: a popup in the window, since Blender's own reports of a modal operator hide."""

from __future__ import annotations

import bpy

LETTERS, MOST_SENTENCES = 80, 8

# Blender shows no popup from within the operator that is about to end.
DELAY_SECONDS = 0.05


def wrap(text: str, width: int) -> list[str]:
    """Lines of at most so many letters, if no word is longer."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def show_soon(title: str, sentences: list[str]) -> None:
    """Open the popup where the mouse is, once whatever runs has ended."""

    def draw(menu, _context) -> None:
        for sentence in sentences[:MOST_SENTENCES]:
            for number, line in enumerate(wrap(sentence, LETTERS)):
                menu.layout.label(text=line, icon="BLANK1" if number else "ERROR")
        if len(sentences) > MOST_SENTENCES:
            menu.layout.label(text=f"And {len(sentences) - MOST_SENTENCES} more, in the panel.", icon="BLANK1")

    def show() -> None:
        manager = bpy.context.window_manager
        if manager.windows:
            with bpy.context.temp_override(window=bpy.context.window or manager.windows[0]):
                bpy.context.window_manager.popup_menu(draw, title=title, icon="INFO")

    bpy.app.timers.register(show, first_interval=DELAY_SECONDS)
