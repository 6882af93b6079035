"""Shadows of see-through things against Cycles: a white diffuse plane baked with DIFFUSE / DIRECT shows E / pi."""

import math

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.read.geometry import read_polygons
from beamspread.blender.read.lights import read_illumination
from beamspread.core.native import native
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from cycles_truth import TEXELS, add_receiver, around, cycles_irradiance
from mathutils import Matrix
from nodes import Nodes, add_sockets

FINE = 4
TOLERANCE = 0.01
ABOVE = Matrix.Translation((0, 0, 0.5))


class Tree(Nodes):
    """A material of its own."""

    def __init__(self, name="See-through"):
        super().__init__(bpy.data.materials.new(name), clear=True)

    def transparent(self, *color):
        return self.add("BsdfTransparent", {"Color": (*color, 1)})

    def mix(self, factor, first, second):
        return self.add("MixShader", {0: factor, 1: first.outputs[0], 2: second.outputs[0]})


def make_image(values, name="Pattern", is_float=False, **properties):
    """From (H, W, 4), row 0 at the bottom."""
    height, width, _ = values.shape
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.ascontiguousarray(values, np.float32).ravel())
    for key, value in properties.items():
        setattr(image, key, value)
    image.update()
    image.pack()
    return image


def stripes(count=8, alpha=(1.0, 0.0), shape=(16, 64)):
    """Opaque and clear along u, their borders between texels."""
    values = np.ones((*shape, 4))
    values[..., 3] = np.array(alpha)[np.arange(shape[1]) * count // shape[1] % 2]
    return values


def noise(seed=2, size=16, channels=4):
    values = np.ones((size, size, 4))
    values[..., :channels] = np.random.default_rng(seed).random((size, size, channels))
    return values


def add_card(material, size=(1.2, 1.2), **options):
    options.setdefault("matrix", ABOVE)
    return scenes.add_plane("Card", size, material=material, **options)


def our_irradiance(plane):
    """Transmittance by the add-on at FINE x FINE points of each texel (FINE H, FINE W, 3), and its warnings."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    illumination = read_illumination(depsgraph)
    polygons = flatten(read_polygons(plane.evaluated_get(depsgraph), "Target"))
    receiver = build_receiver(polygons, FINE * TEXELS, FINE * TEXELS)
    grid = receiver.charts[0].grid
    total = np.zeros((grid.height, grid.width, 3), np.float32)
    for lamp in illumination.lights:
        options = {"samples": 2, "clearance": grid.clearance}
        white, _ = native.gather_rays(grid.native(), lamp.native(), illumination.caster(grid, lamp), **options)
        total += white * lamp.rgb()
    return receiver.to_texture([total]), [*map(str, illumination.messages)]


def in_texels(fine):
    """Each texel's points, and those one step around it: (N, TEXELS, TEXELS, 3)."""
    near = np.stack([around(fine[..., i]) for i in range(3)], axis=-1)
    return near.reshape(9, TEXELS, FINE, TEXELS, FINE, 3).transpose(0, 2, 4, 1, 3, 5).reshape(-1, TEXELS, TEXELS, 3)


def assert_agree(warnings=()):
    """Within 1 % of the brightest if a texel is even, else within the range of our values in it; returns ours."""
    plane, image = add_receiver(Matrix())
    scenes.add_sun(20, 30)
    cycles = cycles_irradiance(plane, image)
    fine, said = our_irradiance(plane)
    assert list(said) == list(warnings)
    inner = np.zeros((TEXELS, TEXELS), bool)
    inner[2:-2, 2:-2] = True
    # At the diagonal of the plane, and there alone, Cycles samples a part of a texel; elsewhere its middle most.
    inner &= np.abs(np.subtract.outer(np.arange(TEXELS), np.arange(TEXELS))) > 1
    points = in_texels(fine)
    ours, low, high = points.mean(0), points.min(0), points.max(0)
    error = TOLERANCE * ours.max()
    assert (cycles >= low - error)[inner].all()
    assert (cycles <= high + error)[inner].all()
    even = inner & ((high - low).max(-1) < 3 * error)
    assert even.sum() > 0.3 * inner.sum()
    np.testing.assert_allclose(cycles[even], ours[even], rtol=0, atol=error)
    return ours


def test_a_tinted_transparent_card():
    tree = Tree()
    add_card(tree.finish(tree.transparent(0.9, 0.4, 0.1)))
    ours = assert_agree()
    np.testing.assert_allclose(ours[28, 34] / math.cos(math.radians(20)), (0.9, 0.4, 0.1), rtol=1e-5)


def test_principled_alpha():
    tree = Tree()
    add_card(tree.finish(tree.add("BsdfPrincipled", {"Alpha": 0.3})))
    np.testing.assert_allclose(assert_agree()[28, 34] / math.cos(math.radians(20)), 0.7, rtol=1e-5)


@pytest.mark.parametrize("kind", ["principled", "mix"])
def test_a_card_with_alpha_stripes(kind):
    tree = Tree()
    texture = tree.add("TexImage", image=make_image(stripes()))
    if kind == "principled":
        shader = tree.add("BsdfPrincipled", {"Alpha": texture.outputs["Alpha"]})
    else:
        shader = tree.mix(texture.outputs["Alpha"], tree.transparent(1, 1, 1), tree.add("BsdfDiffuse"))
    add_card(tree.finish(shader))
    assert_agree()


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("interpolation", ["Linear", "Closest"])
def test_extensions_and_mapping(extension, interpolation):
    tree = Tree()
    kinds = bpy.types.ShaderNodeTexImage.bl_rna.properties["extension"].enum_items
    if extension not in kinds:
        pytest.skip("came with a later Blender")
    uvs = tree.add("UVMap", uv_map="UVMap")
    mapping = tree.add(
        "Mapping",
        {"Vector": uvs.outputs[0], "Location": (-0.6, -0.4, 0), "Rotation": (0, 0, 0.3), "Scale": (2, 1.5, 1)},
    )
    texture = tree.add(
        "TexImage",
        {"Vector": mapping.outputs[0]},
        image=make_image(noise(size=6)),
        extension=extension,
        interpolation=interpolation,
    )
    add_card(tree.finish(tree.mix(texture.outputs["Alpha"], tree.transparent(1, 1, 1), tree.add("BsdfDiffuse"))))
    ours = assert_agree()
    assert np.ptp(ours[..., 0]) > 0.5 * ours.max()


def in_group(tree):
    """Transparency by a factor that comes through two groups and a reroute."""
    inner, outer = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Inner", "Outer"))
    for group in (inner, outer):
        add_sockets(group, "NodeSocketFloat", "Part")
        add_sockets(group, "NodeSocketShader", outputs="Shader")
    for group in (inner, outer):
        nodes, links = group.nodes, group.links
        entry, leave, bend = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput"), nodes.new("NodeReroute")
        links.new(entry.outputs[0], bend.inputs[0])
        if group is inner:
            mix = nodes.new("ShaderNodeMixShader")
            links.new(nodes.new("ShaderNodeBsdfDiffuse").outputs[0], mix.inputs[1])
            links.new(nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[2])
            links.new(bend.outputs[0], mix.inputs[0])
            links.new(mix.outputs[0], leave.inputs[0])
        else:
            nested = nodes.new("ShaderNodeGroup")
            nested.node_tree = inner
            links.new(bend.outputs[0], nested.inputs[0])
            links.new(nested.outputs[0], leave.inputs[0])
    return tree.add("Group", {}, node_tree=outer)


def grouped(tree):
    node = in_group(tree)
    node.inputs[0].default_value = 0.6
    return node


def muted(tree):
    """A muted node passes on one input in Cycles: a mix its first shader."""
    mix = tree.mix(0.3, tree.transparent(0.6, 0.6, 0.6), tree.add("BsdfDiffuse"))
    mix.mute = True
    return mix


def is_shadow_ray(tree):
    path = tree.add("LightPath")
    return tree.mix(path.outputs["Is Shadow Ray"], tree.add("BsdfGlass"), tree.transparent(0.6, 0.6, 0.6))


def added(tree):
    first, second = tree.transparent(0.4, 0.4, 0.4), tree.transparent(0.2, 0.2, 0.2)
    return tree.add("AddShader", {0: first.outputs[0], 1: second.outputs[0]})


def arithmetic(tree):
    third = tree.add("Math", {0: 0.7, 1: 0.5}, operation="MULTIPLY")
    ramp = tree.add("ValToRGB", {0: third.outputs[0]})  # black to white: .35
    inverted = tree.add("Invert", {0: 1.0, "Color": ramp.outputs[0]})
    # .65 by Invert, clamped to .6.
    return tree.mix(
        tree.add("Clamp", {0: inverted.outputs[0], 2: 0.6}).outputs[0],
        tree.add("BsdfDiffuse"),
        tree.transparent(1, 1, 1),
    )


@pytest.mark.parametrize("shader", [grouped, muted, is_shadow_ray, added, arithmetic])
def test_trees_that_let_three_fifths_through(shader):
    tree = Tree()
    add_card(tree.finish(shader(tree)))
    ours = assert_agree()
    np.testing.assert_allclose(ours[28, 34] / math.cos(math.radians(20)), 0.6, atol=1e-5)


@pytest.mark.parametrize("kind", ["BsdfGlass", "BsdfRefraction", "BsdfTranslucent", "Holdout"])
def test_shaders_that_bend_or_spread_light_cast_full_shadows(kind):
    tree = Tree()
    add_card(tree.finish(tree.add(kind)))
    assert not assert_agree()[28, 34].any()


def test_materials_without_transparent_shadows_are_opaque():
    tree = Tree()
    material = tree.finish(tree.transparent(1, 1, 1))
    owner = material if hasattr(material, "use_transparent_shadow") else material.cycles
    owner.use_transparent_shadow = False
    add_card(material)
    assert not assert_agree()[28, 34].any()


@pytest.mark.parametrize(
    ("threshold", "is_float", "alpha_mode"),
    [(0.5, False, "STRAIGHT"), (None, True, "STRAIGHT"), (None, False, "CHANNEL_PACKED"), (None, False, "NONE")],
)
def test_a_leaf_card(threshold, is_float, alpha_mode):
    """Alpha of an image, also cut at a threshold, on a quad in two slots with one mesh placed twice."""
    values = noise(size=8)
    tree = Tree()
    texture = tree.add("TexImage", image=make_image(values, is_float=is_float, alpha_mode=alpha_mode))
    alpha = texture.outputs["Alpha"]
    if threshold:
        alpha = tree.add("Math", {0: alpha, 1: threshold}, operation="GREATER_THAN").outputs[0]
    card = add_card(tree.finish(tree.add("BsdfPrincipled", {"Alpha": alpha})), size=(0.8, 0.8))
    again = bpy.data.objects.new("Again", card.data)
    again.matrix_world = Matrix.Translation((0.3, 0.2, 0.8)) @ Matrix.Rotation(0.4, 4, "Z")
    bpy.context.collection.objects.link(again)
    assert_agree()


@pytest.mark.parametrize("color_space", ["sRGB", "Non-Color"])
@pytest.mark.parametrize("uses_alpha", [False, True])
def test_color_of_an_image_tints(color_space, uses_alpha):
    values = noise(size=4)
    values[..., 3] = 0.5 + 0.5 * values[..., 3]
    tree = Tree()
    texture = tree.add("TexImage", image=make_image(values, alpha_mode="STRAIGHT"), interpolation="Closest")
    texture.image.colorspace_settings.name = color_space
    clear = tree.add("BsdfTransparent", {"Color": texture.outputs["Color"]})
    if uses_alpha:
        clear = tree.mix(texture.outputs["Alpha"], tree.add("BsdfDiffuse"), clear)
    add_card(tree.finish(clear))
    ours = assert_agree()
    assert np.abs(ours[..., 0] - ours[..., 2]).max() > 0.2


def test_a_volume_alone_lets_light_through_and_says_so():
    tree = Tree("Haze")
    add_card(tree.finish(tree.add("VolumeScatter", {"Density": 1e-6}), "Volume"))
    words = "The material 'Haze' has a volume and no surface: it casts no shadow."
    assert assert_agree(warnings=[words]).min() > 0


def test_unsupported_nodes_are_opaque_and_named():
    tree = Tree("Mottled")
    factor = tree.add("TexNoise").outputs[0]
    add_card(tree.finish(tree.mix(factor, tree.transparent(1, 1, 1), tree.add("BsdfDiffuse"))))
    plane, _ = add_receiver(Matrix())
    scenes.add_sun(20, 30)
    ours, warnings = our_irradiance(plane)
    assert not ours[112, 136].any()
    words = "The material 'Mottled' casts opaque shadows. The node 'Noise Texture' is not supported."
    assert list(warnings) == [words]


def test_a_factor_between_opaque_shaders_need_not_be_understood():
    tree = Tree("Mottled")
    add_card(tree.finish(tree.mix(tree.add("TexNoise").outputs[0], tree.add("BsdfGlossy"), tree.add("BsdfDiffuse"))))
    assert not assert_agree()[28, 34].any()


@pytest.mark.parametrize("bounces", [3, 4])
def test_rays_end_after_so_many_cards(bounces):
    bpy.context.scene.cycles.transparent_max_bounces = bounces
    tree = Tree()
    material = tree.finish(tree.transparent(0.9, 0.9, 0.9))
    for i in range(4):
        add_card(material, matrix=Matrix.Translation((0, 0, 0.3 + 0.1 * i)))
    assert assert_agree()[28, 34].any() == (bounces == 4)


def hide_from_shadows(card):
    card.visible_shadow = False


def hold_out(card):
    card.is_holdout = True


def catch_shadows(card):
    card.is_shadow_catcher = True


def make_indirect(card):
    bpy.context.scene.collection.children.link(scenes.new_collection("Indirect", card))
    bpy.context.view_layer.layer_collection.children["Indirect"].indirect_only = True


@pytest.mark.parametrize("change", [hide_from_shadows, hold_out, catch_shadows, make_indirect])
def test_visibility(change):
    tree = Tree()
    change(add_card(tree.finish(tree.add("BsdfDiffuse"))))
    assert assert_agree()[28, 34].any() == (change is hide_from_shadows)


@pytest.mark.parametrize("is_visible", [True, False])
def test_instances_of_a_collection(is_visible):
    tree = Tree()
    card = add_card(tree.finish(tree.transparent(0.5, 0.5, 0.5)), size=(0.5, 0.5), matrix=Matrix())
    cards, mirror = scenes.new_collection("Cards", card), Matrix.Diagonal((-1, 1.2, 1, 1))
    for i in range(3):
        place = Matrix.Translation((0.4 * i - 0.4, 0.1 * i, 0.4 + 0.1 * i))
        scenes.add_instancer(cards, place @ mirror).visible_shadow = is_visible
    ours = assert_agree()
    assert (np.ptp(ours) > 0.5) == is_visible
