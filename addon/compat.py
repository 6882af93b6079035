"""Differences between Blender versions, bridged in this one place."""

import bpy


def add_output_socket(tree, socket_type: str, name: str) -> None:
    """Give a node group an output (its interface moved in Blender 4.0)."""
    if hasattr(tree, "interface"):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=socket_type)
    else:
        tree.outputs.new(socket_type, name)


def uses_nodes(material) -> bool:
    """Whether a material has a node tree in use (`use_nodes` is deprecated since Blender 5.0, where all have)."""
    if material.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or material.use_nodes


def light_casts_shadow(light) -> bool:
    """Cycles' own shadow switch where it has one, else the light's."""
    cycles = getattr(light, "cycles", None)
    if hasattr(cycles, "cast_shadow"):
        return bool(cycles.cast_shadow)
    return bool(getattr(light, "use_shadow", True))


def spot_falloff() -> str:
    """How Cycles shapes a spot's cone (see native/scene/lights.h)."""
    return "scaled" if bpy.app.version >= (4, 0, 0) else "legacy"


def light_strength(light) -> float:
    """Energy with exposure (Blender 4.5 on) applied."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def light_color(light) -> tuple[float, float, float]:
    """Colour with the temperature's (Blender 4.5 on) applied."""
    color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = tuple(a * b for a, b in zip(color, light.temperature_color))
    return color
