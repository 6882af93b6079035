"""What is linked to the Base Color of a node, at the texels of a texture: baked as light that a surface sends out.

Part of the child process (child.py).
"""

import bpy
import numpy as np
from child_fields import Baker, linked_source, without_limits
from child_ghost import finish
from mathutils import Matrix


def colors(request, scene, _progress) -> dict:
    """The task `colors`: float32 (height, width, 3), means over texels; not a number where none of it is on the mesh.

    `texture` names the input: the group nodes around a node, the node, the socket. `places` along each side of a texel
    are baked, each the mean of `samples`: Cycles takes the first of these in the middle, and moves those back that are
    beyond a triangle.
    """
    obj, material = made_real(scene, request["object"], request["matrix"]), bpy.data.materials[request["material"]]
    obj = selectable(scene, obj)
    shown = material.copy()  # a linked one would be baked as it was
    source = linked_source(shown.node_tree, *request["texture"])
    if source is None:
        raise RuntimeError(f"nothing is linked to the Base Color of '{material.name}'")
    without_limits(scene)
    scene.cycles.samples, scene.cycles.seed = request["samples"], 0
    width, height, places = (request[name] for name in ("width", "height", "places"))
    image = bpy.data.images.new("Colors", width * places, height * places, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.full(len(image.pixels), np.nan, np.float32))
    glow(shown.node_tree, source, image)
    bare = bpy.data.materials.new("Without image")
    for slot in obj.material_slots:
        slot.material = shown if slot.material == material else bare
    baker = Baker(scene, obj, image, "EMIT")
    layers = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.uv_layers
    baker.options |= {"use_clear": False, "uv_layer": next(one.name for one in layers if one.active_render)}
    fine = baker.bake_passes(set()).reshape(height, places, width, places, 3)
    total, count = np.nan_to_num(fine, nan=0.0).sum(axis=(1, 3)), np.isfinite(fine).sum(axis=(1, 3))
    return {"colors": np.where(count > 0, total / np.maximum(count, 1), np.nan).astype(np.float32)}


def glow(tree, source, image) -> None:
    """Show what a socket has, as emission."""
    for node in [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]:
        tree.nodes.remove(node)
    emission = tree.nodes.new("ShaderNodeEmission")
    finish(tree, emission, image)
    tree.links.new(emission.inputs["Color"], source)


def made_real(scene, name, matrix):
    """The object of that name; with a matrix one that stands there, in place of the instance."""
    if matrix is None:
        return scene.objects[name]
    instanced = next(one for one in bpy.data.objects if one.name == name and one.users_collection)
    obj = instanced.copy()
    instanced.hide_render = True
    obj.name = f"{name} to bake"
    obj.animation_data_clear()
    obj.constraints.clear()
    # A parent's inverse may skew, as instances can, and an object itself can't.
    obj.parent = bpy.data.objects.new("Place", None)
    scene.collection.objects.link(obj.parent)
    obj.parent_type, obj.matrix_parent_inverse, obj.matrix_basis = "OBJECT", Matrix(matrix), Matrix()
    for delta in ("delta_location", "delta_rotation_euler"):
        setattr(obj, delta, (0, 0, 0))
    obj.delta_rotation_quaternion, obj.delta_scale = (1, 0, 0, 0), (1, 1, 1)
    return obj


def selectable(scene, obj):
    """The object, or a copy of a linked one: Blender bakes what is selected, its own, and shown by a view."""
    if obj.library is not None:
        obj = obj.copy()
        obj.name += " to bake"  # Cycles looks for it by its name
    if obj.data.library is not None:
        obj.data = obj.data.copy()
    if obj not in scene.collection.objects.values():
        scene.collection.objects.link(obj)
    obj.hide_viewport = obj.hide_select = False
    bpy.context.view_layer.update()
    obj.hide_set(False)
    return obj
