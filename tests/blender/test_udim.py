"""Images with UDIM tiles: each tile is filled as an image of its own, and light crosses the tiles of one plane."""

import json
import subprocess

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.native import native
from live_scenes import live_lines, settle
from nodes import Nodes

SIZES = {1001: (48, 48), 1002: (64, 64), 1011: (32, 40), 1012: (56, 56)}
MARGIN = 4


@pytest.fixture(autouse=True)
def light(tmp_path):
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin, settings.image_dir = False, MARGIN, str(tmp_path)
    scenes.add_lamp((0.3, -0.4, 1.5), power=200, radius=0.1)
    scenes.add_world((0.2, 0.2, 0.2, 1))


def tiled_image(folder, sizes=None, name="Tiles", value=0.0):
    """An image of tiles of different sizes, in EXR files of this value."""
    return scenes.tiled_image(folder, sizes or SIZES, name, value)


def read(path):
    return native.read_exr(str(path))[0]


def add_quads(corners, uvs, material, name="Quads"):
    """A mesh of quadrilaterals; of each the corner and the size, and those of its UVs."""
    square = np.array(scenes.SQUARE_UVS, float)
    points = [np.column_stack([np.array(at) + square * size, np.zeros(4)]) for at, size in corners]
    places = [np.array(at) + square * size for at, size in uvs]
    faces = [tuple(range(4 * number, 4 * number + 4)) for number in range(len(corners))]
    quads = scenes.add_mesh(name, np.concatenate(points).tolist(), faces, uvs=np.concatenate(places))
    quads.data.materials.append(material)
    return quads


CORNERS = [((-1, -1), 0.8), ((0.2, -1), 0.8), ((-1, 0.2), (0.64, 0.8)), ((0.2, 0.2), 0.8)]
"""Corners and sizes of four planes."""

UVS = [((0.1, 0.1), 0.8), ((1, 0), 1), ((0.25, 1.25), 0.5), ((1.5, 1.1), (0.4, 0.4))]
"""Those of their UVs, each in a tile of its own."""


def four_planes(image, **options):
    return add_quads(CORNERS, UVS, scenes.add_material(image=image, linked=True, **options))


def alone(number, size):
    """Texels of one of the four planes that is baked alone in an image of this size, by the tile's UVs."""
    image = bpy.data.images.new("Alone", *size, float_buffer=True, alpha=False)
    (u, v), extent = UVS[number]
    material = scenes.add_material("Alone", image=image)
    plane = add_quads([CORNERS[number]], [((u % 1, v % 1), extent)], material, "Alone")
    texels = scenes.bake(plane)[0].copy()
    bpy.data.objects.remove(plane)
    return texels


def test_each_tile_equals_its_plane_alone(tmp_path):
    """The same grids, rays and seeds: also the margin is the same. Saved, opened again and baked once more, too."""
    quads = four_planes(tiled_image(tmp_path))
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    tiles = {number: read(scenes.tile_file(tmp_path, number)) for number in SIZES}
    brightest = max(texels.max() for texels in tiles.values())
    bpy.data.objects.remove(quads)
    for place, (number, size) in enumerate(SIZES.items()):
        expected = alone(place, size)
        assert tiles[number].shape == (size[1], size[0], 3)
        assert (expected > 0).mean() > 0.1
        np.testing.assert_allclose(tiles[number], expected, atol=1e-3 * brightest)


