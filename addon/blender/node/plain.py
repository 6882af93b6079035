"""Plain nodes for exporters and engines: an image of 8 bits that glTF holds, and a standard shader that shows it.

Exporters of glTF follow links from the material's output to an image node; of the node itself, before Blender 4.0 also
of groups, they see nothing. They write images as sRGB of 8 bits and clip values above 1, so these nodes show an image
that is made here: the bake times its exposure. The shader's strength is the exposure's inverse.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...core.display import auto_exposure, png
from ...core.errors import ImageError
from .. import compat
from ..read.image_nodes import from_srgb
from ..read.nodes import PLAIN
from .tree import NORMAL, ROUGHNESS, UV_MAP, all_nodes

COAT, EMISSION, UNLIT, GROUP = "COAT", "EMISSION", "UNLIT", "GROUP"

KINDS = (
    (COAT, "Emission and Coat", "Principled BSDF: the bake as emission, below the node's glossy coat", 0),
    (EMISSION, "Emission", "Emission node: the bake alone, with its full strength", 1),
    (UNLIT, "Unlit", "Image without a shader: the bake as color, for engines that show it without their own lights", 2),
    (GROUP, "Group", "Group of nodes for Blenders without this add-on; before 4.0, glTF files do not get its image", 3),
)
"""Kinds of plain nodes, as items of an enum."""

EXPOSURE_KEY = "beamspread_exposure"
"""Key of a material: exposure of the image of its plain nodes, or of the file that a batch wrote last."""

SOURCE = "beamspread_source"
"""Key of an image of 8 bits: the node's image that it was made from."""

LABEL = "Baked Light"

ABOVE, ABOVE_IMAGE, ABOVE_PRINCIPLED, GAP = 320, 520, 760, 40
"""Distances of plain nodes above the Beamspread node, so that an image node, one over it and a Principled BSDF find
place there; and the gap between columns."""

# Keys of the image node: names of the other nodes.
_SHADER, _SCALED, _MAP = "beamspread_shader", "beamspread_scaled", "beamspread_map"
_EXPOSURE = EXPOSURE_KEY

_STRENGTH = "beamspread_strength"
"""Key of the user's Emission node: its strength before it had to make up for the exposure."""


def image_node_of(node):
    """Image node of the plain nodes in the node's place; None without any, or if a group is there."""
    plain = node.id_data.nodes.get(node.plain_node) if node.plain_node else None
    return plain if plain is not None and PLAIN in plain else None


def outputs_of(node) -> dict:
    """Sockets in place of the node's outputs, by their names; empty without these nodes."""
    image = image_node_of(node)
    if image is None:
        return {}
    scaled, shader = _part(image, _SCALED), _part(image, _SHADER)
    return {
        "Color": scaled.outputs[0] if scaled is not None else image.outputs["Color"],
        "BSDF": shader.outputs[0] if shader is not None else image.outputs["Color"],
    }


def nodes_of(node) -> list:
    """The plain nodes in the node's place."""
    image = image_node_of(node)
    return [] if image is None else [image, *filter(None, (_part(image, key) for key in (_SHADER, _SCALED, _MAP)))]


def make(node, kind: str) -> float:
    """Put image nodes of a kind in the node's place; the exposure of their image.

    Raises
    ------
    ImageError
        The node has no single image, or it has no pixels.
    """
    encoded, exposure = encoded_image(node.shown_images()[0])
    tree = node.id_data
    image = _add(tree, "ShaderNodeTexImage", LABEL, node, -1)
    image.image, image.extension = encoded, "EXTEND"
    image[PLAIN] = kind
    node.plain_node = image.name
    _show_map(node, image)
    if kind != UNLIT:
        _add_shader(node, image, kind)
    _show_exposure(image, exposure)
    _take_links(node, image, exposure)
    note_exposure(_material_of(tree), exposure)
    return exposure


def leaves_out_back(node) -> bool:
    """True if the node shows two images, of which image nodes show the front's alone."""
    front, back = node.shown_images()
    return front != back


def remove(node) -> None:
    """Put the node back where these nodes are."""
    image = image_node_of(node)
    if image is None:
        return
    tree, own = node.id_data, nodes_of(node)
    for one, name in _results(image):
        for socket in [link.to_socket for link in one.outputs[0].links if link.to_node not in own]:
            is_shader = name == "BSDF" or socket.type == "SHADER"
            _restore_strength(socket.node)
            tree.links.new(socket, node.outputs["BSDF" if is_shader else "Color"])
    encoded = image.image
    for one in own:
        tree.nodes.remove(one)
    node.plain_node = ""
    if encoded is not None and not any(_shows(other, encoded) for other in all_nodes()):
        bpy.data.images.remove(encoded)
    material = _material_of(tree)
    if material is not None:
        material.pop(EXPOSURE_KEY, None)


