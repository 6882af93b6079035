"""Nodes of light that Cycles finds: their filter, directions and noise."""

import math

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import child_filter, process
from beamspread.blender.cycles.scene_copy import SceneCopy
from beamspread.core.bake.smoothing import SPLINE_VARIANCE
from beamspread.core.scene.lights import DIRECTIONS, STRATA, WEIGHTS
from mathutils import Euler, Matrix


@pytest.mark.parametrize("variance", [1e-9, 1 / 3, 2.0])
def test_the_filter_knows_its_error(variance):
    """Two halves with noise of 30 %, and the result's noise against the truth, after a Gaussian of the variance: from
    three quarters of it to twice as much, and 7 % at most. Means stay within their noise, and dark nodes stay dark."""
    rng = np.random.default_rng(4)
    x, y = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(80) + 0.5) / 80)
    clean = np.stack([1 + x, 1 + y * y, 2 - x], axis=-1) + 0.5 * (x > 0.6)[..., None]
    inside = np.zeros((80, 96), bool)
    inside[10:20, 15:30] = True
    clean[inside] = 0
    halves = [np.float32(clean * (1 + 0.3 * rng.standard_normal((80, 96, 1)))) for _ in range(2)]
    filtered, noise, blur = child_filter.filter_map(*halves, inside, variance, child_filter.Grid())
    assert not filtered[inside].any()
    np.testing.assert_allclose(filtered.mean(axis=(0, 1)), np.mean(halves, axis=(0, 1, 2)), rtol=1e-5)
    error = (filtered - clean).mean(axis=-1)
    if variance > 0.1:
        reach = np.arange(-8, 9)
        weights = np.exp(-(reach**2) / (2 * variance)) / np.exp(-(reach**2) / (2 * variance)).sum()
        for axis in (0, 1):
            error = np.apply_along_axis(np.convolve, axis, error, weights, "same")
    assert 0.75 < math.sqrt(noise + blur) / np.sqrt((error**2).mean()) < 2
    assert np.sqrt((error**2).mean()) < 0.07


def test_nodes_that_are_dark_by_chance_are_no_insides():
    rng = np.random.default_rng(1)
    rare = np.float32(rng.random((32, 40, 40, 1)) < 0.01) * np.ones(3, np.float32)
    assert not child_filter.insides(rare, child_filter.Grid()).any()
    covered = np.ones((32, 40, 40, 3), np.float32)
    covered[:, 10:13, 10:14] = 0
    np.testing.assert_array_equal(child_filter.insides(covered, child_filter.Grid()), ~covered.any(axis=(0, 3)))


FRAMES = {
    "plain": Matrix(),
    "tilted": Matrix.Translation((0.3, -0.2, 0.5)) @ Euler((0.5, -0.4, 0.8)).to_matrix().to_4x4(),
    "far": Matrix.Translation((3000, -2000, 500)) @ Euler((2.5, 0.4, 0.8)).to_matrix().to_4x4(),
}


def fields_of(chart, **options):
    """Light that arrives on a chart."""
    request = {
        "strata": STRATA.tolist(),
        "light": "DIRECT",
        "only": [],
        "by_lamps": False,
        "totals_by_lamps": False,
        "reflectances": {},
        "textures": {},
        "tolerance": 0.0,
        "variance": SPLINE_VARIANCE,
        "direct": 0.0,
        "open": 0.0,
        "negligible": 0.0,
        "with_world": True,
        "charts": [chart],
        **options,
    }
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy:
        return process.run(copy, "fields", request)


