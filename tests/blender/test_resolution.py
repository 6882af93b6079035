"""New images have a resolution by the size of the object and the spread of its medium; a bake tells that spread."""

import json
import subprocess

import bpy
import pytest
import scenes
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.jobs.state import state
from beamspread.blender.live import timer
from beamspread.blender.node.find import find_targets
from mathutils import Matrix
from panel_layout import panel

REMEDY = "Choose a Resolution of 64, and Resize the image if there is one."
DIFFUSE = f"spreads over 0.78 texels, so this is a diffuse bake. {REMEDY}"


@pytest.fixture(autouse=True)
def light(monkeypatch):
    monkeypatch.setattr(timer, "messages", list)
    scenes.add_sun(30)
    bpy.context.scene.beamspread.use_indirect = False


def marble_plane(side, name="Plane", material=None, **properties):
    material = material or scenes.add_material(f"Marble of {name}", linked=True, **properties)
    scenes.node_of(material).preset = "marble"
    return scenes.add_plane(name, (side, side), Matrix.Translation((0, 0, side)), material=material)


def sizes():
    """Sizes of the textures of all objects, without baking them."""
    bpy.context.view_layer.update()
    return [plan.size for plan in read_scene(bpy.context, find_targets(bpy.context.scene.objects))]


@pytest.mark.parametrize(("meters", "side"), [(0.1, 512), (2.0, 1024), (9.0, 4096), (100.0, 2048)])
def test_the_side_follows_size_and_medium(meters, side):
    marble_plane(meters)
    assert sizes() == [(side, side)]


def test_lengths_are_in_meters():
    """A plane of 200 cm has the texels of one of 2 m."""
    bpy.context.scene.unit_settings.scale_length = 0.01
    marble_plane(200.0)
    assert sizes() == [(1024, 1024)]


def test_a_resolution_that_was_set_counts():
    marble_plane(9.0)
    settings = bpy.context.scene.beamspread
    assert settings.use_size
    settings.resolution = 1024  # its default, too
    assert not settings.use_size
    assert sizes() == [(1024, 1024)]
    settings.use_size = True
    assert sizes() == [(4096, 4096)]
    settings.use_size = False
    assert (settings.resolution, sizes()) == (1024, [(1024, 1024)])


def test_a_set_resolution_is_kept_in_files(tmp_path):
    marble_plane(9.0)
    bpy.context.scene.beamspread.resolution = 1024
    scenes.reopen(tmp_path)
    assert not bpy.context.scene.beamspread.use_size


def test_an_image_keeps_its_size():
    marble_plane(9.0, image=bpy.data.images.new("Mine", 48, 32, float_buffer=True))
    assert sizes() == [(48, 32)]


def test_objects_that_will_share_a_new_image_have_one_size():
    large = marble_plane(9.0)
    marble_plane(0.1, "Small", large.data.materials[0])
    assert sizes() == [(4096, 4096)] * 2


def test_the_panel_tells_the_spread():
    """8.51 mm of 2 m at 1024 texels."""
    scenes.select(marble_plane(2.0))
    assert "The light spreads over 4.4 texels" in panel()
    marble_plane(1.0, "Small")
    scenes.select(*bpy.context.scene.objects[-2:])
    assert "The light spreads over 4.4 texels" in panel()
    image = bpy.data.images.new("Fine", 1280, 1280, float_buffer=True)
    fine = marble_plane(1e-2, "Fine", image=image)
    scenes.select(fine)
    assert "The light spreads over 1,100 texels" in panel()


def test_the_panel_tells_no_spread_beyond_an_image():
    """8.51 mm are 4.26 times the side of a plane of 2 mm."""
    tiny = marble_plane(2e-3, "Tiny", image=bpy.data.images.new("Tiny", 64, 64, float_buffer=True))
    scenes.select(tiny)
    assert "The light spreads over the whole surface" in panel()
    scenes.select(tiny, marble_plane(2.0, "Large"))
    assert "The light spreads over 4.4 texels and more" in panel()


def test_a_diffuse_bake_is_named_in_panel_report_and_log(tmp_path):
    image = bpy.data.images.new("Coarse", 16, 16, float_buffer=True, alpha=False)
    plane = marble_plane(0.175, image=image)
    scenes.select(plane)
    assert f"The light inside 'Plane' {DIFFUSE}" in panel().replace("  ", " ")
    scenes.bake(plane)
    assert state.lines() == []
    assert DIFFUSE in panel().replace("  ", " ")
    bpy.ops.beamspread.resize_image(side=64)
    assert tuple(image.size) == (64, 64)
    scenes.bake(plane)
    assert state.lines() == []
    assert "The light spreads over 3.1 texels" in panel()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    command = scenes.batch_command(
        tmp_path / "scene.blend", "--resolution", 16, "--verbose", "--output", tmp_path, "--report", tmp_path / "report"
    )
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (entry,) = json.loads((tmp_path / "report").read_text())["bakes"]
    assert DIFFUSE in entry["message"]
    assert DIFFUSE in done.stdout
    assert "light spreads over 0.778 texels" in done.stdout


def test_both_sides_of_a_sheet_have_one_line():
    front, back = (bpy.data.images.new(name, 16, 16, float_buffer=True, alpha=False) for name in ("Front", "Back"))
    sheet = marble_plane(0.175, image=front)
    node = scenes.node_of(sheet.data.materials[0])
    node.thickness, node.side, node.image_back = 0.05, "BOTH", back
    scenes.select(sheet)
    assert panel().count("so this is a diffuse bake") == 1


def test_irradiance_has_no_spread():
    bpy.context.scene.beamspread.output = "IRRADIANCE"
    scenes.select(marble_plane(9.0, image=bpy.data.images.new("Coarse", 16, 16, float_buffer=True)))
    bpy.ops.beamspread.bake()
    assert state.lines() == []
    assert "spread" not in panel()
