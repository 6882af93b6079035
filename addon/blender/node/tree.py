"""The node's inner tree, made of nodes that every Blender has: a renderer sees it in place of the node."""

import bpy
from bpy.app.handlers import persistent

from .. import compat
from ..read.nodes import INNER_TREE, OWN_NODE

NAME = INNER_TREE
BASE_COLOR, ROUGHNESS, NORMAL = "Base Color", "Roughness", "Normal"
IMAGE, BACK_IMAGE, FRESNEL, COAT, GLOSSY = "Image", "Back Image", "Fresnel", "Coat", "Glossy"
FACING, UV_MAP = "Facing", "UV Map"
INPUT, EMISSION, UNSEEN, TOTAL, OUTPUT = "Input", "Emission", "Unseen", "Total", "Output"
BAKED = "Is Baked"

FORMER_MAP = "beamspread_uv_map"
"""Key of a tree: name of the UV map of its own image, while Live shows another one."""

# Roughness of the coat of older trees, in their Glossy node.
ROUGHNESS_BEFORE = 0.1


def make_inner_tree() -> bpy.types.ShaderNodeTree:
    """Image -> Color; image as emission, with a Fresnel-weighted glossy coat added -> BSDF.

    The image already holds the light that leaves the surface, so the coat adds to it and takes nothing away. Without an
    image, the base color of a diffuse surface replaces the emission, and Color is black.
    """
    # The dot hides it in menus. A Blender without this add-on drops a tree that has no fake user when it saves.
    tree = bpy.data.node_groups.new(NAME, "ShaderNodeTree")
    tree.use_fake_user = True
    compat.add_output_socket(tree, "NodeSocketColor", "Color")
    compat.add_output_socket(tree, "NodeSocketShader", "BSDF")
    image = _add(tree, "ShaderNodeTexImage", IMAGE, (-600, 0))
    image.extension = "EXTEND"
    fresnel = _add(tree, "ShaderNodeFresnel", FRESNEL, (-600, -300))
    coat = _add(tree, "ShaderNodeMath", COAT, (-400, -300))
    coat.operation = "MULTIPLY"
    glossy = _add(tree, "ShaderNodeBsdfGlossy", GLOSSY, (-200, -300))
    glossy.inputs["Roughness"].default_value = ROUGHNESS_BEFORE
    emission = _add(tree, "ShaderNodeEmission", EMISSION, (-200, 0))
    total = _add(tree, "ShaderNodeAddShader", TOTAL, (0, -100))
    output = _add(tree, "NodeGroupOutput", OUTPUT, (200, 0))
    link = tree.links.new
    link(output.inputs["Color"], image.outputs["Color"])
    link(emission.inputs["Color"], image.outputs["Color"])
    link(coat.inputs[0], fresnel.outputs[0])
    link(glossy.inputs["Color"], coat.outputs[0])
    link(total.inputs[0], emission.outputs[0])
    link(total.inputs[1], glossy.outputs[0])
    link(output.inputs["BSDF"], total.outputs[0])
    add_missing_inputs(tree)
    return tree


def is_inner_tree(tree) -> bool:
    """True if `make_inner_tree` made the tree."""
    return tree.name.startswith(NAME) and {IMAGE, FRESNEL, GLOSSY} <= set(tree.nodes.keys())


def add_missing_inputs(tree) -> bool:
    """Give a tree of an older file the inputs that nodes have today; True if it lacked them."""
    compat.set_shader_color(tree)
    lacks_inputs = not compat.has_input_socket(tree, NORMAL) and {FRESNEL, GLOSSY} <= set(tree.nodes.keys())
    if lacks_inputs:
        _add_inputs(tree)
    if UNSEEN not in tree.nodes and {INPUT, IMAGE, EMISSION} <= set(tree.nodes.keys()):
        _use_base_color(tree)
    if BAKED not in tree.nodes and {INPUT, IMAGE, EMISSION, TOTAL, OUTPUT} <= set(tree.nodes.keys()):
        _show_unbaked(tree)
    return lacks_inputs


