"""Marks of the pixels of textures: other ones where the pixels are others.

Files are read once, as long as they are not written to again; large ones count by their size and time. Pixels are read
only of what was painted and is not saved yet: Blender 3.4 does not tell of strokes. Once it is saved, it counts as
another, though it may be the same.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import bpy
import numpy as np

from ...images.files import file_of
from ...node.find import find_node
from ...node.node import BeamspreadNode
from ...node.tree import is_inner_tree

# Files of more bytes would take more than about 10 ms to read.
LARGE = 8 << 20

# Of what is painted and not saved: to read more takes longer than .2 s. More of it counts as painted, however often.
MOST_VALUES = 4 * 2048**2


class Pixels:
    """Marks of images; those of files are kept until they change."""

    def __init__(self) -> None:
        self._files: dict[Path, tuple] = {}  # time and size, mark
        self._packed: dict[tuple, str] = {}

    def forget(self) -> None:
        """All images may be others."""
        self._packed.clear()

    def mark(self, image) -> str:
        """Of what the image shows."""
        if image.is_dirty:
            if len(image.pixels) > MOST_VALUES:
                return "painted"
            values = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(values)
            return _hash(values)
        if image.packed_file is not None:
            key = image.name_full, image.packed_file.as_pointer(), image.packed_file.size
            if key not in self._packed:
                self._packed[key] = _hash(bytes(image.packed_file.data))
            return self._packed[key]
        path = file_of(image)
        if path is None:
            return f"{tuple(image.size)} {tuple(image.generated_color)} {image.generated_type}"
        try:
            state = path.stat()
        except OSError:
            return "missing"
        seen = state.st_mtime_ns, state.st_size
        if self._files.get(path, ("",))[0] != seen:
            self._files[path] = seen, _hash(path.read_bytes()) if state.st_size <= LARGE else str(seen)
        return self._files[path][1]


def _hash(content: bytes | np.ndarray) -> str:
    return hashlib.blake2b(content, digest_size=8).hexdigest()


def images_of(owner) -> set:
    """Textures in the nodes of a material, lamp or world; with our node, where its base colour comes from some."""
    tree = owner.node_tree
    if tree is None:
        return set()
    node = find_node(owner) if isinstance(owner, bpy.types.Material) else None
    if node is not None and not node.has_texture():
        return set()
    return {image for image in _images_in(tree) if image is not None}


def results() -> set:
    """Images that Beamspread nodes show: what bakes make, and not what they read."""
    nodes: Iterable = (find_node(material) for material in bpy.data.materials)
    return {node.image for node in nodes if node is not None}


def _images_in(tree) -> Iterator:
    trees = [tree]
    for tree in trees:
        for node in tree.nodes:
            if node.bl_idname == BeamspreadNode.bl_idname:
                continue
            if hasattr(node, "image"):
                yield node.image
            inner = getattr(node, "node_tree", None)
            if inner is not None and inner not in trees and not is_inner_tree(inner):
                trees.append(inner)
