"""Objects with several planes: each is baked as if it were alone, in its own place of the image."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.read import geometry
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from live_scenes import live_pixels, switch_off
from mathutils import Matrix

SIDE = 96
MARGIN = 4


@pytest.fixture
def box():
    """A turned box with Blender's own UVs, a cross, above a floor, under a lamp and a grey sky."""
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin, settings.resolution = False, MARGIN, 256
    image = bpy.data.images.new("Target", SIDE, SIDE, float_buffer=True, alpha=False)
    # Light spreads so little that little of it crosses the edges: the planes are baked apart.
    material = scenes.add_material(image=image, linked=True, mean_free_path=(0.003,) * 3)
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    cube = bpy.context.object
    cube.matrix_world = Matrix.Rotation(0.4, 4, "Z") @ Matrix.Translation((0, 0, 0.6))
    cube.data.materials.append(material)
    scenes.add_plane("Floor", (4, 4))
    scenes.add_lamp((1.5, -1.0, 2.5), power=200, radius=0.2)
    scenes.add_world((0.2, 0.2, 0.2, 1))
    return cube


def alone(cube, number):
    """A copy of the box with one face, and a material and an image of its own."""
    mesh = bpy.data.meshes.new("Face")
    polygon = cube.data.polygons[number]
    mesh.from_pydata([cube.data.vertices[v].co for v in polygon.vertices], [], [range(4)])
    layer = mesh.uv_layers.new(name="UVMap")
    for corner, loop in enumerate(polygon.loop_indices):
        layer.data[corner].uv = cube.data.uv_layers[0].data[loop].uv
    image = bpy.data.images.new("Alone", SIDE, SIDE, float_buffer=True, alpha=False)
    mesh.materials.append(scenes.add_material("Alone", image=image, linked=True, mean_free_path=(0.003,) * 3))
    face = bpy.data.objects.new("Face", mesh)
    face.matrix_world = cube.matrix_world
    bpy.context.collection.objects.link(face)
    return face


def texels_of(cube, number):
    """Bool (SIDE, SIDE): texels wholly inside a face."""
    loops = cube.data.polygons[number].loop_indices
    uvs = np.array([cube.data.uv_layers[0].data[loop].uv for loop in loops]) * SIDE
    low, high = np.ceil(uvs.min(axis=0) + 1).astype(int), np.floor(uvs.max(axis=0) - 1).astype(int)
    inside = np.zeros((SIDE, SIDE), bool)
    inside[low[1] : high[1], low[0] : high[0]] = True
    return inside


def test_each_face_of_a_box_is_baked_as_if_it_were_alone(box):
    """The box stays as a shadow: its back faces block the light of the faces that are baked alone."""
    together = scenes.bake(box)[0]
    for number in range(6):
        face = alone(box, number)
        inside = texels_of(box, number)
        expected = scenes.bake(face)[0]
        bpy.data.objects.remove(face)
        assert inside.sum() > 100
        # Both bakes find shadows by rays of the same seed; the material of the box and of the face are the same.
        np.testing.assert_allclose(together[inside], expected[inside], atol=1e-3 * together.max())


def test_live_follows_all_planes(box):
    bpy.context.scene.beamspread.use_live = True
    material = box.data.materials[0]
    live_pixels(material)
    box.location.x += 0.3
    live = live_pixels(material)
    switch_off()
    np.testing.assert_allclose(live, scenes.bake(box)[0], rtol=1e-4, atol=1e-6)


def test_faces_that_take_more_memory_than_allowed_are_refused_before(box, monkeypatch):
    """Ten million quads would take 22 GB; here the machine is small instead."""
    assert pytest.approx(22.4 * 2**30, rel=0.01) == geometry.BYTES_PER_CORNER * 4e7
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=100, y_subdivisions=100, location=(3, 0, 0))
    grid = bpy.context.object
    grid.data.materials.append(scenes.add_material("Fine"))
    monkeypatch.setattr(geometry, "machine_bytes", lambda: 2**24)
    read = []
    polygons_of = geometry.polygons_of
    monkeypatch.setattr(geometry, "polygons_of", lambda *arguments: read.append(1) or polygons_of(*arguments))
    scenes.select(grid)
    with pytest.raises(RuntimeError, match=r"The 10000 faces of 'Grid' take about 0\.0 GB of memory, and 0\.0 GB are"):
        bpy.ops.beamspread.bake()
    assert not read
    assert scenes.bake(box)[0].max() > 0


@pytest.mark.parametrize("extrude", [0.0, 0.05])
def test_text_is_baked_and_so_is_its_mesh(box, extrude):
    """Texels cover the area of all faces; the walls of round letters bend."""
    bpy.ops.object.text_add(location=(3, 0, 0))
    text = bpy.context.object
    text.data.body, text.data.extrude = "AB8%", extrude
    text.data.materials.append(scenes.add_material("Letters", mean_free_path=(1e-4,) * 3))
    assert scenes.bake(text)[0].max() > 0
    bpy.ops.object.convert(target="MESH")
    letters = bpy.context.object
    assert scenes.bake(letters)[0].max() > 0
    evaluated = letters.evaluated_get(bpy.context.evaluated_depsgraph_get())
    polygons = geometry.read_polygons(evaluated, "Letters")
    mesh = flatten(polygons, 1e-4, "Text")
    receiver = build_receiver(mesh, 1024, 1024)
    assert mesh.is_bent == (extrude > 0)
    covered = sum(chart.grid.weights.sum(dtype=float) for chart in receiver.charts)
    # Charts may lack a thousandth of a texel at each border; walls are a texel wide and wider.
    assert covered == pytest.approx(polygons.areas.sum(), rel=2e-3)
