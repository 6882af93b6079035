"""The node's inner tree, made of nodes that every Blender has: a renderer sees it in place of the node."""

import bpy

from .. import compat
from ..read.nodes import INNER_TREE

NAME = INNER_TREE
BASE_COLOR, ROUGHNESS, NORMAL = "Base Color", "Roughness", "Normal"
IMAGE, FRESNEL, COAT, GLOSSY = "Image", "Fresnel", "Coat", "Glossy"
FACING = "Facing"
INPUT, EMISSION, UNSEEN, TOTAL, OUTPUT = "Input", "Emission", "Unseen", "Total", "Output"
BAKED = "Is Baked"

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
    show_image(tree, tree.nodes[IMAGE].image)


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


def show_values(tree, image, ior: float) -> None:
    """Bring an image and an index of refraction into the tree."""
    show_image(tree, image)
    show_ior(tree, ior)


def show_ior(tree, ior: float) -> None:
    """Bring an index of refraction into the tree, whose image stays."""
    tree.nodes[FRESNEL].inputs["IOR"].default_value = max(ior, 1.0)
    # Without a step in refraction there is no coat, though a Fresnel node reflects at grazing angles.
    tree.nodes[COAT].inputs[1].default_value = 1.0 if ior > 1 else 0.0


def show_image(tree, image) -> None:
    """Show an image in the tree, or the base color without one."""
    if tree.nodes[IMAGE].image != image:
        tree.nodes[IMAGE].image = image
    baked = tree.nodes[BAKED].outputs[0] if BAKED in tree.nodes else None
    is_baked = float(image is not None)
    if baked is not None and baked.default_value != is_baked:
        baked.default_value = is_baked


def follow_frames(tree, first: int, last: int) -> None:
    """Have the tree's image, a sequence, follow the scene's frame from the first to the last file."""
    user = tree.nodes[IMAGE].image_user
    user.frame_start, user.frame_duration, user.frame_offset = first, last - first + 1, first - 1
    user.use_auto_refresh = True


def _add(tree, kind: str, name: str, location: tuple[int, int]):
    node = tree.nodes.new(kind)
    node.name, node.location = name, location
    return node
