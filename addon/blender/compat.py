"""Differences between Blender versions, bridged in this one place."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import bpy
import numpy as np

# A path property has to say that it understands "//" since Blender 4.5; earlier ones don't know the option.
PATH_OPTIONS = {"ANIMATABLE", "PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else {"ANIMATABLE"}


def engine_id(name: str) -> str:
    """Of CYCLES or EEVEE, whose name differs."""
    if name == "EEVEE":
        return "BLENDER_EEVEE_NEXT" if (4, 2, 0) <= bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"
    return name


def register_node_class(node_class, base: str) -> None:
    """Register a class of nodes derived from the type `base`, also again.

    Blender (4.2 to 5.0, measured) makes a new Python class of that type meanwhile, and takes subclasses of that alone.
    """
    node_class.__bases__ = (getattr(bpy.types, base),)
    bpy.utils.register_class(node_class)


def give_new_node_its_tree(node, tree) -> None:
    """In `init`, after which Blender 5.0 counts the node as a user of its tree once more."""
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
    """Give a node group an input with links alone if `hide_value`, "NodeSocketFloat" being a factor from 0 to 1."""
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


def has_input_socket(tree, name: str) -> bool:
    """Whether a node group has an input of that name."""
    if hasattr(tree, "interface"):
        return any(
            item.item_type == "SOCKET" and item.in_out == "INPUT" and item.name == name
            for item in tree.interface.items_tree
        )
    return name in tree.inputs


def uses_nodes(material) -> bool:
    """Whether a material has a node tree in use (`use_nodes` is deprecated since Blender 5.0, where all have)."""
    if material.node_tree is None:
        return False
    return bpy.app.version >= (5, 0, 0) or material.use_nodes


def has_transparent_shadow(material) -> bool:
    """Whether Cycles looks at transparency in shadows (the switch moved to the material itself in Blender 4.2)."""
    owner = material if hasattr(material, "use_transparent_shadow") else getattr(material, "cycles", None)
    return bool(getattr(owner, "use_transparent_shadow", True))


def transparent_bounces(scene) -> int | None:
    """How many see-through surfaces a shadow ray of Cycles crosses; None where Blender comes without Cycles."""
    return getattr(getattr(scene, "cycles", None), "transparent_max_bounces", None)


@contextmanager
def saving_png(scene) -> Iterator[None]:
    """Have what the scene renders saved as PNG of 8 bits (since Blender 5.0, a kind of media limits the formats)."""
    settings = scene.render.image_settings
    names = [name for name in ("media_type", "file_format", "color_mode", "color_depth") if hasattr(settings, name)]
    before = {name: getattr(settings, name) for name in names}
    try:
        for name, value in {
            "media_type": "IMAGE",
            "file_format": "PNG",
            "color_mode": "RGB",
            "color_depth": "8",
        }.items():
            if name in before:
                setattr(settings, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(settings, name, value)


def light_casts_shadow(light) -> bool:
    """Cycles' own shadow switch where it has one, else the light's."""
    cycles = getattr(light, "cycles", None)
    if hasattr(cycles, "cast_shadow"):
        return bool(cycles.cast_shadow)
    return bool(getattr(light, "use_shadow", True))


def spot_falloff() -> str:
    """How Cycles shapes a spot's cone (see native/scene/lights.h)."""
    return "scaled" if bpy.app.version >= (3, 5, 0) else "legacy"


def world_of(depsgraph):
    """The evaluated world that a render has, or None (view layers may have their own since Blender 4.4)."""
    world = getattr(depsgraph.view_layer, "world_override", None) or depsgraph.scene.world
    return world and world.evaluated_get(depsgraph)


def sun_disk() -> str:
    """How Cycles shapes a sun with an angle (see `SunDiskLight`): measured in 3.4 and 4.5, not between."""
    return "flat" if bpy.app.version < (4, 0, 0) else "even"


def area_lamp_factor() -> float:
    """Over `AreaLight`'s radiance of P / (4 A): Cycles has P / (pi A) from 4.2 on. 4.0 is not measured."""
    return 1.0 if bpy.app.version < (4, 0, 0) else 4 / math.pi


def flat_area_lamps_shine() -> bool:
    """Whether Cycles lights by area lamps of scale 0 along their axis (3.4 does, 4.5 does not)."""
    return bpy.app.version < (4, 0, 0)


def instancer_hides_lamps() -> bool:
    """Whether Cycles asks the instancer's visibility, too, of lamps (4.5 does, 3.4 of meshes alone)."""
    return bpy.app.version >= (4, 4, 0)


def round_lamp_model(light) -> str:
    """How Cycles shapes a lamp with a radius (see `SphereLight`)."""
    soft = getattr(light, "use_soft_falloff", bpy.app.version < (4, 0, 0))
    return "disk" if soft else "sphere"


def light_strength(light) -> float:
    """Energy with exposure (Blender 4.5 on) applied."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def light_color(light) -> tuple[float, float, float]:
    """Colour with the temperature's (Blender 4.5 on) applied."""
    color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = tuple(a * b for a, b in zip(color, light.temperature_color))
    return color


def read_pass(render_pass, width: int, height: int) -> np.ndarray:
    """Float32 (height, width, channels) of a render pass, row 0 at the bottom."""
    values = np.empty((width * height, render_pass.channels), np.float32)
    _foreach(render_pass.rect.foreach_get, values)
    return values.reshape(height, width, render_pass.channels)


def baked_triangles(passes, width: int, height: int) -> np.ndarray:
    """Int32 (height, width): the triangle that each texel shows, negative where none or another image's."""
    primitives = read_pass(passes["BakePrimitive"], width, height)
    # The number comes as the bits of a float: 3.4 gives seed, triangle, u, v, later versions u, v, triangle.
    channel = 1 if primitives.shape[2] == 4 else 2
    return np.ascontiguousarray(primitives[..., channel]).view(np.int32)


def write_pass(render_pass, values: np.ndarray) -> None:
    """Fill a render pass with float32 (height, width, channels), row 0 at the bottom."""
    values = np.ascontiguousarray(values, np.float32).reshape(-1, render_pass.channels)
    _foreach(render_pass.rect.foreach_set, values)


def _foreach(access, values: np.ndarray) -> None:
    """Newer versions take a flat array alone; 3.4 counts rows, and writes past the end of a flat one of that length."""
    try:
        access(values.ravel())
    except TypeError:
        access(values)


def set_shader_color(tree) -> None:
    """Have nodes of this group wear the colour of shaders (seen in 5.2; 4.3 knows the tag, and custom groups don't)."""
    if hasattr(tree, "color_tag"):
        tree.color_tag = "SHADER"


def has_fixed_radius(principled) -> bool:
    """Whether Cycles takes a Principled BSDF's radius as it is, whatever its colour (names changed in Blender 4.0)."""
    other = "RANDOM_WALK_SKIN" if bpy.app.version >= (4, 0, 0) else "RANDOM_WALK"
    return principled.subsurface_method != other
