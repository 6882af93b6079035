"""Objects that a render shows: visibility, collections that objects instance, and the instance that is baked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
from mathutils import Matrix

from ...core.errors import BakeError
from ...core.messages import Message, warning
from .. import compat

# Types of objects whose surfaces become meshes, and of all objects that light bounces from.
SURFACE_TYPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
SOLID_TYPES = SURFACE_TYPES | {"CURVES", "VOLUME", "POINTCLOUD"}

# Types of objects that are baked. A modifier can give the meshes of curves and text a UV map, but not metaballs.
RECEIVER_TYPES = {"MESH", "CURVE", "SURFACE", "FONT"}

# Types of objects that no bake knows, with their names for artists.
UNKNOWN_TYPES = {"CURVES": "hair", "POINTCLOUD": "a point cloud", "VOLUME": "a volume"}


def collection_of(obj):
    """The collection that an object instances, or None."""
    return obj.instance_collection if obj.instance_type == "COLLECTION" else None


def instanced_collections(objects: Iterable) -> list:
    """Collections that objects instance, and those that the objects in these instance in turn; each once."""
    collections, waiting = {}, list(objects)
    for obj in waiting:
        collection = collection_of(obj)
        if collection is not None and collection not in collections:
            collections[collection] = None
            waiting.extend(collection.all_objects)
    return list(collections)


def with_instanced(objects: Iterable) -> list:
    """The objects, and after them those of the collections that they instance; each once."""
    objects = list(objects)
    inner = (obj for collection in instanced_collections(objects) for obj in collection.all_objects)
    return list(dict.fromkeys([*objects, *inner]))


def by_name(scene) -> dict:
    """Objects of a scene and of the collections in it by name; the scene's own win over others of the same name."""
    return {obj.name: obj for obj in reversed(with_instanced(scene.objects))}


def rendered_in(collection) -> list:
    """Objects that a render shows of an instanced collection, without the objects that these instance in turn."""
    objects = {}
    if not collection.hide_render:
        objects = dict.fromkeys(obj for obj in collection.objects if not obj.hide_render)
        for child in collection.children:
            objects |= dict.fromkeys(rendered_in(child))
    return list(objects)


def placed(depsgraph, objects: Iterable, matrix: Matrix | None = None, instancer=None) -> Iterator[tuple]:
    """Evaluated objects, their transforms and instancers, and after them those of collections that they instance."""
    for original in objects:
        obj = original.evaluated_get(depsgraph)
        world = transform_of(obj) if matrix is None else matrix @ transform_of(obj)
        yield obj, world, instancer
        collection = collection_of(original)
        if collection is not None:
            inner = world @ Matrix.Translation(-collection.instance_offset)
            yield from placed(depsgraph, rendered_in(collection), inner, instancer or obj)


def transform_of(obj) -> Matrix:
    """Transform of an evaluated object to the world. Blender updates no hidden ones: these lack their constraints."""
    if obj.is_evaluated:
        return obj.matrix_world
    around = Matrix() if obj.parent is None else transform_of(obj.parent) @ obj.matrix_parent_inverse
    return around @ obj.matrix_basis


def count_instances(objects: Iterable, known: dict | None = None) -> Counter:
    """Number of instances, by object name, that a render shows of collections that the objects instance."""
    known, total = {} if known is None else known, Counter()
    for collection, times in Counter(filter(None, map(collection_of, objects))).items():
        if collection not in known:
            inside = rendered_in(collection)
            known[collection] = count_instances(inside, known) + Counter(obj.name for obj in inside)
        for name, count in known[collection].items():
            total[name] += times * count
    return total


def render_visible_names(view_layer) -> set[str]:
    """Names of the objects that a render of the view layer shows (the depsgraph of the viewport shows others)."""
    names: set[str] = set()

    def visit(layer_collection) -> None:
        if layer_collection.exclude or layer_collection.collection.hide_render:
            return
        names.update(obj.name for obj in layer_collection.collection.objects if not obj.hide_render)
        for child in layer_collection.children:
            visit(child)

    visit(view_layer.layer_collection)
    return names


