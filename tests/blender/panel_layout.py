"""A layout for panels to draw into, which keeps the lines, and a context to draw them in."""

from types import SimpleNamespace

import bpy


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
    region = SimpleNamespace(width=280)
    return SimpleNamespace(
        region=region, preferences=preferences, scene=bpy.context.scene, view_layer=bpy.context.view_layer
    )
