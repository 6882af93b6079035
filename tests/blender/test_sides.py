"""Slabs in Blender: light on both faces counts, and either face, or both, have an image."""

import json
import math

import bpy
import live_scenes
import numpy as np
import pytest
import scenes
from beamspread import Medium, library
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.live import timer
from beamspread.core.target import BACK, FRONT, Target
from mathutils import Matrix

PATH, PATHS, ALBEDO = 0.02, 2.0, 0.9
MEDIUM = Medium(0.0, 1.0, PATHS)
ANGLE = 30
# Error of the solver, and of rounding to the half floats of packed images.
SOLVED = 7e-3
MIDDLE = slice(12, 20)


@pytest.fixture(autouse=True)
def settings():
    state.forget()
    settings = bpy.context.scene.beamspread
    settings.quality, settings.margin, settings.use_indirect = "preview", 0, False
    settings.use_size, settings.resolution = False, 32
    yield settings
    bpy.context.scene.beamspread.use_live = False  # tests open files


@pytest.fixture(scope="module")
def ldf():
    return library(MEDIUM, "preview")


def sheet_material(side="FRONT", **properties):
    values = {"albedo": (ALBEDO,) * 3, "mean_free_path": (PATH,) * 3, "anisotropy": 0.0, "thickness": PATHS * PATH}
    return scenes.add_material(side=side, **(values | properties))


def add_sheet(side="FRONT", matrix=None, **properties):
    """A sheet of 1 m in the xy plane, a sun below it, and its node."""
    plane = scenes.add_plane("Sheet", (1, 1), matrix, material=sheet_material(side, **properties))
    sun = scenes.add_sun(matrix=Matrix.Rotation(math.radians(180 - ANGLE), 4, "X"), strength=2.0)
    return plane, sun, scenes.node_of(plane.data.materials[0])


def expected(ldf):
    """Luminance of the face that is turned from the sun of `add_sheet`, and of the lit one."""
    irradiance = 2.0 * math.cos(math.radians(ANGLE))
    return [total(ANGLE, ALBEDO) * irradiance / math.pi for total in (ldf.transmittance, ldf.reflectance)]


def middle(image):
    return scenes.pixels(image)[MIDDLE, MIDDLE]


def test_both_faces_have_an_image(ldf):
    plane, _, node = add_sheet("BOTH")
    scenes.bake(plane)
    assert (node.image.name, node.image_back.name) == ("Sheet_Medium", "Sheet_Medium_back")
    through, lit = expected(ldf)
    np.testing.assert_allclose(middle(node.image), through, rtol=SOLVED)
    np.testing.assert_allclose(middle(node.image_back), lit, rtol=SOLVED)
    assert [*state.rows] == [Target("Sheet", "Medium"), Target("Sheet", "Medium", BACK)]
    assert {row.status for row in state.rows.values()} == {Status.BAKED}
    assert [str(target) for target in state.rows] == ["Sheet / Medium", "Sheet / Medium, back"]


def test_the_side_decides_which_image_is_baked(ldf):
    plane, _, node = add_sheet("BACK")
    scenes.select(plane)
    bpy.ops.beamspread.bake()
    assert node.image is None
    np.testing.assert_allclose(middle(node.image_back), expected(ldf)[1], rtol=SOLVED)
    shown = node.node_tree.nodes["Image"].image
    assert shown == node.image_back
    # A material that is infinitely thick has a front alone, which is not lit.
    node.thickness = 0.0
    assert node.sides() == (FRONT,)
    assert node.node_tree.nodes["Image"].image is None
    assert "behind 'Sheet'" in scenes.messages_of(bpy.ops.beamspread.bake) or node.image is not None
    assert not scenes.pixels(node.image).any()


def test_flipped_normals_change_the_sides(ldf):
    plane, _, node = add_sheet("BOTH", Matrix.Rotation(math.pi, 4, "Y"))
    scenes.bake(plane)
    through, lit = expected(ldf)
    np.testing.assert_allclose(middle(node.image), lit, rtol=SOLVED)
    np.testing.assert_allclose(middle(node.image_back), through, rtol=SOLVED)


