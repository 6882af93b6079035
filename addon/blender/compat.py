"""Differences between Blender versions. All checks of a version or of a name that not every version has are here.

The child processes of `cycles` import this module by itself, so it uses nothing else of the package.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

PATH_OPTIONS = {"ANIMATABLE", "PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else {"ANIMATABLE"}
"""Options of a path property that understands "//". Blender before 4.5 does not know the second one."""

SHADER_MENUS = ("NODE_MT_category_shader_shader", "NODE_MT_category_SH_NEW_SHADER")
"""Names of the menu Add > Shader: of the Shader Editor in newer versions, and in Blender 3.4."""


BAR_LETTERS = 18
"""Letters of a progress bar, which fit the side bar of a new window."""


def session_id(block) -> int:
    """A number that no other data-block of the session has (Blender 4.1 on); before, its address."""
    return getattr(block, "session_uid", 0) or block.as_pointer()


def engine_id(name: str) -> str:
    """Identifier of the engine CYCLES or EEVEE."""
    if name == "EEVEE":
        return "BLENDER_EEVEE_NEXT" if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    return name


def register_node_class(node_class, base: str) -> None:
    """Register a class of nodes derived from the type `base`, for the first time or again.

    Blender (4.2 to 5.0, measured) replaces the Python class of `base` in between and accepts only subclasses of the new
    one.
    """
    mixins = (kind for kind in node_class.__bases__ if not issubclass(kind, bpy.types.bpy_struct))
    node_class.__bases__ = (*mixins, getattr(bpy.types, base))
    bpy.utils.register_class(node_class)


def unregisters_node_classes_in_use() -> bool:
    """True if a node class can be unregistered while nodes use it.

    Blender up to 4.3 (3.4.1 and 4.3.2 measured) frees the type but not the evaluated copies of nodes that point to it,
    and crashes when these are freed, at the latest on exit. In 4.5 a class that stays keeps the process from exiting.
    """
    return bpy.app.version >= (4, 5, 0)


def shader_menu():
    """The menu Add > Shader, or all of Add if a version has another name for it."""
    return next((getattr(bpy.types, name) for name in SHADER_MENUS if hasattr(bpy.types, name)), bpy.types.NODE_MT_add)


def draw_progress_bar(layout, fraction: float, text: str) -> None:
    """Draw a bar with a text (a widget since Blender 4.0, letters before)."""
    if hasattr(layout, "progress"):
        layout.progress(factor=fraction, text=text)
    else:
        full = round(BAR_LETTERS * fraction)
        column = layout.column(align=True)  # the bar and the text in one line do not fit the width of a new window
        column.label(text=f"{chr(0x2588) * full}{chr(0x2591) * (BAR_LETTERS - full)}", icon="BLANK1")
        column.label(text=text, icon="BLANK1")


def give_new_node_its_tree(node, tree) -> None:
    """Set the tree of a node in `init`. Blender 5.0 counts the node as a user of the tree once more afterwards."""
    node.node_tree = tree
    if bpy.app.version >= (5, 0, 0):
        has_fake_user = tree.use_fake_user
        tree.user_clear()
        tree.use_fake_user = has_fake_user


def add_output_socket(tree, socket_type: str, name: str) -> None:
    """Give a node group an output (its interface moved in Blender 4.0)."""
    if hasattr(tree, "interface"):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=socket_type)
    else:
        tree.outputs.new(socket_type, name)


def add_input_socket(tree, socket_type: str, name: str, default=None, hide_value: bool = False) -> None:
    """Give a node group an input. A "NodeSocketFloat" is a factor from 0 to 1; `hide_value` leaves only the link."""
    if hasattr(tree, "interface"):
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type=socket_type)
        if socket_type == "NodeSocketFloat":
            socket.subtype = "FACTOR"
    else:
        socket = tree.inputs.new("NodeSocketFloatFactor" if socket_type == "NodeSocketFloat" else socket_type, name)
    if socket_type == "NodeSocketFloat":
        socket.min_value, socket.max_value = 0.0, 1.0
    if default is not None:
        socket.default_value = default
    socket.hide_value = hide_value


def uv_attribute_type() -> str:
    """Type of an attribute that is a UV map; Blender 3.4 has none that geometry nodes can store."""
    return "FLOAT_VECTOR" if bpy.app.version < (3, 5, 0) else "FLOAT2"


def corner_normals(mesh) -> np.ndarray | None:
    """Shading normals of the corners of a mesh that `to_mesh` made, float32 (N, 3); None if its faces look flat.

    Blender 3.4 and 4.0 compute them on request; it keeps them with this copy of the artist's mesh.
    """
    if not (mesh.has_custom_normals or smooth_faces(mesh).any()):
        return None
    normals = np.empty(len(mesh.loops) * 3, np.float32)
    if bpy.app.version >= (4, 1, 0):
        mesh.corner_normals.foreach_get("vector", normals)
    else:
        mesh.calc_normals_split()
        mesh.loops.foreach_get("normal", normals)
    return normals.reshape(-1, 3)


def smooth_faces(mesh) -> np.ndarray:
    """True for each face of a mesh that is shaded smoothly, bool (N,)."""
    is_smooth = np.empty(len(mesh.polygons), bool)
    mesh.polygons.foreach_get("use_smooth", is_smooth)
    return is_smooth


def smooth_angle(mesh) -> float | None:
    """Angle of edges up to which a mesh is shaded smoothly; None if it has no such setting (Auto Smooth until 4.0)."""
    return mesh.auto_smooth_angle if getattr(mesh, "use_auto_smooth", False) else None


def input_identifier(tree, name: str) -> str | None:
    """Name of a modifier's property for an input of its node group; None if the group has no such input."""
    sockets = tree.interface.items_tree if hasattr(tree, "interface") else tree.inputs
    inputs = (item for item in sockets if getattr(item, "in_out", "INPUT") == "INPUT" and item.name == name)
    return next((item.identifier for item in inputs), None)


