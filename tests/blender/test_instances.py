"""An object that renders only as an instance of a collection is baked there, as if the instance were made real."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.live import timer
from beamspread.blender.node.find import find_bakeable
from beamspread.blender.ui import bake_panel
from beamspread.core.target import Target
from instance_scenes import MIRRORED, SKEWED, WITHIN, add_instancer, add_tile, nest
from live_scenes import live_lines, settle, shown_pixels
from mathutils import Euler, Matrix
from panel_layout import Layout, context

TILE = Target("Tile", "Medium")


@pytest.fixture(autouse=True)
def small():
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.margin = 32, 0
    state.forget()


def bake_it(holder, material=TILE.material_name):
    scenes.select(holder)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    node = scenes.node_of(bpy.data.materials[material])
    found, node.image = scenes.pixels(node.image), None
    return found


def real_mesh(obj, matrix):
    """A copy with all of the place in its vertices: an object's own can't be skewed."""
    copy = obj.copy()
    copy.data = obj.data.copy()
    copy.data.transform(matrix)
    copy.matrix_world = Matrix()
    if np.linalg.det(matrix.to_3x3()) < 0:
        copy.data.flip_normals()
    return copy


def make_real(holder, collection, matrix):
    """Replace the instance by real objects; by name of the originals."""
    found = {}
    for obj in collection.objects:
        found[obj.name] = real_mesh(obj, matrix @ obj.matrix_world)
        bpy.context.scene.collection.objects.link(found[obj.name])
    bpy.data.objects.remove(holder)
    return found


def in_the_scene():
    _, collection = add_tile()
    return add_instancer(collection, SKEWED), collection, SKEWED @ Matrix.Translation(-collection.instance_offset)


def excluded():
    """The collection is the scene's, and excluded from the view layer."""
    holder, collection, matrix = in_the_scene()
    bpy.context.scene.collection.children.link(collection)
    bpy.context.view_layer.layer_collection.children[collection.name].exclude = True
    return holder, collection, matrix


def nested():
    _, collection = add_tile()
    outer, within = nest(collection)
    return add_instancer(outer, SKEWED), collection, SKEWED @ within


@pytest.mark.parametrize("add", [in_the_scene, excluded, nested])
def test_it_is_baked_as_if_made_real(add):
    """Within rounding of the places' product, which moves shadows' borders by as much."""
    holder, collection, matrix = add()
    scenes.add_sun(30, 20)
    ours = bake_it(holder)
    real = make_real(holder, collection, matrix)["Tile"]
    truth = bake_it(real)
    assert truth.min() < 0.6 * truth.max()  # there is a shadow
    np.testing.assert_allclose(ours, truth, rtol=0, atol=1e-5 * truth.max())


def row():
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    return state.rows[TILE]


def move(name):
    bpy.data.objects[name].location.x += 0.1


def move_lamp_within(_):
    bpy.data.objects["Lamp"].location.x += 0.1


def change_offset(_):
    bpy.data.collections["Tiles"].instance_offset = (0, 0, 0)


CHANGES = [
    ("Holder", move, "object, 'Wall', lights"),  # the wall and the lamp stand there, too
    ("Middle", move, "object, 'Wall', lights"),
    ("Tile", move, "object"),
    ("Wall", move, "'Wall'"),
    ("Lamp", move, "lights"),
    ("", change_offset, "object, 'Wall', lights"),
]


@pytest.mark.parametrize(("name", "change", "parts"), CHANGES, ids=[name or "offset" for name, _, _ in CHANGES])
def test_changes_that_make_a_bake_out_of_date(name, change, parts):
    _, collection = add_tile()
    lamp = scenes.add_lamp((0, 0, 3))
    bpy.context.scene.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    holder = add_instancer(nest(collection)[0], SKEWED)
    assert row().status == Status.NEVER
    scenes.select(holder)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert row().status == Status.BAKED
    change(name)
    assert row().messages[0].text == f"Changed since its bake: {parts}."
    assert bpy.ops.beamspread.bake(objects="STALE") == {"FINISHED"}
    assert row().status == Status.BAKED


def test_another_instance_makes_it_out_of_date_and_says_why_it_cannot_be_baked_again():
    _, collection = add_tile()
    scenes.add_sun()
    scenes.select(add_instancer(collection, SKEWED))
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    add_instancer(collection, MIRRORED)
    assert row().status == Status.STALE
    assert "'Tile' has 2 instances" in scenes.messages_of(lambda: bpy.ops.beamspread.bake(objects="STALE"))


