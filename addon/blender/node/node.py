"""The shader node that makes a material translucent and shows its baked image."""

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, PointerProperty, StringProperty

from ...core.bake.surface import MIRROR, OPEN, Surface
from ...core.errors import MaterialError
from ...core.material import Material
from ...core.messages import Message
from ...core.scene.texture import MULTIPLIED, SCATTERED, TextureUse
from ...core.target import BACK, FRONT
from .. import compat, preferences
from ..read.nodes import InputSocket
from ..registration import all_or_nothing, handlers
from . import plain
from .color import (
    ALBEDO_MODE,
    BASE_COLOR_MODE,
    CUSTOM_PRESET,
    ColorProperties,
    fill_preset,
    filling,
    is_filled,
    is_older,
    keep_name_of_preset,
    note_medium,
    note_own,
    start,
    switch_mode,
    upgrade_color,
)
from .draw import draw_node
from .output import link_output, place
from .path import PathProperties, meters_per_unit
from .tree import (
    BASE_COLOR,
    ROUGHNESS,
    all_nodes,
    is_shared,
    keep_map,
    make_inner_tree,
    own_tree,
    release_unused_trees,
    show_ior,
    show_own_images,
    show_values,
    upgrade,
)

BOTH = "BOTH"
SIDES = {FRONT: (FRONT,), BACK: (BACK,), BOTH: (FRONT, BACK)}
"""Faces that get an image, by the property `side`."""

NEW_ROUGHNESS = 0.4
"""Roughness of the coat of new nodes. Smaller: sharper reflections, as of wet surfaces."""


def _apply_preset(node, context) -> None:
    if node.preset != CUSTOM_PRESET:
        fill_preset(node, meters_per_unit(context))


def _edited(node, _context) -> None:
    """Take the preset's name away, since a value differs from it."""
    if not is_filled(node):
        note_medium(node)
        _part_from_preset(node)
    _show_color(node)


def _part_from_preset(node) -> None:
    if node.preset != CUSTOM_PRESET:
        node.preset = CUSTOM_PRESET


def _color_edited(mode: str):
    """A function for edits of the color of a mode."""

    def edited(node, _context) -> None:
        if not is_filled(node):
            note_own(node, mode)
            _part_from_preset(node)
        _show_color(node)

    return edited


def _thickness_edited(node, context) -> None:
    note_medium(node)
    _show(node, context)


def _mode_edited(node, _context) -> None:
    """Convert the color: the material, and so the name of its preset, stays."""
    if not is_filled(node):
        switch_mode(node)
    _show_color(node)


def _ior_edited(node, context) -> None:
    _edited(node, context)
    tree = own_tree(node)
    if tree is not None:
        show_ior(tree, node.ior)


def _blur_edited(node, _context) -> None:
    """Have the texture multiply light, which is what scripts want that set this value."""
    node.texture_method = MULTIPLIED


def _show_color(node) -> None:
    """Show the color of the node if it has no image yet."""
    if any(node.shown_images()) or BASE_COLOR not in node.inputs:
        return
    color = np.array((*node.visible_color(), 1.0), np.float32)
    if not np.array_equal(node.inputs[BASE_COLOR].default_value, color):
        node.inputs[BASE_COLOR].default_value = color


def _map_edited(node, _context) -> None:
    """Have Live read the mesh again: no update comes from values that scripts set."""
    node.id_data.update_tag()


def _show(node, _context) -> None:
    """Bring images and IOR into the node's inner tree."""
    tree = own_tree(node)
    if tree is not None:
        show_values(tree, *node.shown_images(), node.ior)
        _show_color(node)
    plain.refresh(node.shown_images()[0], node)


def image_of_side(node, side: str):
    """The node's image of a side, or None."""
    return node.image_back if side == BACK else node.image


def set_image(node, image, side: str) -> None:
    """Give the node an image of a side."""
    setattr(node, "image_back" if side == BACK else "image", image)


