"""The two ways to set the node's color: base color and scattering albedo. A switch between them converts the value.

A value is *own* if the user has set it, and derived if a switch made it from the other one. A switch to an own value
changes nothing, so that going back and forth is exact.
"""

from __future__ import annotations

import contextlib

from bpy.props import BoolProperty

from ...core.errors import MaterialError
from ...core.material import preset_roughness, presets
from ..preferences import CUSTOM_PRESET
from .tree import ROUGHNESS

BASE_COLOR_MODE, ALBEDO_MODE = "BASE_COLOR", "ALBEDO"

SAME = 1e-5
"""Relative difference up to which a value is that of its preset: rounding of 32-bit floats, and of scene units."""

_OWN = {BASE_COLOR_MODE: "has_own_base_color", ALBEDO_MODE: "has_own_albedo"}
_OTHER = {BASE_COLOR_MODE: ALBEDO_MODE, ALBEDO_MODE: BASE_COLOR_MODE}

_nodes_being_filled: set[int] = set()


class ColorProperties:
    """Hidden properties of the node: the origin of its colors; see `BeamspreadNode`."""

    has_own_base_color: BoolProperty(options={"HIDDEN"}, description="Base color set by the user")
    has_own_albedo: BoolProperty(options={"HIDDEN"}, description="Albedo set by the user")
    has_new_color: BoolProperty(options={"HIDDEN"}, description="Color of a new node, whose mode nobody has chosen")


@contextlib.contextmanager
def filling(node):
    """Keep the preset's name and the color's origin while values are set in a `with` block."""
    key, was_filled = node.as_pointer(), is_filled(node)
    _nodes_being_filled.add(key)
    try:
        yield
    finally:
        if not was_filled:
            _nodes_being_filled.discard(key)


def is_filled(node) -> bool:
    """True while `filling` sets values of the node."""
    return node.as_pointer() in _nodes_being_filled


def start(node, color) -> None:
    """Give a new node its base color."""
    with filling(node):
        node.color_mode, node.base_color = BASE_COLOR_MODE, color
    node.has_own_base_color = node.has_new_color = True


def upgrade_color(node) -> None:
    """Note which color of a node from an older file is the user's: the one that counts."""
    if is_older(node):
        setattr(node, _OWN[node.color_mode], True)


def is_older(node) -> bool:
    """True if a version of the add-on that did not note the origin of colors made the node."""
    return not (node.has_own_base_color or node.has_own_albedo)


def note_own(node, mode: str) -> None:
    """Note that the user has set the base color, or the albedo.

    A script may set the albedo alone, since nodes began with it: while nobody has chosen another mode, that counts.
    """
    setattr(node, _OWN[mode], True)
    if node.has_new_color:
        node.has_new_color = False
        if mode != node.color_mode:
            with filling(node):
                node.color_mode = mode
    if mode == node.color_mode:
        setattr(node, _OWN[_OTHER[mode]], False)


def note_medium(node) -> None:
    """Note that the user has set another value of the medium: from now on the color that is shown stays."""
    if not getattr(node, _OWN[node.color_mode]):
        note_own(node, node.color_mode)


def switch_mode(node) -> None:
    """Convert the color to the mode that the node has now."""
    node.has_new_color = False
    mode, other = node.color_mode, _OTHER[node.color_mode]
    if getattr(node, _OWN[mode]):
        return
    if not getattr(node, _OWN[other]):
        upgrade_color(node)  # an older node that a script has appended: which mode it had is not known
        return
    surface = node.surface_in(other)
    try:
        value = surface.reflectance() if mode == BASE_COLOR_MODE else surface.exact_albedo()
    except (MaterialError, ImportError):  # the bake says why; the module may be missing
        return
    with filling(node):
        setattr(node, mode.lower(), value)


def fill_preset(node, meters_per_unit: float) -> None:
    """Set the values of the node's preset; lengths are in scene units."""
    # The node has one anisotropy for all channels.
    material = presets()[node.preset].with_one_anisotropy()
    with filling(node):
        node.color_mode, node.albedo = ALBEDO_MODE, material.albedo
        node.mean_free_path = [length / meters_per_unit for length in material.mean_free_path]
        node.anisotropy, node.ior = material.anisotropy, material.ior
    if ROUGHNESS in node.inputs:
        node.inputs[ROUGHNESS].default_value = preset_roughness()[node.preset]
    node.has_own_albedo, node.has_own_base_color, node.has_new_color = True, False, False


def keep_name_of_preset(node, meters_per_unit: float) -> None:
    """Call the preset Custom if its lengths are no longer those of the material, as after another Unit Scale."""
    if node.preset == CUSTOM_PRESET:
        return
    lengths = presets()[node.preset].with_one_anisotropy().mean_free_path
    pairs = zip(node.mean_free_path, lengths)
    if any(abs(length * meters_per_unit - wanted) > SAME * wanted for length, wanted in pairs):
        node.preset = CUSTOM_PRESET
