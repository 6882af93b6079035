"""The engine: Blender's own Bake fills the active image through RenderEngine.bake."""

import math
from types import SimpleNamespace

import bpy
import numpy as np
import panel_layout
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run import active_image, engine
from beamspread.blender.jobs.run.active_image import refusals, textures_at_risk
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.ui import panels
from beamspread.blender.ui.panels import target_of_blender
from beamspread.core.bake.job import BakeJob
from beamspread.core.target import Target
from mathutils import Matrix
from nodes import Nodes, add_sockets


@pytest.fixture(autouse=True)
def beamspread_engine():
    scene = bpy.context.scene
    scene.render.engine = "BEAMSPREAD"
    scene.beamspread.resolution = 32
    scene.render.bake.margin = 0
    state.forget()


def add_active_image(material, name="Active", size=(32, 32)):
    image = bpy.data.images.new(name, *size, float_buffer=True)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    return image


def test_same_as_the_operator():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert state.lines() == []
    filled = scenes.pixels(image)
    assert (filled > 0).all()
    assert filled == pytest.approx(scenes.bake(plane)[0], abs=1e-6)


def with_second_map(plane):
    """The node shows its image by a map that fills the left half of it; the artist's map fills all."""
    layer = plane.data.uv_layers.new(name="Second", do_init=False)
    layer.data.foreach_set("uv", np.float32(np.multiply(scenes.SQUARE_UVS, (0.5, 1))).ravel())
    node = scenes.node_of(plane.data.materials[0])
    node.uv_map = "Second"
    return node


@pytest.mark.parametrize("uv_map", ["", "UVMap", "Second"])
def test_an_image_of_ones_own_is_filled_by_the_map_of_blenders_bake(uv_map):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    node = with_second_map(plane)
    image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    options = {"uv_layer": uv_map} if uv_map else {}
    assert bpy.ops.object.bake(type="COMBINED", **options) == {"FINISHED"}
    assert state.lines() == []
    filled = scenes.pixels(image)
    node.uv_map, node.image = uv_map or "UVMap", bpy.data.images.new("Shown", 32, 32, float_buffer=True)
    expected = scenes.bake(plane)[0]
    inside = filled.any(axis=-1)
    assert inside.mean() == (0.5 if uv_map == "Second" else 1)
    assert filled[inside] == pytest.approx(expected[inside], abs=1e-6)


REFUSED = "Blender's Bake fills the UV map 'UVMap', and the node shows its image by 'Second'."


def test_a_nodes_image_is_refused_by_another_map_than_it_is_shown_by():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    node = with_second_map(plane)
    image = node.image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    message = scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert REFUSED in message
    plane.data.uv_layers.active = plane.data.uv_layers["Second"]
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert scenes.pixels(image)[:, :16].all()


@pytest.mark.parametrize("fault", ["map", "vertices", "none"])
@pytest.mark.parametrize("is_packed", [True, False])
def test_a_nodes_image_keeps_its_bake_where_blenders_own_operator_has_no_result(fault, is_packed):
    """In a window; here the handlers are called as it does."""
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    node = with_second_map(plane)
    image = node.image = add_active_image(plane.data.materials[0])
    before = scenes.bake(plane)[0]
    if not is_packed:
        image.pixels[0] = image.pixels[0]  # as after painting: its file has other pixels
        assert image.is_dirty
    if fault != "map":
        plane.data.uv_layers.active = plane.data.uv_layers["Second"]
    if fault == "vertices":
        plane.data.vertices[0].co.z = np.nan
    active_image._before_bake()
    said = scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert (said == "") == (fault == "none")
    cleared = scenes.pixels(image)
    active_image._after_bake()
    if fault == "none":
        np.testing.assert_array_equal(scenes.pixels(image), cleared)
        assert cleared[:, :16].all()
    else:
        assert not cleared.any()
        np.testing.assert_array_equal(scenes.pixels(image), before)


@pytest.mark.parametrize("is_cleared", [True, False])
def test_a_nodes_image_keeps_its_bake_after_a_script(is_cleared):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    image = with_second_map(plane).image = add_active_image(plane.data.materials[0])
    before = scenes.bake(plane)[0]
    bpy.context.scene.render.bake.use_clear = is_cleared
    assert REFUSED in scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(scenes.pixels(image), before)
    plane.data.uv_layers.active = plane.data.uv_layers["Second"]
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    bpy.context.view_layer.update()
    assert scenes.pixels(image)[:, :16].all()


