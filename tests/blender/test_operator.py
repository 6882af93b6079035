"""The Bake operator fills and links images, reports targets that it cannot bake, and bakes the others."""

import stat
from dataclasses import replace
from pathlib import Path

import beamspread
import bpy
import numpy as np
import pytest
from beamspread.blender.jobs.run.bake_run import BakeThread
from beamspread.blender.jobs.state import state
from beamspread.blender.settings import BeamspreadSettings
from beamspread.core.bake.bake_settings import COMBINED
from beamspread.core.bake.layers import LAYERS
from beamspread.core.bake.runner import CANCELLED, Bake
from beamspread.core.native import native
from beamspread.core.progress import Progress
from beamspread.core.scene.illumination import Illumination
from beamspread.core.target import Target
from mathutils import Matrix
from scenes import (
    add_material,
    add_mesh,
    add_plane,
    add_sun,
    bake,
    file_image,
    image_of,
    messages_of,
    node_of,
    pixels,
    reopen,
    run_batch,
    select,
)


@pytest.fixture(autouse=True)
def small():
    bpy.context.scene.beamspread.resolution = 32


def surface_source(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_socket


def test_first_bake_makes_links_and_packs_an_image():
    plane = add_plane(size=(4, 2), material=add_material())
    add_sun(30)
    (texture,) = bake(plane)
    node = node_of(plane.data.materials[0])
    assert texture.shape == (16, 32, 3)
    assert node.image.is_float
    node.image.reload()
    # Packed pixels, as half floats: 11 bits.
    assert pixels(node.image) == pytest.approx(texture, rel=2**-11)
    assert node.node_tree.nodes["Image"].image == node.image
    assert surface_source(plane.data.materials[0]) == node.outputs["BSDF"]


def test_image_survives_saving_with_all_its_range(tmp_path):
    plane = add_plane(material=add_material(albedo=(0.99, 0.5, 0.0)))
    add_sun(0, strength=50.0)
    (before,) = bake(plane)
    assert before.max() > 2.5
    reopen(tmp_path)
    node = node_of(bpy.data.materials["Medium"])
    assert pixels(node.image) == pytest.approx(before, rel=1e-3, abs=1e-3)
    assert node.node_tree.nodes["Image"].image == node.image


def test_baking_again_replaces_the_pixels():
    plane = add_plane(material=add_material())
    sun = add_sun(0)
    (first,) = bake(plane)
    image = node_of(plane.data.materials[0]).image
    sun.data.energy = 2.0
    (second,) = bake(plane)
    assert node_of(plane.data.materials[0]).image == image
    assert second == pytest.approx(2 * first, rel=1e-5)


def test_an_artists_own_use_of_the_node_is_kept():
    material = add_material(shader=True)
    tree = material.node_tree
    principled = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    tree.links.new(principled.inputs["Base Color"], node_of(material).outputs["Color"])
    plane = add_plane(material=material)
    add_sun(0)
    bake(plane)
    assert surface_source(material).node == principled


def test_file_image_is_written_to_its_file(tmp_path):
    path = tmp_path / "target.exr"
    image = file_image(path, 24, 20)
    plane = add_plane(material=add_material(image=image, albedo=(0.99, 0.9, 0.0)))
    add_sun(0, strength=20.0)
    (shown,) = bake(plane)
    stored, channels, _ = native.read_exr(str(path))
    assert channels == ["R", "G", "B"]
    assert stored.shape == (20, 24, 3)
    assert stored.max() > 1
    assert shown == pytest.approx(stored)


def test_byte_image_gets_encoded_values(tmp_path):
    image = bpy.data.images.new("Bytes", 16, 16)
    plane = add_plane(material=add_material(albedo=(0.9,) * 3))
    add_sun(0, strength=2.0)
    (linear,) = bake(plane)
    node_of(plane.data.materials[0]).image = image
    (encoded,) = bake(plane)
    expected = 1.055 * linear[16, 16, 0] ** (1 / 2.4) - 0.055
    assert encoded[8, 8, 0] == pytest.approx(expected, abs=0.01)


def test_selected_objects_or_all_where_none_has_the_node():
    first = add_plane("First", material=add_material("One"))
    second = add_plane("Second", material=add_material("Two"))
    bystander = add_plane("Bystander", matrix=Matrix.Translation((9, 0, 0)))
    add_sun(0)
    select(second)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert node_of(first.data.materials[0]).image is None
    select(bystander)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    # They lie in the same place.
    one, other = (pixels(node_of(plane.data.materials[0]).image) for plane in (first, second))
    assert np.array_equal(one, other)
    assert (one > 0).all()


def test_hidden_in_viewport_is_baked_and_restored():
    plane = add_plane(material=add_material())
    add_sun(0)
    (open_air,) = bake(plane)
    wall = add_plane("Roof", matrix=Matrix.Translation((0, 0, 1)), size=(9, 9))
    wall.hide_viewport = True
    (dark,) = bake(plane)
    assert not dark.any()
    assert wall.hide_viewport
    wall.hide_render = True
    (lit,) = bake(plane)
    assert np.array_equal(lit, open_air)
    wall.hide_render, wall.visible_shadow, wall.hide_viewport = False, False, False
    (lit,) = bake(plane)
    assert np.array_equal(lit, open_air)


def test_collection_hidden_in_viewport_casts_shadows():
    plane = add_plane(material=add_material())
    add_sun(0)
    (open_air,) = bake(plane)
    roof = add_plane("Roof", matrix=Matrix.Translation((0, 0, 1)), size=(9, 9))
    collection = bpy.data.collections.new("Roofs")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(roof)
    bpy.context.scene.collection.objects.unlink(roof)
    collection.hide_viewport = True
    (dark,) = bake(plane)
    assert not dark.any()
    assert collection.hide_viewport
    bpy.context.view_layer.layer_collection.children["Roofs"].exclude = True
    (lit,) = bake(plane)
    assert np.array_equal(lit, open_air)


def test_instances_and_modifiers_cast_shadows():
    plane = add_plane(material=add_material())
    add_sun(0)
    (open_air,) = bake(plane)
    collection = bpy.data.collections.new("Roofs")
    roof = add_plane("Roof", size=(9, 9))
    bpy.context.scene.collection.objects.unlink(roof)
    collection.objects.link(roof)
    instance = bpy.data.objects.new("Instance", None)
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    instance.location.z = 1
    bpy.context.scene.collection.objects.link(instance)
    (dark,) = bake(plane)
    assert not dark.any()
    roof.modifiers.new("Shrink", "SOLIDIFY")
    roof.scale = (1e-3, 1e-3, 1e-3)
    (lit,) = bake(plane)
    # The remaining strip, a centimetre wide, meets one of the 16 samples of a texel at most.
    assert lit == pytest.approx(open_air, rel=1 / 16)


def test_two_objects_share_an_image_side_by_side():
    image = bpy.data.images.new("Atlas", 32, 16, float_buffer=True)
    material = add_material(image=image)
    left = add_plane("Left", uvs=[(0, 0), (0.5, 0), (0.5, 1), (0, 1)], material=material)
    right = add_plane("Right", uvs=[(0.5, 0), (1, 0), (1, 1), (0.5, 1)], material=material)
    right.location.x = 5
    add_sun(0)
    bake(left, right)
    assert (pixels(image)[:, :, 0] > 0).all()


def test_two_round_tables_share_an_image():
    """Whole, and with margins that continue them, although each lies in the corners of the other's margin."""
    image = bpy.data.images.new("Atlas", 128, 64, float_buffer=True)
    material = add_material(image=image, mean_free_path=(0.002,) * 3)
    angles = 2 * np.pi * np.arange(32) / 32
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    charts = [0.5 + 0.49 * circle * [0.5, 1] + [shift, 0] for shift in (-0.25, 0.25)]
    tables = [
        add_mesh(name, [(x, y, 0) for x, y in circle.tolist()], [tuple(range(32))], uvs=uvs)
        for name, uvs in zip(("Left", "Right"), charts)
    ]
    tables[1].location.x = 5
    for table in tables:
        table.data.materials.append(material)
    add_sun(30, 20)
    margin = bpy.context.scene.beamspread.margin = 4
    alone = [bake(table)[0] for table in tables]
    together = bake(*tables)[0]
    counts = np.array([32], np.uint32)
    coverages = [native.coverage(uvs * [128, 64], counts, 128, 64) for uvs in charts]
    for coverage, texture in zip(coverages, alone):
        assert np.array_equal(together[coverage > 0], texture[coverage > 0])
    beside = (coverages[0] == 0) & (coverages[1] == 0)
    # Means of texels wholly inside lie between their extremes; texels beyond the margin are empty.
    inside = together[(coverages[0] > 0.99) | (coverages[1] > 0.99)]
    filled = beside & together.any(axis=-1)
    assert (together[filled] >= 0.999 * inside.min(axis=0)).all()
    assert (together[filled] <= 1.001 * inside.max(axis=0)).all()
    y, x = np.mgrid[:64, :128] + 0.5
    distance = np.min([np.hypot(x - column, y - 32) for column in (32, 96)], axis=0) - 0.49 * 64
    assert filled[beside & (distance < margin - 1)].all()
    assert not filled[distance > np.sqrt(2) * (margin + 1)].any()


def test_two_objects_on_the_same_part_of_an_image():
    material = add_material(image=bpy.data.images.new("Shared", 16, 16, float_buffer=True))
    planes = [
        add_plane("A", material=material),
        add_plane("B", matrix=Matrix.Translation((5, 0, 0)), material=material),
    ]
    add_sun(0)
    select(*planes)
    assert "same part of the image 'Shared'" in messages_of(bpy.ops.beamspread.bake)


def test_objects_of_one_material_share_a_new_image_whatever_their_proportions():
    bpy.context.scene.beamspread.use_size, bpy.context.scene.beamspread.resolution = False, 64
    material = add_material()
    corner, beside = np.array([(0, 0), (0.4, 0), (0.4, 0.4), (0, 0.4)]), (0.5, 0.5)
    square = add_plane("Square", (1, 1), uvs=corner, material=material)
    long = add_plane("Long", (2, 1), Matrix.Translation((5, 0, 0)), corner + beside, material)
    add_sun(0)
    together, _ = bake(square, long)
    assert not any("resized" in line for line in state.lines())
    assert together.shape == (32, 64, 3)  # as the one with the longer side has them, square
    assert together[:12, :24].all()
    assert together[18:28, 34:56].all()
    again, _ = bake(square, long)
    assert np.array_equal(together, again)


@pytest.mark.parametrize("way", ["single user", "atlas"])
def test_objects_of_one_mesh_get_images_by_each_way_out_that_is_named(way):
    first = add_plane("A", material=add_material())
    second = bpy.data.objects.new("B", first.data)
    second.location.x = 5
    bpy.context.collection.objects.link(second)
    add_sun(0)
    select(first, second)
    message = messages_of(bpy.ops.beamspread.bake)
    assert "Give 'B' a material of its own (Object > Relations > Make Single User > Object & Data & Mat" in message
    assert "or make One Atlas for the Selection" in message
    assert "move its UVs" not in message
    if way == "single user":
        select(second)
        bpy.ops.object.make_single_user(object=True, obdata=True, material=True)
    else:
        bpy.ops.beamspread.make_atlas()
    assert messages_of(bpy.ops.beamspread.bake) == ""
    assert (image_of(first) == image_of(second)) == (way == "atlas")


def hidden(plane):
    plane.hide_render = True


def in_hidden_collection(plane):
    collection = bpy.data.collections.new("Hidden")
    collection.hide_render = True
    bpy.context.scene.collection.children.link(collection)
    bpy.context.scene.collection.objects.unlink(plane)
    collection.objects.link(plane)


def setting(name, value):
    def change(plane):
        setattr(node_of(plane.data.materials[0]), name, value)

    return change


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (hidden, "hidden from render"),
        (in_hidden_collection, "hidden from render"),
        (setting("albedo", (0.5, 1.0, 0.5)), "albedo's green is 1"),
        (setting("mean_free_path", (-0.1, 1, 1)), "mean free path's red is -0.1"),
        (setting("anisotropy", 1.5), "anisotropy is 1.5"),
        (setting("ior", 0.5), "IOR is 0.5"),
        (setting("thickness", -1.0), "thickness is -1"),
    ],
)
def test_targets_that_cannot_be_baked_are_reported_and_the_others_are_baked(spoil, words):
    bad = add_plane("Bad", material=add_material("Spoilt"))
    good = add_plane("Good", matrix=Matrix.Translation((5, 0, 0)), material=add_material("Sound"))
    add_sun(0)
    spoil(bad)
    bpy.context.view_layer.update()
    message = messages_of(lambda: bpy.ops.beamspread.bake(objects="ALL"))
    assert "Bad / Spoilt: " in message
    assert words in message
    assert "Traceback" not in message
    assert len(message.strip().splitlines()) == 1
    assert node_of(bad.data.materials[0]).image is None
    assert pixels(node_of(good.data.materials[0]).image).any()


