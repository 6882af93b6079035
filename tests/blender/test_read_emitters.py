"""Glowing meshes, summed over their triangles by plain code, against Cycles' bake of a white plane."""

import math

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.state import state
from beamspread.blender.node import plain
from beamspread.blender.node.output import make_plain, plain_of
from beamspread.blender.read.emitters import _pieces
from beamspread.core.native import native
from beamspread.core.scene.lights import MeshLight
from cycles_truth import add_receiver, cycles_irradiance, read
from mathutils import Euler, Matrix
from nodes import Nodes

ABOVE = Matrix.Translation((0.3, -0.2, 1.2)) @ Euler((0.5, -0.3, 0.2)).to_matrix().to_4x4()
# Means over 64 texels of 512 samples each.
NOISE = {"rel": 0.006}
COLOR = (1.0, 0.5, 0.25, 1.0)


def glowing_material(strength=3.0, color=COLOR, kind="Emission"):
    """A material and the node that glows."""
    nodes = Nodes(bpy.data.materials.new("Glow"), clear=True)
    inputs = {"Color": color, "Strength": strength}
    if kind == "BsdfPrincipled":
        name = "Emission" if bpy.app.version < (4, 0, 0) else "Emission Color"
        inputs = {name: color, "Emission Strength": strength, "Base Color": (0, 0, 0, 1)}
    node = nodes.add(kind, inputs)
    return nodes.finish(node), node


def add_panel(matrix=ABOVE, size=(1.0, 0.6), material=None):
    return scenes.add_plane("Panel", size, matrix, material=material or glowing_material()[0])


def irradiance(light, cuts=24, points=16):
    """Mean over the plane -1..1 at z = 0, each triangle cut into small ones that shine from their middles."""
    triangles = light.vertices[light.triangles]
    if len(triangles) < 200:
        pieces = _pieces(cuts)
        triangles, count = (pieces @ triangles[:, None]).reshape(-1, 3, 3), len(pieces)
    else:
        count = 1
    middles = triangles.mean(axis=1)
    areas = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    across = (np.arange(points) + 0.5) / points * 2 - 1
    total = np.zeros(3)
    for x in across:
        for y in across:
            way = middles - (x, y, 0)
            squared = (way**2).sum(axis=1)
            # Cosine here and there, both sides of the triangle glow.
            weights = np.maximum(way[:, 2], 0) * np.abs((areas * way).sum(axis=1)) / squared**2
            total += weights @ np.repeat(light.radiance, count, axis=0).astype(float)
    return total / points**2 * light.rgb()


def assert_agrees(*, lights=1, texels=8):
    """The sum of all glowing meshes."""
    plane, image = add_receiver(Matrix(), texels=texels)
    cycles = cycles_irradiance(plane, image, 512).mean(axis=(0, 1))
    bpy.data.objects.remove(plane)
    found = read().lights
    assert len(found) == lights
    assert all(isinstance(light, MeshLight) and light.cast_shadow for light in found)
    assert sum(irradiance(light) for light in found) == pytest.approx(cycles, **NOISE)
    assert cycles.max() > 0


MATRICES = {
    "tilted": ABOVE,
    "flipped": ABOVE @ Matrix.Rotation(math.pi, 4, "X"),
    "stretched": ABOVE @ Matrix.Diagonal((1.6, 0.5, 1, 1)),
    "mirrored": ABOVE @ Matrix.Diagonal((-1.2, 0.7, -1, 1)),
    "flat": ABOVE @ Matrix.Diagonal((1, 1, 0, 1)),
}


@pytest.mark.parametrize("matrix", MATRICES.values(), ids=MATRICES.keys())
def test_both_sides_glow(matrix):
    add_panel(matrix)
    assert_agrees()


@pytest.mark.parametrize("alpha", [1.0, 0.4])
def test_principled_glows_by_its_alpha(alpha):
    material, node = glowing_material(kind="BsdfPrincipled")
    node.inputs["Alpha"].default_value = alpha
    add_panel(material=material)
    assert_agrees()


def test_principled_is_dark_as_it_comes():
    add_panel(material=Nodes(bpy.data.materials.new("Plain")).owner)
    assert read().lights == ()