def group_input(modifier, name: str):
    """Value of an input of a modifier's node group; None if there is none."""
    identifier = input_identifier(modifier.node_group, name)
    if hasattr(modifier, "properties"):  # from Blender 5.2 on
        return getattr(getattr(modifier.properties.inputs, identifier, None), "value", None)
    return modifier.get(identifier)


def move_modifier(obj, modifier, index: int) -> None:
    """Give a modifier of an object a place among its modifiers."""
    if hasattr(obj.modifiers, "move"):  # from Blender 3.5 on
        obj.modifiers.move(list(obj.modifiers).index(modifier), index)
        return
    with bpy.context.temp_override(object=obj, active_object=obj):
        bpy.ops.object.modifier_move_to_index(modifier=modifier.name, index=index)


def set_group_input(modifier, name: str, value) -> None:
    """Set an input of a modifier's node group."""
    identifier = input_identifier(modifier.node_group, name)
    if hasattr(modifier, "properties"):
        getattr(modifier.properties.inputs, identifier).value = value
    else:
        modifier[identifier] = value


def has_input_socket(tree, name: str) -> bool:
    """True if a node group has an input of that name."""
    if hasattr(tree, "interface"):
        return any(
            item.item_type == "SOCKET" and item.in_out == "INPUT" and item.name == name
            for item in tree.interface.items_tree
        )
    return name in tree.inputs


def use_nodes(material) -> None:
    """Give a material a node tree (since Blender 5.0 every material has one)."""
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True


def uses_nodes(material) -> bool:
    """True if a material uses its node tree (since Blender 5.0 every material does)."""
    if material.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or material.use_nodes


def lamp_uses_nodes(lamp) -> bool:
    """True if a lamp uses its node tree (in Blender 5.2 every lamp does, and asking is deprecated)."""
    if lamp.node_tree is None:
        return False
    return bpy.app.version >= (5, 2, 0) or lamp.use_nodes


def has_transparent_shadow(material) -> bool:
    """True if shadows of the material are transparent in Cycles (Blender 4.2 moved the switch to the material)."""
    owner = material if hasattr(material, "use_transparent_shadow") else getattr(material, "cycles", None)
    return bool(getattr(owner, "use_transparent_shadow", True))


def principled_has_layers() -> bool:
    """True if the lobe of a Principled BSDF takes its light from the diffuse part below it (Blender 4.0 on)."""
    return bpy.app.version >= (4, 0, 0)


