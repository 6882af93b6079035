"""Textures at Base Color in which light scatters: each texel has an albedo of its own."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from beamspread import Medium, albedo_from_color, library, luminance
from beamspread.blender.jobs.state import state
from beamspread.core.bake.spreading import Effort
from beamspread.core.ldf.reflectance_table import reflectance_table
from beamspread.core.material import Material
from beamspread.core.native import native
from scenes import add_material, add_mesh, add_plane, add_sun, bake, node_of, tile_file, tiled_image

SIZE, SIDE, ANGLE = 48, 2.0, 30
PATH = SIDE / SIZE
G, IOR = 0.8, 1.4
COLORS = (0.2, 0.3, 0.4), (0.7, 0.6, 0.65)


@pytest.fixture
def plane():
    bpy.context.scene.beamspread.resolution = SIZE
    bpy.context.scene.beamspread.margin = 0
    add_sun(ANGLE)
    state.forget()
    return add_plane(material=add_material(color_mode="BASE_COLOR", mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR))


def stripes(first, second, period=12):
    """Stripes along the rows, float32 (SIZE, SIZE, 3)."""
    is_first = (np.arange(SIZE) % period < period // 2)[None, :, None]
    return np.float32(np.where(is_first, first, second)) * np.ones((SIZE, 1, 1), np.float32)


def add_texture(material, colors):
    """Link an image of linear colors to the node's Base Color."""
    height, width = colors.shape[:2]
    image = bpy.data.images.new("Colors", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.dstack([colors, np.ones((height, width, 1))]).astype(np.float32).ravel())
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, "Closest"
    material.node_tree.links.new(node_of(material).inputs["Base Color"], node.outputs["Color"])
    return image


def expected(albedo, thickness=np.inf):
    """The same by a script."""
    turned = np.radians(ANGLE)
    medium = Material(albedo=(0.5,) * 3, mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR)
    light = np.full(albedo.shape[:2], np.cos(turned), np.float32)
    return luminance(light, (np.sin(turned), 0.0, -np.cos(turned)), medium, PATH, thickness, albedo=albedo)


def distance(ours, truth):
    """Mean difference over the mean."""
    return float(np.abs(ours - truth).mean() / truth.mean())


# Noise of up to 2 and 1 %, root mean square: the mean distance is below that of both together.
SAME = 0.025


def test_a_new_node_scatters_light_by_the_albedo_of_each_texel(plane):
    """The bake is `luminance` of the albedos that give the colors; the convention is off by several times the bound."""
    material = plane.data.materials[0]
    add_texture(material, stripes(*COLORS))
    albedo = stripes(*(albedo_from_color(color, Medium(G, IOR)) for color in COLORS))
    truth = expected(albedo)
    assert node_of(material).texture_method == "SCATTERED"
    assert distance(bake(plane)[0], truth) < SAME
    assert state.lines() == []
    node_of(material).texture_method = "MULTIPLIED"
    assert distance(bake(plane)[0], truth) > 3 * SAME


def test_with_albedos_the_texture_is_the_albedo_itself(plane):
    material = plane.data.materials[0]
    albedo = stripes((0.8, 0.9, 0.85), (0.95, 0.99, 0.97))
    add_texture(material, albedo)
    node_of(material).color_mode = "ALBEDO"
    assert distance(bake(plane)[0], expected(albedo)) < SAME


def test_albedos_of_one_are_cut_and_said(plane, monkeypatch):
    monkeypatch.setattr(Effort, "of_plane", lambda effort, texels: replace(effort, max_walks=64))  # they are very long
    material = plane.data.materials[0]
    add_texture(material, stripes((0.5,) * 3, (1.0,) * 3))
    node_of(material).color_mode = "ALBEDO"
    found = bake(plane)[0]
    assert np.isfinite(found).all()
    assert found.min() >= 0
    assert "cut to 0.99999" in state.lines()[0]


def test_setting_the_blur_chooses_the_convention():
    """Scripts for older versions know no other way to choose it."""
    node = node_of(add_material())
    node.texture_blur = 0.2
    assert node.texture_method == "MULTIPLIED"


def test_nodes_of_older_files_keep_the_convention(plane):
    """They have no value for the method: the bake is that of the method by name."""
    material = plane.data.materials[0]
    add_texture(material, stripes(*COLORS))
    node_of(material).texture_method = "MULTIPLIED"
    by_name = bake(plane)[0].copy()
    node_of(material).texture_method = "SCATTERED"
    node_of(material).property_unset("texture_method")
    assert bake(plane)[0] == pytest.approx(by_name, rel=1e-6)


