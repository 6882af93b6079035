"""Links to the node's Base Color that only Cycles can evaluate, at the texels, in a child process."""

import pickle
import time
from dataclasses import replace

import bpy
import numpy as np
import pytest
from beamspread.blender import preferences
from beamspread.blender.cycles import colors as cycles_colors
from beamspread.blender.cycles import process
from beamspread.blender.cycles.colors import BaseColorByCycles
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.jobs.run.bake_run import BakeThread
from beamspread.blender.jobs.state import state
from beamspread.blender.node.find import find_node
from beamspread.core.bake.runner import CANCELLED
from beamspread.core.bake.steps import Solve
from beamspread.core.progress import Progress
from beamspread.core.target import Target
from mathutils import Euler, Matrix
from scenes import (
    add_group_material,
    add_material,
    add_mesh,
    add_plane,
    add_sun,
    bake,
    diffuse_material,
    node_of,
    pixels,
    select,
)

SIZE, CELLS, FINE = 32, 5, 8
DARK, BRIGHT = (0.2, 0.3, 0.4), (0.8, 0.6, 0.4)


@pytest.fixture(autouse=True)
def quick():
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.margin, settings.quality = SIZE, 0, "preview"
    state.forget()


@pytest.fixture
def plane():
    add_sun(30)
    # A mean free path far below a texel: each texel shows its own colour.
    material = add_material(color_mode="BASE_COLOR", base_color=(0.5,) * 3, mean_free_path=(0.001,) * 3)
    return add_plane(material=material)


def with_color(job):
    """The job after Cycles has evaluated its base color."""
    step, *_ = job.steps
    assert isinstance(step, BaseColorByCycles)
    return step.run(job, Progress())


def add_noise(tree, socket):
    noise, place = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeTexCoord")
    noise.inputs["Scale"].default_value = 2.0
    tree.links.new(noise.inputs["Vector"], place.outputs["Generated"])
    tree.links.new(socket, noise.outputs["Color"])


def base_color(material):
    node = find_node(material)
    return node.inputs["Base Color"]


def add_noise_to(material):
    socket = base_color(material)
    add_noise(socket.node.id_data, socket)


def add_checker(material, scale, one, other):
    tree = material.node_tree
    checker, place = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    for name, value in (("Scale", scale), ("Color1", (*one, 1)), ("Color2", (*other, 1))):
        checker.inputs[name].default_value = value
    tree.links.new(checker.inputs["Vector"], place.outputs["UV"])
    tree.links.new(base_color(material), checker.outputs["Color"])


def bake_of(obj, number=0, size=SIZE, **changes):
    settings = bpy.context.scene.beamspread.for_bake(**changes)
    target = Target(obj.name, obj.data.materials[number].name)
    (plan,) = read_scene(bpy.context, [target], size)
    return plan.bake(settings)


def evaluated(obj, number=0):
    """The colour and the coverage of the texels."""
    job = with_color(bake_of(obj, number).job)
    grids = [chart.grid for chart in job.receiver.charts]
    colors = [grid.albedo if grid.base_color is None else grid.base_color for grid in grids]
    return job.receiver.to_texture(colors), job.receiver.coverage


