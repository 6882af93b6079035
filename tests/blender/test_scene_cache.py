"""The cache of the scene: bakes, and the status of targets, after many kinds of changes agree with reading all anew."""

import re
import signal

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import object_digests, stale
from beamspread.blender.jobs.run import bake_plan
from beamspread.blender.jobs.run.batch_run import bake_all
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.read import geometry
from beamspread.blender.read.scene_cache import scene_cache
from beamspread.core.bake.runner import CANCELLED, Bake
from beamspread.core.batch import batch_options
from beamspread.core.batch.stop import Stop
from beamspread.core.native import native
from beamspread.core.target import Target
from instance_scenes import add_instancer
from mathutils import Matrix

PLANE = Target("Plane", "Medium")
POST = (0.08, 0.08)


def add_post(name, x, y, material=None):
    """A small card that stands above the plane and turns to the light."""
    matrix = Matrix.Translation((x, y, 0.3)) @ Matrix.Rotation(1.0, 4, "Y")
    return scenes.add_plane(name, POST, matrix, material=material)


def principled(name, **inputs):
    material = bpy.data.materials.new(name)
    scenes_use_nodes(material)
    for key, value in inputs.items():
        input_of(name, key.replace("_", " ")).default_value = value
    return material


def scenes_use_nodes(owner):
    if bpy.app.version < (5, 0, 0):
        owner.use_nodes = True


def input_of(name, key):
    return next(node for node in bpy.data.materials[name].node_tree.nodes if node.type == "BSDF_PRINCIPLED").inputs[key]


def add_image(material, socket, name):
    """An image of 8 x 8 texels at an input of a material's node."""
    image = bpy.data.images.new(name, 8, 8)
    image.pixels.foreach_set([0.3, 0.3, 0.3, 1.0] * 32 + [0.6, 0.6, 0.6, 1.0] * 32)
    image.pack()
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(socket, node.outputs["Color"])


def link(name, source, socket):
    tree = bpy.data.materials[name].node_tree
    tree.links.new(socket, tree.nodes.new(source).outputs[0])


def emission(name):
    """A glowing material; a Value node in a group gives its strength."""
    material = scenes.diffuse_material((1, 1, 1), name)
    group = bpy.data.node_groups.new("Strength", "ShaderNodeTree")
    if hasattr(group, "interface"):
        group.interface.new_socket("Value", in_out="OUTPUT", socket_type="NodeSocketFloat")
    else:
        group.outputs.new("NodeSocketFloat", "Value")
    value, output = group.nodes.new("ShaderNodeValue"), group.nodes.new("NodeGroupOutput")
    value.outputs[0].default_value = 8.0
    group.links.new(output.inputs[0], value.outputs[0])
    nodes = material.node_tree.nodes
    light, inner = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeGroup")
    inner.node_tree = group
    material.node_tree.links.new(light.inputs["Strength"], inner.outputs[0])
    material.node_tree.links.new(material.node_tree.get_output_node("ALL").inputs["Surface"], light.outputs[0])
    return material


def add_scattered(ground, leaf):
    ground.modifiers.new("Scatter", "NODES").node_group = scenes.scatter_group(leaf)


def add_particles(ground, leaf):
    ground.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = ground.particle_systems[0].settings
    settings.type, settings.render_type, settings.instance_object, settings.count = "HAIR", "OBJECT", leaf, 12
    settings.particle_size = 1.0


