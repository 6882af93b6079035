"""Digests of the pixels of textures.

A file is read once until it is written again; large files count by size and time. Pixels in memory are read only for
images that were painted and not saved, since Blender 3.4 does not report strokes. Saving such an image changes its
digest.
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

# Bytes of a file above which its size and time are its digest; larger takes longer to read.
LARGE = 8 << 20

# Values of a painted image above which it has one digest however often it is painted; more take longer than .2 s.
MAX_VALUES = 4 * 2048**2


class Pixels:
    """Digests of images, cached until their files change."""

    def __init__(self) -> None:
        self._files: dict[Path, tuple] = {}  # time and size, digest
        self._packed: dict[tuple, str] = {}

    def forget(self) -> None:
        """Drop the digests of packed images: all may have changed."""
        self._packed.clear()

    def mark(self, image) -> str:
        """Digest of the pixels of an image."""
        if image.is_dirty:
            if len(image.pixels) > MAX_VALUES:
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
    """Images in the nodes of a material, lamp or world; with a Beamspread node only if its base color is linked."""
    tree = owner.node_tree
    if tree is None:
        return set()
    node = find_node(owner) if isinstance(owner, bpy.types.Material) else None
    if node is not None and not node.has_texture():
        return set()
    return {image for image in _images_in(tree) if image is not None}


def results() -> set:
    """Images that Beamspread nodes show: results of bakes."""
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