def link_result(node, image, uv_map: str | None = None, side: str = FRONT) -> list[Message]:
    """Show `image` in the node, and the node at its material's output; messages as of `link_output`.

    `uv_map` is the name of the map that shows it, "" for the one that renders; None: as before.
    """
    if node.node_tree is None:
        node.node_tree = make_inner_tree()
    set_image(node, image, side)
    _show(node, None)
    if uv_map is not None:
        keep_map(node.node_tree, uv_map)
        plain.refresh(image, node)
    return link_output(node)


class BeamspreadNode(ColorProperties, PathProperties, bpy.types.ShaderNodeCustomGroup):
    """Translucent surface whose light is baked into an image, beam by beam."""

    bl_idname = "BeamspreadNode"
    bl_label = "Beamspread"
    bl_description = "Bake the light inside a translucent surface into an image, and show it"
    bl_icon = "LIGHT_SUN"
    bl_width_default = 240

    preset: EnumProperty(
        name="Preset", description="Fill in a measured material", items=preferences.preset_items(), update=_apply_preset
    )
    color_mode: EnumProperty(
        name="Color",
        description="Choose how to set the color of the material. A switch converts the value",
        items=[
            ("BASE_COLOR", "Base Color", "Set the visible color; the albedo is computed", 0),
            (
                "ALBEDO",
                "Albedo",
                "Set the share of light that survives each scattering event. For a bright material it is above 0.99",
                1,
            ),
        ],
        default="ALBEDO",
        update=_mode_edited,
    )
    base_color: FloatVectorProperty(
        name="Base Color",
        description="Set the color of the surface in white, uniform light. A color that is too bright for this "
        "material is limited to the brightest possible",
        subtype="COLOR",
        size=3,
        default=(0.6, 0.6, 0.6),
        soft_min=0.0,
        soft_max=1.0,
        update=_color_edited(BASE_COLOR_MODE),
    )
    albedo: FloatVectorProperty(
        name="Scattering Albedo",
        description="Set the share of light that survives each scattering event, below 1. Bright materials have above "
        "0.99",
        size=3,
        default=(0.9, 0.9, 0.9),
        soft_min=0.0,
        soft_max=0.9999,
        precision=4,
        step=1,
        update=_color_edited(ALBEDO_MODE),
    )
    mean_free_path: FloatVectorProperty(
        name="Mean Free Path",
        description="Set the mean distance that light travels between two scattering events, for red, green and blue",
        subtype="XYZ_LENGTH",
        unit="LENGTH",
        size=3,
        default=(0.01, 0.01, 0.01),
        soft_min=1e-6,
        soft_max=10.0,
        precision=5,
        step=1,
        update=_edited,
    )
    anisotropy: FloatProperty(
        name="Anisotropy",
        description="Set the direction of scattered light. 0: all directions; near 1: forward (Henyey-Greenstein). A "
        "new value is simulated once, in a minute or two",
        default=0.8,
        soft_min=-0.95,
        soft_max=0.95,
        update=_edited,
    )
    ior: FloatProperty(
        name="IOR",
        description="Set the index of refraction. 1 = no glossy coat. A new value is simulated once, in a minute or "
        "two",
        default=1.0,
        soft_min=1.0,
        soft_max=2.0,
        update=_ior_edited,
    )
    thickness: FloatProperty(
        name="Thickness",
        description="Set the thickness of the material. 0 = infinitely thick. A new value is simulated once, in a "
        "minute or two",
        subtype="DISTANCE",
        default=0.0,
        soft_min=0.0,
        soft_max=10.0,
        precision=5,
        step=0.001,
        update=_thickness_edited,
    )
    side: EnumProperty(
        name="Side",
        description="Choose which faces of a thin material get an image. Light on both faces counts in each",
        items=(
            (FRONT, "Front", "The face that normals point out of", 0),
            (BACK, "Back", "The other face", 1),
            (BOTH, "Both", "Each face has its own image", 2),
        ),
        default=FRONT,
        update=_show,
    )
    edges: EnumProperty(
        name="Edges",
        description="Choose what the edges of a plane do with light inside the material",
        items=(
            (OPEN, "Open", "Light leaves through the edges"),
            (MIRROR, "Mirror", "Light returns as from a mirror: tiles, trim sheets, floors that end at walls"),
        ),
        default=OPEN,
    )
    image: PointerProperty(
        name="Image",
        description="Choose the image that the bake fills. Empty: a new image is created",
        type=bpy.types.Image,
        update=_show,
    )
    image_back: PointerProperty(
        name="Back Image",
        description="Choose the image of the back that the bake fills. Empty: a new image is created",
        type=bpy.types.Image,
        update=_show,
    )
    uv_map: StringProperty(
        name="UV Map",
        description="Choose the UV map of the image. Empty: the map that renders or, if it does not fit, one that the "
        "bake makes",
        update=_map_edited,
    )
    texture_method: EnumProperty(
        name="Texture",
        description="Choose how the texture at Base Color colors the light",
        items=(
            (
                MULTIPLIED,
                "Multiplied",
                "As in other renderers: light spreads in the mean color, times the texture on its way in and out",
                0,
            ),
            (
                SCATTERED,
                "Scattered",
                "As in nature: each texel has a medium of its own, and light takes on the colors of all that it passes",
                1,
            ),
        ),
        default=MULTIPLIED,  # that of older files
    )
    texture_blur: FloatProperty(
        name="Texture Blur",
        description="Set how much scattering blurs the texture at Base Color. 0 = sharp, 1 = fully blurred",
        subtype="FACTOR",
        default=0.5,
        min=0.0,
        max=1.0,
        update=_blur_edited,
    )
    former_node: StringProperty(options={"HIDDEN"}, description="Node that the material showed before the bake")
    former_socket: StringProperty(options={"HIDDEN"}, description="Output of that node")
    plain_node: StringProperty(options={"HIDDEN"}, description="Group that shows the bake without this add-on")

    def init(self, _context) -> None:
        self.width = self.bl_width_default
        place(self)  # the Add menu moves the node to the mouse afterwards
        compat.give_new_node_its_tree(self, make_inner_tree())
        chosen = preferences.preferences()
        start(self, chosen.new_base_color if chosen else preferences.NEW_BASE_COLOR)
        self.texture_method = SCATTERED
        self.ior = chosen.new_ior if chosen else preferences.NEW_IOR
        self.inputs[ROUGHNESS].default_value = NEW_ROUGHNESS
        if chosen:
            self._fill_as_preferred(chosen)

    def _fill_as_preferred(self, chosen) -> None:
        """Take the path or the preset that the user's preferences have for new nodes."""
        if chosen.is_property_set("new_path"):
            with filling(self):
                self.mean_free_path = (chosen.new_path / 1000 / meters_per_unit(),) * 3
        if chosen.new_preset != CUSTOM_PRESET:
            self.preset = chosen.new_preset

    def free(self) -> None:
        # Removing the tree here crashes on undo; without its fake user it goes when the file is saved.
        if self.node_tree is not None and not is_shared(self.node_tree):
            self.node_tree.use_fake_user = False

    def surface(self) -> Surface:
        """Values of the node; lengths are in scene units, as those of the geometry."""
        return self.surface_in(self.color_mode)

    def surface_in(self, color_mode: str) -> Surface:
        """Values of the node with the color of a mode."""
        material = Material(
            albedo=tuple(map(_decimal, self.albedo)),
            mean_free_path=tuple(map(_decimal, self.mean_free_path)),
            anisotropy=_decimal(self.anisotropy),
            ior=_decimal(self.ior),
        )
        base_color = tuple(map(_decimal, self.base_color)) if color_mode == BASE_COLOR_MODE else None
        return Surface(material, _decimal(self.thickness), base_color, self.edges)

    def sides(self) -> tuple[str, ...]:
        """Faces that get an image; a material that is infinitely thick has one."""
        return SIDES[self.side] if self.thickness > 0 else (FRONT,)

    def shown_images(self) -> tuple:
        """Images that the material shows on its front and on its back; equal where there is one, or None."""
        images = [image_of_side(self, side) for side in self.sides()]
        images = [image for image in images if image is not None] or [None]
        return images[0], images[-1]

    def visible_color(self) -> list[float]:
        """Color in white, uniform light, 0 to 1; the base color if the values are out of range."""
        try:
            color = self.surface().reflectance()
        except (MaterialError, ImportError):  # the module may be missing
            color = self.base_color
        return [min(max(channel, 0.0), 1.0) for channel in color]

    def has_texture(self) -> bool:
        """True if the base color comes from a link, and not from the node's own base color or albedo."""
        return BASE_COLOR in self.inputs and self.inputs[BASE_COLOR].is_linked

    def texture_use(self) -> TextureUse:
        """How a texture at the base color counts."""
        is_albedo = self.texture_method == SCATTERED and self.color_mode == ALBEDO_MODE
        return TextureUse(self.texture_method, self.texture_blur, is_albedo)

    def color_input(self, groups: tuple = ()) -> InputSocket:
        """The input for a texture, inside the group nodes around the node, outermost first."""
        return InputSocket(self.inputs[BASE_COLOR], groups)

    def draw_buttons(self, _context, layout) -> None:
        draw_node(self, layout)

    def draw_label(self) -> str:
        return "Beamspread"


