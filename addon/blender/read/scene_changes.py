"""Changes of a scene, as updates of depsgraphs tell of them, in groups that Live treats alike."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field

import bpy

KINDS = {
    "materials": bpy.types.Material,
    "nodes": bpy.types.ShaderNodeTree,
    "rest": bpy.types.Image | bpy.types.World | bpy.types.Scene | bpy.types.Collection,
}
"""Names of groups, and the data-blocks in them."""

SHOWN_BY_LIVE = bpy.types.Image | bpy.types.ShaderNodeTree
"""Data-blocks that Live itself changes."""

USED_BY_OTHERS = bpy.types.Light | bpy.types.NodeTree | bpy.types.Action | bpy.types.Texture
"""Data-blocks whose users are among the same updates, so that nothing is noted for them."""


@dataclass
class SceneChanges:
    """Names of data-blocks that have changed.

    Attributes
    ----------
    lamps : lamps with another transform or other light.
    moved : other objects with another transform.
    shaped : objects and data with another shape.
    nodes : trees with other values. Every scan of Live reads these, so that they are no reason for one.
    rest : all other data, as for another world, another image or another visibility of an object.
    """

    lamps: set[str] = field(default_factory=set)
    moved: set[str] = field(default_factory=set)
    shaped: set[str] = field(default_factory=set)
    materials: set[str] = field(default_factory=set)
    nodes: set[str] = field(default_factory=set)
    rest: set[str] = field(default_factory=set)

    def __bool__(self) -> bool:
        return bool(self.lamps) or not self.is_lamps_alone()

    def is_lamps_alone(self) -> bool:
        """True if nothing but lamps has changed."""
        return self.is_movement_alone() and not (self.moved or self.materials)

    def is_movement_alone(self) -> bool:
        """True if nothing has changed but the transforms of objects, the light of lamps and `materials`."""
        return not (self.shaped or self.rest)

    def positions(self, scene) -> list:
        """Positions of the changed objects in the world."""
        objects = (scene.objects.get(name) for name in (*self.lamps, *self.moved, *self.shaped))
        return [obj.matrix_world.translation.copy() for obj in objects if obj is not None]


class ChangeLog:
    """The time of the last change of each data-block.

    Attributes
    ----------
    shown_by_live : names of the images and inner trees that Live itself changes: their updates, and those of materials
        along with them, are left out.
    """

    def __init__(self) -> None:
        self.shown_by_live: Callable[[], Collection[str]] = tuple
        self._times: dict[tuple[str, str], int] = {}

    def since(self, time: int) -> SceneChanges:
        """The changes after a time."""
        changes = SceneChanges()
        for (kind, name), changed in reversed(self._times.items()):
            if changed <= time:
                break
            getattr(changes, kind).add(name)
        return changes

    def note_all(self, time: int) -> None:
        """Note that anything may have changed."""
        self._times = {("rest", ""): time}

    def note(self, depsgraph, time: int) -> None:
        """Add the updates of a depsgraph."""
        names, changed = self.shown_by_live(), [(_kind_of(update), update.id) for update in depsgraph.updates]
        ours = [block for _, block in changed if isinstance(block, SHOWN_BY_LIVE) and block.name in names]
        for kind, block in changed:
            if kind is not None and block not in ours and not (ours and kind == "materials"):
                self._note(kind, block.name_full if kind == "materials" else block.name, time)
        # Blender does not name the objects of a lamp whose nodes have changed.
        lights = [] if any(kind == "lamps" for kind, _ in changed) else _lights_among(changed)
        for obj in depsgraph.scene.original.objects if lights else ():
            if obj.data in lights:
                self._note("lamps", obj.name, time)

    def _note(self, kind: str, name: str, time: int) -> None:
        self._times.pop((kind, name), None)  # the latest comes last
        self._times[kind, name] = time


def _lights_among(changed: Iterable[tuple]) -> list:
    return [block.original for _, block in changed if isinstance(block, bpy.types.Light)]


def _kind_of(update) -> str | None:
    block = update.id
    if isinstance(block, bpy.types.Object):
        return _kind_of_object(update)
    for kind, types in KINDS.items():
        if isinstance(block, types):
            return kind
    return "shaped" if update.is_updated_geometry and not isinstance(block, USED_BY_OTHERS) else None


def _kind_of_object(update) -> str | None:
    is_lamp = update.id.type == "LIGHT"
    if is_lamp and (update.is_updated_transform or update.is_updated_geometry):
        return "lamps"
    if update.is_updated_geometry:
        return "shaped"
    if update.is_updated_transform:
        return "moved"
    return "rest" if is_lamp or not update.is_updated_shading else None
