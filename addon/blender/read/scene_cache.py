"""Results of reads by data-block, read again only once a data-block that they depend on has changed.

Bakes, Live and the scans for bakes that are out of date share one cache, and one handler tells it of changes (as the
`id_map` of Cycles, intern/cycles/blender/id_map.h). Meshes and other arrays stay in it while Live is on; digests always
do.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

import bpy
from bpy.app.handlers import persistent

from .. import compat
from ..registration import all_or_nothing, handlers
from .digests import ImageDigests, TreeDigest, digest_of_tree
from .image_nodes import Images
from .nodes import InputSocket
from .scene_changes import ChangeLog

SMALL = {"tree", "shape", "scattered", "kinds"}
"""Kinds of entries without arrays."""

BY_ADDRESS = {"mesh", "emission"}
"""Kinds of entries whose keys have addresses of evaluated data, which change."""

GEOMETRY = bpy.types.Object | bpy.types.Mesh | bpy.types.Curve | bpy.types.MetaBall
"""Data-blocks that only changes of their geometry affect: transforms and visibility are read each time."""

T = TypeVar("T")


class _Entry(NamedTuple):
    time: int
    state: tuple
    value: object


class SceneCache:
    """Results of reading data-blocks.

    Entries belong to one view layer, as the depsgraph of the viewport evaluates it. They hold no Python objects of
    data-blocks: Blender 5.2 crashes when one of a freed data-block is compared.

    Attributes
    ----------
    time : number of the last change.
    geometry_time : time of the last change of an object's geometry.
    images : pixels of images, while a scene is read.
    check : called while nodes are evaluated, and raises an exception to cancel that; or None.
    """

    def __init__(self) -> None:
        self.time = self.geometry_time = 0
        self.images, self.check = Images(), None
        self._entries: dict[tuple, _Entry] = {}
        self._used: set[tuple] = set()
        self._changed: dict[Hashable, int] = {}  # time of the last change of each data-block
        self._image_digests, self._known_images = ImageDigests(), {}
        self._view_layer: tuple[str, str] | None = None
        self.log = ChangeLog()

    def get(self, key: tuple, blocks: Iterable, read: Callable[[], T], images: tuple = (), state: Hashable = None) -> T:
        """The result of `read`, from the cache unless something has changed that it depends on.

        Parameters
        ----------
        key : kind of the entry, and the data-blocks and names that it is about.
        blocks : original data-blocks that the result depends on, or their identities.
        images : full names of images that it depends on.
        state : everything else that it depends on.
        """
        key = tuple(map(identity, key))
        self._used.add(key)
        entry = self._entries.get(key)
        if entry is not None and entry.state == (state, *map(self.image_digest, images)):
            is_new = entry.time == self.time
            parts = () if is_new else map(identity, (*blocks, *images))
            if not any(self._changed.get(part, 0) > entry.time for part in parts):
                return entry.value
        for image in images:
            self._known_images.pop(image, None)
        state = state, *map(self.image_digest, images)
        self._entries[key] = _Entry(self.time, state, read())
        return self._entries[key].value

    def of_nodes(self, kind: str, owner, read: Callable[[], T]) -> T:
        """A result of reading the nodes before the surface of a material or world, and their images."""
        block = owner.original
        return self.get((kind, block), [block], read, self.tree(owner).images)

    def tree(self, owner, is_whole: bool = False) -> TreeDigest:
        """Digest of the nodes before the surface of a material, lamp or world, or before all of its output node."""
        return self._tree(owner.original, is_whole, lambda: _inputs_of(owner.original, is_whole))

    def texture(self, material, wanted: InputSocket) -> TreeDigest:
        """Digest of the nodes before an input of a material's node, which may be in groups."""
        around = [given for group in wanted.groups for given in group.inputs]
        return self._tree(material.original, "texture", lambda: [wanted.socket, *around])

    def _tree(self, block, part: bool | str, inputs: Callable[[], list]) -> TreeDigest:
        key = "tree", identity(block), part
        known = self._entries.get(key)
        blocks = [block, block.node_tree, *(() if known is None else known.value.groups)]
        return self.get(key, blocks, lambda: digest_of_tree(inputs()))

    def image_digest(self, name: str) -> str:
        """Digest of the image of that full name as it was when images were checked last."""
        if name not in self._known_images:
            image = next((image for image in bpy.data.images if image.name_full == name), None)
            self._known_images[name] = "removed" if image is None else self._image_digests.of(image)
        return self._known_images[name]

    def check_images(self) -> None:
        """Look for other pixels, as of files from other programs and of strokes, which Blender 3.4 does not report."""
        self._known_images.clear()

    @contextmanager
    def reading(self, depsgraph, check: Callable[[], None] | None = None) -> Iterator[None]:
        """Read the whole scene within the block; meshes that were not used since the last time go."""
        self.enter(depsgraph)
        unused = [key for key in self._entries if key[0] in BY_ADDRESS and key not in self._used]
        for key in unused:
            del self._entries[key]
        self._used, self.check = set(), check
        try:
            yield
        finally:
            self.images, self.check = Images(), None

    def enter(self, depsgraph) -> None:
        """Forget everything if it belongs to another view layer, or if scripts have removed the handler."""
        place = depsgraph.scene.name_full, depsgraph.view_layer.name
        is_told = self is not scene_cache or _on_update in bpy.app.handlers.depsgraph_update_post
        if self._view_layer != place or not is_told:
            self.forget()
        self._view_layer = place

    def drop_arrays(self) -> None:
        """Keep digests alone, so that the memory is free."""
        self._entries = {key: entry for key, entry in self._entries.items() if key[0] in SMALL}

    def forget(self) -> None:
        """Forget everything, since undo and loading replace data-blocks."""
        self._entries.clear()
        self._changed.clear()
        self._known_images.clear()
        self._image_digests.forget_packed()
        self.time = self.geometry_time = self.time + 1
        self.log.note_all(self.time)

    def note(self, depsgraph) -> None:
        """Take the updates of a viewport's depsgraph."""
        if depsgraph.mode != "VIEWPORT":
            return
        self.time += 1
        for update in depsgraph.updates:
            if update.is_updated_geometry or not isinstance(update.id, GEOMETRY):
                block = identity(update.id.original)
                self._changed[block] = self.time
                self._known_images.pop(block, None)
                if isinstance(update.id, bpy.types.Object):
                    self.geometry_time = self.time
        self.log.note(depsgraph, self.time)


def identity(part: Hashable) -> Hashable:
    """A plain value in place of an original data-block: the full name of an image; any other part unchanged."""
    if isinstance(part, bpy.types.Image):
        return part.name_full
    return compat.session_id(part) if isinstance(part, bpy.types.ID) else part


def _inputs_of(owner, is_whole: bool) -> list:
    output = owner.node_tree.get_output_node("CYCLES") if compat.uses_nodes(owner) else None
    if output is None:
        return []
    return list(output.inputs) if is_whole else [output.inputs["Surface"]]


scene_cache = SceneCache()
"""The cache of the process."""

listeners: list[Callable] = []
"""Functions that are called after each change, with the depsgraph; with None after undo and loading."""


@persistent
def _on_update(_scene, depsgraph) -> None:
    scene_cache.note(depsgraph)
    for listener in listeners:
        listener(depsgraph)


@persistent
def _on_all(*_arguments) -> None:
    scene_cache.forget()
    for listener in listeners:
        listener(None)


register, unregister = all_or_nothing(
    *handlers(
        depsgraph_update_post=_on_update,
        frame_change_post=_on_update,
        undo_post=_on_all,
        redo_post=_on_all,
        load_post=_on_all,
    ),
    (lambda: None, scene_cache.forget),
)