def renders(instance, visible: set[str]) -> bool:
    """True if a render shows an entry of `depsgraph.object_instances`; see `render_visible_names`."""
    obj = instance.object
    if instance.is_instance:
        parent = instance.parent
        return not obj.hide_render and parent is not None and parent.name in visible
    if obj.name not in visible:
        return False
    # An instancer that hides itself still shows its instances.
    return not obj.is_instancer or obj.show_instancer_for_render


def casts_shadows(obj, instancer) -> bool:
    """True if an object casts shadows; `instancer` is the object that instances it, or None."""
    return all(getattr(owner, "visible_shadow", True) for owner in (obj, instancer) if owner is not None)


def lights_surfaces(obj, instancer) -> bool:
    """True if the light of an object falls on surfaces; `instancer` is the object that instances it, or None."""
    asks_instancer = instancer is not None and (obj.type != "LIGHT" or compat.instancer_hides_lamps())
    return obj.visible_diffuse and (not asks_instancer or instancer.visible_diffuse)


@contextmanager
def as_rendered(view_layer):
    """Make the viewport's depsgraph equal to a render's while a `with` block lasts.

    Blender offers scripts no depsgraph in render mode outside a render engine. The viewport's depsgraph lacks objects
    and modifiers that are hidden there but render.
    """
    restore = []

    def set_value(owner, name, value) -> None:
        if getattr(owner, name) != value:
            restore.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    def visit(layer_collection) -> None:
        if layer_collection.exclude:
            return
        set_value(layer_collection, "hide_viewport", False)
        if layer_collection.collection.library is None:
            set_value(layer_collection.collection, "hide_viewport", False)
        for child in layer_collection.children:
            visit(child)

    def show_modifiers(obj) -> None:
        for modifier in obj.modifiers:
            set_value(modifier, "show_viewport", modifier.show_render)
            if modifier.type == "SUBSURF":
                set_value(modifier, "levels", modifier.render_levels)
        show_resolution(obj.data)

    def show_resolution(data) -> None:
        if not isinstance(data, bpy.types.Curve) or data.library is not None:
            return
        for name in ("resolution_u", "resolution_v"):
            rendered = getattr(data, f"render_{name}")
            if rendered:  # 0: that of the window
                # Blender gives a curve's value to its splines: these are restored after it.
                splines = [spline for spline in data.splines if getattr(spline, name) != rendered]
                restore.extend((spline, name, getattr(spline, name)) for spline in splines)
                restore.append((data, name, getattr(data, name)))
                setattr(data, name, rendered)
                for spline in splines:
                    setattr(spline, name, rendered)

    def update_collections() -> None:
        # Instanced collections notice only by a tag that an object in them was hidden or shown.
        for collection in collections:
            collection.update_tag()

    objects = list(view_layer.objects)
    # Lists, since hiding or showing an object makes collections gather their objects anew.
    collections = instanced_collections(view_layer.id_data.objects)
    parts = [part for collection in collections for part in (collection, *collection.children_recursive)]
    instanced = [obj for collection in collections for obj in collection.all_objects]
    hidden = [obj for obj in objects if obj.hide_get(view_layer=view_layer)]
    try:
        visit(view_layer.layer_collection)
        for obj in objects:
            if obj.library is not None or obj.hide_render:
                continue
            set_value(obj, "hide_viewport", False)
            obj.hide_set(False, view_layer=view_layer)
            show_modifiers(obj)
        for part in parts:
            if part.library is None:
                set_value(part, "hide_viewport", part.hide_render)
        update_collections()
        for obj in instanced:
            if obj.library is None:
                set_value(obj, "hide_viewport", obj.hide_render)
                show_modifiers(obj)
        view_layer.update()
        yield
    finally:
        for owner, name, value in reversed(restore):
            setattr(owner, name, value)
        for obj in hidden:
            obj.hide_set(True, view_layer=view_layer)
        update_collections()
        view_layer.update()


