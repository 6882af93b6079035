"""How targets stand: never baked, baked, out of date and why, failed; what the panels and Bake Out of Date go by."""

import bpy
import pytest
from beamspread.blender.jobs import stale
from beamspread.blender.jobs.state import Standing, state
from beamspread.core.bake.runner import Target
from mathutils import Matrix
from scenes import add_blocker, add_material, add_plane, add_sun, bake, messages_of, node_of, pixels, select

PLANE = Target("Plane", "Medium")


def row(target=PLANE):
    stale.refresh(bpy.context)
    return state.rows[target]


def update():
    bpy.context.view_layer.update()


@pytest.fixture
def plane():
    """Baked under a sun, beside a wall."""
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material())
    add_sun(20)
    add_blocker(1.0)
    assert row().standing == Standing.NEVER
    bake(plane)
    assert row().standing == Standing.BAKED
    return plane


def vertex(_plane):
    mesh = bpy.data.objects["Wall"].data
    mesh.vertices[2].co.z = 3
    mesh.update()


def own_uvs(plane):
    plane.data.uv_layers[0].data[0].uv = (0.1, 0.1)
    plane.data.update()


def world(_plane):
    bpy.context.scene.world = bpy.data.worlds.new("Grey")


def see_through(_plane):
    material = bpy.data.materials.new("Veil")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5
    bpy.data.objects["Wall"].data.materials.append(material)


def modifier(_plane):
    bpy.data.objects["Wall"].modifiers.new("Thick", "SOLIDIFY").thickness = 0.1


CHANGES = {
    "lamp": (lambda _: setattr(bpy.data.lights["Sun"], "energy", 3.0), "lights"),
    "lamp turned": (lambda _: setattr(bpy.data.objects["Sun"], "rotation_euler", (0, 0.5, 0)), "lights"),
    "another lamp": (lambda _: add_sun(50), "lights"),
    "hidden lamp": (lambda _: setattr(bpy.data.objects["Sun"], "hide_render", True), "lights"),
    "occluder moved": (lambda _: setattr(bpy.data.objects["Wall"].location, "x", 0.3), "other objects"),
    "occluder's mesh": (vertex, "other objects"),
    "occluder's modifier": (modifier, "other objects"),
    "occluder's material": (see_through, "other objects"),
    "receiver moved": (lambda plane: setattr(plane.location, "z", 0.1), "object"),
    "receiver's UVs": (own_uvs, "object"),
    "node": (lambda plane: setattr(node_of(plane.data.materials[0]), "ior", 1.3), "material"),
    "world": (world, "world"),
    "setting": (lambda _: setattr(bpy.context.scene.beamspread, "samples", 2), "settings"),
    "size": (lambda plane: node_of(plane.data.materials[0]).image.scale(16, 16), "size of the image"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_a_bake_read_makes_it_stale(plane, name):
    change, part = CHANGES[name]
    change(plane)
    update()
    assert row().is_stale
    assert row().standing == Standing.STALE
    assert part in row().sentences[0]


def test_what_it_did_not_read_does_not(plane):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.collection.objects.link(camera)
    camera.location = 1, 2, 3
    select(bpy.data.objects["Wall"])
    scene = bpy.context.scene
    scene.render.resolution_x, scene.frame_current = 100, 5
    scene.beamspread.resolution = 64  # of images that are still to be made
    plane.data.materials[0].node_tree.nodes.new("ShaderNodeValue")
    node_of(plane.data.materials[0]).location.x = 9
    bpy.data.objects["Wall"].name = "Pane"
    update()
    assert row().standing == Standing.BAKED
    plane.location.x = 1
    update()
    assert row().is_stale
    plane.location.x = 0
    update()
    assert not row().is_stale


def test_bakes_of_other_objects_do_not(plane):
    """Each other's images and links don't count, nor does a bake of one undo the other's."""
    other = add_plane("Other", matrix=Matrix.Translation((5, 0, 0)), material=add_material("Second"))
    update()
    assert row().standing == Standing.STALE
    bake(plane)
    before = node_of(other.data.materials[0]).image
    bake(other)
    assert (before, row().standing) == (None, Standing.BAKED)
    assert row(Target("Other", "Second")).standing == Standing.BAKED


def test_only_what_is_stale_is_baked_again(plane):
    other = add_plane("Other", matrix=Matrix.Translation((0, 0, -5)), material=add_material("Second"))
    bake(plane, other)
    assert "Nothing is out of date" in messages_of(lambda: bpy.ops.beamspread.bake(objects="STALE"))
    node_of(other.data.materials[0]).albedo = (0.2, 0.2, 0.2)
    images = [node_of(one.data.materials[0]).image for one in (plane, other)]
    for image in images:
        values = [0.5] * len(image.pixels)
        image.pixels.foreach_set(values)
        image.pack()
    assert bpy.ops.beamspread.bake(objects="STALE") == {"FINISHED"}
    assert (pixels(images[0]) == 0.5).all()
    assert not (pixels(images[1]) == 0.5).any()
    assert not row(Target("Other", "Second")).is_stale


def test_it_is_known_after_loading_and_undo(plane, tmp_path):
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.data.lights["Sun"].energy = 5.0
    update()
    assert row().is_stale
    bpy.ops.wm.open_mainfile(filepath=path)
    assert row().standing == Standing.BAKED
    bpy.data.lights["Sun"].energy = 5.0
    update()
    assert row().sentences == ("Changed since its bake: lights.",)


def test_painting_in_the_image(plane):
    image = node_of(plane.data.materials[0]).image
    image.pixels.foreach_set([0.5] * len(image.pixels))
    image.update()
    assert "pixels of the image" in row().sentences[0]


def test_a_copy_with_the_same_image_was_never_baked(plane):
    copy = plane.copy()
    copy.location.x = 9
    bpy.context.collection.objects.link(copy)
    assert row(Target(copy.name, "Medium")).standing == Standing.NEVER


def test_dark_is_a_warning_that_stays_with_the_image(tmp_path):
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material())
    add_sun(180)
    bake(plane)
    assert row().standing == Standing.WARNED
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert row().standing == Standing.WARNED
    assert "All lights are behind 'Plane'" in row().sentences[0]


def test_failures_stand_beside_what_was_baked_before(plane):
    plane.hide_render = True
    select(plane)
    assert "hidden from render" in messages_of(bpy.ops.beamspread.bake)
    assert row().standing == Standing.FAILED
    assert "hidden from render" in row().sentences[0]
    plane.hide_render = False
    bake(plane)
    assert row().standing == Standing.BAKED


def test_it_costs_little_to_look(plane):
    """Meshes are hashed once, not at each look."""
    hashed = []
    original = stale.fingerprints._shape
    stale.fingerprints._shape = lambda obj, depsgraph: hashed.append(obj.name) or original(obj, depsgraph)
    try:
        row()
        bpy.data.objects["Sun"].location.x = 3
        bpy.data.objects["Wall"].location.x = 3
        update()
        row()
        assert hashed == []
        vertex(plane)
        update()
        row()
        assert hashed == ["Wall"]
    finally:
        del stale.fingerprints._shape
