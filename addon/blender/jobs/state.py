"""What panels show of bakes: the one that runs, and what was said of each target when it was last baked.

Operators and engines don't outlive their calls, and panels can't ask them; hence one object for the whole process.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ...core.bake.runner import Bake, Target


class State:
    """Progress and messages."""

    def __init__(self) -> None:
        self._subject, self._own, self._all = "", 0.0, 0.0
        self._messages: dict[str, list[str]] = {}

    def is_running(self) -> bool:
        """Whether a bake runs in the window."""
        return bool(self._subject)

    def start(self, subject: Target) -> None:
        self._subject, self._own = str(subject), 0.0

    def update(self, own: float, everything: float) -> None:
        """Note how far this bake and all bakes of the run are, 0..1."""
        self._own, self._all = own, everything

    def stop(self) -> None:
        self._subject, self._own, self._all = "", 0.0, 0.0

    def progress(self) -> tuple[str, str]:
        """What is running, and how far it is."""
        return f"Baking {self._subject}", f"{self._own:.0%}, all {self._all:.0%} (Esc cancels)"

    def note(self, bake: Bake) -> None:
        """Keep what there is to say of a bake in place of what was said of its target before."""
        self._messages.pop(bake.target.object_name, None)  # what was said while nothing of it could be baked
        error = [f"{bake.target}: {bake.error}"] if bake.error else []
        self._messages[str(bake.target)] = error + bake.warnings

    def messages(self) -> list[str]:
        """Everything said, each sentence once."""
        return list(dict.fromkeys(message for said in self._messages.values() for message in said))

    def forget(self) -> None:
        self._messages.clear()


state = State()


def redraw(context) -> None:
    """Have every area that shows the state show the new one."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "NODE_EDITOR"}:
                area.tag_redraw()


@persistent
def _forget(*_arguments) -> None:
    state.forget()


def register() -> None:
    bpy.app.handlers.load_pre.append(_forget)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(_forget)
