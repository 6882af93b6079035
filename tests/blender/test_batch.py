"""The batch as users run it: a process of its own, with exit code, files and report."""

import json
import re
import stat
import subprocess
from pathlib import Path

import bpy
import numpy as np
import pytest
from beamspread.core.native import native
from mathutils import Matrix
from scenes import (
    BATCH,
    add_group_material,
    add_material,
    add_plane,
    add_sun,
    add_world,
    bake,
    batch_command,
    file_image,
    node_of,
    pixels,
    save_scene,
)

KEYS = {"object", "material", "frame", "path", "width", "height", "seconds", "status", "message"} | {
    *("output", "lights", "left_out", "indirect", "dark", "estimated_seconds", "exposure", "side"),
}


def run_batch(scene, *arguments, program=()):
    """Run a batch; (exit code, bakes of its report or None, all it printed)."""
    report = scene.parent / "report.json"
    command = batch_command(scene, *arguments, "--report", report, program=program)
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    bakes = json.loads(report.read_text())["bakes"] if report.exists() else None
    return done.returncode, bakes, done.stdout + done.stderr


def test_one_plane(tmp_path):
    plane = add_plane(size=(2, 1), material=add_material("Stone", albedo=(0.99, 0.9, 0.5)))
    add_sun(40, 30, strength=10)
    scene = save_scene(tmp_path)
    code, bakes, _ = run_batch(scene, "--output", tmp_path / "out")
    assert code == 0
    assert len(bakes) == 1
    assert set(bakes[0]) == KEYS
    expected = {"object": "Plane", "material": "Stone", "frame": 1, "width": 32, "height": 16, "status": "written"}
    expected |= {"output": "LUMINANCE", "lights": 1, "left_out": [], "dark": False}
    assert {key: bakes[0][key] for key in expected} == expected
    assert Path(bakes[0]["path"]) == tmp_path / "out" / "Plane_Stone.exr"
    stored, channels, _ = native.read_exr(bakes[0]["path"])
    assert channels == ["R", "G", "B"]
    assert stored == pytest.approx(bake(plane)[0], abs=1e-6)


