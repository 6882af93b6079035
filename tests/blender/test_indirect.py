"""Light that Cycles finds on a copy of the scene, bounced and emitted; the scene stays unchanged."""

import importlib
import math
import os
import subprocess
import tempfile
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import cycles_light, process
from beamspread.blender.cycles.folders import PREFIX, remove_leftovers
from beamspread.blender.cycles.scene_copy import SceneCopy
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.blender.node.find import find_node
from beamspread.core.bake.runner import CANCELLED, FAILED
from beamspread.core.bake.smoothing import SPLINE_VARIANCE
from beamspread.core.messages import Level
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import DIRECTIONS, STRATA, WEIGHTS
from beamspread.core.target import Target
from cycles_truth import cycles_bake, target_material
from mathutils import Euler, Matrix
from nodes import Nodes, add_node, set_input

TEXELS, GREY = 32, 0.5


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Few nodes, with noise far below that of bakes."""
    monkeypatch.setattr(cycles_light, "NODES", 32)
    monkeypatch.setattr(cycles_light, "NOISE", 5e-4)
    monkeypatch.setattr(Illumination, "bounce_problem", "They are off.")
    bpy.context.scene.beamspread.use_indirect = True
    bpy.context.scene.beamspread.margin = 0


def add_halves(tree, socket):
    """Link a colour of .9, .5, .1 for x < 0, and .1, .5, .9 beyond."""
    split = add_node(tree, "SeparateXYZ", {0: add_node(tree, "TexCoord").outputs["Object"]})
    step = add_node(tree, "Math", {0: split.outputs[0], 1: 0.0}, operation="GREATER_THAN").outputs[0]
    red, blue = (
        add_node(tree, "Math", {0: step, 1: slope, 2: begin}, operation="MULTIPLY_ADD").outputs[0]
        for slope, begin in ((-0.8, 0.9), (0.8, 0.1))
    )
    set_input(socket, add_node(tree, "CombineXYZ", {0: red, 1: 0.5, 2: blue}).outputs[0])


def add_wall(color=(0.9, 0.6, 0.3)):
    """It stands on the floor, in the light, and leans a little."""
    corners = [(-0.8, 0.3, 0), (0.8, 0.3, 0), (0.8, 0.4, 0.9), (-0.8, 0.4, 0.9)]
    wall = scenes.add_mesh("Wall", corners, [(0, 1, 2, 3)])
    wall.data.materials.append(scenes.diffuse_material(color))
    return wall


def add_scene(material=None):
    floor = scenes.add_plane(
        "Floor", material=material or scenes.add_material(color_mode="BASE_COLOR", base_color=(GREY,) * 3)
    )
    add_wall()
    scenes.add_sun(40, 60, 3.0)
    return floor


def jobs_of(*objects, output="IRRADIANCE"):
    targets = [Target(obj.name, obj.data.materials[0].name) for obj in objects]
    settings = bpy.context.scene.beamspread.for_bake(output=output)
    return list(prepare_scene(bpy.context, targets, settings, TEXELS))


def baked(floor, indirect, output):
    bpy.context.scene.beamspread.use_indirect = indirect
    (bake,) = jobs_of(floor, output=output)
    bake.run()
    assert not bake.error
    return bake.texture


def irradiance(floor, indirect):
    return baked(floor, indirect, "IRRADIANCE")


def blocks(values):
    """Means of 4 x 4 texels."""
    return values.reshape(TEXELS // 4, 4, TEXELS // 4, 4, 3).mean(axis=(1, 3))


def test_a_wall_returns_light_as_in_cycles():
    """Bounced several times, as the floor returns it, too: means of 4 x 4 texels within 2 %, and their noise of 1 %."""
    floor = add_scene()
    ours = blocks(irradiance(floor, True) - irradiance(floor, False))
    material, image = target_material((GREY,) * 3, TEXELS)
    floor.data.materials[0] = material
    # In 3.4 a bake of indirect light alone lacks the lamps' light.
    both, direct = (cycles_bake(floor, image, passes, 2048) for passes in ({"DIRECT", "INDIRECT"}, {"DIRECT"}))
    truth = blocks(both - direct)
    lit = truth > 0.1 * truth.max()
    assert lit.mean() > 0.5
    error = np.abs(ours - truth)[lit] / truth[lit]
    # Beside the wall light changes within a node.
    assert np.median(error) < 0.015
    assert np.percentile(error, 90) < 0.04
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), truth.sum(axis=(0, 1)), rtol=0.01)
    assert truth[..., 0].sum() > 2 * truth[..., 2].sum()  # orange


def test_materials_that_the_scene_does_not_use_are_no_obstacle():
    """Materials of a deleted object, or of another scene, which Cycles' copy lacks."""
    floor = add_scene()
    expected = irradiance(floor, True)
    scenes.add_material("Unused").use_fake_user = True
    np.testing.assert_array_equal(irradiance(floor, True), expected)


