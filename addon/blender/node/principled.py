"""Takes over the look of a material's Principled BSDF."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.material.principled import (
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

# Over 1 an index of refraction would be endless; 0.25 is one of 3.
HIGHEST_REFLECTANCE = 0.25

# Parts of a Principled BSDF that a translucent surface has not.
LOST = ("Metallic", "Transmission", "Transmission Weight", "Sheen", "Sheen Weight", "Clearcoat", "Coat Weight")


def find_principled(node):
    """The Principled BSDF that the node may follow: what its material showed before, else the only or active one."""
    former = former_output(node)
    if former is not None and former.node.bl_idname == PRINCIPLED:
        return former.node
    found = [one for one in node.id_data.nodes if one.bl_idname == PRINCIPLED]
    linked = [one for one in found if one.outputs[0].is_linked]
    return next(iter(linked + found), None)


@dataclass(frozen=True)
class _Inputs:
    """A Principled BSDF's inputs, by any of the names that they have had."""

    node: object

    def socket(self, *names: str):
        return next((self.node.inputs[name] for name in names if name in self.node.inputs), None)

    def value(self, *names: str, default=0.0):
        socket = self.socket(*names)
        return default if socket is None else socket.default_value

    def source(self, *names: str):
        """The output that is linked to it, or None."""
        socket = self.socket(*names)
        return socket.links[0].from_socket if socket is not None and socket.is_linked else None


def take_over(node, principled) -> list[str]:
    """Set the node's values and links from the Principled BSDF's; sentences on what it can't have."""
    inputs, notes = _Inputs(principled), []
    weight = inputs.value("Subsurface Weight", "Subsurface")
    color = _take_color(node, inputs, weight)
    node.ior = _ior(inputs)
    lengths = _mean_free_path(inputs, principled, weight, color)
    if lengths is None:
        notes.append(f"'{principled.name}' has no subsurface scattering: the mean free path stays as it was.")
    else:
        node.anisotropy = inputs.value("Subsurface Anisotropy")
        node.mean_free_path = [length * (1 - node.anisotropy) for length in lengths]
    _take_input(node, ROUGHNESS, inputs)
    _take_input(node, NORMAL, inputs)
    linked = [name for name in ("Subsurface Radius", "Subsurface Scale", "IOR") if inputs.source(name) is not None]
    if linked:
        notes.append(
            f"The node has one value of {', '.join(linked)}: what is linked there in '{principled.name}' is lost."
        )
    lost = [name for name in LOST if inputs.value(name) > 0 or inputs.source(name) is not None]
    if lost:
        notes.append(f"A translucent surface has no {', '.join(lost)}: this part of '{principled.name}' is lost.")
    return notes


def _take_color(node, inputs: _Inputs, weight: float) -> tuple[float, float, float]:
    """Value or texture; before Blender 4.0 scattered light had a colour of its own, mixed in by its weight."""
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
    """From what is reflected straight on: 8 % times Specular before Blender 4.0, twice the level times that of the IOR
    since."""
    if inputs.socket("Specular IOR Level") is None:
        reflected = 0.08 * inputs.value("Specular", default=0.5)
    else:
        reflected = reflectance_of_ior(inputs.value("IOR")) * 2 * inputs.value("Specular IOR Level")
    return ior_of_reflectance(min(max(reflected, 0.0), HIGHEST_REFLECTANCE))


def _mean_free_path(inputs: _Inputs, principled, weight: float, color) -> list[float] | None:
    """Per channel, at an anisotropy of 0 and in scene units, or None where nothing is scattered."""
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
