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


def pages_of(names):
    """The page that Blender's F1 opens for each button; None for a button without one."""
    import bl_operators.wm as buttons

    look_up = buttons.WM_OT_doc_view_manual._lookup_rna_url
    return {name: look_up(buttons._wm_doc_get_id(name, do_url=False), verbose=False) for name in names}


def test_f1_opens_a_page_on_each_value_and_button():
    node = bpy.data.materials.new("Medium")
    node.use_nodes = True
    node = node.node_tree.nodes.new("BeamspreadNode")
    inherited = {item.identifier for item in bpy.types.ShaderNodeCustomGroup.bl_rna.properties}
    own = {item.identifier for item in node.bl_rna.properties} - inherited
    names = [f"BeamspreadNode.{name}" for name in own]
    settings = type(bpy.context.scene.beamspread)
    names += [f"{settings.__name__}.{name}" for name in settings.__annotations__]
    names += [f"beamspread.{name}" for name in dir(bpy.ops.beamspread)]
    assert len(names) > 50
    assert [name for name, page in pages_of(names).items() if page is None or "docs/" not in page] == []