@pytest.mark.parametrize("in_group", [False, True])
def test_a_textured_floor_returns_its_colours(in_group):
    """Red on one side, blue on the other, the node's own colour black: against a diffuse floor of the same nodes.

    All of each colour within 2 %; means of 4 x 4 texels within 2.5 % of the brightest, at the median of those lit.
    """
    floor = add_scene(scenes.add_group_material() if in_group else None)
    node = find_node(floor.data.materials[0])
    node.color_mode, node.base_color = "BASE_COLOR", (0, 0, 0)
    add_halves(node.id_data, node.inputs["Base Color"])
    ours = blocks(irradiance(floor, True) - irradiance(floor, False))
    material, image = target_material((0, 0, 0), TEXELS)
    add_halves(material.node_tree, material.node_tree.nodes["Diffuse BSDF"].inputs["Color"])
    floor.data.materials[0] = material
    both, direct = (cycles_bake(floor, image, passes, 512) for passes in ({"DIRECT", "INDIRECT"}, {"DIRECT"}))
    truth = blocks(both - direct)
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), truth.sum(axis=(0, 1)), rtol=0.02)
    lit = truth > 0.1 * truth.max()
    assert np.median((np.abs(ours - truth) / truth.max())[lit]) < 0.025


def test_bounced_light_spreads_as_any_other():
    """The base colour is the reflectance under even light. Light of a leaning wall is uneven, and some leaves at the
    border: its reflectance agrees within 10 %.
    """
    floor = add_scene()
    scenes.node_of(floor.data.materials[0]).mean_free_path = (0.005,) * 3
    arriving, leaving = (
        (baked(floor, True, output) - baked(floor, False, output)).sum(axis=(0, 1))
        for output in ("IRRADIANCE", "LUMINANCE")
    )
    assert arriving[0] > 2 * arriving[2]
    np.testing.assert_allclose(math.pi * leaving / arriving, GREY, rtol=0.1)


@pytest.fixture
def child_filter(monkeypatch):
    """The child's module."""
    monkeypatch.syspath_prepend(Path(process.__file__).parent)
    return importlib.import_module("child_filter")


@pytest.mark.parametrize("variance", [1e-9, 1 / 3, 2.0])
def test_the_filter_knows_its_error(child_filter, variance):
    """Two halves with noise of 30 %, and the result's noise against the truth, after a Gaussian of the variance: from
    three quarters of it to twice as much, and 7 % at most. Means stay within their noise, and dark nodes stay dark."""
    rng = np.random.default_rng(4)
    x, y = np.meshgrid((np.arange(96) + 0.5) / 96, (np.arange(80) + 0.5) / 80)
    clean = np.stack([1 + x, 1 + y * y, 2 - x], axis=-1) + 0.5 * (x > 0.6)[..., None]
    inside = np.zeros((80, 96), bool)
    inside[10:20, 15:30] = True
    clean[inside] = 0
    halves = [np.float32(clean * (1 + 0.3 * rng.standard_normal((80, 96, 1)))) for _ in range(2)]
    filtered, noise, blur = child_filter.filter_map(*halves, inside, variance)
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


