"""The scenes of blend_examples/ are read whole, and baked; light in textures agrees with Cycles' path tracing."""

import re
from functools import partial
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import cycles_light
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.jobs.run.batch_run import bake_all
from beamspread.blender.node.find import find_bakeable
from beamspread.blender.node.uv_maps import objects_with_maps
from beamspread.blender.read.geometry import OWN_MAP
from beamspread.blender.read.lights import read_illumination
from beamspread.core.bake.bounced import BouncedLight
from beamspread.core.batch.batch_options import parse

FOLDER = Path(__file__).resolve().parents[2] / "blend_examples"
KINDS = {
    "laser_beams": ["SpotLight"] * 7,
    "obstacle": ["SunLight"],
    # Its world is for the eye alone.
    "marble_floor": ["MeshLight", "PointLight", "SunLight", "SunLight"],
    "low_sun": ["SunLight", "SunLight"],
    "soapstone": ["SunLight", "WorldLight"],
    "stage": ["AreaLight"] + ["SpotLight"] * 4,
    "shop_window": ["AreaLight"] * 2 + ["MeshLight"] * 9,
    "soap_bar": ["PointLight", "WorldLight"],
    "plank_floor": ["SunLight", "WorldLight"],
    "acrylic_letters": ["SpotLight", "WorldLight"],
    "round_soap": ["AreaLight", "WorldLight"],
    "jade_bowl": ["AreaLight", "MeshLight", "PointLight"],
    "marble_head": ["SunLight", "WorldLight"],
    "paper_page": ["PointLight", "WorldLight"],
    "paper_shade": ["PointLight", "WorldLight"],
    "veined_slab": ["SunLight", "SunLight"],
    "quail_egg": ["AreaLight", "WorldLight"],
    "inlay": ["PointLight", "SunLight"],
    "printed_letters": ["SunLight", "SunLight"],
    "freckled_arm": ["SunLight", "SunLight"],
}
PARTS = {"soap_bar": 1, "plank_floor": 35, "acrylic_letters": 6}


def test_all_are_listed():
    assert {path.stem for path in FOLDER.glob("*.blend")} == set(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_all_light_is_understood(name):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    illumination = read_illumination(bpy.context.evaluated_depsgraph_get())
    notes = ["The sun in 'World' is baked as a disk of 1°."] if name == "soapstone" else []
    assert [message.text for message in illumination.messages] == notes
    assert sorted(type(light).__name__ for light in illumination.lights) == KINDS[name]


@pytest.mark.parametrize("name", PARTS)
def test_objects_without_a_fitting_map_get_one(name):
    """They come without a UV map that fits into one image, as artists have them."""
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    targets = find_bakeable(bpy.context.view_layer)
    assert not objects_with_maps()
    (plan,) = read_scene(bpy.context, targets)
    assert objects_with_maps() == {plan.target.object_name}
    assert (len(plan.mesh.parts), plan.mesh.uv_map) == (PARTS[name], OWN_MAP)
    assert len(plan.mesh.messages) == 1  # the new map


@pytest.mark.parametrize("name", KINDS)
def test_all_are_baked(name, tmp_path, monkeypatch):
    # Coarse bounced light is enough here, and takes a fraction of the time.
    monkeypatch.setattr(cycles_light, "BouncedLight", partial(BouncedLight, tolerance=0.1))
    # Bounced light takes long: Cycles would find that of the marble floor, and the planks lie in a room. Only Cycles
    # could find that of the bowl's flame, and not on a mesh that bends.
    arguments = ["--no-indirect"] if name in ("marble_floor", "plank_floor", "jade_bowl") else []
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    bpy.context.scene.beamspread.quality = "preview"
    report = bake_all(parse([*arguments, "--resolution", "32", "--output", str(tmp_path)]))
    assert report.bakes
    assert {bake.status for bake in report.bakes} == {"written"}
    assert not any(bake.dark or bake.left_out for bake in report.bakes)


@pytest.mark.parametrize("name", KINDS)
def test_all_open_ready_to_bake(name):
    """Through the camera, with a quick preview, the objects of the bake selected, and the side bar with its panel."""
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"), load_ui=True)
    (space,) = [area.spaces.active for area in bpy.data.screens["Layout"].areas if area.type == "VIEW_3D"]
    assert (space.region_3d.view_perspective, space.shading.type) == ("CAMERA", "MATERIAL")
    assert space.shading.use_scene_lights
    assert space.shading.use_scene_world
    assert space.show_region_ui
    baked = {target.object_name for target in find_bakeable(bpy.context.view_layer)}
    assert {obj.name for obj in bpy.context.selected_objects} == baked
    assert bpy.context.view_layer.objects.active.name in baked


# Texels of the bake that the path tracing covers, and those along the side of its blocks.
TRACED = {
    "printed_letters": (np.s_[:], 8),
    "freckled_arm": (np.s_[16:112, 24:168], 4),
    "veined_slab": (np.s_[:], 12),
    "inlay": (np.s_[:], 8),
}
# Mean error beyond the noise of the paths, with the noise of the bake, and error of the total, whose paths have noise
# below .1 %. Bent textures have the bounds of tests/statistical/test_bent_textures.py, here for less contrast.
OFF = {
    "printed_letters": (0.01, 0.005),
    "freckled_arm": (0.02, 0.01),
    "veined_slab": (0.015, 0.005),
    "inlay": (0.025, 0.01),
}
OF_CONVENTION = 0.7  # most of the convention's error


def traced(name):
    """Means over blocks by Cycles' paths, (rows, columns, 3), and the part of their mean error that is noise."""
    file = FOLDER / f"{name}_paths.csv"
    noise = float(re.search(r"mean error of ([.0-9]+)%", file.read_text(encoding="utf-8"))[1]) / 100
    row, column, *colors = np.loadtxt(file, delimiter=",", comments="#", skiprows=3).T
    return np.stack(colors, -1).reshape(int(row.max()) + 1, int(column.max()) + 1, 3), noise


def distance(values, truth, noise):
    """Mean error beyond noise, over the mean."""
    off = abs(values - truth).mean() / truth.mean()
    return np.sqrt(max(off**2 - noise**2, 0))


@pytest.mark.parametrize("name", TRACED)
def test_light_in_textures_agrees_with_paths(name, tmp_path):
    part, side = TRACED[name]
    truth, noise = traced(name)
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))  # the baked file lies beside it
    obj = bpy.context.view_layer.objects.active
    node = next(node for node in obj.active_material.node_tree.nodes if node.bl_idname == "BeamspreadNode")
    baked = {}
    for node.texture_method in ("SCATTERED", "MULTIPLIED"):
        (texture,) = scenes.bake(obj)
        rows, columns = truth.shape[:2]
        baked[node.texture_method] = texture[part].reshape(rows, side, columns, side, 3).mean(axis=(1, 3))
    off = distance(baked["SCATTERED"], truth, noise)
    assert off < OFF[name][0]
    assert off < OF_CONVENTION * distance(baked["MULTIPLIED"], truth, noise)
    assert abs(baked["SCATTERED"].mean() / truth.mean() - 1) < OFF[name][1]