def test_a_bad_map_of_the_node_does_not_matter_to_an_image_of_ones_own():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    with_second_map(plane)
    plane.data.uv_layers["Second"].data.foreach_set("uv", np.float32(np.multiply(scenes.SQUARE_UVS, 3)).ravel())
    image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    assert scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED")) == ""
    assert scenes.pixels(image).all()


@pytest.mark.parametrize("is_chosen", [False, True], ids=["by the bake", "by the node"])
def test_the_button_refuses_a_nodes_image_by_another_map_before_blender_clears_it(is_chosen):
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    node = with_second_map(plane)
    image = node.image = add_active_image(plane.data.materials[0])
    before = scenes.bake(plane)[0]
    assert before[:, :16].all()
    if not is_chosen:
        node.uv_map = ""
    assert REFUSED in scenes.messages_of(bpy.ops.beamspread.bake_active)
    assert any(REFUSED in reason for reason in refusals(bpy.context).values())
    np.testing.assert_array_equal(scenes.pixels(image), before)


def test_a_copy_of_the_nodes_map_is_the_same_map():
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(40, 30)
    plane.data.uv_layers.new(name="Copy")
    node = scenes.node_of(plane.data.materials[0])
    node.uv_map, node.image = "Copy", add_active_image(plane.data.materials[0])
    scenes.select(plane)
    for bake in (bpy.ops.object.bake, bpy.ops.beamspread.bake_active):
        assert scenes.messages_of(bake) == ""
        assert scenes.pixels(node.image).all()


class Stopping:
    """An engine whose user presses Esc."""

    def __init__(self, real):
        self._real = real

    def __getattr__(self, name):
        return getattr(self._real, name)

    def test_break(self):
        return True


def test_esc_reaches_the_evaluation_of_nodes(monkeypatch):
    plane = scenes.add_plane(material=scenes.add_material(shader=True))
    scenes.add_sun()
    add_active_image(plane.data.materials[0])
    scenes.select(plane)
    bake = engine.bake_active_image
    monkeypatch.setattr(engine, "bake_active_image", lambda real, *rest: bake(Stopping(real), *rest))
    monkeypatch.setattr(BakeJob, "run", lambda *_: pytest.fail("a job has run"))
    scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert state.status_of(Target("Plane", "Medium")).status == Status.CANCELLED


def test_two_objects_with_an_image_each():
    planes = [scenes.add_plane(name, material=scenes.add_material(name)) for name in "AB"]
    planes[1].location.x = 5
    scenes.add_sun(0)
    images = [add_active_image(plane.data.materials[0], plane.name, (16, 24)) for plane in planes]
    scenes.select(*planes)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert (scenes.pixels(images[0]) > 0).all()
    assert scenes.pixels(images[1]) == pytest.approx(scenes.pixels(images[0]), abs=1e-5)


def test_two_materials_of_one_object_fill_their_images():
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]
    corner = scenes.add_mesh("Corner", vertices, [(0, 1, 2, 3), (0, 3, 4, 5)], uvs=[(0, 0), (1, 0), (1, 1), (0, 1)] * 2)
    for index in range(2):
        material = scenes.add_material(f"Side {index}", albedo=(0.9, 0.9, 0.9), mean_free_path=(0.002,) * 3)
        corner.data.materials.append(material)
        corner.data.polygons[index].material_index = index
    scenes.add_sun(30, 180)
    bpy.context.scene.beamspread.quality = "final"
    images = [add_active_image(material, material.name) for material in corner.data.materials]
    scenes.select(corner)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert state.lines() == []
    # The sun meets the floor at 30 degrees and the wall at 60: totals as in test_reflectance.py, and to its tolerance.
    for image, angle in zip(images, (30, 60)):
        expected = scenes.diffuse_reflectance(1.0, 0.8, 0.9, angle) * math.cos(math.radians(angle)) / math.pi
        assert scenes.pixels(image)[16, 16, 0] == pytest.approx(expected, rel=0.01)


def test_failure_is_reported_and_does_not_touch_the_rest():
    plane = scenes.add_plane(material=scenes.add_material(albedo=(1.0, 0.5, 0.5)))
    scenes.add_sun(0)
    add_active_image(plane.data.materials[0])
    scenes.select(plane)
    scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert len(state.lines()) == 1
    assert "albedo's red is 1" in state.lines()[0]
    scenes.node_of(plane.data.materials[0]).albedo = (0.5, 0.5, 0.5)
    bpy.ops.object.bake(type="COMBINED")
    assert state.lines() == []


