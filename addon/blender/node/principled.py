"""Copies the look of a material's Principled BSDF to the node."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.material import (
    FIXED_RADIUS,
    MEAN_FREE_PATH,
    ior_of_reflectance,
    reflectance_of_ior,
    transport_length,
)
from .. import compat
from .output import former_output
from .tree import BASE_COLOR, NORMAL, ROUGHNESS

PRINCIPLED = "ShaderNodeBsdfPrincipled"

# Largest reflectance at normal incidence; it is that of an index of refraction of 3.
MAX_REFLECTANCE = 0.25

# Inputs of a Principled BSDF that the node lacks.
LOST = ("Metallic", "Transmission", "Transmission Weight", "Sheen", "Sheen Weight", "Clearcoat", "Coat Weight")


def find_principled(node):
    """Principled BSDF to copy: the one that the material showed before, else one that is linked, else any; or None."""
    former = former_output(node)
    if former is not None and former.node.bl_idname == PRINCIPLED:
        return former.node
    candidates = [candidate for candidate in node.id_data.nodes if candidate.bl_idname == PRINCIPLED]
    linked = [candidate for candidate in candidates if candidate.outputs[0].is_linked]
    return next(iter(linked + candidates), None)


@dataclass(frozen=True)
class _Inputs:
    """Inputs of a Principled BSDF, by any of their names in different versions of Blender."""

    node: object

    def socket(self, *names: str):
        return next((self.node.inputs[name] for name in names if name in self.node.inputs), None)

    def value(self, *names: str, default=0.0):
        socket = self.socket(*names)
        return default if socket is None else socket.default_value

    def source(self, *names: str):
        """Output that is linked to an input, or None."""
        socket = self.socket(*names)
        return socket.links[0].from_socket if socket is not None and socket.is_linked else None


def take_over(node, principled) -> list[str]:
    """Copy the Principled BSDF's values and links to the node; returns sentences on those that it lacks."""
    inputs, notes = _Inputs(principled), []
    weight = inputs.value("Subsurface Weight", "Subsurface")
    color = _take_color(node, inputs, weight)
    node.ior = _ior(inputs)
    lengths = _mean_free_path(inputs, principled, weight, color)
    if lengths is None:
        notes.append(f"'{principled.name}' has no subsurface scattering: the mean free path stays unchanged.")
    else:
        node.anisotropy = inputs.value("Subsurface Anisotropy")
        node.mean_free_path = [length * (1 - node.anisotropy) for length in lengths]
    _take_input(node, ROUGHNESS, inputs)
    _take_input(node, NORMAL, inputs)
    linked = [name for name in ("Subsurface Radius", "Subsurface Scale", "IOR") if inputs.source(name) is not None]
    if linked:
        notes.append(
            f"The node can't have textures for {', '.join(linked)}: the links in '{principled.name}' are ignored."
        )
    lost = [name for name in LOST if inputs.value(name) > 0 or inputs.source(name) is not None]
    if lost:
        notes.append(f"The node has no {', '.join(lost)}: these values of '{principled.name}' are ignored.")
    return notes


def _take_color(node, inputs: _Inputs, weight: float) -> tuple[float, float, float]:
    """Copy the color or its texture; before Blender 4.0 scattered light had a color of its own, mixed by its weight."""
    names = ["Base Color"]
    if weight > 0.5 and inputs.socket("Subsurface Color") is not None:
        names.insert(0, "Subsurface Color")
    source = inputs.source(names[0])
    if source is not None:
        node.id_data.links.new(node.inputs[BASE_COLOR], source)
        return (0.8, 0.8, 0.8)
    for link in list(node.inputs[BASE_COLOR].links):
        node.id_data.links.remove(link)
    node.color_mode = "BASE_COLOR"
    node.base_color = inputs.value(names[0])[:3]
    return tuple(node.base_color)


def _ior(inputs: _Inputs) -> float:
    """Index of refraction with the reflectance at normal incidence of the Principled BSDF.

    The reflectance is 8 % times Specular before Blender 4.0. From 4.0 on it is that of the IOR, times twice the level.
    """
    if inputs.socket("Specular IOR Level") is None:
        reflected = 0.08 * inputs.value("Specular", default=0.5)
    else:
        reflected = reflectance_of_ior(inputs.value("IOR")) * 2 * inputs.value("Specular IOR Level")
    return ior_of_reflectance(min(max(reflected, 0.0), MAX_REFLECTANCE))


def _mean_free_path(inputs: _Inputs, principled, weight: float, color) -> list[float] | None:
    """Mean free path of each channel at an anisotropy of 0, in scene units; None without subsurface scattering."""
    scale = inputs.value("Subsurface Scale", default=weight)
    radii = [radius * scale for radius in inputs.value("Subsurface Radius")]
    if weight <= 0 or not all(radius > 0 for radius in radii):
        return None
    method = FIXED_RADIUS if compat.has_fixed_radius(principled) else MEAN_FREE_PATH
    ior = inputs.value("Subsurface IOR", default=1.4)
    return [transport_length(radius, method, channel, ior) for radius, channel in zip(radii, color)]


def _take_input(node, name: str, inputs: _Inputs) -> None:
    source, target = inputs.source(name), node.inputs[name]
    for link in list(target.links):
        node.id_data.links.remove(link)
    if source is not None:
        node.id_data.links.new(target, source)
    elif name != NORMAL:
        target.default_value = inputs.value(name)