def _add_inputs(tree) -> None:
    glossy, fresnel = tree.nodes[GLOSSY], tree.nodes[FRESNEL]
    compat.add_input_socket(tree, "NodeSocketColor", BASE_COLOR, hide_value=True)
    compat.add_input_socket(tree, "NodeSocketFloat", ROUGHNESS, default=ROUGHNESS_BEFORE)
    compat.add_input_socket(tree, "NodeSocketVector", NORMAL, hide_value=True)
    given = _add(tree, "NodeGroupInput", INPUT, (-1400, -450))
    normal = _normal_or_plain(tree, given.outputs[NORMAL])
    tree.links.new(glossy.inputs["Roughness"], given.outputs[ROUGHNESS])
    tree.links.new(glossy.inputs["Normal"], normal)
    tree.links.new(fresnel.inputs["Normal"], normal)


def _use_base_color(tree) -> None:
    """Make the emission depend on the base color, times 0: Blender 5 grays out inputs that no output depends on."""
    nothing = _add(tree, "ShaderNodeVectorMath", UNSEEN, (-600, 250))
    nothing.operation = "MULTIPLY"
    nothing.inputs[1].default_value = (0.0, 0.0, 0.0)
    total = _add(tree, "ShaderNodeVectorMath", "Seen", (-400, 150))
    link = tree.links.new
    link(nothing.inputs[0], tree.nodes[INPUT].outputs[BASE_COLOR])
    link(total.inputs[0], tree.nodes[IMAGE].outputs["Color"])
    link(total.inputs[1], nothing.outputs[0])
    link(tree.nodes[EMISSION].inputs["Color"], total.outputs[0])


def _show_unbaked(tree) -> None:
    """Switch between the bake and a diffuse surface of the base color; an image node without image is magenta."""
    baked = _add(tree, "ShaderNodeValue", BAKED, (-600, 450))
    diffuse = _add(tree, "ShaderNodeBsdfDiffuse", "Diffuse", (-400, 350))
    surface = _add(tree, "ShaderNodeMixShader", "Surface", (-200, 200))
    color = _add(tree, "ShaderNodeVectorMath", "Baked Color", (0, 100))
    color.operation = "MULTIPLY"
    link = tree.links.new
    link(diffuse.inputs["Color"], tree.nodes[INPUT].outputs[BASE_COLOR])
    link(diffuse.inputs["Normal"], tree.nodes[GLOSSY].inputs["Normal"].links[0].from_socket)
    link(surface.inputs[0], baked.outputs[0])
    link(surface.inputs[1], diffuse.outputs[0])
    link(surface.inputs[2], tree.nodes[EMISSION].outputs[0])
    link(tree.nodes[TOTAL].inputs[0], surface.outputs[0])
    link(color.inputs[0], tree.nodes[IMAGE].outputs["Color"])
    link(color.inputs[1], baked.outputs[0])
    link(tree.nodes[OUTPUT].inputs["Color"], color.outputs[0])
    show_images(tree, *shown_images(tree))


def _normal_or_plain(tree, given):
    """The given normal, or the surface's own without a link: the group's input is then the null vector."""
    link = tree.links.new
    geometry = _add(tree, "ShaderNodeNewGeometry", FACING, (-1400, -650))
    length = _add(tree, "ShaderNodeVectorMath", "Length", (-1200, -450))
    length.operation = "LENGTH"
    missing = _add(tree, "ShaderNodeMath", "Missing", (-1000, -450))
    missing.operation = "LESS_THAN"
    missing.inputs[1].default_value = 0.5
    surface_normal = _add(tree, "ShaderNodeVectorMath", "Own", (-1000, -650))
    surface_normal.operation = "SCALE"
    total = _add(tree, "ShaderNodeVectorMath", "Normal", (-800, -450))
    link(length.inputs[0], given)
    link(missing.inputs[0], length.outputs["Value"])
    link(surface_normal.inputs[0], geometry.outputs["Normal"])
    link(surface_normal.inputs["Scale"], missing.outputs[0])
    link(total.inputs[0], given)
    link(total.inputs[1], surface_normal.outputs[0])
    return total.outputs[0]


def show_values(tree, front, back, ior: float) -> None:
    """Bring images and an index of refraction into the tree."""
    show_images(tree, front, back)
    show_ior(tree, ior)


