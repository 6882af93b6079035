"""Digests of the parts of a scene that bakes read: while they stay the same, so does the result of a bake.

They are made from the scene as the window has it, so that they cost little. Another version of Blender may make other
digests: after a change of version a bake counts as out of date.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator

import bpy
import numpy as np

from ....core.errors import text_of
from ....core.target import Target
from ... import compat
from ...node.find import find_node, node_of
from ...node.tree import is_inner_tree
from ...read.visibility import SOLID_TYPES, SURFACE_TYPES, by_name, collection_of, render_visible_names, rendered_in
from .pixels import Pixels, images_of, results
from .scatter import Scatter, scatters

Parts = dict[str, str]
"""Digests of the parts of a scene that a bake reads, by names for artists."""

IMAGE, QUALITY, SETTINGS = "size of the image", "quality", "settings"

# Cycles' settings for bounced light.
BOUNCES = (
    *("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces"),
    *("transparent_max_bounces", "caustics_reflective", "caustics_refractive"),
)


# Sockets of the Beamspread node that change its look in a render and not the bake.
LOOKS = {"Roughness", "Normal"}

_NODE_LOOKS = set(bpy.types.Node.bl_rna.properties.keys()) - {"mute"}
_ID_LOOKS = set(bpy.types.ID.bl_rna.properties.keys()) | {"animation_data", "node_tree"}
_DEEPEST = 4


def digest(*values) -> str:
    """Hash of the values, 8 bytes in hexadecimal."""
    return hashlib.blake2b(repr(values).encode(), digest_size=8).hexdigest()


def values_of(struct, skipped: Iterable[str] = (), depth: int = 0) -> list:
    """All properties of a Blender struct, nested ones included; other data-blocks by their names."""
    found = []
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in skipped or name in ("rna_type", "name", "show_expanded", "is_active") or depth > _DEEPEST:
            continue
        value = getattr(struct, name, None)
        if prop.type == "COLLECTION":
            value = [values_of(one, (), depth + 1) for one in value or () if one is not None]
        elif isinstance(value, bpy.types.ID):
            # Without the folder, which becomes relative when the file is saved elsewhere. Pixels have their own digest.
            value = value.name_full, bpy.path.basename(getattr(value, "filepath", ""))
        elif isinstance(value, bpy.types.bpy_struct):
            value = values_of(value, (), depth + 1)
        elif prop.type == "POINTER":
            continue
        elif getattr(prop, "is_array", False):
            value = np.array(value).tolist()
        found.append((name, value))
    return found


def tree_values(tree, entered: dict | None = None) -> list | int:
    """Nodes with their values, and links; names and positions in the editor don't count.

    A group that was `entered` before is named by its number.
    """
    entered = {} if entered is None else entered
    if tree in entered:
        return entered[tree]
    entered[tree] = len(entered)
    return [[_node_values(node, entered) for node in tree.nodes], _links_between(tree.nodes, tree.links)]


def _links_between(nodes: Iterable, links: Iterable) -> list:
    """Links that have these nodes at both ends."""
    numbers = {node.name: number for number, node in enumerate(nodes)}
    ends = (
        (
            numbers.get(link.from_node.name),
            link.from_socket.identifier,
            numbers.get(link.to_node.name),
            link.to_socket.identifier,
        )
        for link in links
    )
    return sorted(end for end in ends if None not in end)


def _node_values(node, entered: dict) -> list:
    inner = getattr(node, "node_tree", None)
    inputs = []
    for socket in node.inputs:
        if not socket.is_linked and hasattr(socket, "default_value"):
            value = socket.default_value
            inputs.append(value if isinstance(value, int | float | str) else _plain(value))
    skipped = _NODE_LOOKS | {"node_tree"}
    return [node.bl_idname, values_of(node, skipped), inputs, tree_values(inner, entered) if inner else None]


def _plain(value) -> object:
    if value is None or isinstance(value, bpy.types.ID):
        return value and value.name_full
    return np.array(value).tolist()


class Fingerprints:
    """Digests of the targets of a scene. Those of meshes, lamps and trees are cached until `forget` names them."""

    def __init__(self) -> None:
        self._kept: dict[int, str] = {}
        self._images: dict[int, list[str]] = {}  # by owner of nodes: names of its textures
        self._pixels, self._scatter = Pixels(), Scatter()
        self._sees_media = True

    def forget(self, identifiers: Iterable[int] | None = None) -> None:
        """Drop the cached digests of these data-blocks (`as_pointer()` of the originals); None: of all."""
        if identifiers is None:
            self._kept.clear()
            self._images.clear()
            self._pixels.forget()
            self._scatter.forget()
            return
        for identifier in identifiers:
            self._kept.pop(identifier, None)
            self._images.pop(identifier, None)

    def forget_scatter(self) -> None:
        """Drop the digests of scattered instances, since geometry has changed."""
        self._scatter.forget()

    def of(self, context, targets: Iterable[Target]) -> dict[Target, Parts]:
        """Digests of each target of the context's scene; targets that are gone are left out."""
        scene, view_layer = context.scene, context.view_layer
        depsgraph = context.evaluated_depsgraph_get()
        visible = render_visible_names(view_layer)
        self._sees_media = scene.beamspread.use_indirect
        lamps, solids, own, known = 0, 0, {}, {}
        shown = [obj for obj in scene.objects if obj.name in visible]
        self._scatter.look(depsgraph, [obj for obj in shown if scatters(obj)])
        for obj, text in self._with_instanced(shown, depsgraph, known):
            if obj.type == "LIGHT":
                lamps += _number(text)
            else:
                number = _number(digest(text, known[obj][1]))
                own.setdefault(obj.name, (text, number))
                solids += number
        owners = [obj.data for obj in known if obj.type == "LIGHT"]
        owners += [slot.material for obj in known for slot in obj.material_slots]
        shared = {
            "lights": f"{lamps % 2**64:x}",
            "world": self._world(scene, view_layer),
            "textures": self._textures([*owners, scene.world]),
        }
        found, objects = {}, by_name(scene)
        for target in targets:
            obj, node = objects.get(target.object_name), None
            if obj is not None:
                node = node_of(target)
            if node is None:
                continue
            mine, number = own.get(obj.name, ("", 0))
            found[target] = {
                "object": mine,
                "other objects": f"{(solids - number) % 2**64:x}",
                **shared,
                "material": digest(self._surface(node)),
                SETTINGS: settings_part(scene),
                QUALITY: _quality(scene),
                IMAGE: image_part(node.image),
            }
        return found

    def _keep(self, block, make) -> str:
        key = block.as_pointer()
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def _lamp(self, obj) -> str:
        data = obj.data
        kept = self._keep(data, lambda: digest(values_of(data, _ID_LOOKS), _tree_of(data)))
        return digest(kept, _matrix(obj), obj.visible_diffuse, _links(obj))

    def _with_instanced(self, objects: Iterable, depsgraph, known: dict, place: str = "") -> Iterator[tuple]:
        """Objects, and after them the objects of collections that they instance, each with a digest.

        `place` is the digest of the instance. `known` gets for each object its digest without `place`, and the digests
        of its materials.
        """
        later = []
        for obj in objects:
            collection = collection_of(obj)
            if obj.type == "LIGHT" or obj.type in SOLID_TYPES or obj.instance_type != "NONE":
                if obj not in known:
                    text = self._lamp(obj) if obj.type == "LIGHT" else self._solid(obj, depsgraph)
                    known[obj] = text, [self._material(slot.material) for slot in obj.material_slots]
                text, _ = known[obj]
                if collection is not None:
                    later.append((collection, digest(place, text, list(collection.instance_offset))))
                if obj.type != "EMPTY":
                    yield obj, digest(place, text) if place else text
        for collection, there in later:
            yield from self._with_instanced(rendered_in(collection), depsgraph, known, there)

    def _solid(self, obj, depsgraph) -> str:
        """Digest of shape and transform, without materials and instanced collections."""
        seen = obj.visible_diffuse, obj.visible_shadow, obj.show_instancer_for_render, obj.instance_type, _links(obj)
        shape = self._keep(obj, lambda: self._shape(obj, depsgraph))
        scattered = ()
        if scatters(obj):
            self._scatter.look(depsgraph, [obj])
            text, materials = self._scatter.of(obj)
            scattered = text, [self._material(material) for material in materials]
        return digest(shape, _matrix(obj), seen, *scattered)

    def _shape(self, obj, depsgraph) -> str:
        modifiers = [(modifier.show_render, modifier.type, _modifier(modifier)) for modifier in obj.modifiers]
        particles = [values_of(one.settings, _ID_LOOKS) for one in obj.particle_systems]
        return digest(_mesh(obj, depsgraph), modifiers, particles)

    def _material(self, material) -> str:
        """Digest of a material for other objects: a Beamspread node counts by its medium, not by its baked image."""
        if material is None:
            return ""
        node = find_node(material)
        if node is not None:
            return digest(self._surface(node)) if self._sees_media else ""
        return self._keep(material, lambda: digest(_tree_of(material), compat.has_transparent_shadow(material)))

    def _textures(self, owners: Iterable) -> str:
        """Digest of the pixels of all textures, without the results of bakes."""
        names = {name for owner in dict.fromkeys(owners) if owner is not None for name in self._names_in(owner)}
        own = {image.name_full for image in results() if image is not None}
        images = {image.name_full: image for image in bpy.data.images} if names - own else {}
        return digest([(name, self._pixels.mark(images[name])) for name in sorted(names - own) if name in images])

    def _names_in(self, owner) -> list[str]:
        key = owner.as_pointer()
        if key not in self._images:
            self._images[key] = [image.name_full for image in images_of(owner)]
        return self._images[key]

    def _surface(self, node) -> list:
        # Only linked inputs are read; a node of an older file gets its inputs late.
        linked = (socket for socket in node.inputs if socket.is_linked and socket.name not in LOOKS)
        inputs = [(socket.identifier, _upstream(socket)) for socket in linked]
        return [repr(node.surface()), getattr(node, "side", ""), inputs]

    def _world(self, scene, view_layer) -> str:
        world = compat.original_world(view_layer, scene)
        if world is None or not view_layer.use_sky:
            return ""
        return self._keep(world, lambda: digest(tuple(world.color), _tree_of(world), world.cycles_visibility.diffuse))


