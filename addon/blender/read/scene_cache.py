"""Cache of meshes, materials and the world, for readers of a scene that changes little between two reads."""

from __future__ import annotations

from collections.abc import Callable, Collection

from . import emitters, transparency


class SceneCache:
    """Meshes, the light and the transparency of their materials, and the world.

    Attributes
    ----------
    meshes : occluder meshes, by a key that names their data.
    emissive : emissive meshes, by object name and mesh.
    world : key of the world (its name, and whether the view layer shows it) and its light; None if it was not read.
    """

    def __init__(self, check: Callable[[], None] | None = None) -> None:
        """`check` is called while nodes are evaluated, and raises an exception to cancel that."""
        self.check = check
        self.meshes: dict = {}
        self.emissive: dict = {}
        self._keys: dict[str, list[tuple[dict, tuple]]] = {}  # cache entries by the names that they depend on
        self.forget_images()

    def note(self, entries: dict, key: tuple, instance) -> None:
        """Remember the objects and data that an entry of `meshes` or `emissive` depends on.

        Parameters
        ----------
        instance : entry of `depsgraph.object_instances` that the cache entry was read from.
        """
        obj = instance.object
        names = {obj.name, *([obj.data.name] if obj.data is not None else [])}
        if instance.is_instance and instance.parent is not None:
            names.add(instance.parent.name)
        for name in names:
            self._keys.setdefault(name, []).append((entries, key))

    def forget(self, names: Collection[str]) -> None:
        """Drop entries that depend on the shape of objects or data of these names."""
        for name in names:
            for entries, key in self._keys.pop(name, ()):
                entries.pop(key, None)

    def forget_materials(self, names: Collection[str]) -> None:
        """Drop materials, by their full names, and the meshes that carry them."""
        for name in names:
            self.emission.forget(name)
            self.transparency.forget(name)
        for key in [key for key in self.meshes if not set(names).isdisjoint(key)]:
            del self.meshes[key]
        self.emissive.clear()

    def forget_images(self) -> None:
        """Drop everything that may depend on images."""
        self.emission, self.transparency = emitters.Materials(self.check), transparency.Materials(self.check)
        self.meshes.clear()
        self.emissive.clear()
        self._keys.clear()
        self.world: tuple | None = None