@pytest.mark.parametrize("second", [(64, 64), (96, 80)])
def test_light_crosses_the_tiles_of_one_plane(second, tmp_path):
    """A plane of 2 x 1 that two tiles share, beside one image. Tiles of other density are resampled: means of 8 x 8."""
    image = tiled_image(tmp_path, {1001: (64, 64), 1012: second})
    halves = [((-1, -0.5), 1), ((0, -0.5), 1)]
    plane = add_quads(halves, [((0, 0), 1), ((1, 1), 1)], scenes.add_material(image=image, mean_free_path=(0.2,) * 3))
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    bpy.data.objects.remove(plane)
    whole = bpy.data.images.new("Whole", 128, 64, float_buffer=True, alpha=False)
    material = scenes.add_material("Whole", image=whole, mean_free_path=(0.2,) * 3)
    expected = scenes.bake(add_quads(halves, [((0, 0), (0.5, 1)), ((0.5, 0), (0.5, 1))], material, "Whole"))[0]
    left, right = read(scenes.tile_file(tmp_path, 1001)), read(scenes.tile_file(tmp_path, 1012))
    if second == (64, 64):
        np.testing.assert_allclose(np.hstack([left, right]), expected, atol=1e-3 * expected.max())
        return
    means = [blocks(texels, 8) for texels in (left, right, expected[:, :64], expected[:, 64:])]
    np.testing.assert_allclose(means[:2], means[2:], atol=4e-3 * expected.max())