@dataclass(frozen=True)
class ObjectInstance:
    """An evaluated object in the world.

    Attributes
    ----------
    obj : the evaluated object.
    matrix : transform to the world, of the first instance if there are several.
    count : number of instances that a render shows.
    is_instance : True if only collections that others instance show the object.
    """

    obj: object
    matrix: object
    count: int = 1
    is_instance: bool = False


def find_instances(depsgraph, names: set[str], visible: set[str] | None = None) -> dict[str, ObjectInstance]:
    """Instances by object name: an object of the view layer itself, else the instances of it that render.

    Parameters
    ----------
    visible : names of the view layer's objects that count; None: all do.
    """
    objects = {
        obj.name: obj.evaluated_get(depsgraph)
        for obj in depsgraph.view_layer.objects
        if obj.name in names and (visible is None or obj.name in visible)
    }
    instances = {name: ObjectInstance(obj, obj.matrix_world) for name, obj in objects.items()}
    if len(instances) == len(names):
        return instances
    visible = render_visible_names(depsgraph.view_layer) if visible is None else visible
    for instance in depsgraph.object_instances:
        name = instance.object.name
        if name not in names or name in objects or not instance.is_instance or not renders(instance, visible):
            continue
        obj = instance.object.original.evaluated_get(depsgraph)
        # Geometry nodes may give an object instances of other meshes under its own name.
        if instance.object.data == obj.data:
            first = instances.get(name) or ObjectInstance(obj, instance.matrix_world.copy(), 0, is_instance=True)
            instances[name] = replace(first, count=first.count + 1)
    return instances


def check_instance(name: str, instance: ObjectInstance | None, view_layer) -> None:
    """Raise BakeError unless a render shows exactly one instance of an object."""
    if instance is None:
        raise BakeError(why_hidden(name, view_layer))
    if instance.count > 1:
        raise BakeError(
            f"The object '{name}' has {instance.count} instances and one image, which can't show "
            "the light of all: make them real (Object > Apply > Make Instances Real) and give each a material of its "
            "own (Object > Relations > Make Single User > Object & Data & Materials), or hide all but one from render."
        )


def why_hidden(name: str, view_layer) -> str:
    """A sentence about an object that does not render."""
    instancers = [] if name in view_layer.objects else with_instanced(view_layer.objects)
    names = " and ".join(f"'{obj.name}'" for obj in instancers if _instances(obj, name))
    icons = "its camera icon, and its collections'" + (f", and those of {names}, which shows it" if names else "")
    return f"The object '{name}' is hidden from render: turn on {icons}, in the Outliner."


def _instances(obj, name: str) -> bool:
    return any(inner.name == name for inner in with_instanced([obj]) if inner != obj)


def left_out(obj) -> Message | None:
    """Warning about an evaluated object if a bake leaves out its shadow and light, wholly or in part."""
    if obj.type in UNKNOWN_TYPES:
        text = f"'{obj.name}' is {UNKNOWN_TYPES[obj.type]}: its shadow and its own light are not baked."
        return warning(obj.name, text)
    if any(_draws_hair(system.settings) for system in getattr(obj, "particle_systems", ())):
        return warning(obj.name, f"The hair of '{obj.name}' is not baked: neither its shadow nor its own light.")
    return None


def left_out_of_world(world) -> Message | None:
    """Warning about a world whose fog a bake leaves out."""
    if world is None or not compat.uses_nodes(world):
        return None
    output = world.node_tree.get_output_node("CYCLES")
    if output is None or not output.inputs["Volume"].is_linked:
        return None
    text = f"The volume of the world '{world.name}' is not baked: neither the light that it absorbs nor its own light."
    return warning(world.name, text)


def _draws_hair(settings) -> bool:
    return settings.type == "HAIR" and settings.render_type == "PATH"