def refresh(source, chosen=None) -> None:
    """Bring a bake that has filled an image into all image nodes that show it, or into those of one node.

    Nodes whose image is gone, or is no single image, keep what they show.
    """
    nodes = [chosen] if chosen else all_nodes()
    nodes = [node for node in nodes if node.shown_images()[0] == source and image_node_of(node)]
    if not nodes:
        return
    try:
        encoded, exposure = encoded_image(source)
    except ImageError:
        return
    for node in nodes:
        image = image_node_of(node)
        if exposure == _exposure_of(image):
            image.image = encoded
            _show_map(node, image)
        else:
            kind = image[PLAIN]
            remove(node)
            make(node, kind)


def encoded_image(source) -> tuple[bpy.types.Image, float]:
    """Packed PNG of 8 bits that holds an image times its exposure, and the exposure; made anew each time.

    Raises
    ------
    ImageError
        There is no single image with pixels.
    """
    if source is None:
        raise ImageError("The node has no baked image.", "Bake it first.")
    if source.source not in ("FILE", "GENERATED") or 0 in source.size:
        text = f"'{source.name}' is not a single image: glTF holds no UDIM tiles and no sequences."
        raise ImageError(text, "Choose Group, or bake to one image.")
    texture = _linear(source)
    exposure = auto_exposure(texture)
    content = png(texture, 8, exposure)
    encoded = next((image for image in bpy.data.images if image.get(SOURCE) == source), None)
    if encoded is None:
        encoded = bpy.data.images.new(f"{source.name} 8 bit", *source.size)
        encoded[SOURCE] = source
    encoded.pack(data=content, data_len=len(content))
    for kind in ("GENERATED", "FILE"):  # Blender loads the packed file; `reload` would look for one on the disk first
        encoded.source = kind
    encoded.colorspace_settings.name = _srgb()
    return encoded, exposure


def note_exposure(material, exposure: float) -> None:
    """Keep the exposure in the material, which exporters write among its custom properties."""
    if material is None or material.library is not None:
        return
    if exposure != 1 or EXPOSURE_KEY in material:
        material[EXPOSURE_KEY] = exposure


def _linear(image) -> np.ndarray:
    """Linear RGB (height, width, 3), row 0 at the bottom."""
    values = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(values)
    texture = values.reshape(image.size[1], image.size[0], image.channels)[..., :3]
    is_encoded = not image.is_float and not image.colorspace_settings.is_data
    return from_srgb(texture) if is_encoded else texture


def _srgb() -> str:
    """Name of the color space of byte images, which differs between configurations."""
    named = bpy.data.images.new("Beamspread", 1, 1)
    try:
        return named.colorspace_settings.name
    finally:
        bpy.data.images.remove(named)


def _add(tree, kind: str, label: str, node, column: int, above: int = ABOVE):
    """Add a node above the Beamspread node, `column` steps of its width to the right; the output stays free."""
    new = tree.nodes.new(kind)
    new.name = new.label = label
    new.location = node.location.x + column * (node.width + GAP), node.location.y + above
    return new


def _part(image, key: str):
    name = image.get(key)
    return image.id_data.nodes.get(name) if name else None


def _results(image) -> list[tuple]:
    """Nodes whose first outputs stand for the node's, with the name of that output."""
    named = [(_part(image, _SHADER), "BSDF"), (_part(image, _SCALED), "Color"), (image, "Color")]
    return [(one, name) for one, name in named if one is not None]


def _shows(node, encoded) -> bool:
    image = image_node_of(node)
    return image is not None and image.image == encoded


def _material_of(tree):
    return next((material for material in bpy.data.materials if material.node_tree == tree), None)


def _exposure_of(image) -> float:
    """Exposure that the nodes around an image node stand for."""
    return image[_EXPOSURE]


def _strength(shader):
    return shader.inputs["Strength" if shader.bl_idname == "ShaderNodeEmission" else "Emission Strength"]