@pytest.fixture
def plane(tmp_path):
    """A scene with objects of each kind, baked. Live is on, so that the cache keeps what bakes read."""
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.samples, settings.use_live = 24, 1, True
    plane = scenes.add_plane(material=scenes.add_material())
    add_image(plane.data.materials[0], scenes.node_of(plane.data.materials[0]).inputs["Base Color"], "Bark")
    scenes.add_sun(30)
    wall = scenes.add_blocker(0.6)
    wall.modifiers.new("Thick", "SOLIDIFY").thickness = 0.02
    veil = principled("Veil", Alpha=0.4)
    add_post("Screen", -0.6, 0.5, veil)
    lace = principled("Lace")
    add_image(lace, input_of("Lace", "Alpha"), "Holes")
    add_post("Curtain", -0.6, 0.0, lace)
    add_post("Bulb", -0.6, -0.5, emission("Glow"))
    stones = bpy.data.collections.new("Stones")
    stone = add_post("Stone", 0, 0)
    bpy.context.scene.collection.objects.unlink(stone)
    stones.objects.link(stone)
    add_instancer(stones, Matrix.Translation((0.5, 0.6, 0)))
    leaf = scenes.add_plane("Leaf", (0.1, 0.1), Matrix.Translation((0, 0, 9)))
    add_scattered(scenes.add_plane("Grass", (0.6, 0.6), Matrix.Translation((0.6, -0.5, 0.3))), leaf)
    petal = scenes.add_plane("Petal", (0.06, 0.06), Matrix.Translation((0, 0, 9)))
    add_particles(scenes.add_plane("Bush", (0.3, 0.3), Matrix.Translation((-0.1, -0.7, 0.3))), petal)
    ghost = add_post("Ghost", 0.1, 0.6)
    ghost.hide_viewport = True
    mirrored, axis = add_post("Twin", 0.2, 0.8), bpy.data.objects.new("Axis", None)
    mirrored.modifiers.new("Mirror", "MIRROR").mirror_object = axis
    bpy.context.collection.objects.link(axis)
    bending = add_post("Flag", 0.3, -0.85)
    bending.shape_key_add(name="Flat")
    key = bending.shape_key_add(name="Bent")
    key.data[0].co.x -= 0.2
    for frame in (1, 10):
        key.value = float(frame > 1)
        key.keyframe_insert("value", frame=frame)
    text = bpy.data.objects.new("Sign", bpy.data.curves.new("Sign", "FONT"))
    text.data.body, text.data.size, text.location = "I", 0.3, (-0.2, 0.2, 0.3)
    bpy.context.collection.objects.link(text)
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    scenes_use_nodes(world)
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.1, 0.1, 1)
    bpy.context.scene.frame_set(1)
    bake()
    assert row().status == Status.BAKED, row().messages
    return plane


def bake():
    return scenes.bake(bpy.data.objects["Plane"])[0].copy()


def row():
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    return state.rows[PLANE]


def vertex(name):
    mesh = bpy.data.objects[name].data
    mesh.vertices[2].co.x += 0.3
    mesh.update()


def move(name):
    bpy.data.objects[name].location.x += 0.07


def paint(name):
    image = bpy.data.images[name]
    image.pixels.foreach_set([0.2] * len(image.pixels))
    image.update()


def other_uvs():
    mesh = bpy.data.objects["Plane"].data
    for corner in mesh.uv_layers[0].data:
        corner.uv *= 0.5
    mesh.update()


def group_value():
    bpy.data.node_groups["Strength"].nodes["Value"].outputs[0].default_value = 4.0


def lamp_nodes():
    data = bpy.data.lights["Sun"]
    scenes_use_nodes(data)
    next(node for node in data.node_tree.nodes if node.type == "EMISSION").inputs["Strength"].default_value = 0.5


def other_material():
    bpy.data.objects["Wall"].data.materials.append(bpy.data.materials["Glow"])


def colored_veil():
    input_of("Veil", "Base Color").default_value = (1, 0, 0, 1)


def camera():
    obj = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(obj)


def data(kind, name, attribute, value):
    return lambda: setattr(getattr(bpy.data, kind)[name], attribute, value)


