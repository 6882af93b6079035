"""The scenes of blend_examples/ are read whole."""

from pathlib import Path

import bpy
import pytest
from beamspread.blender.read.lights import read_illumination

FOLDER = Path(__file__).resolve().parents[2] / "blend_examples"
KINDS = {
    "laser_beams": ["SpotLight"] * 7,
    "obstacle": ["SunLight"],
    # Its world is for the eye alone.
    "marble_floor": ["MeshLight", "PointLight", "SunLight", "SunLight"],
    "low_sun": ["SunLight", "SunLight"],
    "soapstone": ["WorldLight"],
    "stage": ["AreaLight"] + ["SphereSpotLight"] * 4,
    "shop_window": ["AreaLight"] * 2 + ["MeshLight"] * 9,
}


def test_all_are_listed():
    assert {path.stem for path in FOLDER.glob("*.blend")} == set(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_all_light_is_understood(name):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    illumination = read_illumination(bpy.context.evaluated_depsgraph_get())
    assert illumination.warnings == ()
    assert sorted(type(light).__name__ for light in illumination.lights) == KINDS[name]
