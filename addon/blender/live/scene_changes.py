"""Changes of a scene since it was last scanned, as depsgraph handlers are told of them."""

from __future__ import annotations

from collections.abc import Collection

import bpy

USED_BY_OTHERS = bpy.types.Light | bpy.types.NodeTree | bpy.types.Action | bpy.types.Texture
"""Data-blocks whose users are among the same updates, so that nothing is noted for them."""


class SceneChanges:
    """Changes collected from the updates of depsgraphs.

    Attributes
    ----------
    lamps : names of lamps with another place or other light.
    moved : names of other objects with another place.
    shaped : names of objects and of data with another shape.
    materials : full names of changed materials.
    nodes : True if nodes have other values. Every scan reads these, so that they are no reason for one.
    images : True if an image has changed that materials may show.
    world : True if the world has changed.
    other : True if anything else has changed, such as the visibility of an object.
    """

    def __init__(self) -> None:
        self.lamps: set[str] = set()
        self.moved: set[str] = set()
        self.shaped: set[str] = set()
        self.materials: set[str] = set()
        self.nodes = self.images = self.world = self.other = False

    def __bool__(self) -> bool:
        return bool(self.lamps) or not self.is_lamps_alone()

    def is_lamps_alone(self) -> bool:
        """True if nothing but lamps has changed."""
        return not (self.moved or self.shaped or self.materials or self.images or self.world or self.other)

    def is_movement_alone(self) -> bool:
        """True if nothing has changed but the places of objects, the light of lamps and `materials`."""
        return not (self.shaped or self.images or self.world or self.other)

    def note(self, updates: Collection, shown_by_live: Collection[str]) -> None:
        """Add the updates of a depsgraph.

        `shown_by_live` has the names of images and inner trees that Live itself changes: their updates, and those of
        materials along with them, are ignored.
        """
        ignored = bpy.types.Image | bpy.types.ShaderNodeTree
        by_live = any(isinstance(update.id, ignored) and update.id.name in shown_by_live for update in updates)
        for update in updates:
            data = update.id
            if isinstance(data, bpy.types.Object):
                self._note_object(update, data)
            elif isinstance(data, bpy.types.Image):
                self.images |= data.name not in shown_by_live
            elif isinstance(data, bpy.types.Material):
                self.materials |= set() if by_live else {data.name_full}
            elif isinstance(data, bpy.types.World):
                self.world = True
            elif isinstance(data, bpy.types.Scene | bpy.types.Collection):
                self.other = True
            elif isinstance(data, bpy.types.ShaderNodeTree):
                self.nodes = True
            elif update.is_updated_geometry and not isinstance(data, USED_BY_OTHERS):
                self.shaped.add(data.name)

    def _note_object(self, update, obj) -> None:
        if obj.type == "LIGHT" and (update.is_updated_transform or update.is_updated_geometry):
            self.lamps.add(obj.name)
        elif update.is_updated_geometry:
            self.shaped.add(obj.name)
        elif update.is_updated_transform:
            self.moved.add(obj.name)
        elif obj.type == "LIGHT" or not update.is_updated_shading:
            self.other = True

    def positions(self, scene) -> list:
        """Positions of the changed objects in the world."""
        objects = (scene.objects.get(name) for name in (*self.lamps, *self.moved, *self.shaped))
        return [obj.matrix_world.translation.copy() for obj in objects if obj is not None]
