"""Labels and choices fit into a side bar of the default width, in Blender's own font."""

from types import SimpleNamespace

import blf
import bpy
import pytest
from beamspread.blender import compat
from beamspread.blender.node.draw import draw_properties
from beamspread.blender.node.node import BeamspreadNode

POINTS = 11
"""Size of the font of Blender's default theme."""

PIXELS = 160
"""Pixels that a text has beside its icon in a side bar of 229 pixels."""

FIELD_PIXELS, PANEL_PIXELS = 78, 90
"""Pixels that the choice of an enum has in the right half of such a side bar, and in that of the render properties."""


def width_of(text: str) -> float:
    """Pixels of a text at a user-interface scale of 1."""
    blf.size(0, POINTS)
    return blf.dimensions(0, text)[0]


class Recorder:
    """A layout that keeps labels and the fields that share a line with their names."""

    def __init__(self, is_split: bool) -> None:
        self.labels, self.fields = [], []
        self.use_property_split = is_split

    def column(self, **_options):
        return self._part()

    row = column

    def _part(self):
        part = Recorder(self.use_property_split)
        part.labels, part.fields = self.labels, self.fields
        return part

    def label(self, text, **_options):
        self.labels.append(text)

    def operator(self, _name, text, **_options):
        self.labels.append(text)
        return SimpleNamespace()

    def prop(self, _owner, name, **_options):
        self.fields += [name] if self.use_property_split else []

    def operator_menu_enum(self, _name, _kind, text, **_options):
        self.labels.append(text)

    def template_ID(self, *_arguments, **_options):
        pass

    def prop_search(self, *_arguments, **_options):
        pass


def drawn(preset: str, mode: str) -> Recorder:
    """The labels and fields that a panel draws for a node."""
    material = bpy.data.materials.new("Drawn")
    material.use_nodes = True
    node = material.node_tree.nodes.new(BeamspreadNode.bl_idname)
    node.preset, node.color_mode = preset, mode
    layout = Recorder(is_split=True)
    draw_properties(node, layout)
    bpy.data.materials.remove(material)
    return layout


@pytest.mark.parametrize("mode", ["BASE_COLOR", "ALBEDO"])
def test_labels_of_every_preset_fit(mode):
    presets = [item.identifier for item in BeamspreadNode.bl_rna.properties["preset"].enum_items[1:]]
    cut = {text for preset in presets for text in drawn(preset, mode).labels if width_of(text) > PIXELS}
    assert not cut


def test_the_line_of_the_path_has_a_label():
    labels = drawn("marble", "ALBEDO").labels
    assert "Mean free path:" in labels
    assert "0.456, 0.381, 0.333 mm" in labels


def test_choices_fit_into_their_fields():
    fields = drawn("marble", "ALBEDO").fields
    owners = [(BeamspreadNode, name, FIELD_PIXELS) for name in fields]
    settings = bpy.context.scene.beamspread
    owners += [(settings, prop.identifier, PANEL_PIXELS) for prop in settings.bl_rna.properties]
    choices = {
        f"{name}: {item.name}": width_of(item.name) - room
        for owner, name, room in owners
        if (prop := owner.bl_rna.properties[name]).type == "ENUM"
        for item in prop.enum_items
    }
    assert len(choices) > 20
    assert not {choice for choice, excess in choices.items() if excess > 0}


def test_a_preset_fits_into_a_whole_line():
    names = [item.name for item in BeamspreadNode.bl_rna.properties["preset"].enum_items]
    assert not [name for name in names if width_of(name) > PIXELS]
    assert "preset" not in drawn("marble", "ALBEDO").fields


def test_widths_are_those_of_the_window():
    """Texts that Blender 3.4 was seen to cut, and to show."""
    assert width_of("Scattering Albedo") > FIELD_PIXELS > width_of("Base Color") > 40
    assert width_of("Mean free path: 0.456, 0.381, 0.333 mm") > PIXELS


@pytest.mark.parametrize("fraction", [0.0, 0.5, 1.0])
def test_a_bar_fits(fraction):
    """Blender 3.4, which draws it by letters, was seen to cut a bar of `PIXELS`."""
    layout = Recorder(is_split=False)
    if "progress" in bpy.types.UILayout.bl_rna.functions:
        layout.progress = lambda factor, text: layout.label(text)
    compat.draw_progress_bar(layout, fraction, "49%, about 9 s left")
    assert layout.labels
    assert max(map(width_of, layout.labels)) < 0.95 * PIXELS
