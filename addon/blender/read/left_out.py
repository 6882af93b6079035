"""What a render shows and a bake does not know: named, so that nobody looks for its light or shadow in vain."""

from __future__ import annotations

from .. import compat

# By type of object, and what of it is missing. A depsgraph shows all others as meshes or as lamps.
KINDS = {
    "CURVES": "hair",
    "POINTCLOUD": "a point cloud",
    "VOLUME": "a volume",
}


def left_out(obj) -> str:
    """A sentence about an evaluated object whose shadow and light a bake leaves out, wholly or in part, or ""."""
    if obj.type in KINDS:
        return f"'{obj.name}' is {KINDS[obj.type]}: its shadow and its own light are not baked."
    if any(_draws_hair(system.settings) for system in getattr(obj, "particle_systems", ())):
        return f"The hair of '{obj.name}' is not baked: neither its shadow nor its own light."
    return ""


def left_out_of_world(world) -> str:
    """The same of a world, or None, whose fog changes what lamps send."""
    if world is None or not compat.uses_nodes(world):
        return ""
    output = world.node_tree.get_output_node("CYCLES")
    if output is None or not output.inputs["Volume"].is_linked:
        return ""
    return f"The world '{world.name}' is filled with a volume: what that takes from the light, or adds, is not baked."


def _draws_hair(settings) -> bool:
    return settings.type == "HAIR" and settings.render_type == "PATH"
