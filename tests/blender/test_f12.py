"""F12 with the engine: a picture by Cycles or EEVEE, with the baked images."""

import re
import time
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender import compat
from beamspread.blender.jobs.run.render_copy import render_picture


@pytest.fixture(autouse=True)
def beamspread_engine():
    bpy.context.scene.render.engine = "BEAMSPREAD"


@pytest.fixture
def seen():
    """A camera above a plane that shows a known image, 8 x 6 pixels of Cycles."""
    scene = bpy.context.scene
    scenes.add_camera()
    scene.render.resolution_x, scene.render.resolution_y = 8, 6
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    return scenes.add_plane(material=scenes.add_material(image=scenes.known_image(), linked=True))


def picture(tmp_path):
    """Image of F12, (height, width, 3) linear."""
    scene = bpy.context.scene
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", str(tmp_path / "f12.exr")
    bpy.ops.render.render(write_still=True)
    return scenes.pixels(bpy.data.images.load(str(tmp_path / "f12.exr")))


@pytest.mark.parametrize("engine", ["CYCLES", "EEVEE"])
def test_f12_shows_the_scene_with_its_baked_images(seen, tmp_path, engine):
    bpy.context.scene.beamspread.render_engine = engine
    found = picture(tmp_path)
    assert found.shape == (6, 8, 3)
    assert found == pytest.approx(np.tile([0.25, 0.5, 0.75], (6, 8, 1)), abs=2e-3)
    assert bpy.context.scene.render.engine == "BEAMSPREAD"


def test_f12_renders_the_frame_the_border_and_each_view_layer(seen, tmp_path):
    scene = bpy.context.scene
    seen.location.x = 5
    seen.keyframe_insert("location", frame=1)
    seen.location.x = 0
    seen.keyframe_insert("location", frame=2)
    scene.frame_set(2)
    scene.view_layers.new("Second")
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_max_x = 0.5
    found = picture(tmp_path)
    assert found.shape == (6, 4, 3)
    assert found == pytest.approx(np.tile([0.25, 0.5, 0.75], (6, 4, 1)), abs=2e-3)


def test_f12_ends_soon_when_it_should_and_keeps_no_picture(seen):
    engine, scene = MagicMock(resolution_x=1024, resolution_y=1024), bpy.context.scene
    engine.test_break.side_effect = [False] * 30 + [True] * 1000  # asked ten times a second
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 1_000_000, False
    began = time.monotonic()
    render_picture(engine, bpy.context.evaluated_depsgraph_get())
    assert time.monotonic() - began < 30
    engine.end_result.assert_called_once_with(engine.begin_result.return_value, cancel=True)
    engine.report.assert_not_called()
    assert engine.begin_result.return_value.load_from_file.call_count == 0


def test_f12_says_how_far_it_is(seen):
    engine, scene = MagicMock(resolution_x=64, resolution_y=64), bpy.context.scene
    engine.test_break.return_value = False
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 2000, False
    render_picture(engine, bpy.context.evaluated_depsgraph_get())
    told = [call.args[0] for call in engine.update_progress.call_args_list]
    assert any(0 < fraction <= 1 for fraction in told), told


def test_f12_that_fails_says_why(seen, tmp_path, capfd):
    bpy.context.scene.camera = None
    said = scenes.messages_of(lambda: picture(tmp_path)) + capfd.readouterr().out
    assert "camera" in said


def test_f12_that_fails_says_so_in_one_sentence_and_the_log_has_the_rest(seen, caplog):
    engine = MagicMock(resolution_x=64, resolution_y=64)
    engine.test_break.return_value = False
    bpy.context.scene.camera = None
    render_picture(engine, bpy.context.evaluated_depsgraph_get())
    (_, said), _ = engine.report.call_args
    assert re.fullmatch(
        r"Cycles failed on a copy of the scene: [^.:|]*camera[^.:|]*\. The console has the details\.", said
    )
    engine.error_set.assert_called_once_with(said)
    assert "Traceback" in caplog.text


def test_f12_comes_without_denoising_where_there_is_none_and_says_so(seen):
    engine = MagicMock(resolution_x=64, resolution_y=64)
    engine.test_break.return_value = False
    bpy.context.scene.cycles.use_denoising = True
    render_picture(engine, bpy.context.evaluated_depsgraph_get())
    assert engine.begin_result.return_value.load_from_file.call_count == 1
    said = [call.args for call in engine.report.call_args_list]
    assert said == [({"WARNING"}, "The picture was not denoised: this Blender has no denoiser.")] * (
        not compat.has_denoiser()
    )
    assert bpy.context.scene.cycles.use_denoising  # the scene's own setting stays