def scatter(tile):
    """Five instances as particles, too."""
    plane = scenes.add_plane("Ground")
    plane.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = plane.particle_systems[0].settings
    settings.type, settings.render_type, settings.instance_object, settings.count = "HAIR", "OBJECT", tile, 5


def test_particles_count_as_places():
    tile, collection = add_tile()
    add_instancer(collection, SKEWED)
    scatter(tile)
    scenes.add_sun()
    assert "'Tile' has 6 instances" in scenes.messages_of(lambda: bpy.ops.beamspread.bake(objects="ALL"))


def test_instances_of_other_meshes_under_its_name_are_no_places():
    """Instances made by geometry nodes."""
    tile, collection = add_tile()
    tile.modifiers.new("Scatter", "NODES").node_group = group = scenes.scatter_group(tile)
    tree_info = next(one for one in group.nodes if one.bl_idname == "GeometryNodeObjectInfo")
    cube, points = group.nodes.new("GeometryNodeMeshCube"), tree_info.outputs["Geometry"].links[0].to_node
    cube.inputs["Size"].default_value = (0.01,) * 3
    group.links.new(points.inputs["Instance"], cube.outputs[0])
    group.nodes.remove(tree_info)
    join = group.nodes.new("GeometryNodeJoinGeometry")
    given, result = (next(one for one in group.nodes if one.type == kind) for kind in ("GROUP_INPUT", "GROUP_OUTPUT"))
    for source in (given, group.nodes["Move"]):
        group.links.new(join.inputs[0], source.outputs[0])
    group.links.new(result.inputs[0], join.outputs[0])
    scenes.add_sun(30, 20)
    assert bake_it(add_instancer(collection, SKEWED)).any()


def test_an_instance_that_does_not_render_is_no_place():
    holder, collection, _ = in_the_scene()
    scenes.add_sun(30, 20)
    truth = bake_it(holder)
    add_instancer(collection, MIRRORED).hide_render = True
    scenes.node_of(bpy.data.materials["Medium"]).image = bpy.data.images.new(
        "Former", *truth.shape[1::-1], float_buffer=True
    )
    assert bpy.ops.beamspread.bake(objects="ALL") == {"FINISHED"}
    assert np.array_equal(scenes.pixels(scenes.node_of(bpy.data.materials["Medium"]).image), truth)


def hide(name):
    bpy.data.objects[name].hide_render = True


def hide_collection(name):
    bpy.data.collections[name].hide_render = True


HIDDEN = [(hide, "Holder"), (hide, "Middle"), (hide, "Tile"), (hide_collection, "Tiles"), (hide_collection, "Outer")]


@pytest.mark.parametrize(("change", "name"), HIDDEN, ids=[name for _, name in HIDDEN])
def test_objects_that_do_not_render_are_not_baked(change, name):
    holder, _, _ = nested()
    scenes.add_sun()
    change(name)
    scenes.select(holder)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "'Tile' is hidden from render" in message
    assert "and those of 'Holder' and 'Middle', which shows it, in the Outliner" in message


def hide_in_viewport(name):
    bpy.data.objects[name].hide_viewport = True


def hide_collection_in_viewport(name):
    bpy.data.collections[name].hide_viewport = True


SHOWN = [
    (hide_in_viewport, "Holder"),
    (hide_in_viewport, "Middle"),
    (hide_in_viewport, "Tile"),
    (hide_in_viewport, "Wall"),
    (hide_collection_in_viewport, "Tiles"),
]


@pytest.mark.parametrize(("change", "name"), SHOWN, ids=[name for _, name in SHOWN])
def test_objects_that_the_viewport_hides_are_baked(change, name):
    holder, _, _ = nested()
    scenes.add_sun(30, 20)
    truth = bake_it(holder)
    change(name)
    assert bpy.ops.beamspread.bake(objects="ALL") == {"FINISHED"}
    assert np.array_equal(scenes.pixels(scenes.node_of(bpy.data.materials["Medium"]).image), truth)
    assert [one.hide_viewport for one in (*bpy.data.objects, *bpy.data.collections)].count(True) == 1


def darkest(texture):
    """Away from the border, as part of the brightest."""
    return texture[8:24, 8:24, 0].min() / texture[..., 0].max()


def test_a_wall_that_does_not_render_throws_no_shadow():
    holder, collection, _ = in_the_scene()
    scenes.add_sun(30, 20)
    within = bpy.data.collections.new("Within")
    collection.children.link(within)
    collection.objects.unlink(bpy.data.objects["Wall"])
    within.objects.link(bpy.data.objects["Wall"])
    assert darkest(bake_it(holder)) < 0.7
    within.hide_render = True
    assert darkest(bake_it(holder)) > 0.9
    assert "Wall" in {one.object.name for one in bpy.context.evaluated_depsgraph_get().object_instances}