def test_materials_of_faces():
    """Each face has its own; a slot too high stands for the last, an empty one is dark."""
    box = [(x, y, z) for z in (0.8, 1.2) for y in (-0.3, 0.3) for x in (-0.3, 0.3)]
    faces = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
    obj = scenes.add_mesh("Box", box, faces)
    for material in (glowing_material(1)[0], None, glowing_material(4, (0.1, 1, 0.2, 1))[0]):
        obj.data.materials.append(material)
    for polygon, slot in zip(obj.data.polygons, (0, 1, 2, 7, 1, 0)):
        polygon.material_index = slot
    obj.data.update()
    # A convex body: of each face only the sunny side counts, and its back never sees the plane but through the others.
    (light,) = read().lights
    # Per glowing quad two triangles.
    assert len(light.triangles) == 8
    assert sorted(set(map(tuple, light.radiance.astype(float).round(3).tolist()))) == [
        (0.4, 4.0, 0.8),
        (1.0, 0.5, 0.25),
    ]


BOX = [(x, y, z) for z in (-0.3, 0.3) for y in (-0.3, 0.3) for x in (-0.3, 0.3)]
OUTWARD = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]


def add_box(matrix=ABOVE, faces=OUTWARD):
    box = scenes.add_mesh("Box", BOX, faces, matrix)
    box.data.materials.append(glowing_material()[0])
    return box


@pytest.mark.parametrize("mirror", [1, -1])
def test_backs_of_a_closed_body_send_no_rays(mirror):
    """Its fronts alone bring as much light as in Cycles, mirrored or not."""
    add_box(ABOVE @ Matrix.Diagonal((1, mirror, 1, 1)))
    plane, image = add_receiver(Matrix(), texels=8)
    cycles = cycles_irradiance(plane, image, 512).mean(axis=(0, 1))
    bpy.data.objects.remove(plane)
    illumination = read()
    (light,) = illumination.lights
    assert light.is_closed
    grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 0.25, 0.25, 8, 8)
    alone = native.gather_rays(grid, light.native(), rays=256)[0].mean(axis=(0, 1)) * light.rgb()
    assert alone == pytest.approx(cycles, **NOISE)


def test_a_room_whose_ceiling_glows_lights_its_floor():
    """Seen from within are the backs of a closed body, also of one whose faces do not all glow."""
    room = add_box(Matrix.Translation((0, 0, 0.5)) @ Matrix.Diagonal((4, 4, 3, 1)))
    room.data.materials.append(bpy.data.materials.new("Dark"))
    for number, polygon in enumerate(room.data.polygons):
        polygon.material_index = number != 1  # the upper one
    (light,) = read().lights
    assert light.is_closed
    assert len(light.triangles) == 2
    grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 0.25, 0.25, 8, 8)
    inside = native.gather_rays(grid, light.native(), rays=256)[0].mean(axis=(0, 1)) * light.rgb()
    assert inside == pytest.approx(irradiance(light), rel=0.01)


def open_box(box):
    box.data.clear_geometry()
    box.data.from_pydata(BOX, [], OUTWARD[1:])


def add_clear_slot(box):
    nodes = Nodes(bpy.data.materials.new("Glass"), clear=True)
    box.data.materials.append(nodes.finish(nodes.add("BsdfTransparent")))
    box.data.polygons[0].material_index = 1


def turn_inside_out(box):
    box.data.flip_normals()


def cast_no_shadow(box):
    box.visible_shadow = False


def instance_without_shadow(box):
    lit = scenes.new_collection("Lit", box)
    scenes.add_instancer(lit, Matrix.Translation((2, 0, 0))).visible_shadow = False


SEEN_BACKS = [open_box, add_clear_slot, turn_inside_out, cast_no_shadow, instance_without_shadow]


@pytest.mark.parametrize("change", SEEN_BACKS, ids=lambda change: change.__name__)
def test_backs_that_are_seen_glow(change):
    box = add_box()
    (light,) = read().lights
    assert light.is_closed
    change(box)
    (light,) = read().lights
    assert not light.is_closed