def filtered_roughness(scene) -> float:
    """Least roughness of glossy lobes for light that bounced diffusely before, by Cycles' Filter Glossy.

    The alpha there is .5 sqrt(1 - p / filter), with the density p of the bounce; its mean is 2 / (3 pi).
    """
    blur = getattr(getattr(scene, "cycles", None), "blur_glossy", 0.0)
    return math.sqrt(0.5 * math.sqrt(1 - 2 / (3 * math.pi) / blur)) if blur > 2 / (3 * math.pi) else 0.0


def max_bounces(scene) -> tuple[int, int, int]:
    """Cycles' numbers of bounces, total, diffuse and glossy; its defaults if Blender has no Cycles."""
    cycles = getattr(scene, "cycles", None)
    names = {"max_bounces": 12, "diffuse_bounces": 4, "glossy_bounces": 4}
    return tuple(getattr(cycles, name, value) for name, value in names.items())


def transparent_bounces(scene) -> int | None:
    """Number of transparent surfaces that a shadow ray of Cycles crosses; None if Blender has no Cycles."""
    return getattr(getattr(scene, "cycles", None), "transparent_max_bounces", None)


@contextmanager
def saving_png(scene, bits: int = 8) -> Iterator[None]:
    """Save renders of the scene as PNG within the block (since Blender 5.0 a media type limits the formats)."""
    settings = scene.render.image_settings
    names = [name for name in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, name)]
    before = {name: getattr(settings, name) for name in names}
    try:
        for name, value in {
            "media_type": "IMAGE",
            "file_format": "PNG",
            "color_mode": "RGB",
            "color_depth": str(bits),
        }.items():
            if name in before:
                setattr(settings, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(settings, name, value)


def has_denoiser() -> bool:
    """True if Cycles of this Blender can denoise; builds of some distributions can't."""
    try:
        import _cycles
    except ImportError:
        return False
    return bool(getattr(_cycles, "with_openimagedenoise", True))


def save_as_multilayer_exr(scene) -> None:
    """Save renders of the scene as multi-layer EXR of 32 bits (since Blender 5.0 a media type limits the formats)."""
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR_MULTILAYER", "32"


def set_panorama(camera) -> None:
    """Make a camera show an equirectangular panorama in Cycles (newer versions have the setting on the camera)."""
    camera.type = "PANO"
    owner = camera if hasattr(camera, "panorama_type") else camera.cycles
    owner.panorama_type = "EQUIRECTANGULAR"


def light_linking(obj):
    """Light linking of an object; None before Blender 4.0."""
    return getattr(obj, "light_linking", None)


def indirect_bakes_lack_lamps() -> bool:
    """True if a bake of indirect light lacks light that lamps send to other objects (3.4 measured, 4.5 does not)."""
    return bpy.app.version < (4, 5, 0)


def light_casts_shadow(light) -> bool:
    """True if Cycles' own shadow switch is on, or the light's if Cycles has none."""
    cycles = getattr(light, "cycles", None)
    if hasattr(cycles, "cast_shadow"):
        return bool(cycles.cast_shadow)
    return bool(getattr(light, "use_shadow", True))


def spot_falloff() -> str:
    """Shape of a spot's cone in Cycles."""
    return "scaled" if bpy.app.version >= (3, 5, 0) else "legacy"


def world_of(depsgraph):
    """Evaluated world that a render of the depsgraph uses, or None."""
    world = original_world(depsgraph.view_layer, depsgraph.scene)
    return world and world.evaluated_get(depsgraph)


def original_world(view_layer, scene):
    """World that a render of the view layer uses, or None (view layers may have their own since Blender 4.4)."""
    return getattr(view_layer, "world_override", None) or scene.world


def sun_disk() -> str:
    """Shape of a sun with an angle in Cycles (measured in 3.4 and 4.5, not in between)."""
    return "flat" if bpy.app.version < (4, 0, 0) else "even"


def area_lamp_factor() -> float:
    """Radiance of an area lamp relative to P / (4 A): P / (pi A) in Cycles from 4.2 on (4.0 is not measured)."""
    return 1.0 if bpy.app.version < (4, 0, 0) else 4 / math.pi


def flat_area_lamps_shine() -> bool:
    """True if area lamps of scale 0 along their axis shine in Cycles (3.4 measured, 4.5 does not)."""
    return bpy.app.version < (4, 0, 0)


def instancer_hides_lamps() -> bool:
    """True if the instancer's visibility counts for lamps (4.5 measured; in 3.4 it counts for meshes only)."""
    return bpy.app.version >= (4, 4, 0)


def round_lamp_shape(light) -> str:
    """Shape of a lamp with a radius in Cycles."""
    soft = getattr(light, "use_soft_falloff", bpy.app.version < (4, 0, 0))
    return "disk" if soft else "sphere"


def light_strength(light) -> float:
    """Energy of a light times its exposure (Blender 4.5 on)."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def light_color(light) -> tuple[float, float, float]:
    """Color of a light times that of its temperature (Blender 4.5 on)."""
    color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = tuple(a * b for a, b in zip(color, light.temperature_color))
    return color


def alpha_is_straight(image) -> bool:
    """True if Cycles takes the colors of an image's pixels as not multiplied by alpha.

    Its mode says so in Blender 5.2 (measured); before, those of bytes are and those of floats are not, in any mode.
    """
    return image.alpha_mode == "STRAIGHT" if bpy.app.version >= (5, 2, 0) else not image.is_float


def read_pass(render_pass, width: int, height: int) -> np.ndarray:
    """Float32 (height, width, channels) of a render pass, row 0 at the bottom."""
    values = np.empty((width * height, render_pass.channels), np.float32)
    _foreach(render_pass.rect.foreach_get, values)
    return values.reshape(height, width, render_pass.channels)


def baked_triangles(passes, width: int, height: int) -> np.ndarray:
    """Int32 (height, width): triangle of each texel, negative without one or if it belongs to another image."""
    return baked_points(passes, width, height)[0]


def baked_points(passes, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangle of each texel as by `baked_triangles`, and the weights of its first two corners, (height, width, 2)."""
    primitives = read_pass(passes["BakePrimitive"], width, height)
    # The number is stored as the bits of a float: 3.4 gives seed, triangle, u, v, later versions u, v, triangle.
    channel, weights = (1, slice(2, 4)) if primitives.shape[2] == 4 else (2, slice(0, 2))
    return np.ascontiguousarray(primitives[..., channel]).view(np.int32), primitives[..., weights]


def write_pass(render_pass, values: np.ndarray) -> None:
    """Fill a render pass with float32 (height, width, channels), row 0 at the bottom."""
    values = np.ascontiguousarray(values, np.float32).reshape(-1, render_pass.channels)
    _foreach(render_pass.rect.foreach_set, values)


def _foreach(access, values: np.ndarray) -> None:
    """Copy pixels. Newer versions accept flat arrays only; 3.4 counts rows and writes past the end of a flat array."""
    try:
        access(values.ravel())
    except TypeError:
        access(values)


def set_shader_color(tree) -> None:
    """Give nodes of this group the color of shaders (shown in 5.2; 4.3 ignores the tag on custom groups)."""
    if hasattr(tree, "color_tag"):
        tree.color_tag = "SHADER"


def curves_of(animation) -> list:
    """Curves of the action of animation data (Blender 5.0 has them in layers alone, by slots)."""
    action = animation.action
    if action is None:
        return []
    if bpy.app.version < (5, 0, 0):
        return list(action.fcurves)
    slot = animation.action_slot
    bags = [strip.channelbag(slot) for layer in action.layers for strip in layer.strips] if slot is not None else []
    return [curve for bag in bags if bag is not None for curve in bag.fcurves]


def subsurface_walk(shader, method: str) -> str | None:
    """Name of the `Walk` of a Principled BSDF or a Subsurface Scattering by its method; None if that is not known.

    Blender 4.0 renamed the methods, and 5.2 gave RANDOM_WALK another meaning.
    """
    names = {"BURLEY": "FIXED", "RANDOM_WALK_FIXED_RADIUS": "FIXED", "RANDOM_WALK_LEGACY": "FIXED"}
    names["RANDOM_WALK_SKIN"] = "SKIN"
    if bpy.app.version < (4, 0, 0):
        names["RANDOM_WALK"] = "SKIN"
    else:
        prop = shader.bl_rna.properties["falloff" if hasattr(shader, "falloff") else "subsurface_method"]
        is_later = "RANDOM_WALK_LEGACY" in prop.enum_items
        names["RANDOM_WALK"] = "FREE_PATH" if is_later else "FIXED"
    return names.get(method)