def png_image(folder):
    path = folder / "target.png"
    image = bpy.data.images.new("Target", 8, 8)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)
    return path, bpy.data.images.load(str(path))


def test_image_whose_file_is_gone(tmp_path):
    path, image = png_image(tmp_path)
    plane = add_plane(material=add_material(image=image))
    add_sun(0)
    path.unlink()
    select(plane)
    assert f"has lost its file {path}" in messages_of(bpy.ops.beamspread.bake)


def test_image_whose_file_is_read_only_keeps_it(tmp_path):
    path, image = png_image(tmp_path)
    plane = add_plane(material=add_material(image=image))
    add_sun(0)
    path.chmod(stat.S_IRUSR)
    content = path.read_bytes()
    select(plane)
    assert "read-only" in messages_of(bpy.ops.beamspread.bake)
    assert path.read_bytes() == content
    path.chmod(stat.S_IRUSR | stat.S_IWUSR)


def test_nothing_to_bake():
    select(add_plane())
    assert "No mesh has a material with a Beamspread node" in messages_of(bpy.ops.beamspread.bake)


def test_samples_of_a_folder(tmp_path):
    """Exitance far from the border is the power of the sample, for any anisotropy of the material."""
    image = np.zeros((21, 21))
    image[8:13, 8:13] = 0.02
    for angle in (0, 60):
        beamspread.LdfSample(image, 0.5, angle, 0.9).save(tmp_path / f"{angle}.exr")
    plane = add_plane(size=(2, 2), material=add_material(albedo=(0.9, 0.9, 0.9)))
    add_sun(30, strength=2.0)
    settings = bpy.context.scene.beamspread
    settings.distributions, settings.sample_folder = "ANGULAR", str(tmp_path)
    (luminance,) = bake(plane)
    expected = image.sum() * 0.25 * 2 * np.cos(np.radians(30)) / np.pi
    assert luminance[16, 16] == pytest.approx(expected, rel=1e-3)
    settings.sample_folder = str(tmp_path / "missing")
    select(plane)
    assert "There is no folder of LDF samples" in messages_of(bpy.ops.beamspread.bake)