def test_nodes_that_are_dark_by_chance_are_no_insides(child_filter):
    rng = np.random.default_rng(1)
    rare = np.float32(rng.random((32, 40, 40, 1)) < 0.01) * np.ones(3, np.float32)
    assert not child_filter.insides(rare).any()
    covered = np.ones((32, 40, 40, 3), np.float32)
    covered[:, 10:13, 10:14] = 0
    np.testing.assert_array_equal(child_filter.insides(covered), ~covered.any(axis=(0, 3)))


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


def test_a_lamp_that_only_cycles_understands():
    """Light and shadow of a checkered lamp beside a plain one against a bake: means of 4 x 4 texels within 2 % of E."""
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    add_wall()
    scenes.add_gobo("POINT")
    scenes.add_sun(40, 60, 1.0)
    (bake,) = jobs_of(floor)
    assert not bake.messages.of(Level.WARNING)
    bpy.context.scene.beamspread.use_indirect = False
    (bake,) = jobs_of(floor)
    assert "Gobo" not in bake.job.illumination.by_cycles
    bake.run()
    assert not bake.error
    ours = bake.texture
    material, image = target_material((1, 1, 1), TEXELS)
    floor.data.materials[0] = material
    truth = cycles_bake(floor, image, {"DIRECT"}, 1024)
    assert np.ptp(truth[..., 0]) > 0.5 * truth[..., 0].max()
    assert np.abs(blocks(ours) - blocks(truth)).mean() < 0.02 * truth.mean()
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=0.01)


def add_checkered_panel():
    """A glowing mesh whose nodes only Cycles understands."""
    material = scenes.glowing_material(8.0)
    nodes = Nodes(material)
    colors = {"Color1": (1, 0.2, 0.1, 1), "Color2": (0, 0.5, 1, 1)}
    checker = nodes.add("TexChecker", {**colors, "Vector": nodes.add("NewGeometry").outputs["Incoming"]})
    nodes.set(nodes.of_type("EMISSION").inputs["Color"], checker.outputs["Color"])
    scenes.add_plane("Gobo", (0.4, 0.4), Matrix.Translation((0.2, 0.1, 1.2)), material=material)


def new_collection(obj, state):
    collection = bpy.data.collections.new("Links")
    collection.objects.link(obj)
    collection.collection_objects[0].light_linking.link_state = state
    return collection


@pytest.mark.skipif(bpy.app.version < (4, 0, 0), reason="light linking came in Blender 4.0")
@pytest.mark.parametrize("add", [lambda: scenes.add_gobo("POINT"), add_checkered_panel], ids=["lamp", "mesh"])
def test_linking_holds_for_light_that_cycles_computes(add):
    """Light that is linked to the floor, and that the wall does not block, against a bake: all of it within 1.5 %, and
    means of 4 x 4 texels within 4 % of E, as the checker's borders are a node wide. The wall would take a third away.
    Where it is not linked to the floor it is not asked for, and not spoken of."""
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    wall = add_wall()
    add()
    bpy.context.scene.world = None
    bpy.context.scene.beamspread.use_indirect = False
    linking = bpy.data.objects["Gobo"].light_linking
    linking.receiver_collection = new_collection(floor, "EXCLUDE")
    (bake,) = jobs_of(floor)
    assert not bake.job.finds_light
    assert not any("Gobo" in str(one) for one in bake.messages)
    blocked = irradiance_of_jobs(floor, linking, new_collection(floor, "INCLUDE"), None)
    ours = irradiance_of_jobs(floor, linking, new_collection(floor, "INCLUDE"), new_collection(wall, "EXCLUDE"))
    assert ours.sum() > 1.3 * blocked.sum()
    material, image = target_material((1, 1, 1), TEXELS)
    floor.data.materials[0] = material
    truth = cycles_bake(floor, image, {"DIRECT"}, 1024)
    assert np.abs(blocks(ours) - blocks(truth)).mean() < 0.04 * truth.mean()
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=0.015)