def _decimal(value: float) -> float:
    """Number as typed, from Blender's 32-bit float: 0.8 and not 0.800000012, which would be another medium."""
    return float(f"{value:.7g}")


@persistent
def upgrade_nodes(*_arguments) -> None:
    """Give nodes of older files the inputs that they have today; links and values stay."""
    for tree in {node.node_tree for node in all_nodes()} - {None}:
        upgrade(tree)
    for node in all_nodes():
        if node.id_data.library is None:
            upgrade_color(node)
            _show_color(node)


def upgrade_appended_nodes() -> None:
    """The same for nodes that were appended to this file since: Blender 3.4 tells nobody of that."""
    if any(node.id_data.library is None and is_older(node) for node in all_nodes()):
        upgrade_nodes()


_subscriber = object()


@persistent
def _watch_unit_scale(*_arguments) -> None:
    """Have a new Unit Scale check the presets; files that are opened end the watch."""
    _end_watch()
    key = (bpy.types.UnitSettings, "scale_length")
    bpy.msgbus.subscribe_rna(key=key, owner=_subscriber, args=(), notify=keep_names_of_presets)


def _end_watch() -> None:
    bpy.msgbus.clear_by_owner(_subscriber)


@persistent
def keep_names_of_presets(*_arguments) -> None:
    """Call presets Custom whose lengths are no longer those of their materials."""
    for node in all_nodes():
        if node.id_data.library is None:
            keep_name_of_preset(node, meters_per_unit())