def blocks(texels, count):
    height, width = texels.shape[:2]
    return texels.reshape(count, height // count, count, width // count, 3).mean(axis=(1, 3))


def test_a_new_image_has_the_tiles_that_are_used_and_a_render_shows_them(tmp_path):
    scene = bpy.context.scene
    scene.beamspread.use_udim, scene.beamspread.resolution = True, 64
    quads = four_planes(None)
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert [layer.name for layer in quads.data.uv_layers] == ["UVMap"]
    scenes.reopen(tmp_path)
    image = scenes.image_of(bpy.data.objects["Quads"])
    assert image.source == "TILED"
    assert {tile.number: tuple(tile.size) for tile in image.tiles} == dict.fromkeys(SIZES, (64, 64))
    assert sorted(path.name for path in tmp_path.glob("*.exr")) == [f"Quads_Medium.{number}.exr" for number in SIZES]
    scene = bpy.context.scene
    scene.render.engine, scene.world = "CYCLES", None
    for lamp in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(lamp)
    scenes.add_camera(2.0)
    shown = scenes.render(tmp_path / "render.exr", size=100, samples=16)
    for (at, size), (uv, extent), number in zip(CORNERS, UVS, SIZES):
        # The middle of each plane: eight pixels of .02, and the texels of the same part.
        middle = (np.array(at) + np.multiply(size, 0.5) + 1) * 50
        x, y = np.rint(middle).astype(int)
        half = np.multiply(0.08 / np.multiply(size, [1, 1]), extent) * 64
        u, v = (np.array(uv) % 1 + np.multiply(extent, 0.5)) * 64
        texels = read(scenes.tile_file(tmp_path, number, "Quads_Medium"))
        rows, columns = (slice(*np.rint([at - d, at + d]).astype(int)) for at, d in ((v, half[1]), (u, half[0])))
        expected = texels[rows, columns].mean(axis=(0, 1))
        assert expected.min() > 0
        np.testing.assert_allclose(shown[y - 4 : y + 4, x - 4 : x + 4].mean(axis=(0, 1)), expected, rtol=0.02)


def test_tiles_of_a_new_image_have_sizes_by_their_planes(tmp_path):
    """512 texels per meter: 2 m fill a tile, .8 m the others; marble needs no more."""
    bpy.context.scene.beamspread.use_udim = True
    material = scenes.add_material(linked=True)
    scenes.node_of(material).preset = "marble"
    quads = add_quads([((-1, -1), 2), ((3, 0), 0.8)], [((0, 0), 1), ((1, 0), 1)], material)
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert {tile.number: tuple(tile.size) for tile in scenes.image_of(quads).tiles} == {
        1001: (1024, 1024),
        1002: (512, 512),
    }


def failed(obj):
    scenes.select(obj)
    return scenes.messages_of(bpy.ops.beamspread.bake)


def test_missing_tiles_are_named(tmp_path):
    image = tiled_image(tmp_path, {1001: (32, 32), 1002: (32, 32)})
    text = failed(four_planes(image))
    assert "The image 'Tiles.1001.exr' lacks the UDIM tiles 1011, 1012, which the UV map of 'Quads' uses." in text
    assert "Add and save them in the Image Editor" in text


def test_a_face_across_a_border_is_named(tmp_path):
    material = scenes.add_material(image=tiled_image(tmp_path))
    text = failed(add_quads([((-1, -1), 1), ((0, -1), 1)], [((0, 0), 1), ((0.6, 1.1), 0.8)], material))
    assert "UV islands of 'Quads' cross the border of the UDIM tile 1012: 1 of 2 faces." in text
    text = failed(add_quads([((-1, 0), 1)], [((-2, 0), 1)], material, "Left"))
    assert "The UV map of 'Left' reaches where no UDIM tile can be, in 1 of 1 faces." in text


def test_lost_packed_and_unsaved_tiles_are_named(tmp_path):
    image = tiled_image(tmp_path)
    quads = four_planes(image)
    image.pack()
    assert "has packed UDIM tiles" in failed(quads)
    generated = scenes.node_of(quads.data.materials[0]).image = bpy.data.images.new("Generated", 8, 8, tiled=True)
    generated.pixels[0] = 0.5
    assert "has UDIM tiles that were never saved. Save it with <UDIM> in its name" in failed(quads)
    missing = tiled_image(tmp_path, name="Missing")
    scenes.node_of(quads.data.materials[0]).image = missing
    scenes.tile_file(tmp_path, 1002, "Missing").unlink()
    missing.buffers_free()
    assert f"has lost its file {scenes.tile_file(tmp_path, 1002, 'Missing')}" in failed(quads)
    bpy.context.scene.beamspread.use_udim, bpy.context.scene.beamspread.image_dir = True, "//textures"
    scenes.node_of(quads.data.materials[0]).image = None
    assert "UDIM tiles are files beside the .blend file, which was never saved. Save it first" in failed(quads)


def test_a_new_tiled_image_of_blender_gets_files(tmp_path):
    """It has one tile more than the object, and lacks three of its tiles."""
    image = bpy.data.images.new("Blender's", 24, 20, float_buffer=True, tiled=True)
    image.tiles.new(1005)
    quads = four_planes(image)
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    numbers = [*SIZES][:2] + [1005] + [*SIZES][2:]
    assert sorted(tile.number for tile in image.tiles) == sorted(numbers)
    assert {read(scenes.tile_file(tmp_path, number, "Blender_s")).shape for number in SIZES} == {(20, 24, 3)}
    assert all(read(scenes.tile_file(tmp_path, number, "Blender_s")).any() for number in SIZES)
    before = read(scenes.tile_file(tmp_path, 1001, "Blender_s"))
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    np.testing.assert_array_equal(read(scenes.tile_file(tmp_path, 1001, "Blender_s")), before)


def test_a_failure_leaves_all_files(tmp_path, monkeypatch):
    """The third of four files can't be written: no file is replaced, and none is left beside them."""
    quads = four_planes(tiled_image(tmp_path, value=0.25))
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    write, calls = native.write_exr, []

    def full(path, *arguments, **options):
        calls.append(path)
        if len(calls) == 3:
            raise OSError(28, "No space left on device")
        write(path, *arguments, **options)

    monkeypatch.setattr(native, "write_exr", full)
    text = failed(quads)
    assert "cannot be written and stay as they were: No space left on device" in text
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    monkeypatch.undo()
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert all(path.read_bytes() != old for path, old in before.items())


def test_objects_share_tiles(tmp_path):
    """Two objects in one tile: a bake of one leaves the texels of the other bit for bit, in that tile and others."""
    image = tiled_image(tmp_path, {1001: (64, 64), 1002: (64, 64)})
    material = scenes.add_material(image=image)
    first = add_quads([((-1, -1), 0.8), ((-1, 0.2), 0.8)], [((0.05, 0.05), 0.4), ((1, 0), 1)], material, "First")
    second = add_quads([((0.2, -1), 0.8)], [((0.55, 0.55), 0.4)], scenes.add_material("Other", image=image), "Second")
    scenes.select(first)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    before = {number: read(scenes.tile_file(tmp_path, number)) for number in (1001, 1002)}
    scenes.select(second)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    after = {number: read(scenes.tile_file(tmp_path, number)) for number in (1001, 1002)}
    np.testing.assert_array_equal(after[1002], before[1002])
    np.testing.assert_array_equal(after[1001][:32, :32], before[1001][:32, :32])
    assert before[1001][36:60, 36:60].max() == 0
    assert after[1001][36:60, 36:60].min() > 0
    assert state.lines() == []


def test_objects_of_one_material_share_a_new_image(tmp_path):
    """The first bake makes the image, the second one adds a tile; both have one size in the tile that they share."""
    settings = bpy.context.scene.beamspread
    settings.use_udim = True
    material = scenes.add_material(linked=True)
    scenes.node_of(material).preset = "marble"
    first = add_quads([((-3, -3), 1.2)], [((0, 0), 0.4)], material, "First")
    second = add_quads([((1, 0), 0.5), ((1, 1), 0.5)], [((0.5, 0.5), 0.4), ((1, 0), 1)], material, "Second")
    scenes.select(first, second)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    image = scenes.image_of(first)
    sizes = {tile.number: tuple(tile.size) for tile in image.tiles}
    assert sizes == {1001: (2048, 2048), 1002: (512, 512)}
    texels = read(scenes.tile_file(tmp_path, 1001, "First_Medium"))
    assert texels[100:700, 100:700].min() > 0
    assert texels[1100:1700, 1100:1700].min() > 0
    assert state.lines() == []


def test_a_tiled_bake_is_up_to_date_until_something_changes(tmp_path):
    quads = four_planes(tiled_image(tmp_path))
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    scenes.reopen(tmp_path)
    stale.refresh(bpy.context)
    (row,) = state.rows.values()
    assert (row.status, row.messages) == (Status.BAKED, ())
    scenes.tile_file(tmp_path, 1011).unlink()
    scenes.reopen(tmp_path)
    stale.refresh(bpy.context)
    (row,) = state.rows.values()
    assert "image file (missing)" in str(row.messages[0])


@pytest.mark.parametrize("is_relative", [False, True])
def test_tiles_keep_the_path_that_the_artist_gave_them(tmp_path, is_relative):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    image = tiled_image(tmp_path)
    if is_relative:
        image.filepath = bpy.path.relpath(image.filepath)
    path = image.filepath
    assert path.startswith("//") == is_relative
    scenes.select(four_planes(image))
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert image.filepath == path


def test_tiles_of_another_scene_stay(tmp_path):
    """After Save As, the new scene's first bake makes files of its own."""
    bpy.context.scene.beamspread.use_udim, bpy.context.scene.beamspread.resolution = True, 32
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "first.blend"))
    quads = four_planes(None)
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "first.blend"))
    assert scenes.image_of(quads).filepath == "//Quads_Medium.<UDIM>.exr"
    before = {path: path.read_bytes() for path in tmp_path.glob("*.exr")}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "second.blend"))
    bpy.data.objects["Lamp"].location.x = -0.5
    scenes.select(quads)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert len(before) == 4
    assert {path: path.read_bytes() for path in before} == before
    image = scenes.image_of(quads)
    assert image.filepath.endswith("Quads_Medium_2.<UDIM>.exr")
    assert {tile.number: tuple(tile.size) for tile in image.tiles} == dict.fromkeys(SIZES, (32, 32))
    (line,) = [line for line in state.lines() if "belongs to" in line]
    assert "'Quads_Medium.<UDIM>.exr' belongs to 'first.blend'" in line


