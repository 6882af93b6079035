"""Digests of node trees, meshes and images: where they are equal, so is everything that is read.

A tree is described by the values of its nodes, so that one that only Cycles can evaluate has a digest as well.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

from ...core.errors import text_of
from .. import compat
from .nodes import Links, shows_bake

SCHEME = 4
"""Number of the way in which digests are made; those of another one can't be compared. A change has to count it up."""

LARGE = 8 << 20
"""Size of a file in bytes above which its time and size are its digest; more takes longer to read."""

MAX_VALUES = 4 * 2048**2
"""Number of values of a painted image above which it has one digest for all strokes; more takes longer than .2 s."""

NORMAL_DIGITS = 2
"""Digits of custom normals that count; more tell smaller changes, and rounding."""

MAX_DEPTH = 4
"""Levels of structs in structs that count as values of a struct."""

_NODE_LOOKS = set(bpy.types.Node.bl_rna.properties.keys()) - {"mute"} | {"node_tree"}
_LEFT_OUT = {"rna_type", "name", "show_expanded", "is_active"}


def digest(*values) -> str:
    """Hash of the values, 8 bytes in hexadecimal."""
    return hashlib.blake2b(repr(values).encode(), digest_size=8).hexdigest()


def values_of(struct, skipped: Iterable[str] = (), depth: int = 0) -> list:
    """All properties of a Blender struct, nested ones included; other data-blocks by their names."""
    values = []
    for prop in struct.bl_rna.properties if depth <= MAX_DEPTH else ():
        name = prop.identifier
        if name in skipped or name in _LEFT_OUT:
            continue
        value = getattr(struct, name, None)
        if prop.type == "COLLECTION":
            value = [values_of(item, (), depth + 1) for item in value or () if item is not None]
        elif isinstance(value, bpy.types.ID):
            # Without the folder, which becomes relative when the file is saved elsewhere. Pixels have their own digest.
            value = value.name_full, bpy.path.basename(getattr(value, "filepath", ""))
        elif isinstance(value, bpy.types.bpy_struct):
            value = values_of(value, (), depth + 1)
        elif prop.type == "POINTER":
            continue
        elif getattr(prop, "is_array", False):
            value = np.array(value).tolist()
        elif isinstance(value, set):
            value = sorted(value)
        values.append((name, value))
    return values


class TreeDigest(NamedTuple):
    """Digest of the nodes before some inputs.

    Attributes
    ----------
    images : full names of the images of these nodes, whose pixels the digest does not cover.
    groups : session ids of the trees of groups among them.
    """

    text: str = ""
    images: tuple[str, ...] = ()
    groups: tuple[int, ...] = ()


def digest_of_tree(inputs: Iterable) -> TreeDigest:
    """Digest of all nodes that inputs depend on; names and positions in the editor don't count.

    Nodes have numbers in the order in which links lead to them, and so have groups: each is described once.
    """
    links, groups, images = Links(), {}, {}
    rows, queue = [[*_rows(links, inputs, groups, images)]], 0
    while queue < len(groups):
        rows.append([*_rows(links, _outputs_of([*groups][queue]), groups, images)])
        queue += 1
    return TreeDigest(digest(rows), tuple(images), tuple(map(compat.session_id, groups)))


def _rows(links: Links, inputs: Iterable, groups: dict, images: dict) -> Iterator:
    """The value of each input without a link; the node before each other one, with its values at the first time."""
    numbers, waiting = {}, list(inputs)
    for socket in waiting:
        link = links.link_into(socket)
        if link is None:
            yield _own_value(socket)
            continue
        node = link.from_node
        is_new = node not in numbers
        yield numbers.setdefault(node, len(numbers)), link.from_socket.identifier, _own_value(link.from_socket)
        if is_new:
            yield _node_values(node, groups, images)
            waiting += () if shows_bake(node) else node.inputs


