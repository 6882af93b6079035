"""Links to the node's Base Color: evaluated at the texels, on the light's way in and out."""

import bpy
import numpy as np
import pytest
from beamspread.blender.jobs.state import state
from scenes import add_material, add_plane, add_sun, bake, node_of, pixels

SIZE = 16
# Rows go up; left and right halves of two colours each.
COLORS = np.array([[(0.2, 0.8, 0.5), (0.6, 0.4, 0.5)], [(0.4, 0.8, 0.5), (0.8, 0.4, 0.5)]], np.float32)


@pytest.fixture
def plane():
    bpy.context.scene.beamspread.resolution = SIZE
    bpy.context.scene.beamspread.margin = 0
    add_sun(30)
    state.forget()
    return add_plane(material=add_material(color_mode="BASE_COLOR", base_color=(0.5, 0.6, 0.5)))


def add_image(material, colors=COLORS, is_smooth=False):
    """An Image Texture node of a linear image."""
    height, width = colors.shape[:2]
    image = bpy.data.images.new("Colors", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.dstack([colors, np.ones((height, width, 1))]).astype(np.float32).ravel())
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Linear" if is_smooth else "Closest"
    return node


def link(material, output):
    material.node_tree.links.new(node_of(material).inputs["Base Color"], output)


def texels(colors):
    return np.repeat(np.repeat(colors, SIZE // len(colors), axis=0), SIZE // colors.shape[1], axis=1)


def test_on_top_it_multiplies_the_bake_of_its_mean(plane):
    material = plane.data.materials[0]
    plain = bake(plane)[0].copy()
    link(material, add_image(material).outputs["Color"])
    node_of(material).texture_blur, node_of(material).base_color = 0.0, (0.1, 0.1, 0.1)
    assert bake(plane)[0] == pytest.approx(plain * texels(COLORS) / (0.5, 0.6, 0.5), rel=1e-4)
    assert state.lines() == []


def test_blurred_it_is_softer_than_on_top(plane):
    material = plane.data.materials[0]
    link(material, add_image(material).outputs["Color"])
    ranges = []
    for blur in (0.0, 0.5, 1.0):
        node_of(material).texture_blur = blur
        row = bake(plane)[0][SIZE // 4, :, 0]
        ranges.append(row.max() / row.min())
    assert ranges[0] > ranges[1] > ranges[2] > 1.0


@pytest.mark.parametrize("uv_map", ["", "UVMap"])
def test_nodes_and_mappings_on_the_way(plane, uv_map):
    material = plane.data.materials[0]
    tree, image = material.node_tree, add_image(material)
    uvs, mapping = tree.nodes.new("ShaderNodeUVMap"), tree.nodes.new("ShaderNodeMapping")
    gamma = tree.nodes.new("ShaderNodeGamma")
    uvs.uv_map = uv_map
    mapping.inputs["Location"].default_value = (0.5, 0, 0)  # exchanges the columns
    gamma.inputs[1].default_value = 2.0
    tree.links.new(mapping.inputs["Vector"], uvs.outputs["UV"])
    tree.links.new(image.inputs["Vector"], mapping.outputs["Vector"])
    tree.links.new(gamma.inputs["Color"], image.outputs["Color"])
    squared = COLORS[:, ::-1] ** 2
    node_of(material).base_color = squared.mean(axis=(0, 1))
    plain = bake(plane)[0].copy()
    link(material, gamma.outputs["Color"])
    node_of(material).texture_blur = 0.0
    found = bake(plane)[0]
    assert found == pytest.approx(plain * texels(squared) / squared.mean(axis=(0, 1)), rel=1e-4)


def test_by_the_objects_own_coordinates(plane):
    material = plane.data.materials[0]
    plane.location = (3, 4, 5)
    tree = material.node_tree
    place, separate = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeSeparateXYZ")
    greater = tree.nodes.new("ShaderNodeMath")
    greater.operation, greater.inputs[1].default_value = "GREATER_THAN", 0.0
    tree.links.new(separate.inputs[0], place.outputs["Object"])
    tree.links.new(greater.inputs[0], separate.outputs["Y"])
    link(material, greater.outputs[0])
    node_of(material).texture_blur = 0.0
    found = bake(plane)[0]
    assert not found[: SIZE // 2].any()
    assert (found[SIZE // 2 :] > 0).all()


def test_images_finer_than_the_bake_are_averaged(plane):
    material = plane.data.materials[0]
    stripes = np.tile(np.array([[(0.2,) * 3, (0.8,) * 3]], np.float32), (4 * SIZE, 2 * SIZE, 1))
    link(material, add_image(material, stripes).outputs["Color"])
    node_of(material).base_color = (0.5,) * 3
    node_of(material).texture_blur = 0.0
    found = bake(plane)[0].copy()
    material.node_tree.links.remove(node_of(material).inputs["Base Color"].links[0])
    assert found == pytest.approx(bake(plane)[0], rel=1e-4)


def test_colors_above_one_are_cut_and_said(plane):
    material = plane.data.materials[0]
    link(material, add_image(material, COLORS * 2).outputs["Color"])
    found = bake(plane)[0]
    assert np.isfinite(found).all()
    assert "cut to 1" in state.lines()[0]


def test_the_default_is_half_and_half():
    assert node_of(add_material()).texture_blur == 0.5


def test_arriving_light_is_not_colored(plane):
    bpy.context.scene.beamspread.output = "IRRADIANCE"
    material = plane.data.materials[0]
    link(material, add_image(material).outputs["Color"])
    bpy.ops.object.select_all(action="SELECT")
    bpy.context.view_layer.objects.active = plane
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    found = pixels(next(image for image in bpy.data.images if "Irradiance" in image.name))
    assert found == pytest.approx(np.full((SIZE, SIZE, 3), np.cos(np.radians(30))), rel=1e-4)