def test_irradiance_has_tiles_of_its_own(tmp_path):
    """Twice: the second time they are there already."""
    quads = four_planes(tiled_image(tmp_path))
    bpy.context.scene.beamspread.output = "IRRADIANCE"
    for _ in range(2):
        scenes.select(quads)
        assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert not read(scenes.tile_file(tmp_path, 1001)).any()
    files = sorted(path.name for path in tmp_path.glob("*Irradiance*"))
    assert files == [f"Tiles.1001.exr_Irradiance.{number}.exr" for number in SIZES]
    assert all(read(tmp_path / name).any() for name in files)


def test_a_batch_writes_tiles_and_lists_them(tmp_path):
    four_planes(tiled_image(tmp_path))
    out = tmp_path / "out"
    scenes.save_scene(tmp_path)
    report = tmp_path / "report.json"
    command = scenes.batch_command(
        tmp_path / "scene.blend", "--frames", "2-3", "--output", out, "--report", report, "--resolution", 24
    )
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    entries = json.loads(report.read_text())["bakes"]
    for entry, frame in zip(entries, (2, 3), strict=True):
        assert entry["path"] == str(out / f"Quads_Medium_{frame:04d}.<UDIM>.exr")
        assert entry["files"] == [str(out / f"Quads_Medium_{frame:04d}.{number}.exr") for number in SIZES]
        assert (entry["width"], entry["height"]) == (24, 24)
        assert [read(file).shape for file in entry["files"]] == [(24, 24, 3)] * 2 + [(24, 19, 3), (24, 24, 3)]
    assert not read(scenes.tile_file(tmp_path, 1001)).any()
    (out / "Quads_Medium_0003.1011.exr").unlink()
    done = subprocess.run([*command, "--resume"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [entry["status"] for entry in json.loads(report.read_text())["bakes"]] == ["skipped", "written"]
    done = subprocess.run(scenes.batch_command(tmp_path / "scene.blend"), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert all(read(scenes.tile_file(tmp_path, number)).any() for number in SIZES)


def test_live_and_blenders_bake_say_that_they_have_no_tiles(tmp_path):
    image = tiled_image(tmp_path)
    quads = four_planes(image)
    bpy.context.scene.beamspread.use_live = True
    settle()
    assert any("has UDIM tiles, in which Live has no previews" in line for line in live_lines())
    bpy.context.scene.beamspread.use_live = False
    tree = quads.data.materials[0].node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.nodes.active = texture
    bpy.context.scene.render.engine = "BEAMSPREAD"
    scenes.select(quads)
    scenes.messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert any("which Blender's own Bake can't fill" in line for line in state.lines())


@pytest.mark.parametrize("by_cycles", [False, True])
def test_colors_come_from_the_uvs_of_each_tile(by_cycles, tmp_path):
    """The color is the U coordinate over 2; by Cycles, noise of no size is added."""
    bpy.context.scene.render.engine = "CYCLES"
    image = tiled_image(tmp_path, {1001: (64, 64), 1002: (64, 64)})
    material = scenes.add_material(image=image, mean_free_path=(1e-4,) * 3, color_mode="BASE_COLOR", texture_blur=0.0)
    nodes = Nodes(material)
    split = nodes.add("SeparateXYZ", {"Vector": nodes.add("TexCoord").outputs["UV"]})
    half = nodes.tree.nodes.new("ShaderNodeMath")
    half.operation = "MULTIPLY"
    half.inputs[1].default_value = 0.5
    nodes.tree.links.new(half.inputs[0], split.outputs["X"])
    value = half.outputs[0]
    if by_cycles:
        noise = nodes.add("TexNoise", {"Scale": 0.0})
        nothing = nodes.tree.nodes.new("ShaderNodeMath")
        nothing.operation = "MULTIPLY_ADD"
        nothing.inputs[1].default_value = 0.0
        nodes.tree.links.new(nothing.inputs[0], noise.outputs[0])
        nodes.tree.links.new(nothing.inputs[2], value)
        value = nothing.outputs[0]
    nodes.tree.links.new(scenes.node_of(material).inputs["Base Color"], value)
    for obj in [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    plane = add_quads([((-1, 0), 1), ((0, 0), 1)], [((0, 0), 1), ((1, 0), 1)], material)
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    row = np.concatenate([read(scenes.tile_file(tmp_path, number))[32, :, 0] for number in (1001, 1002)])
    ramp = np.polyfit(np.arange(8, 120), row[8:120], 1)
    assert np.abs(np.polyval(ramp, np.arange(8, 120)) - row[8:120]).max() < 0.02 * row.max()
    assert ramp[1] == pytest.approx(0, abs=0.02 * row.max())
    assert ramp[0] > 0
