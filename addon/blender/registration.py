"""Registration of a part's classes and handlers in Blender: completely or not at all, and undone in reverse order."""

from __future__ import annotations

from collections.abc import Callable

import bpy

Step = tuple[Callable[[], object], Callable[[], object]]
"""A function that adds something to Blender, and the function that removes it."""


def classes(*types: type) -> list[Step]:
    """Steps that register classes."""
    return [
        (lambda cls=cls: bpy.utils.register_class(cls), lambda cls=cls: bpy.utils.unregister_class(cls))
        for cls in types
    ]


def handlers(**functions: Callable) -> list[Step]:
    """Steps that add functions to the lists of these names in `bpy.app.handlers`."""
    return [
        (lambda name=name, call=call: _list(name).append(call), lambda name=name, call=call: _list(name).remove(call))
        for name, call in functions.items()
    ]


def all_or_nothing(*steps: Step) -> tuple[Callable[[], None], Callable[[], None]]:
    """`register` and `unregister` of a part. A step that fails undoes the steps before it and raises."""

    def register() -> None:
        for number, (add, _) in enumerate(steps):
            try:
                add()
            except BaseException:
                _undo(steps[:number])
                raise

    def unregister() -> None:
        _undo(steps)

    return register, unregister


def _undo(steps: tuple[Step, ...]) -> None:
    for _, remove in reversed(steps):
        remove()


def _list(name: str) -> list[Callable]:
    return getattr(bpy.app.handlers, name)