def _add_shader(node, image, kind: str) -> None:
    tree = node.id_data
    if kind == EMISSION:
        shader = _add(tree, "ShaderNodeEmission", LABEL, node, 0)
        color = shader.inputs["Color"]
    else:
        shader = _add(tree, "ShaderNodeBsdfPrincipled", LABEL, node, 0, ABOVE_PRINCIPLED)
        color = shader.inputs["Emission Color" if "Emission Color" in shader.inputs else "Emission"]
        _set_coat(node, shader)
    image[_SHADER] = shader.name
    tree.links.new(color, image.outputs["Color"])


def _set_coat(node, shader) -> None:
    """Give a Principled BSDF the node's coat and nothing below it but emission."""
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    if "Specular" in shader.inputs:  # before Blender 4.0, .08 times which is the reflectance straight on
        shader.inputs["Specular"].default_value = ((node.ior - 1) / (node.ior + 1)) ** 2 / 0.08
    else:
        shader.inputs["IOR"].default_value = max(node.ior, 1.0)
    for name in (ROUGHNESS, NORMAL):
        source = node.inputs.get(name)
        if source is None:
            continue
        if source.is_linked:
            node.id_data.links.new(shader.inputs[name], source.links[0].from_socket)
        elif name == ROUGHNESS:
            shader.inputs[name].default_value = source.default_value


def _show_map(node, image) -> None:
    """Show the image by the UV map of the node's inner tree, by a node that exporters read where there is one."""
    tree, name, old = node.id_data, map_of(node), _part(image, _MAP)
    if old is not None:
        tree.nodes.remove(old)
        del image[_MAP]
    if not name:
        return
    is_exported = not is_map_of_modifier(node)
    kind, attribute, output = ("UVMap", "uv_map", "UV") if is_exported else ("Attribute", "attribute_name", "Vector")
    new = _add(tree, f"ShaderNode{kind}", "Baked UV Map", node, -2)
    setattr(new, attribute, name)
    image[_MAP] = new.name
    tree.links.new(image.inputs["Vector"], new.outputs[output])


def map_of(node) -> str:
    """Name of the UV map that shows the node's image; "" for the one that renders."""
    inner = node.node_tree and node.node_tree.nodes.get(UV_MAP)
    return getattr(inner, "uv_map", None) or getattr(inner, "attribute_name", "") if inner else ""


def is_map_of_modifier(node) -> bool:
    """True if the map exists as an attribute alone, as Blender 3.4 has those of modifiers: exporters don't write it."""
    name, material = map_of(node), _material_of(node.id_data)
    if not name or compat.uv_attribute_type() == "FLOAT2":
        return False
    meshes = (mesh for mesh in bpy.data.meshes if material in mesh.materials[:])
    return not any(name in mesh.uv_layers for mesh in meshes)


def _show_exposure(image, exposure: float) -> None:
    image[_EXPOSURE] = exposure
    shader = _part(image, _SHADER)
    if shader is not None:
        _strength(shader).default_value = 1.0 / exposure


def _take_links(node, image, exposure: float) -> None:
    """Move the links of the node's outputs to these nodes, where colors have the bake's values again."""
    tree, outputs = node.id_data, outputs_of(node)
    for socket in [link.to_socket for link in node.outputs["BSDF"].links]:
        tree.links.new(socket, outputs["BSDF"])
    for socket in [link.to_socket for link in node.outputs["Color"].links]:
        target, strength = socket.node, socket.node.inputs.get("Strength")
        if exposure == 1 or socket.type == "SHADER":
            tree.links.new(socket, image.outputs["Color"])
        elif target.bl_idname == "ShaderNodeEmission" and not strength.is_linked:
            # Exporters read the strength of an Emission node, and no arithmetic before its color.
            target[_STRENGTH] = strength.default_value
            strength.default_value /= exposure
            tree.links.new(socket, image.outputs["Color"])
        else:
            tree.links.new(socket, _scaled(node, image, exposure).outputs[0])


def _scaled(node, image, exposure: float):
    """Node that divides the image by its exposure."""
    scaled = _part(image, _SCALED)
    if scaled is None:
        scaled = _add(node.id_data, "ShaderNodeVectorMath", "Baked Radiance", node, -1, ABOVE_IMAGE)
        scaled.operation = "SCALE"
        image[_SCALED] = scaled.name
        node.id_data.links.new(scaled.inputs[0], image.outputs["Color"])
    scaled.inputs["Scale"].default_value = 1.0 / exposure
    return scaled


def _restore_strength(target) -> None:
    if _STRENGTH in target:
        target.inputs["Strength"].default_value = target[_STRENGTH]
        del target[_STRENGTH]