def test_other_layers_have_images_and_files_beside_the_combined_one(monkeypatch, tmp_path):
    plane = add_plane(material=add_material())
    add_sun(0)
    (combined,) = bake(plane)
    assert combined.max() > 0
    image = node_of(plane.data.materials[0]).image
    plain = BeamspreadSettings.for_bake
    monkeypatch.setattr(BeamspreadSettings, "for_bake", lambda *options: replace(plain(*options), layer="Half"))
    monkeypatch.setitem(LAYERS, "Half", lambda *arguments: [values / 2 for values in LAYERS[COMBINED](*arguments)])
    bake(plane)
    assert pixels(bpy.data.images[f"{image.name} Half"]) == pytest.approx(combined / 2)
    bake(plane)
    assert sorted(one.name for one in bpy.data.images) == ["Plane_Medium", "Plane_Medium Half"]
    assert pixels(image) == pytest.approx(combined)
    report = run_batch("--output", tmp_path)
    assert [Path(one.path).name for one in report.bakes] == ["Plane_Medium_Half.exr"]
    assert native.read_exr(str(tmp_path / "Plane_Medium_Half.exr"))[0] == pytest.approx(combined / 2)


class EndlessJob:
    """Goes on until it is told to stop; `BakeJob` in all that a thread asks of it."""

    illumination = Illumination([])

    def messages(self):
        return []

    def seconds(self):
        return 1.0

    def run(self, progress):
        while progress(0.5):
            pass
        raise beamspread.Cancelled


def test_thread_stops_when_asked():
    thread = BakeThread(Bake(Target("Plane"), EndlessJob()), Progress())
    thread.start()
    thread.progress.cancel()
    thread.join(timeout=10)
    assert not thread.is_alive()
    assert (thread.bake.status, thread.bake.texture) == (CANCELLED, None)


class DeafJob(EndlessJob):
    """Ends without having asked whether to go on."""

    texture = np.ones((2, 2, 3), np.float32)

    def run(self, progress):
        return self

    def is_dark(self):
        return False

    def messages_after(self):
        return []


def test_a_bake_that_ends_after_escape_is_not_stored_either():
    thread = BakeThread(Bake(Target("Plane"), DeafJob()), Progress())
    thread.progress.cancel()
    thread.start()
    thread.join(timeout=10)
    assert (thread.bake.status, thread.bake.texture) == (CANCELLED, None)
