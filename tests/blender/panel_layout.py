"""A layout for panels to draw into, which keeps the lines, and a context to draw them in."""

from types import SimpleNamespace

import bpy
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.ui import bake_panel


class Layout:
    """Takes labels alone."""

    def __init__(self):
        self.said = ""

    def box(self):
        return self

    def column(self, **_options):
        return self

    def row(self, **_options):
        return self

    def operator(self, *_arguments, **_options):
        return SimpleNamespace()

    def prop(self, *_arguments, **_options):
        pass

    def label(self, text, icon):
        self.said += f"{text} "


def context():
    """Height of a panel of Blender's default width."""
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    region = SimpleNamespace(width=280, type="WINDOW")
    return SimpleNamespace(
        region=region, preferences=preferences, scene=bpy.context.scene, view_layer=bpy.context.view_layer
    )


def panel() -> str:
    """The text of the bake's panel."""
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    layout = Layout()
    bake_panel.draw_bake(layout, context())
    return layout.said