def test_blender_reads_the_exr_the_right_way_up(tmp_path):
    add_plane(uvs=[(0, 0), (0.5, 0), (0.5, 0.25), (0, 0.25)], material=add_material())
    add_sun(0, strength=10)
    bpy.context.scene.beamspread.margin = 0
    code, bakes, _ = run_batch(save_scene(tmp_path), "--output", tmp_path)
    assert code == 0
    image = bpy.data.images.load(bakes[0]["path"])
    stored, _, _ = native.read_exr(bakes[0]["path"])
    assert pixels(image) == pytest.approx(stored, abs=1e-6)
    height, width = stored.shape[:2]
    assert stored[: height // 4, : width // 2].all()
    assert not stored[height // 4 :].any()


def test_frames_objects_resolution_and_solver(tmp_path):
    add_plane("One", material=add_material("M1"))
    add_plane("Two", matrix=Matrix.Translation((5, 0, 0)), material=add_material("M2"))
    sun = add_sun(0)
    for frame in (1, 3):
        sun.data.energy = frame
        sun.data.keyframe_insert("energy", frame=frame)
    scene = save_scene(tmp_path)
    code, bakes, _ = run_batch(
        scene, "--object", "Two", "--frames", "1-3", "--resolution", 16, "--solver", "direct", "--output", tmp_path
    )
    assert code == 0
    assert [(one["object"], one["frame"], one["width"]) for one in bakes] == [("Two", frame, 16) for frame in (1, 2, 3)]
    assert len({one["path"] for one in bakes}) == 3
    means = [native.read_exr(one["path"])[0].mean() for one in bakes]
    assert means[2] / means[0] == pytest.approx(3, rel=1e-4)
    assert means[0] < means[1] < means[2]


def test_png_shows_srgb(tmp_path):
    plane = add_plane(material=add_material(albedo=(0.9,) * 3))
    add_sun(0, strength=2.0)
    scene = save_scene(tmp_path)
    code, bakes, _ = run_batch(scene, "--format", "PNG", "--output", tmp_path)
    assert code == 0
    assert bakes[0]["path"].endswith(".png")
    linear = bake(plane)[0][16, 16, 0]
    image = bpy.data.images.load(bakes[0]["path"])
    image.colorspace_settings.is_data = True
    assert pixels(image)[16, 16, 0] == pytest.approx(1.055 * linear ** (1 / 2.4) - 0.055, abs=0.01)


def test_without_output_the_images_own_file_is_written(tmp_path):
    path = tmp_path / "own.exr"
    add_plane(material=add_material(image=file_image(path, 8, 8)))
    add_sun(0)
    code, bakes, _ = run_batch(save_scene(tmp_path))
    assert code == 0
    assert Path(bakes[0]["path"]) == path
    assert native.read_exr(str(path))[0].all()


def test_without_output_and_image_the_scenes_folder_is_used(tmp_path):
    add_plane(material=add_material())
    add_sun(0)
    bpy.context.scene.beamspread.output_dir = "//mine/"
    code, bakes, _ = run_batch(save_scene(tmp_path))
    assert code == 0
    assert Path(bakes[0]["path"]).parent == tmp_path / "mine"


def test_hidden_in_the_viewport_makes_no_difference(tmp_path):
    plane, sun = add_plane(material=add_material()), add_sun(0)
    bpy.context.scene.beamspread.resolution = 32
    (shown,) = bake(plane)
    node_of(plane.data.materials[0]).image = None
    plane.hide_set(True)
    sun.hide_viewport = True
    code, bakes, _ = run_batch(save_scene(tmp_path), "--output", tmp_path)
    assert code == 0
    assert native.read_exr(bakes[0]["path"])[0] == pytest.approx(shown, abs=1e-6)


def missing_image(folder):
    image = bpy.data.images.new("Gone", 8, 8)
    image.source, image.filepath = "FILE", str(folder / "gone.exr")
    return image


def read_only_image(folder):
    path = folder / "locked.exr"
    image = file_image(path, 8, 8)
    path.chmod(stat.S_IRUSR)
    return image


def add_failures(folder):
    """Planes that cannot be baked, each in its own way; {name: word of its message}."""
    wrong = {
        "Albedo": ({"albedo": (1, 1, 1)}, "albedo"),
        "Negative": ({"mean_free_path": (-1, 1, 1)}, "mean free path"),
        "Gone": ({"image": missing_image(folder)}, "gone.exr"),
        "Locked": ({"image": read_only_image(folder)}, "read-only"),
        "Hidden": ({}, "hidden from render"),
    }
    for place, (name, (properties, _)) in enumerate(wrong.items(), start=1):
        matrix = Matrix.Translation((0, 5 * place, 0))
        plane = add_plane(name, matrix=matrix, material=add_material(f"M {name}", **properties))
        if name == "Hidden":
            plane.hide_render = True
    return {name: word for name, (_, word) in wrong.items()}


def test_each_failure_is_one_sentence_and_the_others_are_baked(tmp_path):
    add_plane("Sound", material=add_material("Sound"))
    words = add_failures(tmp_path)
    add_plane("Sound too", matrix=Matrix.Translation((0, -5, 0)), material=add_material("Sound too"))
    add_sun(0)
    code, bakes, output = run_batch(save_scene(tmp_path), "--output", tmp_path / "out")
    assert code == 1
    by_name = {one["object"]: one for one in bakes}
    assert set(by_name) == {"Sound", "Sound too", *words}
    for name, word in words.items():
        assert by_name[name]["status"] == "failed", name
        assert word in by_name[name]["message"], name
        assert "\n" not in by_name[name]["message"]
        assert by_name[name]["message"] in output
    for name in ("Sound", "Sound too"):
        assert by_name[name]["status"] == "written"
        assert (native.read_exr(by_name[name]["path"])[0] > 0).all()
    assert "Traceback" not in output
    assert len(list((tmp_path / "out").iterdir())) == 2


def test_unknown_object_and_object_without_the_node(tmp_path):
    add_plane(material=add_material())
    add_plane("Plain")
    add_sun(0)
    code, bakes, _ = run_batch(save_scene(tmp_path), "--object", "Nobody", "Plain", "Plane", "--output", tmp_path)
    assert code == 1
    assert [(one["object"], one["status"]) for one in bakes] == [
        ("Nobody", "failed"),
        ("Plain", "failed"),
        ("Plane", "written"),
    ]
    assert "not in the scene" in bakes[0]["message"]
    assert "no material with a Beamspread node" in bakes[1]["message"]


def test_nothing_to_bake_is_no_success(tmp_path):
    code, bakes, output = run_batch(save_scene(tmp_path))
    assert code == 1
    assert bakes == []
    assert "No mesh has a material" in output


def test_output_folder_that_cannot_be_made(tmp_path):
    add_plane(material=add_material())
    add_sun(0)
    (tmp_path / "file").write_text("")
    code, bakes, output = run_batch(save_scene(tmp_path), "--output", tmp_path / "file" / "folder")
    assert code == 1
    assert bakes[0]["status"] == "failed"
    assert "cannot be made" in bakes[0]["message"]
    assert "Traceback" not in output


@pytest.mark.skipif(not bpy.app.binary_path, reason="add-ons are installed in Blender's program")
def test_with_the_add_on_installed(tmp_path, monkeypatch):
    """The batch uses the installed copy, wherever its own file lies."""
    scripts = tmp_path / "scripts" / "addons"
    scripts.mkdir(parents=True)
    (scripts / "beamspread").symlink_to(BATCH.parent)
    add_plane(material=add_material())
    add_sun(0)
    scene = save_scene(tmp_path)
    monkeypatch.setenv("BLENDER_USER_SCRIPTS", str(tmp_path / "scripts"))
    code, bakes, output = run_batch(scene, "--output", tmp_path, program=["--addons", "beamspread"])
    assert code == 0, output
    assert bakes[0]["status"] == "written"


def test_node_is_read_from_the_file(tmp_path):
    """The subprocess knows the node's values only from the file, saved while the class was registered."""
    material = add_material(albedo=(0.0, 0.0, 0.5))
    add_plane(material=material)
    add_sun(0)
    code, bakes, _ = run_batch(save_scene(tmp_path), "--output", tmp_path)
    assert code == 0
    texture = native.read_exr(bakes[0]["path"])[0]
    assert not texture[..., :2].any()
    assert texture[..., 2].all()
    assert node_of(material).image is None


def test_node_in_groups_is_read_from_the_file(tmp_path):
    add_plane(material=add_group_material())
    add_sun(0)
    code, _, printed = run_batch(save_scene(tmp_path), "--output", tmp_path)
    assert code == 0, printed


def behind():
    """A plane that turns its back on its only lamp."""
    add_plane(matrix=Matrix.Diagonal((1, 1, -1, 1)), material=add_material())
    add_sun(0)
    return "All lights are behind 'Plane'"


def in_shadow():
    add_plane(material=add_material())
    add_plane("Roof", size=(9, 9), matrix=Matrix.Translation((0, 0, 1)))
    add_sun(0)
    return "No light reaches 'Plane'"


def without_lights():
    add_plane(material=add_material())
    return "The scene has no light that can be baked"


@pytest.mark.parametrize("add", [behind, in_shadow, without_lights])
@pytest.mark.parametrize("output", ["LUMINANCE", "IRRADIANCE"])
def test_a_bake_that_gets_no_light_is_no_success(add, output, tmp_path):
    words = add()
    add_plane("Lit", matrix=Matrix.Translation((20, 0, 0)), material=add_material("Lit"))
    scene = save_scene(tmp_path)
    code, bakes, output_text = run_batch(scene, "--pass", output, "--no-indirect", "--output", tmp_path)
    assert code == 1
    record, lit = bakes
    assert (record["status"], record["dark"]) == ("written", True)
    assert words in record["message"]
    assert not native.read_exr(record["path"])[0].any()
    assert lit["dark"] == (add is without_lights)
    names = "'Plane', 'Lit'" if add is without_lights else "'Plane'"
    assert f"Beamspread: No light reaches {names}: an error, unless --allow-dark is given." in output_text
    code, bakes, output_text = run_batch(
        scene, "--pass", output, "--no-indirect", "--allow-dark", "--output", tmp_path, "--object", "Plane"
    )
    assert (code, [one["dark"] for one in bakes]) == (0, [True])
    assert "--allow-dark" not in output_text


def test_a_failed_bake_is_no_success_in_the_dark_either(tmp_path):
    add_plane(material=add_material(albedo=(1, 1, 1)))
    code, bakes, _ = run_batch(save_scene(tmp_path), "--allow-dark", "--output", tmp_path)
    assert (code, bakes[0]["status"], bakes[0]["dark"]) == (1, "failed", False)


def test_a_pass_behind_which_a_lamp_shines_is_dark_and_nothing_is_simulated(tmp_path, monkeypatch):
    """A medium that no package brings: its simulation would leave a file in the cache."""
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path / "cache"))
    add_plane(material=add_material(thickness=0.0375, anisotropy=0.31))
    add_sun(0, matrix=Matrix.Rotation(np.pi, 4, "X"))
    scene = save_scene(tmp_path)
    code, bakes, _ = run_batch(scene, "--no-indirect", "--pass", "irradiance", "--output", tmp_path)
    assert code == 1
    assert "All lights are behind 'Plane', so it is black. Choose another Side" in bakes[0]["message"]
    assert not (tmp_path / "cache").exists()
    # The light that comes through the slab needs a simulation.
    code, bakes, _ = run_batch(scene, "--no-indirect", "--output", tmp_path)
    assert (code, bakes[0]["left_out"], bakes[0]["dark"]) == (0, [], False)
    assert [*(tmp_path / "cache").rglob("*.exr")]


