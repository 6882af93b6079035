"""Textures of targets of Live on their receivers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..bake.textured_bake import multiplied_note, why_multiplied, with_factors
from ..material import Material
from ..messages import Message
from ..scene.receiver import Receiver
from .live_target import LiveTarget


def is_scattered(target: LiveTarget) -> bool:
    """True if light is to scatter in the target's texture."""
    return target.texture is not None and target.texture.use.is_scattered


def textured(target: LiveTarget, receiver: Receiver, material: Material, sources: Sequence) -> Receiver:
    """The receiver with the target's texture, and with its factors for light that enters and leaves."""
    texture = target.texture
    if not is_scattered(target):
        return texture.on(receiver)
    if why_multiplied(target.settings):
        return target.surface.multiplied(texture).on(receiver)
    receiver = texture.on(receiver)
    grids, _ = with_factors([chart.grid for chart in receiver.charts], material, sources)
    charts = tuple(replace(chart, grid=grid) for chart, grid in zip(receiver.charts, grids))
    return replace(receiver, charts=charts)


def texture_notes(target: LiveTarget) -> tuple[Message, ...]:
    """Notes about a texture that can't scatter light."""
    why = why_multiplied(target.settings) if is_scattered(target) else ""
    return (multiplied_note(target.target.object_name, why),) if why else ()