def show_ior(tree, ior: float) -> None:
    """Bring an index of refraction into the tree, whose image stays."""
    tree.nodes[FRESNEL].inputs["IOR"].default_value = max(ior, 1.0)
    # Without a step in refraction there is no coat, though a Fresnel node reflects at grazing angles.
    tree.nodes[COAT].inputs[1].default_value = 1.0 if ior > 1 else 0.0


def show_images(tree, front, back) -> None:
    """Show an image on the front and one on the back of faces, or the base color without any."""
    if front != back and BACK_IMAGE not in tree.nodes:
        _add_back(tree)
    _show_in(tree.nodes[IMAGE], front)
    if BACK_IMAGE in tree.nodes:
        _show_in(tree.nodes[BACK_IMAGE], back)
    baked = tree.nodes[BAKED].outputs[0] if BAKED in tree.nodes else None
    is_baked = float(front is not None)
    if baked is not None and baked.default_value != is_baked:
        baked.default_value = is_baked


def shown_images(tree) -> tuple:
    """Images that the tree shows on the front and on the back of faces; equal where there is one, or None."""
    front = tree.nodes[IMAGE].image
    return front, tree.nodes[BACK_IMAGE].image if BACK_IMAGE in tree.nodes else front


def _show_in(node, image) -> None:
    if node.image != image:
        node.image = image


def _add_back(tree) -> None:
    """Choose between the image and one of the back by the side that is seen, wherever the image is linked."""
    image, link = tree.nodes[IMAGE], tree.links.new
    readers = [wire.to_socket for wire in image.outputs["Color"].links]
    back = _add(tree, "ShaderNodeTexImage", BACK_IMAGE, (-600, 700))
    back.extension = image.extension
    if image.inputs["Vector"].is_linked:
        link(back.inputs["Vector"], image.inputs["Vector"].links[0].from_socket)
    geometry = _add(tree, "ShaderNodeNewGeometry", "Seen Side", (-600, 1000))
    difference = _add(tree, "ShaderNodeVectorMath", "Back or Front", (-400, 700))
    difference.operation = "SUBTRACT"
    side = _add(tree, "ShaderNodeVectorMath", "Side", (-200, 700))
    side.operation = "MULTIPLY_ADD"
    link(difference.inputs[0], back.outputs["Color"])
    link(difference.inputs[1], image.outputs["Color"])
    link(side.inputs[0], difference.outputs[0])
    link(side.inputs[1], geometry.outputs["Backfacing"])
    link(side.inputs[2], image.outputs["Color"])
    for reader in readers:
        link(reader, side.outputs[0])


def show_map(tree, name: str) -> None:
    """Show the image by the UV map of that name; "" is the one that renders."""
    node = tree.nodes.get(UV_MAP)
    if node is None and not name:
        return
    # Blender 3.4 has the map of a modifier as an attribute alone.
    kind, output, attribute = ("UVMap", "UV", "uv_map")
    if compat.uv_attribute_type() != "FLOAT2" and name:
        kind, output, attribute = ("Attribute", "Vector", "attribute_name")
    if node is not None and node.bl_idname != f"ShaderNode{kind}":
        tree.nodes.remove(node)
        node = None
    if node is None:
        node = _add(tree, f"ShaderNode{kind}", UV_MAP, (-800, 0))
        for image in (IMAGE, BACK_IMAGE):
            if image in tree.nodes:
                tree.links.new(tree.nodes[image].inputs["Vector"], node.outputs[output])
    if getattr(node, attribute) != name:
        setattr(node, attribute, name)


def keep_map(tree, name: str) -> None:
    """Show the image by the UV map of that name from here on."""
    show_map(tree, name)
    tree.pop(FORMER_MAP, None)


def show_map_for_now(tree, name: str) -> None:
    """Show the image by the UV map of that name until `show_own_images_in`."""
    shown = _shown_map(tree)
    if name != shown:
        tree[FORMER_MAP] = tree.get(FORMER_MAP, shown)
        show_map(tree, name)


