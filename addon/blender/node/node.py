"""The shader node that makes a material translucent and shows its baked image."""

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, PointerProperty

from ...core.bake.surface import Surface
from ...core.material.material import Material
from ...core.material.presets import presets
from .. import compat

CUSTOM_PRESET = "CUSTOM"
IMAGE, FRESNEL, COAT = "Image", "Fresnel", "Coat"


def _preset_items() -> list[tuple]:
    # A saved file keeps the number: it counts the rows of the table, to whose end new materials go.
    items = [
        (name, name.replace("_", " ").title(), material.source, number)
        for number, (name, material) in enumerate(presets().items(), start=1)
    ]
    return [(CUSTOM_PRESET, "Custom", "Values set by hand", 0), *sorted(items)]


def _apply_preset(node, context) -> None:
    if node.preset == CUSTOM_PRESET:
        return
    # The node has one anisotropy for all channels.
    material = presets()[node.preset].with_one_anisotropy()
    # Lengths are stored in scene units, which `scale_length` metres make one of.
    metres_per_unit = context.scene.unit_settings.scale_length if context and context.scene else 1.0
    node.color_mode = "ALBEDO"
    node.albedo = material.albedo
    node.mean_free_path = [length / metres_per_unit for length in material.mean_free_path]
    node.anisotropy = material.anisotropy
    node.ior = material.ior


def _show(node, _context) -> None:
    """Bring image and IOR into the inner tree, the node's own from here on.

    A copied node shares the original's tree until then: assigning another in `copy()`, while Blender has not counted
    the users of the new node yet, leaves the original's with too few, and Blender drops it when it saves.
    """
    if node.node_tree is None:
        return
    if _is_shared(node.node_tree):
        node.node_tree = node.node_tree.copy()
        node.node_tree.use_fake_user = True
    tree = node.node_tree
    tree.nodes[IMAGE].image = node.image
    tree.nodes[FRESNEL].inputs["IOR"].default_value = max(node.ior, 1.0)
    # Without a step in refraction there is no coat, whatever the renderer's Fresnel node says at grazing angles.
    tree.nodes[COAT].inputs[1].default_value = 1.0 if node.ior > 1 else 0.0


def _is_shared(tree) -> bool:
    """Whether more than one node shows the tree; its fake user counts as a user."""
    return tree.users - tree.use_fake_user > 1


def make_inner_tree() -> bpy.types.ShaderNodeTree:
    """Image -> Color; image as emission, with a Fresnel-weighted glossy coat added -> BSDF.

    The image already is what leaves the surface, so the coat adds to it and takes nothing away.
    """
    # The dot hides it in menus. A Blender without this add-on drops a tree that has no fake user when it saves.
    tree = bpy.data.node_groups.new(".Beamspread", "ShaderNodeTree")
    tree.use_fake_user = True
    compat.add_output_socket(tree, "NodeSocketColor", "Color")
    compat.add_output_socket(tree, "NodeSocketShader", "BSDF")
    image = _add(tree, "ShaderNodeTexImage", IMAGE, (-600, 0))
    image.extension = "EXTEND"
    fresnel = _add(tree, "ShaderNodeFresnel", FRESNEL, (-600, -300))
    coat = _add(tree, "ShaderNodeMath", COAT, (-400, -300))
    coat.operation = "MULTIPLY"
    glossy = _add(tree, "ShaderNodeBsdfGlossy", "Glossy", (-200, -300))
    glossy.inputs["Roughness"].default_value = 0.1
    emission = _add(tree, "ShaderNodeEmission", "Emission", (-200, 0))
    total = _add(tree, "ShaderNodeAddShader", "Total", (0, -100))
    output = _add(tree, "NodeGroupOutput", "Output", (200, 0))
    link = tree.links.new
    link(output.inputs["Color"], image.outputs["Color"])
    link(emission.inputs["Color"], image.outputs["Color"])
    link(coat.inputs[0], fresnel.outputs[0])
    link(glossy.inputs["Color"], coat.outputs[0])
    link(total.inputs[0], emission.outputs[0])
    link(total.inputs[1], glossy.outputs[0])
    link(output.inputs["BSDF"], total.outputs[0])
    return tree


def _add(tree, kind: str, name: str, location: tuple[int, int]):
    node = tree.nodes.new(kind)
    node.name, node.location = name, location
    return node


