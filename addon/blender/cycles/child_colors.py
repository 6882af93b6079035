"""Colors that are linked to the Base Color of a node, at the texels of a texture: baked as emission.

Part of the child process (child.py).
"""

import bpy
import numpy as np
from mathutils import Matrix

from .child_fields import Baker, linked_source, without_limits
from .child_ghost import finish


def colors(request, scene, _progress) -> dict:
    """Task `colors`: means over texels, float32 (height, width, 3), NaN for texels that are not on the mesh.

    `texture` names the input: the group nodes around a node, the node, the socket. Each texel is baked at `positions`
    along each of its sides, with `samples` at each. Cycles takes the first sample in the middle of a pixel, and moves
    samples beyond a triangle back to it.
    """
    obj, material = made_real(scene, request["object"], request["matrix"]), bpy.data.materials[request["material"]]
    obj = selectable(scene, obj if obj.type == "MESH" else as_mesh(scene, obj, request["uv_map"]))
    if request["uv_map"] and request["uv_map"] not in obj.data.uv_layers:
        apply_modifiers(obj, request["uv_map"])
    copied = material.copy()  # a linked material can't be changed
    source = linked_source(copied.node_tree, *request["texture"])
    if source is None:
        raise RuntimeError(f"nothing is linked to the Base Color of '{material.name}'")
    without_limits(scene)
    scene.cycles.samples, scene.cycles.seed = request["samples"], 0
    width, height, side = (request[name] for name in ("width", "height", "positions"))
    image = bpy.data.images.new("Colors", width * side, height * side, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.full(len(image.pixels), np.nan, np.float32))
    show_as_emission(copied.node_tree, source, image)
    bare = bpy.data.materials.new("Without image")
    for slot in obj.material_slots:
        slot.material = copied if slot.material == material else bare
    baker = Baker(scene, obj, image, "EMIT")
    layers = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.uv_layers
    uv_map = request["uv_map"] or next(layer.name for layer in layers if layer.active_render)
    if any(request["tile"]):
        uv_map = moved_map(obj.data, uv_map, request["tile"])
    baker.options |= {"use_clear": False, "uv_layer": uv_map}
    fine = baker.bake_passes(set()).reshape(height, side, width, side, 3)
    total, count = np.nan_to_num(fine, nan=0.0).sum(axis=(1, 3)), np.isfinite(fine).sum(axis=(1, 3))
    return {"colors": np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)}


def apply_modifiers(obj, uv_map: str) -> None:
    """Give an object its evaluated mesh: Blender bakes to maps of the mesh itself, and a modifier may make this one."""
    mesh = evaluated_mesh(obj, uv_map)
    obj.modifiers.clear()
    obj.data = mesh
    bpy.context.view_layer.update()


def as_mesh(scene, obj, uv_map: str):
    """An object with the evaluated mesh of a curve or text, which Blender itself can't bake; hides the original."""
    mesh, materials = evaluated_mesh(obj, uv_map), [slot.material for slot in obj.material_slots]
    mesh.materials.clear()
    for material in materials:
        mesh.materials.append(material)
    new = bpy.data.objects.new(f"{obj.name} to bake", mesh)
    scene.collection.objects.link(new)
    set_transform(scene, new, obj.matrix_world)
    obj.hide_render = True
    return new


def evaluated_mesh(obj, uv_map: str):
    """A copy of an object's evaluated mesh, with a UV map of that name that a modifier may make.

    Blender 3.4 has it as an attribute of vectors.
    """
    depsgraph, before = bpy.context.evaluated_depsgraph_get(), obj.data
    evaluated = obj.evaluated_get(depsgraph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=depsgraph)
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = before.texspace_location, before.texspace_size
    attribute = None if uv_map in mesh.uv_layers else mesh.attributes.get(uv_map)
    if attribute is not None:
        vectors = np.empty(3 * len(mesh.loops), np.float32)
        attribute.data.foreach_get("vector", vectors)
        mesh.attributes.remove(attribute)
        layer = mesh.uv_layers.new(name=uv_map, do_init=False)
        layer.data.foreach_set("uv", np.ascontiguousarray(vectors.reshape(-1, 3)[:, :2]).ravel())
    return mesh


def moved_map(mesh, name: str, corner) -> str:
    """Name of a copy of a UV map, in which the UDIM tile with this corner lies from 0 to 1."""
    layer = mesh.uv_layers.new(name="Tile", do_init=False)
    if layer is None:
        raise RuntimeError("the mesh has as many UV maps as it can have")
    uvs = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[name].data.foreach_get("uv", uvs)
    layer.data.foreach_set("uv", (uvs.reshape(-1, 2) - np.float32(corner)).ravel())
    mesh.update()
    bpy.context.view_layer.update()
    return layer.name


def show_as_emission(tree, source, image) -> None:
    """Show the color of a socket as emission."""
    for node in [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]:
        tree.nodes.remove(node)
    emission = tree.nodes.new("ShaderNodeEmission")
    finish(tree, emission, image)
    tree.links.new(emission.inputs["Color"], source)


def made_real(scene, name, matrix):
    """Object of that name; with a matrix, a copy of it with that transform, in place of the instance."""
    if matrix is None:
        return scene.objects[name]
    instanced = next(obj for obj in bpy.data.objects if obj.name == name and obj.users_collection)
    obj = instanced.copy()
    instanced.hide_render = True
    obj.name = f"{name} to bake"
    obj.animation_data_clear()
    obj.constraints.clear()
    set_transform(scene, obj, matrix)
    for delta in ("delta_location", "delta_rotation_euler"):
        setattr(obj, delta, (0, 0, 0))
    obj.delta_rotation_quaternion, obj.delta_scale = (1, 0, 0, 0), (1, 1, 1)
    return obj


def set_transform(scene, obj, matrix) -> None:
    """Give an object a transform to the world, which may be sheared as that of instances may be.

    The inverse of a parent can be sheared, and an object itself can't.
    """
    obj.parent = bpy.data.objects.new("Transform", None)
    scene.collection.objects.link(obj.parent)
    obj.parent_type, obj.matrix_parent_inverse, obj.matrix_basis = "OBJECT", Matrix(matrix), Matrix()


def selectable(scene, obj):
    """The object, or a copy of a linked one. Blender bakes local objects that are selected and visible."""
    if obj.library is not None:
        obj = obj.copy()
        obj.name += " to bake"  # Cycles finds the object by its name
    if obj.data.library is not None:
        obj.data = obj.data.copy()
    if obj not in scene.collection.objects.values():
        scene.collection.objects.link(obj)
    obj.hide_viewport = obj.hide_select = False
    bpy.context.view_layer.update()
    obj.hide_set(False)
    return obj