@pytest.mark.parametrize("names", [[], ["Tile"], ["Holder"], ["Holder", "Tile"]])
def test_a_batch_bakes_it(names, tmp_path):
    holder, _, _ = nested()
    scenes.add_sun(30, 20)
    truth = bake_it(holder)
    chosen = ["--object", *names] if names else []
    report = scenes.run_batch(*chosen, "--output", tmp_path)
    assert [(one.object, one.status) for one in report.bakes] == [("Tile", "written")]
    image = bpy.data.images.load(str(tmp_path / "Tile_Medium.exr"))
    assert np.array_equal(scenes.pixels(image), truth)


def test_a_batch_follows_the_instance(tmp_path):
    holder, _, _ = in_the_scene()
    scenes.add_sun(30, 20)
    holder.rotation_euler = (0, 0, 0)
    for frame, angle in ((1, 0.0), (2, -0.4)):
        holder.rotation_euler.y = angle
        holder.keyframe_insert("rotation_euler", frame=frame)
    report = scenes.run_batch("--output", tmp_path, "--frames", "1-2")
    assert report.all_written()
    one, two = (scenes.pixels(bpy.data.images.load(one.path)) for one in report.bakes)
    assert np.abs(one - two).max() > 0.1 * one.max()
    assert np.array_equal(bake_it(holder), two)


def link_tiles(tmp_path, has_image):
    """An instance of a collection of another file, whose material may have been baked there."""
    add_tile()
    if has_image:
        scenes.node_of(bpy.data.materials["Medium"]).image = bpy.data.images.new("Baked", 4, 4)
    path = str(tmp_path / "library.blend")
    bpy.data.libraries.write(path, {bpy.data.collections["Tiles"]})
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return add_instancer(scenes.load_data(path, link=True, collections=["Tiles"])[0], SKEWED)


@pytest.mark.parametrize("has_image", [False, True])
def test_one_of_another_file_is_refused_unless_it_was_baked_there(has_image, tmp_path):
    scenes.select(link_tiles(tmp_path, has_image))
    scenes.add_sun()
    problems = bake_panel.draw_problems(Layout(), context())
    assert len(problems) == (not has_image)
    message = scenes.messages_of(bpy.ops.beamspread.bake)
    assert all(str(one) in message for one in problems)
    assert ("No mesh has a material" if has_image else "belongs to another .blend file") in message


def use_shared_group(tile):
    material = tile.data.materials[0] = scenes.add_group_material()
    material.copy()  # which has the same group


def instance_again(tile):
    add_instancer(tile.users_collection[0], MIRRORED)


def make_black_holes(tile):
    scenes.node_of(tile.data.materials[0]).albedo = (1, 1, 1)


def hide_within(tile):
    tile.hide_render = True


PROBLEMS = {
    "'Grouped' has one image, but its node group 'Outer'": use_shared_group,
    "The object 'Tile' has 2 instances": instance_again,
    "The albedo's red is 1": make_black_holes,
    "The object 'Tile' is hidden from render": hide_within,
}


@pytest.mark.parametrize("sentence", PROBLEMS)
def test_problems_inside_are_said_in_the_panel_and_by_the_bake(sentence):
    tile, collection = add_tile()
    scenes.add_sun()
    scenes.select(add_instancer(nest(collection)[0], SKEWED))
    assert not bake_panel.draw_problems(Layout(), context())
    PROBLEMS[sentence](tile)
    layout = Layout()
    bake_panel.draw_problems(layout, context())
    assert layout.said.count(sentence) == 1
    assert ("'Tile'" in layout.said) != ("Tile: " in layout.said)  # once, where the sentence does not name it
    assert sentence in scenes.messages_of(bpy.ops.beamspread.bake)


def test_an_object_of_the_scene_is_baked_where_it_stands_itself():
    """Though an instance shows it as well."""
    plane = scenes.add_plane("Tile", material=scenes.add_material())
    collection = bpy.data.collections.new("Tiles")
    collection.objects.link(plane)
    scenes.add_sun(30)
    truth = bake_it(plane)
    add_instancer(collection, Matrix.Translation((0, 0, 9)) @ Euler((0, 0.8, 0)).to_matrix().to_4x4())
    bpy.context.view_layer.update()
    assert find_bakeable(bpy.context.view_layer) == [TILE]
    assert np.array_equal(bake_it(plane), truth)


