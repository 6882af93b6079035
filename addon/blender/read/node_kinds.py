"""Kinds of the nodes before a surface: whether it glows, and whether our own readers know all of them.

Nothing is evaluated, so that this takes no time; it serves estimates.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .. import compat
from .image_nodes import missing_images
from .node_math import FUNCTIONS
from .nodes import OWN_NODE, InputSocket, Links, Source, shows_bake, surface_of
from .reflection import CLOSURES, NOT_REFLECTING

KNOWN = {
    *FUNCTIONS,
    *CLOSURES,
    *NOT_REFLECTING,
    *(f"ShaderNode{name}" for name in ("AddShader", "MixShader", "LightPath", "Fresnel", "LayerWeight", "UVMap")),
    *(f"ShaderNode{name}" for name in ("TexImage", "TexEnvironment", "TexCoord", "NewGeometry")),
    OWN_NODE,
}
"""Types of nodes that our own readers know, as a rule."""

UNREAD = {"Normal", "Tangent", "Clearcoat Normal", "Coat Normal"}
"""Inputs that no reader evaluates."""

BEYOND = ("Transmission", "Transmission Weight", "Sheen", "Sheen Weight")
"""Inputs of the Principled BSDF that have to be 0 for rays of our own."""


@dataclass(frozen=True)
class NodeKinds:
    """The nodes before a surface.

    Attributes
    ----------
    glows : True if it gives light.
    color : radiance of a world or lamp of one color without links; None for all others.
    is_known : True if our own readers know all nodes.
    asks_path : True if it depends on the kind of ray, as that of a world for the camera alone.
    """

    glows: bool = False
    color: tuple[float, float, float] | None = None
    is_known: bool = True
    asks_path: bool = False


def kinds_of(owner) -> NodeKinds:
    """The nodes before the surface of a material, world or lamp."""
    surface = surface_of(owner.node_tree) if compat.uses_nodes(owner) else None
    if surface is None or missing_images(Links(), surface):
        return NodeKinds()
    sources = [*_sources(surface)]
    glowing = [source for source in sources if _glows(source)]
    is_known = all(map(_is_known, sources))
    color = _color(glowing[0].node) if len(sources) == 1 and glowing else None
    asks_path = any(source.node.bl_idname == "ShaderNodeLightPath" for source in sources)
    return NodeKinds(bool(glowing), color, is_known, asks_path)


def closures_of(material) -> list:
    """The nodes before the surface of a material with nodes that reflect light, or let it through."""
    surface = surface_of(material.node_tree)
    nodes = [] if surface is None else [source.node for source in _sources(surface)]
    return [node for node in nodes if "Bsdf" in node.bl_idname]


def all_known(wanted: InputSocket) -> bool:
    """True if our own readers know all nodes before an input."""
    return all(map(_is_known, _sources(wanted)))


def _sources(surface: InputSocket) -> Iterator[Source]:
    """The outputs of nodes that an input depends on, each once."""
    links, waiting, seen = Links(), [surface], set()
    while waiting:
        source = links.source(waiting.pop())
        if source.socket.is_output and source not in seen:
            seen.add(source)
            yield source
            waiting += (wanted for wanted in source.inputs() if wanted.socket.name not in UNREAD)


def _is_known(source: Source) -> bool:
    node = source.node
    beyond = [node.inputs[name] for name in BEYOND if name in node.inputs]
    is_beyond = any(socket.is_linked or socket.default_value > 0 for socket in beyond)
    is_uv_map = node.bl_idname == "ShaderNodeAttribute" and source.socket.name == "Vector"
    return shows_bake(node) or is_uv_map or (node.bl_idname in KNOWN and not is_beyond)


def _glows(source: Source) -> bool:
    names = ("Emission Color", "Emission") if source.node.bl_idname == "ShaderNodeBsdfPrincipled" else ("Color",)
    if source.node.bl_idname not in ("ShaderNodeEmission", "ShaderNodeBackground", "ShaderNodeBsdfPrincipled"):
        return False
    color = next(source.node.inputs[name] for name in names if name in source.node.inputs)
    strength = source.node.inputs.get("Emission Strength") or source.node.inputs.get("Strength")
    has_color = color.is_linked or any(color.default_value[:3])
    return has_color and (strength is None or strength.is_linked or strength.default_value > 0)


def _color(node) -> tuple[float, float, float] | None:
    if node.bl_idname == "ShaderNodeBsdfPrincipled" or any(socket.is_linked for socket in node.inputs):
        return None
    return tuple(channel * node.inputs["Strength"].default_value for channel in node.inputs["Color"].default_value[:3])
