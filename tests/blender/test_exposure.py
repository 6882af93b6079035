"""Formats and exposure of batches: what other readers find in a file, divided by its exposure, is the bake."""

import io
import struct
from pathlib import Path

import bpy
import numpy as np
import pytest
from beamspread.blender.read.image_nodes import from_srgb
from beamspread.core.batch.batch_options import FORMATS
from beamspread.core.display import EXPOSURE, png_exposure
from beamspread.core.native import native
from scenes import add_material, add_plane, add_sun, bake, messages_of, node_of, pixels, run_batch, select

from plain_hdr import decoded_hdr

# Relative errors of a mean of 1024 texels by rounding: of sums in 32 bits; of half floats; of 8 bits at random, whose
# last digit is a tenth of the darkest mean; of 16 bits; of 8 bits of the largest channel.
BOUNDS = {"EXR": 1e-5, "EXR_HALF": 5e-4, "PNG": 5e-3, "PNG16": 5e-4, "HDR": 5e-3}


def scene(strength):
    """Mean of a bake, stored in no file."""
    bpy.context.scene.beamspread.resolution = 32
    add_sun(0, strength=strength)
    plane = add_plane(material=add_material())
    mean = bake(plane)[0].mean(axis=(0, 1))
    node_of(plane.data.materials[0]).image = None
    return mean, plane.data.materials[0]


def radiance_of(path, file_format):
    """Linear values of a file and its exposure, by readers of their own where there are any."""
    if file_format.startswith("EXR"):
        values, _, attributes = native.read_exr(path)
        return values, float(attributes.get(EXPOSURE, 1))
    content = Path(path).read_bytes()
    if file_format == "HDR":
        values, lines = decoded_hdr(content)
        digits = 2.0 ** (np.frexp(values.max(axis=2, keepdims=True))[1] - 8)
        assert np.abs(pixels(bpy.data.images.load(path)) - values).max() <= digits.max()  # Blender adds half a digit
        line = next((line for line in lines if line.startswith(b"EXPOSURE=")), b"=1")
        return values, float(line.partition(b"=")[2])
    if file_format == "PNG":
        from PIL import Image

        return from_srgb(np.asarray(Image.open(io.BytesIO(content)), np.float64) / 255), png_exposure(content)
    assert struct.unpack(">B", content[24:25]) == (16,)
    image = bpy.data.images.load(path)
    image.colorspace_settings.is_data = True
    return from_srgb(pixels(image).astype(np.float64)), png_exposure(content)


@pytest.mark.parametrize("file_format", FORMATS)
@pytest.mark.parametrize("exposure", ["auto", "0.01", None])
def test_a_file_divided_by_its_exposure_is_the_bake(tmp_path, file_format, exposure):
    mean, material = scene(strength=40.0)
    assert mean.max() > 1
    options = [] if exposure is None else ["--exposure", exposure]
    (record,) = run_batch("--format", file_format, "--output", tmp_path, *options).bakes
    values, stored = radiance_of(record.path, file_format)
    assert record.exposure == stored == material.get("beamspread_exposure", 1.0)
    is_png = file_format.startswith("PNG")
    if exposure == "auto":
        assert (stored < 1) == is_png  # the other formats hold values above 1
    else:
        assert stored == float(exposure or 1)
    clips = is_png and exposure is None
    assert ("clips values above 1. EXR keeps them, and --exposure auto scales them." in record.message) == clips
    if not clips:
        assert values.mean(axis=(0, 1)) / stored == pytest.approx(mean, rel=BOUNDS[file_format])


def test_the_scene_asks_for_it_as_well(tmp_path):
    scene(strength=40.0)
    settings = bpy.context.scene.beamspread
    settings.format, settings.use_exposure = "PNG16", True
    (record,) = run_batch("--output", tmp_path).bakes
    assert record.exposure < 1
    assert "clips" not in record.message


def test_messages_of_the_window_name_its_own_settings(tmp_path, capfd):
    scene(strength=40.0)
    settings = bpy.context.scene.beamspread
    assert settings.output_dir.startswith("//")
    select(bpy.data.objects["Plane"])
    text = messages_of(bpy.ops.beamspread.bake_animation)
    assert "The scene was never saved, so there is no folder to write to. Save it, or choose another folder." in text
    settings.format, settings.output_dir = "PNG", str(tmp_path)
    bpy.ops.beamspread.bake_files()
    assert "clips values above 1. EXR keeps them, and Fit Exposure scales them." in capfd.readouterr().out
    settings.use_exposure = True
    sun = bpy.data.objects["Sun"].data
    for frame, energy in ((1, 10), (2, 160)):
        sun.energy = energy
        sun.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 2
    bpy.ops.beamspread.bake_animation()
    out = capfd.readouterr().out
    assert "instead of" in out
    assert "EXR files need none." in out
    assert "--" not in out


def test_a_batch_of_a_file_that_was_never_saved_names_its_option():
    scene(strength=40.0)
    (record,) = run_batch().bakes
    assert "Save it, or give another folder by --output." in record.message


def test_frames_have_one_exposure_while_it_fits(tmp_path):
    scene(strength=40.0)
    sun = bpy.data.objects["Sun"].data
    for frame, energy in ((1, 40), (2, 10), (3, 160)):
        sun.energy = energy
        sun.keyframe_insert("energy", frame=frame)
    records = run_batch("--format", "PNG", "--exposure", "auto", "--frames", "1-3", "--output", tmp_path).bakes
    first, second, third = (record.exposure for record in records)
    assert first == second == 4 * third
    assert [("instead of" in record.message) for record in records] == [False, False, True]


def test_values_beyond_half_floats_stay_in_32_bits_and_it_is_said(tmp_path):
    mean, _ = scene(strength=2e6)
    (record,) = run_batch("--format", "EXR_HALF", "--output", tmp_path).bakes
    assert "65504" in record.message
    assert native.read_exr(record.path)[0].mean(axis=(0, 1)) == pytest.approx(mean, rel=1e-5)


def test_directions_need_exr(tmp_path):
    scene(strength=1.0)
    (record,) = run_batch("--pass", "DIRECTION", "--format", "HDR", "--output", tmp_path).bakes
    assert "An HDR file can't hold directions" in record.message
