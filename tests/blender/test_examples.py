"""The scenes of blend_examples/ are read whole, and baked."""

from pathlib import Path

import bpy
import pytest
from beamspread.blender.jobs.run.batch_run import bake_all
from beamspread.blender.read.lights import read_illumination
from beamspread.core.batch.batch_options import parse

FOLDER = Path(__file__).resolve().parents[2] / "blend_examples"
KINDS = {
    "laser_beams": ["SpotLight"] * 7,
    "obstacle": ["SunLight"],
    # Its world is for the eye alone.
    "marble_floor": ["MeshLight", "PointLight", "SunLight", "SunLight"],
    "low_sun": ["SunLight", "SunLight"],
    "soapstone": ["WorldLight"],
    "stage": ["AreaLight"] + ["SpotLight"] * 4,
    "shop_window": ["AreaLight"] * 2 + ["MeshLight"] * 9,
}


def test_all_are_listed():
    assert {path.stem for path in FOLDER.glob("*.blend")} == set(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_all_light_is_understood(name):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    illumination = read_illumination(bpy.context.evaluated_depsgraph_get())
    assert illumination.messages == ()
    assert sorted(type(light).__name__ for light in illumination.lights) == KINDS[name]


@pytest.mark.parametrize("name", KINDS)
def test_all_are_baked(name, tmp_path):
    # Glowing meshes of the marble floor would send bounced light to Cycles, which takes long.
    arguments = ["--no-indirect"] if name == "marble_floor" else []
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    bpy.context.scene.beamspread.quality = "preview"
    report = bake_all(parse([*arguments, "--resolution", "64", "--output", str(tmp_path)]))
    assert report.bakes
    assert {bake.status for bake in report.bakes} == {"written"}
    assert not any(bake.dark or bake.left_out for bake in report.bakes)