def test_verbose_prints_the_scene_and_the_stages(tmp_path):
    add_plane(size=(2, 1), material=add_material())
    add_plane("Wall", size=(9, 9), matrix=Matrix.Translation((0, 0, -1)))
    add_sun(0, strength=3.5, color=(1, 0.5, 0.25))
    scene = save_scene(tmp_path)
    _, _, quiet = run_batch(scene, "--no-indirect", "--output", tmp_path)
    _, _, verbose = run_batch(scene, "--no-indirect", "--verbose", "--output", tmp_path)
    # Two rectangles of two triangles each.
    for words in ("1 lights; 4 triangles", "Sun 'Sun': strength 3.5, color 1 0.5 0.25", "32 x 16 texels, 2 x 1 scene"):
        assert f"Beamspread: {words}" in verbose.replace("'Plane': ", "")
        assert words not in quiet
    assert [f"{stage}: " in verbose for stage in ("scene", "'Plane': Baking")] == [True, True]
    assert re.search(r"'Plane / Medium': [\d.]+ s, estimated [\d.]+ s", verbose)


def test_a_log_has_versions_what_was_read_and_the_outcome(tmp_path):
    """The second run appends to it. Nothing of it is printed."""
    add_plane(material=add_material())
    add_sun(0, strength=3.5)
    scene, log = save_scene(tmp_path), tmp_path / "bakes.log"
    for _ in range(2):
        code, _, printed = run_batch(scene, "--no-indirect", "--log", log, "--output", tmp_path)
        assert code == 0
        assert "Sun 'Sun': strength" not in printed
    lines = log.read_text().splitlines()
    for words in (f"Blender {bpy.app.version_string}", "Sun 'Sun': strength 3.5", "Baking: ", "Plane_Medium.exr"):
        assert sum(words in line for line in lines) == 2
    code, _, printed = run_batch(scene, "--log", tmp_path, "--output", tmp_path / "other")
    assert (code, (tmp_path / "other").exists()) == (1, False)
    assert f"The log {tmp_path} cannot be written" in printed


def test_a_sky_by_cycles_is_a_light_of_the_report(tmp_path):
    """Its line and its time stand in the log under its own name, and nothing is said of bounced light."""
    nodes, background = add_world(name="Sky")
    nodes.set(background.inputs["Color"], nodes.add("TexChecker").outputs["Color"])
    add_plane("Floor", material=add_material())
    scene = save_scene(tmp_path)
    _, (bake,), verbose = run_batch(scene, "--output", tmp_path, "--no-indirect", "--verbose")
    assert (bake["status"], bake["lights"], bake["left_out"]) == ("written", 1, [])
    assert "'Floor': World 'Sky': strength 1, color 1 1 1" in verbose
    assert "'Floor': Finding light with Cycles: Sky: " in verbose
    assert "ounced" not in verbose