def irradiance_of_jobs(floor, linking, receivers, blockers):
    linking.receiver_collection, linking.blocker_collection = receivers, blockers
    (bake,) = jobs_of(floor)
    bake.run()
    assert not bake.error
    return bake.texture


def test_leaks_into_a_closed_box_are_no_light(monkeypatch):
    """Blender's first cube around a plane as wide: some ten-millionth of the light gets in along the edges."""
    monkeypatch.setattr(cycles_light, "NODES", 64)
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    bpy.ops.mesh.primitive_cube_add()
    scenes.add_sun(40, 60, 10.0)
    scenes.add_lamp((4, 1, 6), 1000.0).data.shadow_soft_size = 0.1
    bpy.context.scene.world = bpy.data.worlds.new("Grey")
    (bake,) = jobs_of(floor)
    bake.run()
    assert not bake.error
    assert bake.is_dark
    assert "No light reaches 'Floor'" in " ".join(map(str, bake.messages))


def asked(monkeypatch):
    """Numbers of samples of each request, as they come."""
    numbers, run = [], process.run

    def note(*arguments):
        arrays = run(*arguments)
        numbers.append(int(arrays["samples"]))
        return arrays

    monkeypatch.setattr(cycles_light, "run", note)
    return numbers


def test_effort_follows_the_light_that_there_is(monkeypatch):
    """The first samples show that a decal of four triangles returns next to nothing; beside a wall there are more."""
    monkeypatch.setattr(cycles_light, "NOISE", 0.01)
    numbers = asked(monkeypatch)
    floor = scenes.add_plane("Floor", (4, 4), material=scenes.add_material(color_mode="BASE_COLOR"))
    corners = [(-0.2, -0.2, 0.002), (0.2, -0.2, 0.002), (0.2, 0.2, 0.002), (-0.2, 0.2, 0.002), (0, 0, 0.003)]
    decal = scenes.add_mesh("Decal", corners, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    decal.data.materials.append(scenes.diffuse_material((0.8, 0.4, 0.2)))
    scenes.add_sun(40, 60, 3.0)
    scenes.add_lamp((0, 0, 3), 100.0, "AREA")
    (bake,) = jobs_of(floor)
    bake.run()
    monkeypatch.setattr(cycles_light, "NOISE", 0.001)
    add_wall()
    (bake,) = jobs_of(floor)
    bake.run()
    assert not [str(message) for message in bake.messages if "noise" in str(message)]
    assert numbers[0] == 4 < numbers[1]
    monkeypatch.setattr(cycles_light, "NEGLIGIBLE", 1.0)
    (bake,) = jobs_of(floor)
    bake.run()
    assert cycles_light.NOTHING_BOUNCES in bake.messages


def test_noise_that_is_left_is_named(monkeypatch):
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 4)
    (bake,) = jobs_of(add_scene())
    bake.run()
    assert "of noise, relative to all light there" in " ".join(map(str, bake.messages))


def test_nothing_above_a_receiver_means_no_search():
    floor = scenes.add_plane("Floor", material=scenes.add_material())
    scenes.add_sun(40, 60, 3.0)
    below = scenes.add_plane("Below", matrix=Matrix.Translation((0, 0, -1)), material=scenes.add_material("Other"))
    first, second = jobs_of(floor, below)
    assert not first.job.finds_light
    assert second.job.finds_light  # the floor is above it
    bpy.context.scene.beamspread.use_indirect = False
    assert not jobs_of(below)[0].job.finds_light