class BeamspreadNode(bpy.types.ShaderNodeCustomGroup):
    """Translucent surface whose light is baked into an image, beam by beam."""

    bl_idname = "BeamspreadNode"
    bl_label = "Beamspread"
    bl_icon = "LIGHT_SUN"

    preset: EnumProperty(
        name="Preset", description="Fill in a measured material", items=_preset_items(), update=_apply_preset
    )
    color_mode: EnumProperty(
        name="Color",
        items=[
            ("BASE_COLOR", "Base Color", "The colour under even light; the albedo follows from it", 0),
            ("ALBEDO", "Albedo", "Single-scattering albedo: what one scattering leaves of the light", 1),
        ],
        default="ALBEDO",
    )
    base_color: FloatVectorProperty(
        name="Base Color",
        description="Seen under even light; where the medium can't be as bright, it becomes as bright as it can be",
        subtype="COLOR",
        size=3,
        default=(0.6, 0.6, 0.6),
        soft_min=0.0,
        soft_max=1.0,
    )
    albedo: FloatVectorProperty(
        name="Albedo",
        description="Part of the light that one scattering leaves, below 1",
        size=3,
        default=(0.9, 0.9, 0.9),
        soft_min=0.0,
        soft_max=0.9999,
        precision=4,
        step=1,
    )
    mean_free_path: FloatVectorProperty(
        name="Mean Free Path",
        description="How far light goes between two scatterings, for red, green and blue",
        subtype="XYZ_LENGTH",
        unit="LENGTH",
        size=3,
        default=(0.01, 0.01, 0.01),
        soft_min=1e-6,
        soft_max=10.0,
        precision=5,
        step=1,
    )
    anisotropy: FloatProperty(
        name="Anisotropy",
        description="Henyey-Greenstein: 0 scatters evenly, towards 1 forward",
        default=0.8,
        soft_min=-0.95,
        soft_max=0.95,
    )
    ior: FloatProperty(
        name="IOR",
        description="Index of refraction, inside over outside; 1 has no coat",
        default=1.0,
        soft_min=1.0,
        soft_max=2.0,
        update=_show,
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Of the slab under the surface; 0 is endlessly thick",
        subtype="DISTANCE",
        default=0.0,
        soft_min=0.0,
        soft_max=10.0,
        precision=5,
    )
    image: PointerProperty(
        name="Image", description="Target of the bake; none: one is made", type=bpy.types.Image, update=_show
    )

    def init(self, context) -> None:
        self.width = 220
        self.node_tree = make_inner_tree()
        _show(self, context)

    def free(self) -> None:
        # Removing the tree here crashes on undo; without its fake user it goes when the file is saved.
        if self.node_tree is not None and not _is_shared(self.node_tree):
            self.node_tree.use_fake_user = False

    def surface(self) -> Surface:
        """The values; lengths stay in scene units, as the geometry's."""
        material = Material(
            albedo=tuple(map(_decimal, self.albedo)),
            mean_free_path=tuple(map(_decimal, self.mean_free_path)),
            anisotropy=_decimal(self.anisotropy),
            ior=_decimal(self.ior),
        )
        base_color = tuple(map(_decimal, self.base_color)) if self.color_mode == "BASE_COLOR" else None
        return Surface(material, _decimal(self.thickness), base_color)

    def draw_buttons(self, _context, layout) -> None:
        draw_properties(self, layout)

    def draw_label(self) -> str:
        return "Beamspread"


def draw_properties(node, layout) -> None:
    """The node's properties, in the node editor and in panels."""
    layout.prop(node, "preset")
    layout.row().prop(node, "color_mode", expand=True)
    if node.color_mode == "BASE_COLOR":
        layout.prop(node, "base_color")
    else:
        _draw_channels(layout, node, "albedo", "Albedo")
    _draw_channels(layout, node, "mean_free_path", "Free Path")
    layout.prop(node, "anisotropy")
    layout.prop(node, "ior")
    layout.prop(node, "thickness")
    layout.template_ID(node, "image", new="image.new", open="image.open")


def _draw_channels(layout, node, name: str, label: str) -> None:
    column = layout.column(align=True)
    for index, channel in enumerate(("Red", "Green", "Blue")):
        column.prop(node, name, index=index, text=channel if index else f"{label} {channel}")


def is_linked(node) -> bool:
    """Whether anything uses the node's outputs."""
    return any(socket.is_linked for socket in node.outputs)


def link_result(node, image) -> None:
    """Show `image` in the node, and the node at its material's output if nothing uses it yet."""
    tree = node.id_data
    if node.node_tree is None:
        node.node_tree = make_inner_tree()
    node.image = image
    _show(node, None)
    output = tree.get_output_node("ALL") or tree.nodes.new("ShaderNodeOutputMaterial")
    surface = output.inputs["Surface"]
    if not surface.is_linked or not is_linked(node):
        tree.links.new(surface, node.outputs["BSDF"])


def _decimal(value: float) -> float:
    """The number typed, from Blender's 32-bit float: 0.8, not 0.800000012, which would be another medium."""
    return float(f"{value:.7g}")


def _is_used() -> bool:
    """Whether any material or group of the file has the node."""
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree] + list(bpy.data.node_groups)
    return any(node.bl_idname == BeamspreadNode.bl_idname for tree in trees for node in tree.nodes)


def register() -> None:
    if not BeamspreadNode.is_registered:
        bpy.utils.register_class(BeamspreadNode)


def unregister() -> None:
    # Blender 3.4 frees the type but not the evaluated copies of nodes that point to it, and crashes when those go, at
    # the latest on exit: there a class in use stays. In 4.5 a class that stays keeps the process from exiting.
    if bpy.app.version >= (4, 0, 0) or not _is_used():
        bpy.utils.unregister_class(BeamspreadNode)