@pytest.mark.parametrize("totals_by_lamps", [False, True])
@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("world", FRAMES.values(), ids=FRAMES.keys())
def test_directions_of_a_glowing_square(world, mirrored, totals_by_lamps):
    """Light on a small plane, stratum by stratum, against sums over the square. The noise is .4 %: within 1.5 % of the
    sum; with 16 samples of a stratum at each of 64 nodes .9 %, within five times that. The flow agrees within 7 %,
    because each stratum counts as one direction and the square fills parts of few.
    """
    side, place = 0.6, np.array((0.5, 0.3, 0.8))
    corners = [place + (x * side / 2, y * side / 2, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    panel = scenes.add_mesh("Panel", [tuple(corner) for corner in corners], [(0, 1, 2, 3)], world)
    panel.data.materials.append(scenes.glowing_material(2.0))
    bpy.context.view_layer.update()
    axes = np.array(world.to_3x3().transposed())
    sign = -1.0 if mirrored else 1.0
    chart = {
        "corner": (np.array(world.translation) + axes.T @ (-0.005 * sign, -0.005, 0)).tolist(),
        "x_axis": (sign * axes[0]).tolist(),
        "y_axis": axes[1].tolist(),
        "normal": axes[2].tolist(),
        "size": [0.01, 0.01],
        "nodes": [8, 8] if totals_by_lamps else [4, 4],
    }
    found = fields_of(chart, most_samples=100 if totals_by_lamps else 1500, totals_by_lamps=totals_by_lamps)
    found = found["radiance_0"].mean(axis=(1, 2, 3))
    steps = (np.arange(200) + 0.5) / 200 - 0.5
    x, y = np.meshgrid(place[0] + side * steps, place[1] + side * steps)
    way = np.stack([x, y, np.full_like(x, place[2])], axis=-1)
    distance = np.linalg.norm(way, axis=-1)
    cosine = place[2] / distance
    power = 2.0 * cosine**2 / distance**2 * (side / 200) ** 2
    ours = np.pi * WEIGHTS * found
    assert ours.sum() == pytest.approx(power.sum(), rel=0.015)
    squared, turn = 1 - cosine**2, np.arctan2(way[..., 1], sign * way[..., 0]) / (2 * np.pi) % 1
    begin, reach, first, part = STRATA.T[:, :, None, None]
    inside = (begin <= squared) & (squared < begin + reach) & (first <= turn) & (turn < first + part)
    atol = (0.045 if totals_by_lamps else 0.015) * power.sum()
    np.testing.assert_allclose(ours, (inside * power).sum(axis=(1, 2)), atol=atol)
    flow = (power[..., None] * -way / distance[..., None]).sum(axis=(0, 1)) * (sign, 1, 1)
    np.testing.assert_allclose(ours @ DIRECTIONS, flow, atol=0.07 * np.linalg.norm(flow))


def test_the_noise_is_as_estimated():
    """Even light on a small plane, where all that differs from node to node is noise; without smoothing afterwards."""
    panel = scenes.add_mesh("Panel", [(0.2, 0, 0.8), (0.8, 0, 0.8), (0.8, 0.6, 0.8), (0.2, 0.6, 0.8)], [(0, 1, 2, 3)])
    panel.data.materials.append(scenes.glowing_material(2.0))
    axes = {"x_axis": [1, 0, 0], "y_axis": [0, 1, 0], "normal": [0, 0, 1]}
    chart = {"corner": [-0.005, -0.005, 0], **axes, "size": [0.01, 0.01], "nodes": [32, 32]}
    found = fields_of(chart, variance=1e-9, most_samples=8)
    assert found["samples"] == 8
    irradiance = np.tensordot(WEIGHTS, found["radiance_0"].mean(axis=3), 1)
    assert 1 < found["noise"] / (irradiance.std() / irradiance.mean()) < 10  # careful where the map is even
    finer = fields_of(chart, variance=1e-9, tolerance=0.5 * float(found["noise"]), most_samples=1000)
    assert 8 < finer["samples"] <= 64
    assert finer["noise"] <= 0.5 * found["noise"]
    assert fields_of(chart, direct=1e3, tolerance=0.01, most_samples=1000)["samples"] == 4  # beside much other light
    assert fields_of(chart, open=1e3, most_samples=1000)["samples"] < 64  # far below the light without obstacles