def _number(text: str) -> int:
    return int(text, 16)


def _matrix(obj) -> list:
    return np.array(obj.matrix_world, np.float32).tolist()


def _links(obj) -> list:
    """Collections of light linking (Blender 4.0 and later), by name."""
    linking = compat.light_linking(obj)
    return values_of(linking) if linking is not None else []


def _tree_of(owner) -> list | None:
    return tree_values(owner.node_tree) if owner.node_tree and compat.uses_nodes(owner) else None


def _upstream(socket) -> list:
    """Values of the whole tree of a socket, if it is linked."""
    tree = socket.id_data
    if not socket.is_linked:
        return []
    nodes = [node for node in tree.nodes if node.bl_idname not in LEFT_OUT and not _shows_bake(node)]
    links = [link for link in tree.links if link.to_node != socket.node or link.to_socket == socket]
    entered: dict = {}
    return [[_node_values(node, entered) for node in nodes], _links_between([*nodes, socket.node], links)]


def _shows_bake(node) -> bool:
    """True for a plain group, which stands for a Beamspread node."""
    inner = getattr(node, "node_tree", None)
    return inner is not None and is_inner_tree(inner)


def image_part(image) -> str:
    """Digest of the size of the node's image; "" for None."""
    return digest(tuple(image.size)) if image is not None else ""