def test_instances_are_one_light():
    panel = add_panel(Matrix.Translation((0, 0, 0.4)), size=(0.4, 0.3))
    lit = scenes.new_collection("Lit", panel)
    for x, scale in ((-0.4, 1), (0.5, -1.5)):
        scenes.add_instancer(lit, Matrix.Translation((x, 0.1, 0.8)) @ Matrix.Diagonal((scale, 1, 1, 1)))
    assert_agrees()


def test_modifiers_and_parents():
    panel = add_panel(Matrix.Translation((0.2, 0, 0)))
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.matrix_world = Matrix.Translation((0, 0, 1)) @ Matrix.Diagonal((1, -0.8, 1, 1))
    panel.parent = parent
    panel.modifiers.new("Array", "ARRAY").count = 2
    assert_agrees()


def test_text_glows():
    text = bpy.data.objects.new("Sign", bpy.data.curves.new("Sign", "FONT"))
    text.data.body, text.data.size, text.data.extrude = "IO", 0.8, 0.0
    text.matrix_world = Matrix.Translation((-0.4, -0.2, 0.9))
    text.data.materials.append(glowing_material()[0])
    bpy.context.scene.collection.objects.link(text)
    assert_agrees()


def striped_image():
    """Left half red, right half green with a gradient upward, 32 x 16."""
    image = bpy.data.images.new("Stripes", 32, 16, float_buffer=True)
    values = np.zeros((16, 32, 4), np.float32)
    values[:, :16, 0], values[:, 16:, 1], values[..., 3] = 1, np.linspace(0, 2, 16)[:, None], 1
    image.pixels.foreach_set(values.ravel())
    return image


@pytest.mark.parametrize("coordinates", ["default", "UV", "mapped"])
def test_an_image_glows_by_its_uv_map(coordinates):
    material, emission = glowing_material()
    nodes = Nodes(material)
    texture = nodes.add("TexImage", image=striped_image())
    nodes.set(emission.inputs["Color"], texture.outputs["Color"])
    if coordinates != "default":
        source = nodes.add("TexCoord").outputs["UV"]
        if coordinates == "mapped":
            inputs = {"Vector": source, "Scale": (2.5, 1, 1), "Location": (0.2, 0.3, 0)}
            source = nodes.add("Mapping", inputs).outputs["Vector"]
        nodes.set(texture.inputs["Vector"], source)
    add_panel(Matrix.Translation((0, 0, 0.4)), (1.5, 1.5), material)
    light = read().lights[0]
    assert 4000 < len(light.triangles) < 20000
    # Cycles samples one half of texels on the diagonal, which shows if one side of the plane is brighter.
    assert_agrees(texels=64)


def set_flag(name):
    def apply(panel):
        setattr(panel, name, False)

    return apply


def hide(panel):
    panel.hide_render = True


def no_nodes(panel):
    if bpy.app.version >= (5, 0, 0):
        pytest.skip("all materials have nodes")
    panel.data.materials[0].use_nodes = False


@pytest.mark.parametrize("darken", [set_flag("visible_diffuse"), hide, no_nodes], ids=["diffuse", "hidden", "no_nodes"])
def test_dark_meshes(darken):
    panel = add_panel()
    darken(panel)
    plane, image = add_receiver(Matrix(), texels=4)
    assert cycles_irradiance(plane, image, 16).max() == 0
    assert read().lights == ()


@pytest.mark.parametrize("flag", ["visible_camera", "visible_shadow", "visible_glossy", "is_holdout"])
def test_flags_that_do_not_matter(flag):
    panel = add_panel()
    setattr(panel, flag, not getattr(panel, flag))
    assert_agrees()


@pytest.mark.parametrize("flag", ["holdout", "indirect_only"])
def test_collections_that_cameras_do_not_see_light_all_the_same(flag):
    panel = add_panel()
    bpy.context.scene.collection.children.link(scenes.new_collection("Away", panel))
    setattr(bpy.context.view_layer.layer_collection.children["Away"], flag, True)
    assert_agrees()


def test_the_beamspread_node_is_no_light():
    scenes.add_plane(material=scenes.add_material(linked=True))
    assert read().lights == ()