def _node_values(node, groups: dict, images: dict) -> list:
    if shows_bake(node):
        return []  # no bake reads the result of another
    if getattr(node, "image", None) is not None:
        images[node.image.name_full] = None
    inner = getattr(node, "node_tree", None)
    number = None if inner is None else groups.setdefault(inner, len(groups))
    return [node.bl_idname, number, values_of(node, _NODE_LOOKS)]


def _outputs_of(tree) -> list:
    output = next((node for node in tree.nodes if node.type == "GROUP_OUTPUT" and node.is_active_output), None)
    return [] if output is None else list(output.inputs)


def _own_value(socket) -> object:
    value = getattr(socket, "default_value", None)
    if value is None or isinstance(value, int | float | str):
        return value
    return value.name_full if isinstance(value, bpy.types.ID) else np.array(value).tolist()


def digest_of_mesh(obj) -> str:
    """Digest of vertices, faces, UV maps and painted colors of an object, with the modifiers that it is evaluated with.

    It covers all that any reader or Cycles may read of the mesh. An object without faces counts by its data's name.
    """
    try:
        mesh = obj.to_mesh()
    except RuntimeError as error:
        return text_of(error)
    if mesh is None:
        return ""
    try:
        hashed = hashlib.blake2b(digest_size=8)
        for values, name, kind, size in [
            (mesh.vertices, "co", np.float32, 3),
            (mesh.loops, "vertex_index", np.int32, 1),
            (mesh.polygons, "loop_total", np.int32, 1),
            (mesh.polygons, "material_index", np.int32, 1),
            *((layer.data, "uv", np.float32, 2) for layer in mesh.uv_layers),
            *((layer.data, "color", np.float32, 4) for layer in mesh.color_attributes),
        ]:
            array = np.empty(len(values) * size, kind)
            values.foreach_get(name, array)
            hashed.update(array)
        hashed.update(repr([layer.active_render for layer in mesh.uv_layers]).encode())
        _add_shading(hashed, mesh)
        return hashed.hexdigest()
    finally:
        obj.to_mesh_clear()


def _add_shading(hashed, mesh) -> None:
    """Add what shading normals depend on to the hash of a mesh; the normals themselves are rounded anew each time."""
    is_smooth = compat.smooth_faces(mesh)
    if is_smooth.any():
        is_sharp = np.empty(len(mesh.edges), bool)
        mesh.edges.foreach_get("use_edge_sharp", is_sharp)
        hashed.update(np.concatenate([is_smooth, is_sharp]))
        hashed.update(repr(compat.smooth_angle(mesh)).encode())
    if mesh.has_custom_normals:
        hashed.update(np.round(compat.corner_normals(mesh), NORMAL_DIGITS) + 0.0)  # no negative zero


class ImageDigests:
    """Digests of the pixels of images.

    A file is read once until it is written again. Pixels in memory are read only of images that were painted and not
    saved, since Blender 3.4 does not report strokes. Saving such an image changes its digest.
    """

    def __init__(self) -> None:
        self._files: dict[Path, tuple] = {}  # time and size, digest
        self._packed: dict[tuple, str] = {}

    def of(self, image) -> str:
        """Digest of an image's pixels, and of its settings that change their meaning."""
        return digest(image.alpha_mode, image.colorspace_settings.name, self._content(image))

    def forget_packed(self) -> None:
        """Read packed images again: undo and loading may give them other pixels."""
        self._packed.clear()

    def _content(self, image) -> str:
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
        if image.source == "GENERATED":
            return repr((*image.size, *image.generated_color, image.generated_type))
        path = Path(os.path.normpath(bpy.path.abspath(image.filepath, library=image.library)))
        try:
            state = path.stat()
            seen = state.st_mtime_ns, state.st_size
            if self._files.get(path, ("",))[0] != seen:
                self._files[path] = seen, _hash(path.read_bytes()) if state.st_size <= LARGE else str(seen)
        except OSError:
            return "missing"
        return self._files[path][1]


def _hash(content: bytes | np.ndarray) -> str:
    return hashlib.blake2b(content, digest_size=8).hexdigest()
