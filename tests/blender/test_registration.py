"""The add-on is registered as a whole or not at all."""

import bpy
import pytest
from beamspread import blender
from beamspread.blender.jobs.run import operator


def handlers():
    """Our functions that Blender calls."""
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers) if name != "persistent"}
    entries = [
        (name, function) for name, functions in lists.items() if isinstance(functions, list) for function in functions
    ]
    return [(name, function.__name__) for name, function in entries if function.__module__.startswith("beamspread")]


def registered():
    names = [name for name in dir(bpy.types) if name.startswith(("BEAMSPREAD_", "Beamspread"))]
    return names, handlers(), hasattr(bpy.types.Scene, "beamspread")


def test_a_registration_that_fails_half_way_leaves_nothing():
    before = registered()
    assert before[1]
    blender.unregister()
    nothing = registered()
    assert nothing == ([], [], False)
    register, seen = bpy.utils.register_class, []

    def refuse(cls):
        seen.append(cls.__name__)
        if cls is operator.BEAMSPREAD_OT_cancel:
            raise RuntimeError("no")
        register(cls)

    try:
        bpy.utils.register_class = refuse
        with pytest.raises(RuntimeError, match="no"):
            blender.register()
        assert len(seen) > 5
        assert registered() == nothing
    finally:
        bpy.utils.register_class = register
        blender.register()
    assert registered() == before