@pytest.mark.parametrize("is_active", [True, False])
def test_a_texture_of_the_node_is_not_baked_to(is_active):
    """Blender bakes to the first image texture where none is active, and clears it before it asks."""
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    material = plane.data.materials[0]
    texture = add_active_image(material)
    texture.pixels.foreach_set([0.5] * len(texture.pixels))
    texture.pack()
    source = material.node_tree.nodes.active
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], source.outputs["Color"])
    if not is_active:
        material.node_tree.nodes.active = scenes.node_of(material)
    scenes.select(plane)
    scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert "would erase the active image" in state.lines()[0]
    bpy.context.view_layer.update()  # as every operator does
    assert np.array_equal(scenes.pixels(texture), np.full((32, 32, 3), 0.5))


def test_plain_material_is_refused():
    plane = scenes.add_plane(material=bpy.data.materials.new("Plain"))
    plane.data.materials[0].use_nodes = True
    add_active_image(plane.data.materials[0])
    scenes.select(plane)
    scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert "Beamspread node" in state.lines()[-1]


def test_viewport_hidden_caster_and_modifiers_render():
    plane = scenes.add_plane(material=scenes.add_material())
    roof = scenes.add_plane("Roof", size=(9, 9), matrix=Matrix.Translation((0, 0, 1)))
    roof.hide_viewport = True
    scenes.add_sun(0)
    image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    bpy.ops.object.bake(type="COMBINED")
    assert np.array_equal(scenes.pixels(image), np.zeros((32, 32, 3)))


def test_panels_of_blender_know_the_engine():
    names = ["MATERIAL_PT_preview", "RENDER_PT_color_management", "RENDER_PT_output", "RENDER_PT_format"]
    for name in names:
        assert "BEAMSPREAD" in getattr(bpy.types, name).COMPAT_ENGINES


def test_its_own_bake_is_known_of_in_the_image_that_the_node_shows(tmp_path):
    """And not where another image is active; known again when the file is opened."""
    plane = scenes.add_plane(material=scenes.add_material())
    sun = scenes.add_sun(0)
    image = add_active_image(plane.data.materials[0])
    scenes.select(plane)
    bpy.ops.object.bake(type="COMBINED")
    assert row().status == Status.NEVER
    scenes.node_of(plane.data.materials[0]).image = image
    bpy.ops.object.bake(type="COMBINED")
    assert row().status == Status.BAKED
    sun.data.energy = 3
    bpy.context.view_layer.update()
    assert row().status == Status.STALE
    sun.data.energy = 1
    image.pack()
    scenes.reopen(tmp_path)
    assert row().status == Status.BAKED


def row():
    stale.refresh(bpy.context)
    return state.rows[Target("Plane", "Medium")]


def test_the_panel_names_the_image_that_blenders_own_bake_fills():
    material = scenes.add_material()
    assert target_of_blender(None) == target_of_blender(material)
    assert target_of_blender(material).startswith("Select an Image Texture node")
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Filled", 4, 4)
    material.node_tree.nodes.active = texture
    assert target_of_blender(material) == "Fills 'Filled', the image of the selected Image Texture node."