def state():
    """All that an artist could notice of the scene."""
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    view_layer.update()
    data = {
        kind: [(one.name, one.users, one.is_evaluated) for one in getattr(bpy.data, kind)]
        for kind in ("scenes", "objects", "meshes", "materials", "images", "worlds", "lights", "cameras", "node_groups")
    }
    objects = [
        (
            *(obj.name, obj.hide_render, obj.hide_viewport, obj.visible_glossy, obj.visible_diffuse, obj.mode),
            *(obj.select_get(), obj.hide_get(), [slot.material and slot.material.name for slot in obj.material_slots]),
            [tuple(row) for row in obj.matrix_world],
        )
        for obj in scene.objects
    ]
    trees = [
        (one.name, [(node.name, node.bl_idname) for node in one.node_tree.nodes], len(one.node_tree.links))
        for one in [*bpy.data.materials, *bpy.data.worlds]
        if one.node_tree
    ]
    images = [(one.name, one.is_dirty, one.filepath, one.source, tuple(one.size)) for one in bpy.data.images]
    names = "samples", "seed", "glossy_bounces", "diffuse_bounces", "use_denoising", "sample_clamp_indirect"
    cycles = [getattr(scene.cycles, name) for name in names]
    active = view_layer.objects.active and view_layer.objects.active.name
    frame = scene.frame_current, scene.frame_subframe, scene.render.engine, scene.render.filepath
    return data, objects, trees, images, cycles, active, frame, bpy.data.filepath, bpy.data.is_dirty


def folders():
    return set(Path(tempfile.gettempdir()).glob(f"{PREFIX}{os.getpid()}-*"))


def test_the_scene_stays_as_it_is(monkeypatch, tmp_path):
    floor = add_scene()
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 8)
    dirty = bpy.data.images.new("In memory", 8, 8)
    dirty.pixels[0] = 0.5
    bpy.context.scene.frame_set(7)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    saved = []
    handler = lambda *_: saved.append(1)  # noqa: E731
    bpy.app.handlers.save_pre.append(handler)
    try:
        before, there = state(), folders()
        (bake,) = jobs_of(floor)
        bake.run()
        assert bake.texture is not None
        assert state() == before

        (bake,) = jobs_of(floor)
        broken = tmp_path / "broken.py"
        broken.write_text("import os\nprint('what went wrong', flush=True)\nos._exit(5)\n")
        monkeypatch.setattr(process, "CHILD", broken)
        process.end()
        bake.run()
        assert bake.status == FAILED
        assert "exit code 5" in bake.error
        assert "what went wrong" in bake.error
        assert state() == before
        assert not saved
    finally:
        bpy.app.handlers.save_pre.remove(handler)
    del bake
    assert folders() <= there


def test_cancelling_kills_the_process(monkeypatch):
    floor = add_scene()
    monkeypatch.setattr(cycles_light, "NOISE", 1e-5)
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 300)
    children = []

    class Popen(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            children.append(self)

    process.end()
    monkeypatch.setattr(process.subprocess, "Popen", Popen)
    before, there = state(), folders()
    (bake,) = jobs_of(floor)
    assert not folders() <= there
    fractions = []

    def progress(fraction):
        fractions.append(fraction)
        return fraction < 0.2

    bake.run(progress)
    assert bake.status == CANCELLED
    (child,) = children
    assert child.returncode is not None
    assert child.returncode != 0
    assert 0.2 <= fractions[-1] < 0.5  # it had begun, and had not ended
    assert state() == before
    del bake
    assert folders() <= there


def test_folders_of_killed_processes_go(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    leftover = tmp_path / f"{PREFIX}abc"
    leftover.mkdir()
    ours = SceneCopy(bpy.context.scene, bpy.context.view_layer)
    for folder in (leftover, ours.folder):
        os.utime(folder, (0, 0))
    remove_leftovers()
    assert not leftover.exists()
    assert ours.folder.exists()


def test_a_process_that_is_cancelled_at_once():
    scenes.add_sun()
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy, pytest.raises(native.Cancelled):
        process.run(copy, "world", {}, lambda _fraction: False)
