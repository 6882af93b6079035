"""What a bake of a mesh that bends replaces or leaves out, as messages."""

from __future__ import annotations

from ..messages import Message, note
from .bake_settings import ADJACENT_FACES, COMBINED, BakeSettings
from .surface import Surface

MAX_BEYOND = 0.01
"""Fraction of a surface that bends more than libraries know, above which a bake names it. More: fewer notes."""


def bent_messages(name: str, surface: Surface, settings: BakeSettings, beyond: float) -> list[Message]:
    """Messages about the object `name`; `beyond` is the fraction that bends more than its medium is known for."""
    messages = []
    if settings.margin and settings.margin_type == ADJACENT_FACES:
        text = f"The margin of '{name}', which bends, continues its UV islands in place of adjacent faces."
        messages.append(note(name, text, "Set Margin Type to Extend."))
    if settings.layer != COMBINED:
        return messages
    if beyond > MAX_BEYOND and not surface.thickness:
        bends = "bends more than its medium is known for: light there is approximate"
        text = f"{beyond:.0%} of the surface of '{name}' {bends}."
        messages.append(note(name, text, "A shorter Mean Free Path, or a larger object, bends less."))
    if settings.distributions != "library":
        text = f"The LDF samples know flat surfaces alone, so light in '{name}' spreads as if it did not bend."
        messages.append(note(name, text, "Set Distributions to Library."))
    elif surface.thickness > 0:
        text = f"'{name}' is a sheet that bends. Light in it spreads as in a flat one"
        mirrored = ", without light that its far face mirrors before it scatters" if surface.material.ior > 1 else ""
        messages.append(note(name, f"{text}{mirrored}.", "Where it bends tightly, bend it less or make it thinner."))
    return messages
