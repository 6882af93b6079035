"""What has changed in a scene since somebody last looked, as handlers are told."""

from __future__ import annotations

from collections.abc import Collection

import bpy

# Those that use them are told of, too.
USED = bpy.types.Light | bpy.types.NodeTree | bpy.types.Action | bpy.types.Texture


class Marks:
    """Collected from the updates of depsgraphs.

    Attributes
    ----------
    lamps : names of lamps that moved or shine differently.
    moved, shaped : names of other objects that are elsewhere, and of objects and data of another shape.
    materials : full names of those that have changed.
    nodes : whether any have other values; these are read at every look, so that it is no reason for one.
    images : whether any has changed that materials may show.
    other : whether anything else has, as what is visible, or the world.
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
        """Whether nothing but lamps has changed."""
        return not (self.moved or self.shaped or self.materials or self.images or self.world or self.other)

    def is_movement_alone(self) -> bool:
        """Whether objects are elsewhere or lamps shine differently, and nothing has another shape; see `materials`."""
        return not (self.shaped or self.images or self.world or self.other)

    def note(self, updates: Collection, own_images: Collection[str]) -> None:
        """Add the updates of a depsgraph; those of `own_images`, and of materials along with them, are no news."""
        is_own = any(isinstance(one.id, bpy.types.Image) and one.id.name in own_images for one in updates)
        for one in updates:
            changed = one.id
            if isinstance(changed, bpy.types.Object):
                self._note_object(one, changed)
            elif isinstance(changed, bpy.types.Image):
                self.images |= changed.name not in own_images
            elif isinstance(changed, bpy.types.Material):
                self.materials |= set() if is_own else {changed.name_full}
            elif isinstance(changed, bpy.types.World):
                self.world = True
            elif isinstance(changed, bpy.types.Scene | bpy.types.Collection):
                self.other = True
            elif isinstance(changed, bpy.types.ShaderNodeTree):
                self.nodes = True
            elif one.is_updated_geometry and not isinstance(changed, USED):
                self.shaped.add(changed.name)

    def _note_object(self, update, obj) -> None:
        if obj.type == "LIGHT" and (update.is_updated_transform or update.is_updated_geometry):
            self.lamps.add(obj.name)
        elif update.is_updated_geometry:
            self.shaped.add(obj.name)
        elif update.is_updated_transform:
            self.moved.add(obj.name)
        elif obj.type == "LIGHT" or not update.is_updated_shading:
            self.other = True

    def places(self, scene) -> list:
        """Where objects have changed, in the world."""
        found = (scene.objects.get(name) for name in (*self.lamps, *self.moved, *self.shaped))
        return [obj.matrix_world.translation.copy() for obj in found if obj is not None]