class TestBakeActiveImage:
    """The button refuses beforehand what Blender would clear."""

    @pytest.fixture
    def texture(self):
        """Gray pixels in memory alone, which nothing brings back once Blender has cleared them."""
        plane = scenes.add_plane(material=scenes.add_material(shader=True))
        scenes.add_sun(0)
        texture = add_active_image(plane.data.materials[0])
        texture.pixels.foreach_set([0.5] * len(texture.pixels))
        scenes.select(plane)
        return texture

    def refusal(self, texture):
        """What the operator says; the panel shows the same, and the pixels are as before."""
        said = scenes.messages_of(bpy.ops.beamspread.bake_active)
        assert " ".join(dict.fromkeys(refusals(bpy.context).values())) in said
        assert np.array_equal(scenes.pixels(texture), np.full((32, 32, 3), 0.5))
        return said

    def link(self, texture, name, reader=None):
        material = bpy.data.materials["Medium"]
        source = next(node for node in material.node_tree.nodes if getattr(node, "image", None) == texture)
        reader = reader or scenes.node_of(material)
        material.node_tree.links.new(reader.inputs[name], source.outputs["Color"])

    def test_fills_an_image_that_nothing_reads(self, texture):
        assert bpy.ops.beamspread.bake_active() == {"FINISHED"}
        assert (scenes.pixels(texture) != 0.5).all()

    @pytest.mark.parametrize("name", ["Base Color", "Roughness"])
    def test_refuses_a_texture_of_the_node(self, texture, name):
        self.link(texture, name)
        assert "a texture of the Beamspread node" in self.refusal(texture)

    def test_refuses_a_texture_of_the_former_shader(self, texture):
        material = bpy.data.materials["Medium"]
        bsdf = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        self.link(texture, "Base Color", bsdf)
        scenes.bake(bpy.data.objects["Plane"])
        assert "the former shader" in self.refusal(texture)

    def test_refuses_a_texture_at_the_input_of_a_group(self, texture):
        material = scenes.add_group_material()
        bpy.data.objects["Plane"].data.materials[0] = material
        groups = bpy.data.node_groups
        inner = groups["Inner"]
        node = next(node for node in inner.nodes if node.bl_idname == "BeamspreadNode")
        outer = material.node_tree.nodes
        source = outer.new("ShaderNodeTexImage")
        source.image = texture
        for tree, child in ((groups["Outer"], inner), (material.node_tree, groups["Outer"])):
            add_sockets(child, "NodeSocketColor", inputs=["Color"])
            holder = next(node for node in tree.nodes if getattr(node, "node_tree", None) == child)
            given = child.nodes.new("NodeGroupInput")
            target = (
                node.inputs["Base Color"]
                if child == inner
                else next(node.inputs["Color"] for node in child.nodes if getattr(node, "node_tree", None) == inner)
            )
            child.links.new(target, given.outputs["Color"])
            if tree == material.node_tree:
                tree.links.new(holder.inputs["Color"], source.outputs["Color"])
        assert "a texture of the Beamspread node" in self.refusal(texture)

    def test_refuses_objects_whose_images_it_could_only_clear(self, texture):
        plain = Nodes(bpy.data.materials.new("Plain")).owner
        bpy.data.objects["Plane"].data.materials.append(plain)
        bpy.data.objects["Plane"].data.materials.pop(index=0)
        source = plain.node_tree.nodes.new("ShaderNodeTexImage")
        source.image = texture
        assert "'Plain' of 'Plane' has no Beamspread node" in self.refusal(texture)

    def test_refuses_tiles(self, texture):
        texture.source = "TILED"
        assert "UDIM tiles" in scenes.messages_of(bpy.ops.beamspread.bake_active)

    @pytest.mark.parametrize("is_packed", [True, False])
    def test_pixels_come_back_where_blenders_own_operator_ran(self, texture, is_packed):
        """In a window; here the handlers are called as it does."""
        self.link(texture, "Base Color")
        if is_packed:
            texture.pack()
        active_image._before_bake()
        scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
        assert not scenes.pixels(texture).any()
        assert "reload" not in state.lines()[0]
        active_image._after_bake()
        assert np.array_equal(scenes.pixels(texture), np.full((32, 32, 3), 0.5))
        assert texture.is_dirty != is_packed

    @pytest.mark.parametrize(("is_packed", "is_cleared"), [(True, True), (True, False), (False, False)])
    def test_pixels_come_back_after_a_script(self, texture, is_packed, is_cleared):
        """Packed pixels, as those of files, and those that Blender has not cleared first."""
        self.link(texture, "Base Color")
        if is_packed:
            texture.pack()
        bpy.context.scene.render.bake.use_clear = is_cleared
        said = scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
        assert "no file has its pixels" not in said
        bpy.context.view_layer.update()
        assert np.array_equal(scenes.pixels(texture), np.full((32, 32, 3), 0.5))
        assert active_image._after_script not in bpy.app.handlers.depsgraph_update_post

    def test_a_script_hears_that_pixels_are_lost(self, texture):
        self.link(texture, "Base Color")
        bpy.context.scene.render.bake.use_clear = True
        said = scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
        assert "Blender has cleared it, and no file has its pixels" in said

    def test_textures_that_another_engine_would_replace_are_named(self, texture):
        assert textures_at_risk(bpy.context) == []
        self.link(texture, "Base Color")
        (sentence,) = textures_at_risk(bpy.context)
        assert sentence == f"Bake replaces '{texture.name}', a texture of the Beamspread node in 'Medium'."
        bpy.context.scene.render.engine = "CYCLES"
        layout = panel_layout.Layout()
        drawn = SimpleNamespace(layout=layout)
        panels._warn_of_cycles(drawn, panel_layout.context())
        assert "'Medium'" in layout.said