def _add_class() -> None:
    # Registering would replace a class that another version of the add-on left in use.
    in_use = bpy.types.Node.bl_rna_get_subclass_py(BeamspreadNode.bl_idname) is not None
    stays = in_use and not compat.unregisters_node_classes_in_use()
    if not (BeamspreadNode.is_registered or stays):
        compat.register_node_class(BeamspreadNode, "ShaderNodeCustomGroup")
    # While Blender starts, add-ons see no file; load_post comes later.
    if isinstance(bpy.data, bpy.types.BlendData):
        upgrade_nodes()


def _remove_class() -> None:
    may_go = compat.unregisters_node_classes_in_use() or not any(all_nodes())
    if BeamspreadNode.is_registered and may_go:
        bpy.utils.unregister_class(BeamspreadNode)


def _name_class() -> None:
    """Have F1 find the node's properties: Blender looks for their class here, where it puts no node classes."""
    setattr(bpy.types, BeamspreadNode.bl_idname, BeamspreadNode)


def _forget_name() -> None:
    delattr(bpy.types, BeamspreadNode.bl_idname)


register, unregister = all_or_nothing(
    (_add_class, _remove_class),
    (_name_class, _forget_name),
    *handlers(load_post=upgrade_nodes, save_pre=release_unused_trees),
    (_watch_unit_scale, _end_watch),
    *handlers(load_post=_watch_unit_scale, undo_post=keep_names_of_presets, redo_post=keep_names_of_presets),
    *handlers(load_post=show_own_images, undo_post=show_own_images, redo_post=show_own_images),
)
