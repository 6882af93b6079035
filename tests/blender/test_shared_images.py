"""Surfaces that share an image: objects, materials of one mesh, planes. Each fills its own texels and margin."""

from contextlib import nullcontext

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images import files, waiting
from beamspread.blender.images.shared import read_parts, within
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run.bake_run import BakeRun
from beamspread.blender.jobs.state import Status, state
from beamspread.core.errors import ImageError
from beamspread.core.native import native
from beamspread.core.target import Target
from live_scenes import live_pixels, shown_pixels, switch_off

SIDE, MARGIN = 64, 8

PLACES = {"Left": (4.3, 5.6, 28.4, 57.2), "Right": (34.5, 7.4, 60.1, 59.7)}
"""Corners of the two surfaces in the image, texels; 6 texels lie between them, fewer than the margin."""

BOTH = 2


@pytest.fixture(autouse=True)
def light():
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin = False, MARGIN
    scenes.add_world((0.3, 0.5, 0.2, 1))
    return scenes.add_lamp((0.4, -0.6, 2.0), power=200)


def uvs_of(name):
    left, bottom, right, top = PLACES[name]
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)]) / SIDE


def make_image(kind, folder):
    if kind == "EXR file":
        return scenes.file_image(folder / "shared.exr", SIDE, SIDE)
    if kind == "PNG file":
        image = bpy.data.images.new("Bytes", SIDE, SIDE)
        image.filepath_raw, image.file_format = str(folder / "shared.png"), "PNG"
        image.save()
        bpy.data.images.remove(image)
        return bpy.data.images.load(str(folder / "shared.png"))
    return bpy.data.images.new("Shared", SIDE, SIDE, float_buffer=True, alpha=False)


def two_objects(image, materials=2):
    """Two planes with an image each in the left and in the right half; one material or two."""
    media = [scenes.add_material(f"M{number}", image=image, linked=True) for number in range(materials)]
    planes = []
    for number, name in enumerate(PLACES):
        left, bottom, right, top = PLACES[name]
        size = (right - left) / 26, (top - bottom) / 26  # so that a new image is square
        plane = scenes.add_plane(name, size, uvs=uvs_of(name), material=media[number % materials])
        plane.location.x = 1.5 * number
        planes.append(plane)
    bpy.context.view_layer.update()
    return planes


def two_materials(image):
    """One mesh of two planes at a right angle, with a material each."""
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1)]
    mesh = scenes.add_mesh("Corner", vertices, [(0, 1, 2, 3), (3, 2, 5, 4)], uvs=[*uvs_of("Left"), *uvs_of("Right")])
    for number in range(2):
        mesh.data.materials.append(scenes.add_material(f"M{number}", image=image, linked=True))
    mesh.data.polygons[1].material_index = 1
    return mesh


def coverage(name):
    return native.coverage(uvs_of(name) * SIDE, np.array([4], np.uint32), SIDE, SIDE)


def nearest():
    """Number of the surface nearest to each texel by rings, `BOTH` if they are as near, -1 beyond both margins."""
    rings = []
    for name in PLACES:
        rows, columns = np.nonzero(coverage(name) > 0)
        y, x = np.mgrid[:SIDE, :SIDE]
        beside = [np.maximum(line.min() - at, at - line.max()) for line, at in ((columns, x), (rows, y))]
        rings.append(np.maximum(np.maximum(*beside), 0))
    rings = np.stack(rings)
    number = np.where(rings[0] == rings[1], BOTH, rings.argmin(axis=0))
    return np.where(rings.min(axis=0) > MARGIN, -1, number)