CHANGES = {
    "lamp moved": (lambda: setattr(bpy.data.objects["Sun"], "rotation_euler", (0, 0.2, 0)), "lights"),
    "lamp's color": (data("lights", "Sun", "color", (1, 0.5, 0.2)), "lights"),
    "lamp's nodes": (lamp_nodes, "lights"),
    "lamp hidden": (data("objects", "Sun", "hide_render", True), "lights"),
    "lamp renamed": (data("objects", "Sun", "name", "Star"), ""),
    "wall moved": (lambda: move("Wall"), "other objects"),
    "wall's modifier": (lambda: setattr(bpy.data.objects["Wall"].modifiers[0], "thickness", 0.3), "other objects"),
    "wall's mesh": (lambda: vertex("Wall"), "other objects"),
    "wall without shadow": (data("objects", "Wall", "visible_shadow", False), "other objects"),
    "wall hidden": (data("objects", "Wall", "hide_render", True), "other objects"),
    "wall hidden in the window": (data("objects", "Wall", "hide_viewport", True), ""),
    "wall renamed": (data("objects", "Wall", "name", "Pane"), ""),
    "wall glows": (other_material, "other objects"),
    "transmittance": (lambda: setattr(input_of("Veil", "Alpha"), "default_value", 0.9), "other objects"),
    "color without bounced light": (colored_veil, ""),
    "transmittance painted": (lambda: paint("Holes"), "textures"),
    "transmittance of another node": (lambda: link("Veil", "ShaderNodeValue", input_of("Veil", "Alpha")), "other"),
    "wall unseen, without bounced light": (data("objects", "Wall", "visible_diffuse", False), ""),
    "glow unseen": (data("objects", "Bulb", "visible_diffuse", False), "other objects"),
    "emission in a group": (group_value, "other objects"),
    "node without links": (lambda: bpy.data.materials["Glow"].node_tree.nodes.new("ShaderNodeTexNoise"), ""),
    "world": (
        lambda: setattr(
            bpy.data.worlds["World"].node_tree.nodes["Background"].inputs["Strength"], "default_value", 3.0
        ),
        "world",
    ),
    "no world": (lambda: setattr(bpy.context.scene, "world", None), "world"),
    "texture painted": (lambda: paint("Bark"), "textures"),
    "texture's color space": (
        lambda: setattr(bpy.data.images["Bark"].colorspace_settings, "name", "Non-Color"),
        "textures",
    ),
    "medium": (lambda: setattr(scenes.node_of(bpy.data.materials["Medium"]), "ior", 1.3), "material"),
    "blur of the texture": (
        lambda: setattr(scenes.node_of(bpy.data.materials["Medium"]), "texture_blur", 0.9),
        "material",
    ),
    "method of the texture": (
        lambda: setattr(scenes.node_of(bpy.data.materials["Medium"]), "texture_method", "MULTIPLIED"),
        "material",
    ),
    "receiver moved": (lambda: move("Plane"), "object"),
    "receiver's UVs": (other_uvs, "object"),
    "size of the image": (lambda: scenes.image_of(bpy.data.objects["Plane"]).scale(16, 16), "size of the image"),
    "settings": (lambda: setattr(bpy.context.scene.beamspread, "solver", "direct"), "settings"),
    "instance moved": (lambda: move("Holder"), "other objects"),
    "object in an instance moved": (lambda: move("Stone"), "other objects"),
    "mesh in an instance": (lambda: vertex("Stone"), "other objects"),
    "geometry nodes": (
        lambda: setattr(
            bpy.data.node_groups["Scatter"].nodes["Move"].inputs["Translation"], "default_value", (0.2, 0, 0)
        ),
        "other objects",
    ),
    "mesh scattered by geometry nodes": (lambda: vertex("Leaf"), "other objects"),
    "particles": (lambda: setattr(bpy.data.objects["Bush"].particle_systems[0], "seed", 7), "other objects"),
    "hidden object moved": (lambda: move("Ghost"), "other objects"),
    "hidden object's mesh": (lambda: vertex("Ghost"), "other objects"),
    "hidden object shown": (data("objects", "Ghost", "hide_viewport", False), ""),
    "modifier's object": (lambda: move("Axis"), "other objects"),
    "frame": (lambda: bpy.context.scene.frame_set(10), "other objects"),
    "text": (lambda: setattr(bpy.data.curves["Sign"], "body", "W"), "other objects"),
    "camera": (camera, ""),
    "see-through surfaces in a row": (
        lambda: setattr(bpy.context.scene.cycles, "transparent_max_bounces", 0),
        "settings",
    ),
    "object removed": (lambda: bpy.data.objects.remove(bpy.data.objects["Wall"]), "other objects"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_status_and_a_bake_from_the_cache_agree_with_a_bake_that_reads_all(plane, name):
    change, part = CHANGES[name]
    before = bake()
    change()
    scanned = row()
    assert scanned.is_stale == bool(part), scanned.messages
    # Objects are named there.
    said = re.sub(r"'[^']+'(, '[^']+')*|removed or hidden objects", "other objects", scanned.messages[0].text)
    assert not part or part in said
    warm = bake()
    assert row().status == Status.BAKED, row().messages
    scene_cache.forget()
    np.testing.assert_array_equal(warm, bake())
    assert row().status == Status.BAKED, row().messages
    assert np.array_equal(warm, before) == (not part)


def meshes_read_by_a_bake(monkeypatch):
    """Names of the objects whose meshes a bake has read as occluders."""
    names, local_mesh = [], geometry.local_mesh
    with monkeypatch.context() as patched:
        patched.setattr(geometry, "local_mesh", lambda obj, slots: names.append(obj.name) or local_mesh(obj, slots))
        bake()
    return set(names)


def test_a_bake_reads_only_meshes_that_have_changed_or_that_the_window_hides(plane, monkeypatch):
    move("Wall")
    assert meshes_read_by_a_bake(monkeypatch) == {"Ghost"}
    vertex("Wall")
    assert meshes_read_by_a_bake(monkeypatch) == {"Ghost", "Wall"}
    bpy.context.scene.beamspread.use_live = False
    bake()
    assert "Screen" in meshes_read_by_a_bake(monkeypatch)  # no arrays stay without Live


def test_a_bake_leaves_digests_of_objects_that_the_window_shows(plane, monkeypatch):
    """It shows hidden objects for a moment, and modifiers as they render."""
    names, digest_of_mesh = [], object_digests.digest_of_mesh
    bake()
    monkeypatch.setattr(object_digests, "digest_of_mesh", lambda obj: names.append(obj.name) or digest_of_mesh(obj))
    row()
    assert set(names) <= {"Ghost", "Leaf", "Petal"}  # scattered objects are read once more after any change of a shape


def test_undo_leaves_nothing_of_the_time_after_it(plane):
    before = bake()
    bpy.ops.ed.undo_push(message="before")
    vertex("Wall")
    row()
    bpy.ops.ed.undo_push(message="after")
    assert row().is_stale
    bpy.ops.ed.undo()
    assert not row().is_stale
    bpy.ops.ed.redo()
    assert row().is_stale
    bpy.ops.ed.undo()
    np.testing.assert_array_equal(bake(), before)


def test_another_file_leaves_nothing(plane, tmp_path):
    before, path = bake(), str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    vertex("Wall")
    row()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert row().status == Status.BAKED
    np.testing.assert_array_equal(bake(), before)


def test_scripts_that_remove_handlers_and_data(plane):
    """The cache reads everything again, since no handler tells it of changes."""
    handlers = bpy.app.handlers.depsgraph_update_post
    functions = [*handlers]
    handlers.clear()
    try:
        vertex("Wall")
        assert row().is_stale
        bpy.data.images.remove(bpy.data.images["Holes"])
        bpy.data.materials.remove(bpy.data.materials["Glow"])
        warm = bake()
        assert row().status in (Status.BAKED, Status.WARNED)
    finally:
        handlers.extend(functions)
    scene_cache.forget()
    np.testing.assert_array_equal(bake(), warm)


@pytest.mark.parametrize("is_excluded", [True, False])
def test_members_of_collections_of_light_linking(plane, is_excluded):
    sun = bpy.data.objects["Sun"]
    if not hasattr(sun, "light_linking"):
        pytest.skip("light linking came in Blender 4.0")
    collection = bpy.data.collections.new("Shadows")
    sun.light_linking.blocker_collection = collection
    bake()
    assert row().status == Status.BAKED
    collection.objects.link(bpy.data.objects["Wall"])
    if is_excluded:
        collection.collection_objects[0].light_linking.link_state = "EXCLUDE"
    assert "lights" in row().messages[0].text


def test_all_of_a_material_counts_where_light_bounces_from_it_and_whether_rays_see_it(plane):
    bpy.context.scene.beamspread.use_indirect = True
    keep_present_digests()
    colored_veil()
    assert row().messages[0].text == "Changed since its bake: 'Screen'."
    keep_present_digests()
    bpy.data.objects["Wall"].visible_diffuse = False
    assert row().messages[0].text == "Changed since its bake: 'Wall'."
    keep_present_digests()
    scenes.node_of(scenes.add_plane("Tile", material=scenes.add_material("Second")).data.materials[0]).ior = 1.2
    keep_present_digests()
    scenes.node_of(bpy.data.materials["Second"]).ior = 1.4
    assert row().messages[0].text == "Changed since its bake: 'Tile'."


def keep_present_digests():
    """Record the digests of the present scene, as a bake does."""
    bpy.context.view_layer.update()
    stale.keep(Bake(PLANE), stale.parts_of(bpy.context, [PLANE])[PLANE])
    assert row().status == Status.BAKED


def cancel():
    raise native.Cancelled("stopped")


def test_a_cancelled_evaluation_is_a_cancelled_bake(plane):
    plans = bake_plan.read_scene(bpy.context, [PLANE], check=cancel)
    bake = plans[0].bake(bpy.context.scene.beamspread.for_bake())
    assert (bake.status, bake.error) == (CANCELLED, "The bake was cancelled.")
    assert not bpy.data.objects["Ghost"].visible_get()


def test_a_batch_that_is_stopped_while_it_reads_cancels_all_bakes(plane, monkeypatch, tmp_path):
    stop, read_illumination = Stop(), bake_plan.read_illumination

    def asked(*arguments):
        stop.ask(signal.SIGINT)
        return read_illumination(*arguments)

    monkeypatch.setattr(bake_plan, "read_illumination", asked)
    monkeypatch.setattr("signal.signal", lambda *_: None)
    report = bake_all(batch_options.parse(["--output", str(tmp_path)]), stop)
    assert [record.status for record in report.bakes] == [CANCELLED]
    monkeypatch.undo()
    assert row().status == Status.BAKED
    np.testing.assert_array_equal(bake(), bake())