def _shown_map(tree) -> str:
    node = tree.nodes.get(UV_MAP)
    return "" if node is None else getattr(node, "uv_map", None) or getattr(node, "attribute_name", "")


def own_map(tree) -> str:
    """Name of the UV map by which the tree shows the node's own image; "" is the one that renders."""
    return tree.get(FORMER_MAP, _shown_map(tree))


def show_own_images_in(tree, node) -> None:
    """Show the images of the tree's node, by the UV map of their bakes."""
    show_images(tree, *node.shown_images())
    if FORMER_MAP in tree:
        keep_map(tree, tree[FORMER_MAP])


def follow_frames(tree, image, first: int, last: int) -> None:
    """Have nodes of the tree that show this image, a sequence, follow the scene's frame from the first to the last."""
    for name in (IMAGE, BACK_IMAGE):
        if name in tree.nodes and tree.nodes[name].image == image:
            user = tree.nodes[name].image_user
            user.frame_start, user.frame_duration, user.frame_offset = first, last - first + 1, first - 1
            user.use_auto_refresh = True


def _add(tree, kind: str, name: str, location: tuple[int, int]):
    node = tree.nodes.new(kind)
    node.name, node.location = name, location
    return node


def plain_of(node):
    """Group of plain nodes that shows the bake in the node's place, or None."""
    plain = node.id_data.nodes.get(node.plain_node) if node.plain_node else None
    return plain if plain is not None and plain.bl_idname == "ShaderNodeGroup" else None


def all_nodes():
    """Beamspread nodes of the file, in materials and in groups."""
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree] + list(bpy.data.node_groups)
    return (node for tree in trees for node in tree.nodes if node.bl_idname == OWN_NODE)


def own_tree(node):
    """The node's inner tree, up to date and the node's own from here on; None without one.

    A copied node shares the original's tree until then. In `copy()` Blender has not counted the users of the new node
    yet: another tree would leave the original's with too few, and Blender would drop it when it saves.
    """
    tree = node.node_tree
    if tree is None:
        return None
    plain = plain_of(node)
    if is_shared(tree, plain) and sum(node.node_tree == tree for node in all_nodes()) > 1:
        tree = tree.copy()
        tree.use_fake_user = True
        node.node_tree = tree
        if plain is not None:
            plain.node_tree = tree
    upgrade(tree)
    return tree


def is_shared(tree, plain=None) -> bool:
    """True if nodes of other materials use the tree, too; its fake user counts as a user.

    Before Blender 4.5, a copied material counts one user too many until the file is opened again.
    """
    users = 1 + (plain is not None and plain.node_tree == tree)
    return tree.users - tree.use_fake_user > users


def upgrade(tree) -> None:
    if tree.library is not None or not add_missing_inputs(tree):
        return
    # Existing nodes get a new input before it has a default.
    for node in all_nodes():
        if node.node_tree == tree:
            node.inputs[ROUGHNESS].default_value = ROUGHNESS_BEFORE


def release_images() -> None:
    """Have trees show no image until `show_own_images`.

    Undo keeps trees that are equal in both of its steps as they are in memory. It frees images that the other step does
    not have, as one of Live or of a bake, even if such a tree shows them: Blender 5.2 crashes then.
    """
    for node in all_nodes():
        tree = node.node_tree
        if tree is not None and tree.library is None and IMAGE in tree.nodes:
            show_images(tree, None, None)


@persistent
def show_own_images(*_arguments) -> None:
    """Have trees show the images of their nodes: undo, and files saved by Blender itself, restore Live's images."""
    for node in all_nodes():
        tree = node.node_tree
        if tree is not None and tree.library is None and IMAGE in tree.nodes:
            show_own_images_in(tree, node)


@persistent
def release_unused_trees(*_arguments) -> None:
    """Release inner trees without a node: no node is told when its material is removed.

    Removing them here would crash on undo. Without their fake user they are not saved.
    """
    trees = [
        tree for tree in bpy.data.node_groups if is_inner_tree(tree) and tree.library is None and tree.use_fake_user
    ]
    for tree, users in bpy.data.user_map(subset=set(trees)).items() if trees else ():
        if not users:
            tree.use_fake_user = False