# Nodes that a first bake adds or links in a material.
LEFT_OUT = {"BeamspreadNode", "ShaderNodeOutputMaterial"}


def _modifier(modifier) -> object:
    return values_of(modifier, {"execution_time", "show_viewport", "levels", "persistent_uid", "object", "is_active"})


def _mesh(obj, depsgraph) -> str:
    """Digest of vertices, faces, UV maps and painted colors, with modifiers if the window shows the object."""
    if obj.type not in SURFACE_TYPES:
        return obj.data.name_full if obj.data else ""
    evaluated = obj.evaluated_get(depsgraph)
    try:
        mesh = evaluated.to_mesh()
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
            hashed.update(array.tobytes())
        hashed.update(repr([layer.active_render for layer in mesh.uv_layers]).encode())
        return hashed.hexdigest()
    finally:
        evaluated.to_mesh_clear()


def settings_part(scene, solver: str | None = None, indirect: bool | None = None) -> str:
    """Digest of the bake settings; arguments override the scene's."""
    own = scene.beamspread
    use_indirect = own.use_indirect if indirect is None else indirect
    bounces = (
        [getattr(scene.cycles, name, None) for name in BOUNCES] if use_indirect and hasattr(scene, "cycles") else []
    )
    return digest([solver or own.solver, own.distributions, own.samples, own.margin, use_indirect], *bounces)


def _quality(scene) -> str:
    """Quality of the distributions, or the folder of samples; no digest, since a quick preview replaces it."""
    own = scene.beamspread
    return own.quality if own.distributions == "LIBRARY" else bpy.path.abspath(own.sample_folder)