def test_planes_of_one_mesh_have_their_parts_of_the_texture():
    """Two squares, one higher, side by side in the image: each is as a plane of its own by a script."""
    bpy.context.scene.beamspread.resolution, bpy.context.scene.beamspread.margin = SIZE, 0
    add_sun(0)
    state.forget()
    corners = [(x + dx, dy, z) for x, z in ((-1, 0), (4, 1)) for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    uvs = [(u + du / 2, v) for u in (0.0, 0.5) for du, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
    obj = add_mesh("Squares", corners, [(0, 1, 2, 3), (4, 5, 6, 7)], uvs=uvs)
    material = add_material(color_mode="BASE_COLOR", mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR)
    obj.data.materials.append(material)
    colors = stripes(*COLORS, period=6)
    colors[:, SIZE // 2 :] = stripes((0.5, 0.5, 0.5), (0.75, 0.7, 0.6), period=8)[:, SIZE // 2 :]
    image = add_texture(material, colors)
    node_of(material).image = bpy.data.images.new("Result", SIZE, SIZE, float_buffer=True)
    found = bake(obj)[0]
    assert image.size[0] == found.shape[1]
    table = reflectance_table(library(Medium(G, IOR)))
    medium = Material(albedo=(0.5,) * 3, mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR)
    for half in (np.s_[:, : SIZE // 2], np.s_[:, SIZE // 2 :]):
        light, albedo = np.ones((SIZE, SIZE // 2)), table.albedo(colors[half])
        truth = luminance(light, (0.0, 0.0, -1.0), medium, (2 * PATH, PATH), albedo=albedo)
        assert distance(found[half], truth) < SAME


def add_arch(radius, width=SIDE):
    """A smooth strip around the y axis, `width` long and wide."""
    steps = np.linspace(-0.5, 0.5, 9) * width / radius
    corners = [(radius * np.sin(turn), y * width, radius * (np.cos(turn) - 1)) for turn in steps for y in (-0.5, 0.5)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(8)]
    uvs = [(i / 8 + du / 8, v) for i in range(8) for du, v in ((0, 0), (1, 0), (1, 1), (0, 1))]
    obj = add_mesh("Arch", corners, faces, uvs=uvs)
    for polygon in obj.data.polygons:
        polygon.use_smooth = True
    return obj


def test_light_scatters_in_textures_of_meshes_that_bend():
    """A strip that bends by 38 degrees, over the same of one color, is as a plane on which the light turns.

    Within the noise of both, 2 and 1 %, and that of small texels; columns up to the open ends have means of 48 texels.
    """
    bpy.context.scene.beamspread.resolution = SIZE
    bpy.context.scene.beamspread.margin = 0
    add_sun(ANGLE)
    state.forget()
    obj = add_arch(radius=3.0)
    material = add_material(color_mode="BASE_COLOR", mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR)
    obj.data.materials.append(material)
    add_texture(material, stripes(*COLORS))
    found = bake(obj)[0]
    albedo = reflectance_table(library(Medium(G, IOR))).albedo(stripes(*COLORS))
    medium = Material(albedo=(0.5,) * 3, mean_free_path=(PATH,) * 3, anisotropy=G, ior=IOR)
    turn = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * SIDE / 3.0
    angle = turn + np.radians(ANGLE)
    way = np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], -1) * np.ones((SIZE, 1, 1))
    truth = luminance(-way[..., 2], way, medium, PATH, albedo=albedo)
    notes = state.lines()
    # A bent strip is brighter than a plane, whatever its colors.
    material.node_tree.links.remove(node_of(material).inputs["Base Color"].links[0])
    node_of(material).base_color = np.mean(COLORS, axis=0)
    even = replace(medium, albedo=tuple(albedo_from_color(np.mean(COLORS, axis=0), Medium(G, IOR))))
    truth *= bake(obj)[0] / luminance(-way[..., 2], way, even, PATH)
    assert distance(found, truth) < 0.05
    assert distance(found.mean(axis=0), truth.mean(axis=0)) < 0.01
    assert np.abs(found.mean(axis=0) / truth.mean(axis=0) - 1).max() < 0.03
    assert not any("multiplies light" in line or "baked as flat" in line for line in notes)


def test_a_mesh_that_bends_has_its_texture_in_tiles(tmp_path):
    """Two UDIM tiles, whose colors are the same since the image repeats, are as one image twice as wide."""
    scene = bpy.context.scene.beamspread
    scene.margin, scene.image_dir, scene.use_indirect = 0, str(tmp_path), False
    add_sun(ANGLE)
    medium = {"color_mode": "BASE_COLOR", "mean_free_path": (PATH,) * 3, "anisotropy": G, "ior": IOR}
    half, colors = SIZE // 2, stripes(*COLORS, period=8)[: SIZE // 2, : SIZE // 2]
    found = {}
    for name, image, wide in (
        ("Tiles", tiled_image(tmp_path, {1001: (half, half), 1002: (half, half)}), colors),
        ("Whole", bpy.data.images.new("Whole", SIZE, half, float_buffer=True), np.tile(colors, (1, 2, 1))),
    ):
        state.forget()
        obj = add_arch(radius=1.5)
        obj.data.materials.append(add_material(name, image=image, **medium))
        add_texture(obj.data.materials[0], wide)
        if name == "Tiles":
            for loop in obj.data.uv_layers.active.data:
                loop.uv[0] *= 2
        texels = bake(obj)[0].copy()
        assert not any("multiplies light" in line for line in state.lines())
        files = [tile_file(tmp_path, number) for number in (1001, 1002)]
        tiles = [native.read_exr(str(path))[0] for path in files] if name == "Tiles" else [texels]
        found[name] = np.concatenate(tiles, axis=1)[..., :3]
        bpy.data.objects.remove(obj)
    assert found["Tiles"].shape == found["Whole"].shape
    assert distance(found["Tiles"], found["Whole"]) < 2 * SAME
