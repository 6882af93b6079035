"""Copies the look of a material's Principled BSDF, or of its Subsurface Scattering, to the node."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.material import Walk, ior_of_reflectance, mean_free_path, reflectance_of_ior
from .. import compat
from .output import former_output
from .tree import BASE_COLOR, NORMAL, ROUGHNESS

PRINCIPLED, SUBSURFACE = "ShaderNodeBsdfPrincipled", "ShaderNodeSubsurfaceScattering"

# Largest reflectance at normal incidence; it is that of an index of refraction of 3.
MAX_REFLECTANCE = 0.25

# Largest anisotropy of Cycles, in its walks of fixed radius and of skin, and in the others.
MAX_ANISOTROPY = 0.9, 0.99

# Inputs of a Principled BSDF that the node lacks, by any of their names, each with the value that has no effect.
LOST = {
    "Metallic": 0.0,
    "Alpha": 1.0,
    "Diffuse Roughness": 0.0,
    "Specular Tint": None,
    "Anisotropic": 0.0,
    "Transmission": 0.0,
    "Transmission Weight": 0.0,
    "Sheen": 0.0,
    "Sheen Weight": 0.0,
    "Clearcoat": 0.0,
    "Coat Weight": 0.0,
    "Thin Film Thickness": 0.0,
    "Thin Wall": False,
}


def find_shader(node):
    """Shader to copy, a Principled BSDF or a Subsurface Scattering, or None.

    It is the one that the material showed before, else one that is linked, else any; those that scatter light inside
    come first.
    """
    former = former_output(node)
    if former is not None and former.node.bl_idname in (PRINCIPLED, SUBSURFACE):
        return former.node
    candidates = [candidate for candidate in node.id_data.nodes if candidate.bl_idname in (PRINCIPLED, SUBSURFACE)]
    candidates.sort(key=lambda candidate: (not candidate.outputs[0].is_linked, not _scatters(candidate)))
    return next(iter(candidates), None)


def _scatters(shader) -> bool:
    inputs = _Inputs(shader)
    return shader.bl_idname == SUBSURFACE or inputs.has("Subsurface Weight", "Subsurface")


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

    def has(self, *names: str, neutral=0.0) -> bool:
        """True if an input is linked, or its value is not the neutral one."""
        return self.source(*names) is not None or self.value(*names, default=neutral) != neutral


def take_over(node, shader) -> list[str]:
    """Copy the shader's values and links to the node; returns sentences on those that it lacks or replaces."""
    inputs = _Inputs(shader)
    notes = _take_subsurface(node, inputs) if shader.bl_idname == SUBSURFACE else _take_principled(node, inputs)
    _take_input(node, NORMAL, inputs)
    lengths = ("Subsurface Radius", "Subsurface Scale", "Radius", "Scale", "IOR", "Subsurface Anisotropy", "Anisotropy")
    linked = [name for name in lengths if inputs.source(name) is not None]
    if linked:
        notes.append(f"The node can't have textures for {', '.join(linked)}: the links in '{shader.name}' are ignored.")
    lost = lost_inputs(shader) if shader.bl_idname == PRINCIPLED else []
    if lost:
        ignored = "this value of '{}' is ignored" if len(lost) == 1 else "these values of '{}' are ignored"
        notes.append(f"The node has no {', '.join(lost)}: {ignored.format(shader.name)}.")
    return notes


def _take_subsurface(node, inputs: _Inputs) -> list[str]:
    """Copy a Subsurface Scattering node, which has no glossy coat."""
    color = _take_color(node, inputs, "Color")
    node.ior = 1.0
    radii = [radius * inputs.value("Scale") for radius in inputs.value("Radius")]
    notes = _take_path(node, inputs.node.falloff, radii, color, inputs.value("Anisotropy"), inputs.value("IOR"), inputs)
    return [*notes, f"'{inputs.node.name}' has no glossy coat: the node's IOR is 1."]


