"""What was read of a scene before and has not changed since: of use where it is read again and again."""

from __future__ import annotations

from collections.abc import Collection

from . import emitters, transparency


class Kept:
    """Meshes and what their materials do to light, and the world.

    Attributes
    ----------
    meshes : of occluders, by a key that names their data.
    glows : of glowing meshes, by name and mesh.
    world : what was read of it, after its name and whether the view layer shows it; None: nothing yet.
    """

    def __init__(self) -> None:
        self.meshes: dict = {}
        self.glows: dict = {}
        self._keys: dict[str, list[tuple[dict, tuple]]] = {}  # by name of what they depend on
        self.forget_images()

    def note(self, kept: dict, key: tuple, instance) -> None:
        """Remember what an entry of `meshes` or `glows` depends on, an instance of the depsgraph."""
        obj = instance.object
        names = {obj.name, *([obj.data.name] if obj.data is not None else [])}
        if instance.is_instance and instance.parent is not None:
            names.add(instance.parent.name)
        for name in names:
            self._keys.setdefault(name, []).append((kept, key))

    def forget(self, names: Collection[str]) -> None:
        """Read what depends on the shape of objects or data of these names again."""
        for name in names:
            for kept, key in self._keys.pop(name, ()):
                kept.pop(key, None)

    def forget_materials(self, names: Collection[str]) -> None:
        """Read these again, by their full names, and what has them."""
        for name in names:
            self.emission.forget(name)
            self.transparency.forget(name)
        for key in [key for key in self.meshes if not set(names).isdisjoint(key)]:
            del self.meshes[key]
        self.glows.clear()

    def forget_images(self) -> None:
        """Read all that may depend on images again."""
        self.emission, self.transparency = emitters.Materials(), transparency.Materials()
        self.meshes.clear()
        self.glows.clear()
        self._keys.clear()
        self.world: tuple | None = None