def test_a_baked_image_is_no_light_by_any_way():
    """By the node's Color as emission, and by the group of plain nodes in the node's place."""
    image = bpy.data.images.new("Baked", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.ones(64, np.float32))
    material = scenes.add_material(image=image)
    scenes.add_plane(material=material)
    node, nodes = scenes.node_of(material), Nodes(material)
    nodes.show(nodes.add("Emission", {"Color": node.outputs["Color"]}))
    assert (read().lights, read().by_cycles) == ((), {})
    make_plain(node)
    assert (read().lights, read().by_cycles) == ((), {})
    nodes.show(plain_of(node).outputs["BSDF"])
    assert (read().lights, read().by_cycles) == ((), {})


@pytest.mark.parametrize("kind", [plain.COAT, plain.EMISSION, plain.UNLIT])
def test_plain_nodes_for_engines_are_no_light(kind):
    image = bpy.data.images.new("Baked", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.full(64, 3, np.float32))
    material = scenes.add_material(image=image, linked=True)
    scenes.add_plane(material=material)
    plain.make(scenes.node_of(material), kind)
    assert (read().lights, read().by_cycles) == ((), {})


def test_a_baked_image_mixed_with_a_texture_is_no_light():
    """The texture is one that only Cycles evaluates."""
    material = scenes.add_material()
    scenes.add_plane(material=material)
    nodes = Nodes(material)
    colors = {"Color1": scenes.node_of(material).outputs["Color"], "Color2": nodes.add("TexNoise").outputs["Color"]}
    nodes.show(nodes.add("Emission", {"Color": nodes.add("MixRGB", colors).outputs["Color"]}))
    assert (read().lights, read().by_cycles, read().messages) == ((), {}, ())


def test_an_unused_beamspread_node_takes_no_light_away():
    material, _ = glowing_material()
    add_panel(material=material)
    (before,) = read().lights
    material.node_tree.nodes.new("BeamspreadNode")
    (light,) = read().lights
    assert np.array_equal(light.radiance, before.radiance)


def test_emission_beside_a_beamspread_node_is_light():
    material, emission = glowing_material()
    add_panel(material=material)
    (before,) = read().lights
    nodes = Nodes(material)
    node = nodes.tree.nodes.new("BeamspreadNode")
    nodes.show(nodes.add("AddShader", {0: emission.outputs[0], 1: node.outputs["BSDF"]}))
    (light,) = read().lights
    assert np.array_equal(light.radiance, before.radiance)


def test_a_bake_of_all_keeps_the_light_of_a_material_with_an_unused_node():
    """A first bake puts the node at the material's output only if that takes no light from the scene."""
    material, emission = glowing_material()
    panel = add_panel(material=material)
    panel.data.uv_layers.new(name="UVMap")
    material.node_tree.nodes.new("BeamspreadNode")
    bpy.context.scene.beamspread.resolution = 16
    bpy.context.scene.beamspread.use_indirect = False
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.select(plane)
    assert bpy.ops.beamspread.bake(objects="SELECTED") == {"FINISHED"}
    alone = scenes.pixels(scenes.image_of(plane)).copy()
    assert alone.any()
    state.forget()
    bpy.ops.beamspread.bake(objects="ALL")
    assert np.array_equal(scenes.pixels(scenes.image_of(plane)), alone)
    output = material.node_tree.get_output_node("ALL")
    assert output.inputs["Surface"].links[0].from_node == emission
    assert any("emits light by 'Emission'" in line for line in state.lines())
    bpy.ops.beamspread.bake(objects="ALL")
    assert np.array_equal(scenes.pixels(scenes.image_of(plane)), alone)


def test_unsupported_nodes_are_named():
    material, emission = glowing_material()
    nodes = Nodes(material)
    nodes.set(emission.inputs["Strength"], nodes.add("TexNoise").outputs[0])
    add_panel(material=material)
    assert read().lights == ()
    text = "The emission of 'Panel' is left out. The node 'Noise Texture' is not supported."
    assert {name: str(message) for name, message in read().by_cycles.items()} == {"Panel": text}


def test_negative_light_is_named():
    add_panel(material=glowing_material(-1)[0])
    text = "The light 'Panel' is left out. The radiance of 'Panel' has negative values, or values that are not numbers."
    assert (read().lights, [*map(str, read().messages)]) == ((), [text])
