"""Mean free path and thickness of the node as artists edit them: one length with a color, and infinite or not.

The node's `mean_free_path`, a length for each channel, and its `thickness` are the only places that store them.
"""

from __future__ import annotations

import math

import bpy
from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty

SLIDER_START, SLIDER_DECADES = 1e-5, 5.0
"""Shortest length on the slider in meters, and the powers of ten above it. More: coarser to the hand."""

STEP = 0.0001
"""Step of the length, which Blender makes 1 µm for each pixel of the mouse; ten times as much makes it 1 mm."""

SHORTEST = 1e-9
"""Shortest length that an edit sets, scene units: the color of the path is relative to its longest channel."""

SMALLEST_RATIO = 1e-3
"""Smallest ratio of a channel to the longest one that the color sets: black must not stop the light."""

SLAB_PATHS = 10.0
"""Thickness in mean free paths of a material that stops being infinite; larger: less light comes through."""


def meters_per_unit(context=None) -> float:
    """Meters in a scene unit; lengths of the node are in scene units."""
    scene = getattr(context or bpy.context, "scene", None)
    return scene.unit_settings.scale_length if scene is not None else 1.0


def _longest(node) -> float:
    return max(*node.mean_free_path, 0.0)


def _ratio(node) -> list[float]:
    longest = _longest(node)
    return [min(max(length / longest, 0.0), 1.0) if longest > 0 else 1.0 for length in node.mean_free_path]


def _set_longest(node, length: float) -> None:
    length = max(length, SHORTEST)
    node.mean_free_path = [length * ratio for ratio in _ratio(node)]


def _set_ratio(node, color) -> None:
    brightest = max(color)
    ratios = [max(channel / brightest, SMALLEST_RATIO) if brightest > 0 else 1.0 for channel in color]
    longest = max(_longest(node), SHORTEST)
    node.mean_free_path = [longest * ratio for ratio in ratios]


def _slider(node) -> float:
    meters = max(_longest(node) * meters_per_unit(), SLIDER_START)
    return min(math.log10(meters / SLIDER_START) / SLIDER_DECADES, 1.0) * 100.0


def _set_slider(node, percent: float) -> None:
    _set_longest(node, SLIDER_START * 10 ** (SLIDER_DECADES * percent / 100.0) / meters_per_unit())


def _set_infinite(node, is_infinite: bool) -> None:
    if is_infinite:
        node.thickness = 0.0
    elif node.thickness == 0:
        node.thickness = SLAB_PATHS * max(_longest(node), SHORTEST)


class PathProperties:
    """Properties of the node that edit its mean free path and its thickness; see `BeamspreadNode`."""

    path_length: FloatProperty(
        name="Mean Free Path",
        description="Set the mean distance that light travels between two scattering events, in the channel where it "
        "is longest. Larger: softer, and shadows fill with light",
        subtype="DISTANCE",
        unit="LENGTH",
        min=0.0,
        soft_max=10.0,
        precision=6,
        step=STEP,
        get=_longest,
        set=_set_longest,
        options=set(),
    )
    path_slider: FloatProperty(
        name="Shorter to Longer",
        description="Change the mean free path by dragging. 0 % is 0.01 mm, 100 % is 1 m, and every 20 % make it ten "
        "times as long",
        subtype="PERCENTAGE",
        min=0.0,
        max=100.0,
        precision=1,
        get=_slider,
        set=_set_slider,
        options=set(),
    )
    path_color: FloatVectorProperty(
        name="Path Color",
        description="Set how far each color travels, relative to the mean free path: red light goes farther than blue "
        "in skin, so its path color is red",
        subtype="COLOR",
        size=3,
        min=0.0,
        max=1.0,
        get=_ratio,
        set=_set_ratio,
        options=set(),
    )
    is_infinite: BoolProperty(
        name="Infinite Depth",
        description="Make the material infinitely thick. Off: a slab of the thickness below",
        get=lambda node: node.thickness == 0,
        set=_set_infinite,
        options=set(),
    )