@pytest.mark.parametrize("scale", [1, -1])
@pytest.mark.parametrize("plain", [False, True])
def test_each_face_shows_its_image(scale, plain, ldf, tmp_path):
    """Seen from above and from below, mirrored objects too, by the node and by plain nodes."""
    plane, sun, _ = add_sheet("BOTH", Matrix.Diagonal((scale, 1, 1, 1)))
    scenes.bake(plane)
    if plain:
        assert bpy.ops.beamspread.make_plain(kind="GROUP") == {"FINISHED"}
    sun.data.energy = 0
    camera, scene = scenes.add_camera(0.2), bpy.context.scene
    scene.world, scene.render.engine = None, "CYCLES"
    through, lit = expected(ldf)
    for turn, value in ((0, through), (math.pi, lit)):
        camera.matrix_world = Matrix.Rotation(turn, 4, "X") @ Matrix.Translation((0, 0, 2))
        np.testing.assert_allclose(scenes.render(tmp_path / f"{turn:.0f}.exr"), value, rtol=SOLVED)


def test_names_of_images_do_not_collide():
    plane, _, node = add_sheet("BOTH")
    scenes.known_image(name="Sheet_Medium_back")
    scenes.bake(plane)
    names = {node.image.name, node.image_back.name}
    assert len(names) == 2
    assert "Sheet_Medium_back" not in names
    # The same image for both is an error with a remedy.
    node.image_back = node.image
    scenes.select(plane)
    assert "Both sides of 'Sheet' have the image 'Sheet_Medium'. Clear Back Image" in scenes.messages_of(
        bpy.ops.beamspread.bake
    )


@pytest.mark.parametrize("output", ["IRRADIANCE", "DIRECTION"])
def test_passes_are_those_of_the_baked_face(output, settings):
    plane, _, node = add_sheet("BOTH")
    settings.output = output
    scenes.select(plane)
    bpy.ops.beamspread.bake()
    front = bpy.data.images[f"Sheet_Medium {output.title()}"]
    back = bpy.data.images[f"Sheet_Medium_back {output.title()}"]
    assert not scenes.pixels(front).any()
    normal_part = 2.0 * math.cos(math.radians(ANGLE)) if output == "IRRADIANCE" else -math.cos(math.radians(ANGLE))
    np.testing.assert_allclose(scenes.pixels(back)[..., 2], normal_part, rtol=2e-3)
    assert node.image is node.image_back is None


def test_a_bake_of_one_side_knows_when_the_scene_changes():
    plane, sun, node = add_sheet("BOTH")
    scenes.bake(plane)
    stale.refresh(bpy.context)
    assert not any(row.is_stale for row in state.rows.values())
    node.side = "FRONT"  # the other one is no longer shown
    stale.refresh(bpy.context)
    assert [(row.target.side, row.is_stale) for row in state.rows.values()] == [(FRONT, False)]
    node.side = "BOTH"
    sun.data.energy = 3.0
    stale.refresh(bpy.context)
    assert [row.is_stale for row in state.rows.values()] == [True, True]


def test_sides_are_kept_in_files(tmp_path):
    plane, _, _ = add_sheet("BOTH")
    scenes.bake(plane)
    scenes.reopen(tmp_path)
    node = scenes.node_of(bpy.data.materials["Medium"])
    assert (node.side, node.image.name, node.image_back.name) == ("BOTH", "Sheet_Medium", "Sheet_Medium_back")
    stale.refresh(bpy.context)
    assert {row.status for row in state.rows.values()} == {Status.BAKED}