def cycles_emission(obj, tree_of, width, height):
    """Emission that Cycles bakes, with a tree built by `tree_of(tree, socket)`; means of FINE x FINE positions.

    One sample each: with several, Cycles moves those beyond a triangle's edge back into it.
    """
    material = diffuse_material((0, 0, 0), "Truth")
    tree = material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    tree_of(tree, emission.inputs["Color"])
    tree.links.new(tree.nodes["Material Output"].inputs["Surface"], emission.outputs[0])
    image = bpy.data.images.new("Truth", FINE * width, FINE * height, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    tree.nodes.active = target
    obj.data.materials[0] = material
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = 1, False, False
    select(obj)
    bpy.ops.object.bake(type="EMIT", margin=0, use_clear=True)
    return pixels(image).reshape(height, FINE, width, FINE, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("method", ["SCATTERED", "MULTIPLIED"])
def test_the_time_of_a_bake_is_known_before_its_colors(plane, method):
    """Else the pace of the session takes the missing part for a slow machine, and announces it again and again."""
    add_noise_to(plane.data.materials[0])
    node_of(plane.data.materials[0]).texture_method = method
    job = bake_of(plane, size=256).job
    colored = with_color(job)
    colored = replace(colored, steps=colored.steps[1:])
    # The mean color is 0.5 before, and that of the texture after.
    assert Solve().seconds(job) == pytest.approx(Solve().seconds(colored), rel=0.05)
    assert Solve().memory_bytes(job) == Solve().memory_bytes(colored)
    plain = replace(job, steps=job.steps[1:])
    assert (Solve().seconds(job) > 1.5 * Solve().seconds(plain)) == (method == "SCATTERED")


def test_a_checker_by_node_is_one_by_an_image(plane):
    """Within 1 % of the brightest where a texel lies in one cell, and in all. Across borders, where the node has 4 x 4
    places in a texel and the image is looked up at 3 x 3, within a quarter of the step."""
    material = plane.data.materials[0]
    node_of(material).texture_blur = 0.0
    add_checker(material, CELLS, DARK, BRIGHT)
    ours = bake(plane)[0].copy()
    assert state.lines() == []

    fine = 16 * CELLS  # pixels along each side: looked up at 3 x 3 places in each texel
    rows, columns = np.mgrid[:fine, :fine] // 16
    is_dark = (rows + columns) % 2 == 1
    image = bpy.data.images.new("Checker", fine, fine, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    full = np.ones((fine, fine, image.channels), np.float32)
    full[..., :3] = np.where(is_dark[..., None], DARK, BRIGHT)
    image.pixels.foreach_set(full.ravel())
    texel = material.node_tree.nodes.new("ShaderNodeTexImage")
    texel.image, texel.interpolation = image, "Closest"
    material.node_tree.links.new(base_color(material), texel.outputs["Color"])
    truth = bake(plane)[0]
    first = (np.arange(SIZE) * CELLS / SIZE + 1e-6).astype(int)
    last = ((np.arange(SIZE) + 1) * CELLS / SIZE - 1e-6).astype(int)
    is_whole = (first == last)[:, None] & (first == last)
    assert is_whole.mean() > 0.7
    error = np.abs(ours - truth) / truth.max(axis=(0, 1))
    assert error[is_whole].max() < 0.01
    assert error.max() < 0.25 * (1 - min(DARK) / max(BRIGHT))
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=0.01)
    assert np.ptp(ours[is_whole][:, 0]) > 0.7 * truth.max()


WHOLE, TURNED = ((0, 0), (1, 0), (1, 1), (0, 1)), ((0.9, 0.1), (0.9, 0.7), (0.2, 0.7), (0.2, 0.1))
SHEARED = ((0, 0), (0.7, 0), (1, 1), (0.3, 1))


@pytest.mark.parametrize(("uvs", "tolerance"), [(WHOLE, 0.005), (TURNED, 0.005), (SHEARED, 0.06)])
def test_noise_is_as_in_a_bake_of_emission(uvs, tolerance):
    """Texels inside, of the whole range. The sheared map has another grid, and colours between its texels are
    interpolated, where this noise changes by a tenth of its range per texel. Texels that cross the border hold their
    neighbours' colour.
    """
    turn = Euler((0.4, 0.2, 1.1)).to_matrix().to_4x4()
    matrix = Matrix.Translation((3, -2, 5)) @ turn @ Matrix.Diagonal((1, -2, 1, 1))
    add_sun(0)
    obj = add_plane(matrix=matrix, uvs=uvs, material=add_material())
    add_noise_to(obj.data.materials[0])
    ours, coverage = evaluated(obj)
    truth = cycles_emission(obj, add_noise, *coverage.shape[::-1])
    inside, border = coverage > 0.99, (coverage > 0) & (coverage <= 0.99)
    error = np.abs(ours - truth).max(axis=2) / np.ptp(truth[inside])
    assert np.ptp(truth[inside]) > 0.2
    assert error[inside].max() < tolerance
    assert ours[border].min(initial=1) > truth[inside].min() - 0.05
    assert ours[border].max(initial=0) < truth[inside].max() + 0.05


def test_fine_patterns_are_averaged(plane):
    """Cells of a quarter of a texel, of which all are met."""
    add_checker(plane.data.materials[0], 4 * SIZE, (0.1,) * 3, (0.9,) * 3)
    ours, _ = evaluated(plane)
    assert ours == pytest.approx(np.full_like(ours, 0.5), rel=1e-4)


def test_colors_of_vertices_inside_a_group():
    add_sun(0)
    obj = add_plane(material=add_group_material())
    colors = obj.data.attributes.new("Painted", "FLOAT_COLOR", "CORNER")
    left, right = (0.2, 0.4, 0.6, 1), (0.6, 0.4, 0.2, 1)
    colors.data.foreach_set("color", np.ravel([left, right, right, left]))
    socket = base_color(obj.data.materials[0])
    tree = socket.node.id_data
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name = "Painted"
    tree.links.new(socket, node.outputs["Color"])
    ours, _ = evaluated(obj)
    ramp = (np.arange(SIZE) + 0.5) / SIZE
    np.testing.assert_allclose(ours[..., 0], np.broadcast_to(0.2 + 0.4 * ramp, (SIZE, SIZE)), atol=0.01)
    np.testing.assert_allclose(ours[..., 2], np.broadcast_to(0.6 - 0.4 * ramp, (SIZE, SIZE)), atol=0.01)


def test_other_materials_of_the_object_do_not_count():
    """Two sides of a corner share a map; the view hides it, and the other side's image has no pixels."""
    add_sun(30, 180)
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]
    corner = add_mesh("Corner", vertices, [(0, 1, 2, 3), (0, 3, 4, 5)], uvs=[(0, 0), (1, 0), (1, 1), (0, 1)] * 2)
    for index, material in enumerate([add_material("One"), diffuse_material((1, 0, 0), "Other")]):
        corner.data.materials.append(material)
        corner.data.polygons[index].material_index = index
    image = bpy.data.images.new("No file", 8, 8)
    image.source, image.filepath = "FILE", "//is_not_there.png"
    tree = corner.data.materials[1].node_tree
    tree.nodes.new("ShaderNodeTexImage").image = image
    add_noise_to(corner.data.materials[0])
    hidden = bpy.data.collections.new("Hidden")
    bpy.context.scene.collection.children.link(hidden)
    hidden.objects.link(corner)
    bpy.context.collection.objects.unlink(corner)
    corner.hide_viewport = corner.hide_select = hidden.hide_viewport = True
    ours, _ = evaluated(corner)
    assert ours.min() > 0.1
    assert np.ptp(ours) > 0.2


def test_nodes_linked_from_another_file(plane, tmp_path):
    add_noise_to(plane.data.materials[0])
    truth, _ = evaluated(plane)
    library = str(tmp_path / "library.blend")
    bpy.data.libraries.write(library, {plane})
    bpy.data.batch_remove([plane, plane.data.materials[0]])
    with bpy.data.libraries.load(library, link=True) as (_there, wanted):
        wanted.objects = ["Plane"]
    bpy.context.collection.objects.link(wanted.objects[0])
    ours, _ = evaluated(wanted.objects[0])
    np.testing.assert_allclose(ours, truth, atol=1e-4)


def test_a_child_that_fails_is_said_and_the_own_color_counts(plane, monkeypatch, tmp_path, caplog):
    material = plane.data.materials[0]
    own = bake(plane)[0].copy()
    add_noise_to(material)
    broken = tmp_path / "broken.py"
    broken.write_text("import os\nprint('what went wrong', flush=True)\nos._exit(5)\n")
    monkeypatch.setattr(process, "CHILD", broken)
    process.end()
    assert bake(plane)[0] == pytest.approx(own, rel=1e-6)
    (message,) = state.lines()
    assert "could not evaluate the Base Color of 'Plane'" in message
    assert "what went wrong" in caplog.text


def test_it_stops_within_two_seconds_and_leaves_the_scene(plane):
    add_noise_to(plane.data.materials[0])
    kinds = "images", "materials", "meshes", "objects", "node_groups", "scenes"
    before = [len(getattr(bpy.data, kind)) for kind in kinds]
    thread = BakeThread(bake_of(plane), Progress())
    thread.start()
    asked = time.monotonic()
    while not thread.progress.stage.startswith("Evaluating the base color"):
        assert time.monotonic() - asked < 2
        time.sleep(0.01)
    thread.progress.cancel()
    asked = time.monotonic()
    thread.join()
    assert time.monotonic() - asked < 2
    assert thread.bake.status == CANCELLED
    assert before == [len(getattr(bpy.data, kind)) for kind in kinds]


def test_it_is_asked_for_once_in_a_run_and_only_where_it_counts(plane, monkeypatch):
    material = plane.data.materials[0]
    add_noise_to(material)
    asked = []

    def colors(_copy, target, _matrix, receiver, _progress):
        asked.append(target)
        return [np.full((chart.grid.height, chart.grid.width, 3), 0.4, np.float32) for chart in receiver.charts]

    monkeypatch.setattr(cycles_colors, "colors_by_cycles", colors)
    settings, target = bpy.context.scene.beamspread.for_bake(), Target("Plane", material.name)
    (plan,) = read_scene(bpy.context, [target])
    for _ in range(2):
        job = with_color(plan.bake(settings).job)
        assert job.surface.base_color == pytest.approx((0.4,) * 3)
    assert asked == [target]
    assert not any(isinstance(step, BaseColorByCycles) for step in bake_of(plane, output="IRRADIANCE").job.steps)
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(base_color(material), image.outputs["Color"])
    assert not any(isinstance(step, BaseColorByCycles) for step in bake_of(plane).job.steps)


def test_a_job_from_a_file_asks_cycles_for_the_same(plane):
    add_noise_to(plane.data.materials[0])
    job = bake_of(plane).job
    here, again = (with_color(one) for one in (job, pickle.loads(pickle.dumps(job))))
    np.testing.assert_array_equal(here.receiver.charts[0].grid.albedo, again.receiver.charts[0].grid.albedo)
    folder = job.steps[0].copy.scene.folder
    del again
    assert folder.exists()  # it belongs to the job that has made it


def test_the_memory_of_cycles_counts(plane, monkeypatch):
    settings = bpy.context.scene.beamspread
    settings.resolution = 512
    monkeypatch.setattr(preferences, "memory_limit", lambda: 500 * 2**20)  # more than the bake, less than Cycles takes
    assert bake_of(plane, 0, 512).job
    add_noise_to(plane.data.materials[0])
    assert "Evaluating the base color: 512 x 512 texels take about 1.0 GB" in bake_of(plane, 0, 512).error
    assert bake_of(plane, 0, 512, output="IRRADIANCE").job


def test_blenders_own_bake_has_it(plane):
    material = plane.data.materials[0]
    add_noise_to(material)
    ours = bake(plane)[0].copy()
    image = bpy.data.images.new("Active", SIZE, SIZE, float_buffer=True)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node
    bpy.context.scene.render.engine = "BEAMSPREAD"
    bpy.context.scene.render.bake.margin = 0
    select(plane)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert state.lines() == []
    assert pixels(image) == pytest.approx(ours, abs=1e-6)
