"""What parts add to Blender: all of it or nothing, and taken away in reverse."""

from __future__ import annotations

from collections.abc import Callable

import bpy

Step = tuple[Callable[[], object], Callable[[], object]]
"""What adds something, and what takes it away again."""


def classes(*found: type) -> list[Step]:
    """Steps that register classes."""
    return [
        (lambda one=one: bpy.utils.register_class(one), lambda one=one: bpy.utils.unregister_class(one))
        for one in found
    ]


def handlers(**functions: Callable) -> list[Step]:
    """Steps that have Blender call functions, by the names of its lists in `bpy.app.handlers`."""
    lists = [(getattr(bpy.app.handlers, name), function) for name, function in functions.items()]
    return [(lambda one=one: one[0].append(one[1]), lambda one=one: one[0].remove(one[1])) for one in lists]


def all_or_nothing(*steps: Step) -> tuple[Callable[[], None], Callable[[], None]]:
    """`register` and `unregister` of a part: where a step fails, those before go again and the error surfaces."""

    def register() -> None:
        for number, (add, _) in enumerate(steps):
            try:
                add()
            except BaseException:
                _take_back(steps[:number])
                raise

    def unregister() -> None:
        _take_back(steps)

    return register, unregister


def _take_back(steps: tuple[Step, ...]) -> None:
    for _, remove in reversed(steps):
        remove()
