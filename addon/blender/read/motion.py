"""Motion in a scene, as far as animation data tell: light that a single bake would freeze."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .. import compat
from .visibility import with_instanced

LIT_TYPES = {"LIGHT", "MESH", "CURVE", "SURFACE", "META", "FONT", "VOLUME", "CURVES", "POINTCLOUD"}
"""Types of objects that give, block or receive light."""

MOVING_SOURCES = {"SEQUENCE", "MOVIE"}
"""Sources of images that change from frame to frame."""

SIMULATIONS = {
    *("CLOTH", "SOFT_BODY", "FLUID", "OCEAN", "WAVE", "BUILD", "EXPLODE"),
    *("PARTICLE_SYSTEM", "PARTICLE_INSTANCE", "MESH_CACHE", "MESH_SEQUENCE_CACHE", "DYNAMIC_PAINT"),
}
"""Types of modifiers that change a mesh as time passes."""

MAX_DEPTH = 20
"""Number of objects that hang on each other, one after the other, whose motion is followed."""


class Motion:
    """Motion of the objects of a scene; each object is looked at once."""

    def __init__(self, scene) -> None:
        self._scene = scene
        self._known: dict = {}

    def lamps(self) -> Iterator[str]:
        """Names of moving lamps that render, and of the world if it changes."""
        yield from (obj.name for obj in self._lit() if obj.type == "LIGHT" and self.moves(obj))
        world = self._scene.world
        if world is not None and (is_animated(world) or _tree_moves(world.node_tree)):
            yield world.name

    def objects(self) -> Iterator[str]:
        """Names of other objects that move, change their shape or their materials."""
        yield from (obj.name for obj in self._lit() if obj.type != "LIGHT" and self.moves(obj))

    def _lit(self) -> Iterable:
        return (obj for obj in with_instanced(self._scene.objects) if obj.type in LIT_TYPES and not obj.hide_render)

    def moves(self, obj, depth: int = 0) -> bool:
        """True if an object, its data or an object that it follows is animated."""
        if obj not in self._known:
            self._known[obj] = False  # ends cycles
            self._known[obj] = depth < MAX_DEPTH and self._finds_motion(obj, depth)
        return self._known[obj]

    def _finds_motion(self, obj, depth: int) -> bool:
        data = obj.data
        if any(map(is_animated, (obj, data, getattr(data, "shape_keys", None)))):
            return True
        if _tree_moves(getattr(data, "node_tree", None)):
            return True
        if obj.rigid_body is not None and obj.rigid_body.type == "ACTIVE" and obj.rigid_body.enabled:
            return True
        if any(_material_moves(slot.material) for slot in obj.material_slots):
            return True
        if any(modifier.show_render and _runs(modifier) for modifier in obj.modifiers):
            return True
        return any(self.moves(other, depth + 1) for other in self._holders(obj))

    def _holders(self, obj) -> Iterator:
        """Objects that an object follows."""
        constraints = [constraint for constraint in obj.constraints if not constraint.mute]
        modifiers = [modifier for modifier in obj.modifiers if modifier.show_render]
        others = [obj.parent, *(getattr(owner, "target", None) for owner in constraints)]
        others += [getattr(owner, "object", None) for owner in modifiers]
        for other in others:
            if other is not None and hasattr(other, "constraints"):
                yield other


def is_animated(block) -> bool:
    """True if a data-block has curves of more than one value, strips, or drivers that follow time."""
    animation = getattr(block, "animation_data", None)
    if animation is None:
        return False
    if any(map(_varies, compat.curves_of(animation))):
        return True
    if any(not track.mute and len(track.strips) for track in animation.nla_tracks):
        return True
    return any(_follows_time(curve.driver) for curve in animation.drivers if not curve.mute)


def _varies(curve) -> bool:
    if curve.mute:
        return False
    if len(curve.modifiers):
        return True
    values = {round(point.co[1], 9) for point in curve.keyframe_points}
    return len(values) > 1


def _follows_time(driver) -> bool:
    """True if a driver reads the frame, or an animated data-block."""
    if "frame" in driver.expression and driver.type == "SCRIPTED":
        return True
    targets = (target for variable in driver.variables for target in variable.targets)
    return any(target.data_path.startswith("frame_current") or is_animated(target.id) for target in targets)


def _material_moves(material) -> bool:
    return material is not None and (is_animated(material) or _tree_moves(material.node_tree))


def _tree_moves(tree) -> bool:
    """True if a node tree or a group in it is animated, or shows images that change."""
    waiting, seen = [tree] if tree is not None else [], set()
    while waiting:
        current = waiting.pop()
        if current in seen:
            continue
        seen.add(current)
        if is_animated(current):
            return True
        for node in current.nodes:
            if node.bl_idname == "BeamspreadNode":
                continue  # its tree shows the result
            if getattr(getattr(node, "image", None), "source", "") in MOVING_SOURCES:
                return True
            waiting += [inner] if (inner := getattr(node, "node_tree", None)) is not None else []
    return False


def _runs(modifier) -> bool:
    """True if a modifier follows time by itself."""
    if modifier.type in SIMULATIONS:
        return True
    tree = modifier.node_group if modifier.type == "NODES" else None
    return tree is not None and any(
        node.bl_idname in ("GeometryNodeInputSceneTime", "GeometryNodeSimulationOutput") for node in tree.nodes
    )