def _take_principled(node, inputs: _Inputs) -> list[str]:
    """Copy a Principled BSDF but for its normal."""
    weight = inputs.value("Subsurface Weight", "Subsurface")
    color, notes = _take_color_of_principled(node, inputs, weight)
    node.ior = _ior(inputs)
    _take_input(node, ROUGHNESS, inputs)
    if inputs.source("Subsurface Weight", "Subsurface") is not None:
        notes.append(
            f"The node can't have a texture for the subsurface weight of '{inputs.node.name}': it counts as 1."
        )
        weight = 1.0
    if weight <= 0:
        return [*notes, f"'{inputs.node.name}' has no subsurface scattering: the mean free path stays unchanged."]
    if weight < 1 and inputs.socket("Subsurface Weight") is not None:
        text = f"The Subsurface Weight of '{inputs.node.name}' is {weight:.2g}: the node scatters all light inside,"
        notes.append(f"{text} so its diffuse share of {1 - weight:.0%} is lost.")
    # Before Blender 4.0 the weight scales the radius, and there is no diffuse share.
    scale = inputs.value("Subsurface Scale", default=weight)
    radii = [radius * scale for radius in inputs.value("Subsurface Radius")]
    anisotropy, ior = inputs.value("Subsurface Anisotropy"), inputs.value("Subsurface IOR", default=1.4)
    return notes + _take_path(node, inputs.node.subsurface_method, radii, color, anisotropy, ior, inputs)


def _take_path(node, method: str, radii, color, anisotropy: float, ior: float, inputs: _Inputs) -> list[str]:
    """Set mean free path and anisotropy to those of Cycles' walk."""
    name, kind = inputs.node.name, compat.subsurface_walk(inputs.node, method)
    if kind is None:
        return [f"The subsurface method '{method}' of '{name}' is not known: the mean free path stays unchanged."]
    if not all(radius > 0 for radius in radii):
        return [f"'{name}' has a subsurface radius of 0: the mean free path stays unchanged."]
    walk = Walk[kind]
    limit = MAX_ANISOTROPY[walk == Walk.FREE_PATH]
    # Burley's profile knows no directions.
    node.anisotropy = 0.0 if method == "BURLEY" else min(max(anisotropy, -limit), limit)
    node.mean_free_path = [
        mean_free_path(radius, walk, channel, ior, node.anisotropy) for radius, channel in zip(radii, color)
    ]
    return []


def lost_inputs(principled) -> list[str]:
    """Names of the inputs of a Principled BSDF that have an effect, and that the node lacks."""
    inputs = _Inputs(principled)
    lost = [
        name for name, neutral in LOST.items() if inputs.socket(name) is not None and _counts(inputs, name, neutral)
    ]
    strength = inputs.has("Emission Strength")
    color = inputs.source("Emission Color", "Emission") is not None or any(
        inputs.value("Emission Color", "Emission", default=(0.0,) * 3)[:3]
    )
    return lost + ["Emission"] * (strength and color)


def _counts(inputs: _Inputs, name: str, neutral) -> bool:
    value = inputs.value(name)
    if neutral is None:  # a tint: white from Blender 4.0 on, a factor before
        neutral = 0.0 if isinstance(value, float) else (1.0, 1.0, 1.0)
        value = value if isinstance(value, float) else tuple(value[:3])
    return inputs.source(name) is not None or value != neutral


def _take_color_of_principled(node, inputs: _Inputs, weight: float) -> tuple[tuple[float, ...], list[str]]:
    """Copy the color or its texture, and a sentence if one is lost.

    Before Blender 4.0 scattered light had a color of its own, mixed by its weight.
    """
    names = ("Base Color", "Subsurface Color")
    if inputs.socket(names[1]) is None or weight <= 0:
        return _take_color(node, inputs, names[0]), []
    sources = [inputs.source(name) for name in names]
    colors = [tuple(inputs.value(name)[:3]) for name in names]
    if sources == [None, None]:
        mixed = [base + weight * (other - base) for base, other in zip(*colors)]
        return _take_color(node, inputs, names[0], mixed), []
    chosen = int(weight > 0.5)
    color = _take_color(node, inputs, names[chosen])
    if weight == 1.0 or sources[0] == sources[1]:
        return color, []
    other = names[1 - chosen]
    return color, [f"'{inputs.node.name}' mixes two colors: {other} is ignored, since it weighs less."]


def _take_color(node, inputs: _Inputs, name: str, value=None) -> tuple[float, ...]:
    """Copy a color, or its texture, for which a grey is returned; `value` replaces the input's."""
    source = inputs.source(name)
    if source is not None:
        node.id_data.links.new(node.inputs[BASE_COLOR], source)
        node.color_mode = "BASE_COLOR"
        return (0.8, 0.8, 0.8)
    for link in list(node.inputs[BASE_COLOR].links):
        node.id_data.links.remove(link)
    node.color_mode = "BASE_COLOR"
    node.base_color = (value or inputs.value(name))[:3]
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


def _take_input(node, name: str, inputs: _Inputs) -> None:
    source, target = inputs.source(name), node.inputs[name]
    for link in list(target.links):
        node.id_data.links.remove(link)
    if source is not None:
        node.id_data.links.new(target, source)
    elif name != NORMAL:
        target.default_value = inputs.value(name)