@pytest.mark.skipif(bpy.app.version < (4, 0, 0), reason="light linking came in Blender 4.0")
def test_light_is_linked_to_the_objects_of_the_instancer():
    holder, _, _ = nested()
    other = scenes.add_plane("Other")
    sun = scenes.add_sun(30, 20)
    truth = bake_it(holder)
    for linked, is_lit in ((holder, True), (other, False)):
        sun.light_linking.receiver_collection = links = bpy.data.collections.new("Links")
        links.objects.link(linked)
        found = bake_it(holder)
        assert np.array_equal(found, truth) if is_lit else not found.any()


def test_indirect_light_is_that_of_real_objects(monkeypatch):
    """Light of a bright wall of the collection and of a card of the scene, with the same random numbers."""
    monkeypatch.setattr("beamspread.core.bake.bounced.NODES", 16)
    holder, collection, matrix = nested()
    bpy.data.objects["Wall"].data.materials.append(scenes.diffuse_material((0.8, 0.1, 0.1)))
    card = scenes.add_plane(
        "Card", (3, 3), matrix @ WITHIN @ Matrix.Translation((0, -1, 1)) @ Matrix.Rotation(1.2, 4, "X")
    )
    card.data.materials.append(scenes.diffuse_material((0.1, 0.8, 0.1)))
    scenes.add_sun(30, 20)
    direct = bake_it(holder)
    bpy.context.scene.beamspread.use_indirect = True
    ours = bake_it(holder)
    truth = bake_it(make_real(holder, collection, matrix)["Tile"])
    bounced = truth - direct
    assert bounced.mean() > 0.03 * direct.mean()
    assert (ours - direct).mean() == pytest.approx(bounced.mean(), rel=0.01)
    np.testing.assert_allclose(ours, truth, rtol=0, atol=0.02 * bounced.max())


def irradiance():
    settings = bpy.context.scene.beamspread.for_bake(output="IRRADIANCE")
    (bake,) = prepare_scene(bpy.context, find_bakeable(bpy.context.view_layer), settings)
    bake.run()
    return bake.texture


def test_cycles_counts_an_instanced_lamp_once():
    """Beside a lamp that it alone understands, whose light it finds with all others switched off."""
    scenes.add_plane(material=scenes.add_material())
    scenes.add_gobo("POINT")
    lamp, collection = scenes.add_lamp((0, 0, 1)), bpy.data.collections.new("Lamps")
    truth = irradiance()
    bpy.context.scene.collection.objects.unlink(lamp)
    collection.objects.link(lamp)
    add_instancer(collection, Matrix())
    np.testing.assert_allclose(irradiance(), truth, rtol=0, atol=0.02 * truth.max())


def test_a_color_by_cycles_is_that_of_real_objects():
    """By coordinates of its own and of the world, in an object that is skewed as it stands."""
    holder, collection, matrix = in_the_scene()
    material = bpy.data.materials["Medium"]
    tree, node = material.node_tree, scenes.node_of(material)
    node.color_mode, node.mean_free_path, node.texture_blur = "BASE_COLOR", (0.001,) * 3, 0.0
    noise, mix = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(mix.inputs[0], tree.nodes.new("ShaderNodeTexCoord").outputs["Object"])
    tree.links.new(mix.inputs[1], tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"])
    tree.links.new(noise.inputs["Vector"], mix.outputs[0])
    tree.links.new(node.inputs["Base Color"], noise.outputs["Color"])
    scenes.add_sun(30, 20)
    ours = bake_it(holder)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.scene.collection.objects.link(parent)
    for obj in collection.objects:
        obj.parent, obj.matrix_parent_inverse = parent, matrix  # which may be skewed
    bpy.data.objects.remove(holder)
    bpy.context.scene.collection.children.link(collection)
    truth = bake_it(bpy.data.objects["Tile"])
    assert truth.std() > 0.1 * truth.mean()
    np.testing.assert_allclose(ours, truth, rtol=0, atol=1e-3 * truth.max())


@pytest.fixture
def live():
    yield
    timer.end()


def test_live_follows_the_instance(live):
    holder, _, _ = nested()
    image = bpy.data.images.new("Target", 64, 64, float_buffer=True, alpha=False)
    material = bpy.data.materials["Medium"]
    node, output = scenes.node_of(material), material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    node.image = image
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    scenes.add_sun(30, 20)
    bpy.context.scene.beamspread.use_live = True
    settle()
    assert live_lines() == []
    before = shown_pixels(material)
    holder.rotation_euler.y += 0.4
    settle()
    after = shown_pixels(material)
    assert np.abs(after - before).max() > 0.05 * before.max()
    bpy.context.scene.beamspread.use_live = False
    timer.step(bpy.context)
    scenes.select(holder)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    np.testing.assert_allclose(after, scenes.pixels(image), rtol=0, atol=0.02 * before.max())