KINDS = ["EXR file", "PNG file", "packed"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("materials", [1, 2])
def test_a_bake_of_one_object_leaves_the_texels_of_the_other(kind, materials, light, tmp_path):
    image = make_image(kind, tmp_path)
    planes = two_objects(image, materials)
    scenes.bake(*planes)
    check_each_alone(image, light, lambda number: scenes.bake(planes[number]))


def check_each_alone(image, light, bake):
    """Each bake changes the texels nearest to its surface, and no others."""
    part, before, changed = nearest(), scenes.pixels(image).copy(), []
    assert (before[part >= 0] > 0).all()
    for number in range(2):
        light.data.energy *= 0.5
        bake(number)
        after = scenes.pixels(image).copy()
        changed.append((after != before).any(axis=-1))
        assert not changed[-1][(part != number) & (part != BOTH)].any()
        assert changed[-1][part == number].mean() > 0.99
        before = after
    assert not (changed[0] & changed[1]).any()


@pytest.mark.parametrize("kind", KINDS)
def test_a_bake_leaves_the_texels_of_a_surface_that_was_never_baked(kind, tmp_path):
    """Its texels may be of a bake by another program, or painted. The margin ends half way between the two."""
    image = make_image(kind, tmp_path)
    painted = np.zeros((SIDE, SIDE, 4), np.float32)
    painted[...] = 1
    painted[..., :3] = np.random.default_rng(1).integers(0, 255, (SIDE, SIDE, 3)) / 255
    image.pixels.foreach_set(painted.ravel())
    image.save() if image.source == "FILE" else image.pack()
    before = scenes.pixels(image).copy()
    planes = two_objects(image)
    for number in (1, 0):
        scenes.bake(planes[number])
        after, part = scenes.pixels(image), nearest()
        is_changed = (after != before).any(axis=-1)
        assert not is_changed[(part != number) & (part != BOTH)].any()
        assert is_changed[part == number].mean() > 0.98
        before = after.copy()


def test_the_order_of_bakes_does_not_matter(tmp_path):
    images = [make_image("packed", tmp_path) for _ in range(3)]
    planes = two_objects(images[0])
    results = []
    for image, order in zip(images, ([0, 1], [1, 0], [])):
        for plane in planes:
            scenes.node_of(plane.data.materials[0]).image = image
        for number in order:
            scenes.bake(planes[number])
        results.append(scenes.pixels(image) if order else scenes.bake(*planes)[0])
    np.testing.assert_array_equal(results[1], results[0])
    np.testing.assert_array_equal(results[2], results[0])


def test_margins_continue_their_own_surface():
    """Two lamps, red and green, over dark ground: where both margins meet, each has its color."""
    bpy.context.scene.world = None
    bpy.data.objects.remove(bpy.data.objects["Lamp"])
    image = make_image("packed", None)
    planes = two_objects(image)
    for number, plane in enumerate(planes):
        plane.location.x = 30.0 * number
        node = scenes.node_of(plane.data.materials[0])
        node.albedo = [(0.9, 0, 0), (0, 0.9, 0)][number]
    scenes.add_sun(10)
    pixels = scenes.bake(*planes)[0]
    assert not pixels[nearest() == 0][:, 1].any()
    assert not pixels[nearest() == 1][:, 0].any()
    assert (pixels[nearest() == 0][:, 0] > 0).all()
    assert (pixels[nearest() == 1][:, 1] > 0).all()


def test_two_materials_of_one_mesh_share_an_image_or_have_one_each(light, tmp_path):
    shared = make_image("packed", tmp_path)
    mesh = two_materials(shared)
    scenes.bake(mesh)
    part, together = nearest(), scenes.pixels(shared).copy()
    assert (together[part >= 0] > 0).all()
    # Each in an image of its own.
    images = [make_image("packed", tmp_path) for _ in range(2)]
    for material, image in zip(mesh.data.materials, images):
        scenes.node_of(material).image = image
    scenes.bake(mesh)
    for number, image in enumerate(images):
        np.testing.assert_array_equal(scenes.pixels(image)[part == number], together[part == number])
        # The margin alone reaches beyond the middle.
        beyond = scenes.pixels(image)[part == 1 - number].any(axis=-1)
        assert beyond.mean() < 0.2


def test_a_new_image_of_two_objects_has_margins_that_meet():
    """The first bake makes the image for both."""
    planes = two_objects(None, materials=1)
    bpy.context.scene.beamspread.resolution = SIDE
    scenes.bake(planes[1])
    image = scenes.image_of(planes[1])
    part = nearest()
    assert not scenes.pixels(image)[(part != 1) & (part != BOTH)].any()
    assert (scenes.pixels(image)[part == 1] > 0).all()
    scenes.bake(planes[0])
    assert scenes.image_of(planes[0]) == image
    assert (scenes.pixels(image)[part >= 0] > 0).all()


def bodies_of_one_material():
    """A box without UVs, a copy with a bevel, another object of its mesh, and a text, of one material without image."""
    bpy.context.scene.beamspread.use_size, bpy.context.scene.beamspread.resolution = False, 128
    material = scenes.add_material()
    bpy.ops.mesh.primitive_cube_add(size=0.5)
    box = bpy.context.object
    box.data.uv_layers.remove(box.data.uv_layers[0])
    box.data.materials.append(material)
    beveled, twin = box.copy(), box.copy()
    beveled.data = box.data.copy()
    for obj in (beveled, twin):
        bpy.context.scene.collection.objects.link(obj)
    beveled.modifiers.new("Bevel", "BEVEL").width = 0.1
    text = bpy.data.objects.new("Text", bpy.data.curves.new("Text", "FONT"))
    text.data.body, text.data.extrude = "L", 0.1
    text.data.materials.append(material)
    bpy.context.scene.collection.objects.link(text)
    objects = [box, beveled, twin, text]
    for number, obj in enumerate(objects):
        obj.location = (1.2 * number, 0, 0)
    bpy.context.view_layer.update()
    return objects


def test_objects_of_one_material_get_maps_side_by_side_in_a_new_image():
    objects = bodies_of_one_material()
    scenes.select(*objects)
    bpy.ops.beamspread.bake()
    assert "\n".join(state.lines()).count("The 4 objects with the material 'Medium' lie side by side in it.") == 4
    assert all(row.status == Status.BAKED for row in state.rows.values())
    image = scenes.image_of(objects[0])
    together = scenes.pixels(image)
    assert max(image.size) == 128
    shown = np.zeros(together.shape[:2], int)
    for obj in objects:
        for column, row, coverage in read_parts(Target(obj.name, "Medium"), tuple(image.size)):
            within(shown, column, row, coverage)[...] += coverage > 0.5
    assert shown.max() == 1
    assert (shown > 0).mean() > 0.3
    assert together[shown == 1][:, :3].min() > 0
    # A bake of one of them leaves the others bit for bit.
    scenes.bake(objects[1])
    assert np.array_equal(scenes.pixels(image), together)


def test_an_object_that_comes_later_has_a_place_once_the_image_is_new():
    """Beside an image it is refused, with the way out; for a new one the maps of earlier bakes are made anew."""
    *first, last = bodies_of_one_material()[:3]
    scenes.select(*first)
    bpy.ops.beamspread.bake()
    scenes.select(last)
    assert "make One Atlas for the Selection" in scenes.messages_of(bpy.ops.beamspread.bake)
    scenes.node_of(first[0].data.materials[0]).image = None
    scenes.select(*first, last)
    bpy.ops.beamspread.bake()
    assert "\n".join(state.lines()).count("The 3 objects with the material 'Medium' lie side by side in it.") == 3
    assert all(row.status == Status.BAKED for row in state.rows.values())


def test_objects_of_several_materials_get_maps_side_by_side():
    """Each object has some of the materials, as parts of characters do; one has faces of a plain one, too."""
    box, beveled, twin, _ = bodies_of_one_material()
    second = scenes.add_material("Second")
    for obj in (box, beveled):
        obj.data.materials.append(second)
        obj.data.polygons[0].material_index = 1
    beveled.data.materials.append(bpy.data.materials.new("Plain"))
    beveled.data.polygons[1].material_index = 2
    twin.data.materials.append(scenes.add_material("Of no face"))
    scenes.select(box, beveled, twin)
    bpy.ops.beamspread.bake()
    said = "\n".join(state.lines())
    assert said.count("The 3 objects with the materials 'Medium' and 'Second' lie side by side in it.") >= 3
    assert "No face" not in said
    names = {(row.target.object_name, row.target.material_name) for row in state.rows.values()}
    assert names == {(obj.name, name) for obj in (box, beveled, twin) for name in ("Medium", "Second")}
    assert all(row.status == Status.BAKED for row in state.rows.values())
    images = {name: scenes.node_of(bpy.data.materials[name]).image for name in ("Medium", "Second")}
    for name, image in images.items():
        shown = np.zeros(scenes.pixels(image).shape[:2], int)
        for obj in (box, beveled, twin):
            for column, row, coverage in read_parts(Target(obj.name, name), tuple(image.size)):
                within(shown, column, row, coverage)[...] += coverage > 0.5
        assert shown.max() == 1
    # A later node of the plain material has its place beside them.
    before = scenes.pixels(images["Medium"]).copy()
    bpy.data.materials["Plain"].use_nodes = True
    bpy.data.materials["Plain"].node_tree.nodes.new("BeamspreadNode")
    assert scenes.bake(beveled)[0].max() > 0
    assert np.array_equal(scenes.pixels(images["Medium"]), before)


def test_an_object_whose_material_has_an_image_gets_a_map_alone():
    objects = bodies_of_one_material()
    scenes.bake(objects[0])
    stale.refresh(bpy.context)
    baked, other = (state.rows[Target(obj.name, "Medium")] for obj in objects[:2])
    assert (other.status, len(other.messages)) == (Status.NEVER, 1)
    assert "has no bake of this object, which shows what lies at its UVs" in other.messages[0].text
    assert other.messages[0] not in baked.messages
    scenes.select(objects[1])
    said = scenes.messages_of(bpy.ops.beamspread.bake)
    assert "lie side by side" not in said + "\n".join(state.lines())
    assert "to the same part of the image" in said


def test_overlapping_surfaces_are_named_before_and_after_the_second_bake():
    image = make_image("packed", None)
    planes = two_objects(image)
    planes[1].data.uv_layers[0].data.foreach_set("uv", np.float32(uvs_of("Left") + [0.2, 0]).ravel())
    planes[1].data.update()
    before = scenes.bake(planes[0])[0].copy()
    (line,) = [line for line in state.lines() if "overlap" in line]
    assert line.startswith("'Left / M0' and 'Right / M1' overlap in the image 'Shared'.")
    scenes.bake(planes[1])
    (line,) = [line for line in state.lines() if "overlaps" in line]
    assert line.startswith("The image 'Shared' belongs to 'Left / M0': 'Right / M1' overlaps it there and now has ")
    assert scenes.image_of(planes[1]) != image
    np.testing.assert_array_equal(scenes.pixels(image), before)


@pytest.mark.usefixtures("live_switched_off")
def test_live_divides_the_texels_as_a_bake():
    planes = two_objects(make_image("packed", None), materials=1)
    material = planes[0].data.materials[0]
    bpy.context.scene.beamspread.use_live = True
    live_pixels(material)
    live = shown_pixels(material).copy()
    switch_off()
    baked = scenes.bake(*planes)[0]
    np.testing.assert_allclose(live, baked, rtol=1e-4, atol=1e-6)


def many_objects(image, count=4):
    """Planes of one material side by side in the image."""
    material, planes = scenes.add_material("Many", image=image, linked=True), []
    for number in range(count):
        left, right = ((number + part) / count for part in (0.1, 0.9))
        uvs = np.array([(left, 0.1), (right, 0.1), (right, 0.9), (left, 0.9)])
        planes.append(scenes.add_plane(f"P{number}", (0.2, 0.8), uvs=uvs, material=material))
        planes[-1].location.x = 0.3 * number
    bpy.context.view_layer.update()
    return planes


@pytest.mark.parametrize("kind", ["EXR file", "PNG file", "packed"])
@pytest.mark.parametrize("last_fails", [False, True])
def test_an_image_waits_for_its_last_object(kind, last_fails, tmp_path, monkeypatch):
    """The first result is shown at once; the others come together, also if the last object has none."""
    image = make_image(kind, tmp_path)
    planes = many_objects(image)
    if last_fails:
        planes[-1].data.clear_geometry()
    results, writes, fill = [], [], files.fill_image

    def counted(*given):
        writes.append(given)
        return fill(*given)

    for pause in (0.0, 1e9):
        writes.clear()
        monkeypatch.setattr(waiting, "PAUSE", pause)
        monkeypatch.setattr(files, "fill_image", counted)
        scenes.select(*planes)
        failing = pytest.raises(RuntimeError, match="'P3' has no faces")
        with failing if last_fails else nullcontext():
            bpy.ops.beamspread.bake()
        monkeypatch.undo()
        count = len(planes) - last_fails
        assert len(writes) == (count if pause == 0 else 2)
        results.append(scenes.pixels(image))
    np.testing.assert_array_equal(results[1], results[0])
    for number in range(count):
        middle = int((number + 0.5) / len(planes) * SIDE)
        assert results[1][SIDE // 2, middle].max() > 0.01


def test_finished_results_of_a_cancelled_run_are_written(tmp_path, monkeypatch):
    """The second result waits when the run is cancelled; the image has it, and nothing of the others."""
    image = make_image("EXR file", tmp_path)
    before, planes, end = scenes.pixels(image), many_objects(image), BakeRun.end

    def end_and_cancel(self, bake):
        end(self, bake)
        if len(self.written) == 2:
            self._progress.cancel()

    monkeypatch.setattr(waiting, "PAUSE", 1e9)
    monkeypatch.setattr(BakeRun, "end", end_and_cancel)
    scenes.select(*planes)
    bpy.ops.beamspread.bake()
    middles = [int((number + 0.5) / len(planes) * SIDE) for number in range(len(planes))]
    changed = [bool((scenes.pixels(image)[SIDE // 2, x] != before[SIDE // 2, x]).any()) for x in middles]
    assert changed == [True, True, False, False]


def test_results_that_can_no_longer_be_written_are_named(tmp_path, monkeypatch):
    image = make_image("EXR file", tmp_path)
    planes, fill, calls = many_objects(image), files.fill_image, []

    def fail_at_last(*given):
        calls.append(given)
        if len(calls) > 1:
            raise ImageError("The disk is full.")
        return fill(*given)

    monkeypatch.setattr(waiting, "PAUSE", 1e9)
    monkeypatch.setattr(files, "fill_image", fail_at_last)
    scenes.select(*planes)
    with pytest.raises(RuntimeError, match="The disk is full") as caught:
        bpy.ops.beamspread.bake()
    assert all(f"P{number} / Many" in str(caught.value) for number in (1, 2, 3))
    assert "P0 / Many" not in str(caught.value)