def test_a_batch_writes_both_and_resumes(tmp_path, ldf):
    add_sheet("BOTH")
    scenes.save_scene(tmp_path)
    arguments = ["--output", tmp_path, "--report", tmp_path / "report.json", "--resume"]
    report = scenes.run_batch(*arguments)
    report.save(str(tmp_path / "report.json"))
    assert [(bake.side, bake.status, bake.left_out, bake.dark) for bake in report.bakes] == [
        ("FRONT", "written", [], False),
        ("BACK", "written", [], False),
    ]
    front, back = (bake.path for bake in report.bakes)
    assert (front, back) == (str(tmp_path / "Sheet_Medium.exr"), str(tmp_path / "Sheet_Medium_Back.exr"))
    for path, value in zip((front, back), expected(ldf)):
        np.testing.assert_allclose(middle(bpy.data.images.load(path)), value, rtol=SOLVED)
    again = scenes.run_batch(*arguments).bakes
    assert [(bake.side, bake.status) for bake in again] == [("FRONT", "skipped"), ("BACK", "skipped")]
    assert {entry["side"] for entry in json.loads((tmp_path / "report.json").read_text())["bakes"]} == {"FRONT", "BACK"}


def test_blenders_own_bake_fills_the_side_of_the_active_image(ldf):
    plane, _, node = add_sheet("BOTH")
    bpy.context.scene.render.engine, bpy.context.scene.render.bake.margin = "BEAMSPREAD", 0
    texture = node.id_data.nodes.new("ShaderNodeTexImage")
    node.id_data.nodes.active = texture
    scenes.select(plane)
    for name, value in zip(("image", "image_back"), expected(ldf)):
        texture.image = bpy.data.images.new(name, 32, 32, float_buffer=True)
        setattr(node, name, texture.image)
        assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
        np.testing.assert_allclose(middle(texture.image), value, rtol=SOLVED)


def test_live_shows_both_faces(settings, ldf):
    plane, _, node = add_sheet("BOTH", linked=True)
    settings.use_live = True
    live_scenes.settle()
    nodes = node.node_tree.nodes
    for name, value in zip(("Image", "Back Image"), expected(ldf)):
        np.testing.assert_allclose(middle(nodes[name].image), value, rtol=SOLVED)
    assert len(live_scenes.hidden_images()) == 2
    assert node.image is node.image_back is None
    settings.use_live = False
    timer.step(bpy.context)
    assert not live_scenes.hidden_images()
    assert nodes["Image"].image is nodes["Back Image"].image is None
    scenes.bake(plane)
    assert nodes["Image"].image == node.image
    assert nodes["Back Image"].image == node.image_back


def test_a_shade_with_a_bulb(settings, ldf):
    """A sphere shade with a bulb in its middle and light that its inside returns: in all T_d R / (1 - R) more.

    The wall returns its diffuse reflectance R of all light. Facets of 7.5 degrees, and 1 % of noise of bounced light.
    """
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    shade = bpy.context.object
    shade.data.polygons.foreach_set("use_smooth", [True] * len(shade.data.polygons))
    shade.data.materials.append(sheet_material())
    scenes.add_lamp((0, 0, 0), 4 * math.pi * math.pi)  # pi W/m^2 at 1 m
    settings.use_indirect = True
    (light,) = scenes.bake(shade)
    cosines = (np.arange(64) + 0.5) / 64
    angles = np.degrees(np.arccos(cosines))
    diffuse = {
        name: 2 * np.mean([getattr(ldf, name)(angle, ALBEDO) * c for angle, c in zip(angles, cosines)])
        for name in ("transmittance", "reflectance")
    }
    # The first bounce, too, is diffuse reflectance in the scene of Beamspread's rays.
    bounced = diffuse["reflectance"] / (1 - diffuse["reflectance"])
    wanted = ldf.transmittance(0, ALBEDO) + diffuse["transmittance"] * bounced
    inside = light.any(axis=-1)
    assert inside.mean() > 0.5
    assert light[inside].mean() == pytest.approx(wanted, rel=0.03)
    notes = " ".join(str(message) for row in state.rows.values() for message in row.messages)
    assert "back is the inside" in notes
