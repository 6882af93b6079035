"""Margins of Blender's two types, in bakes and in Live."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.target import Target
from live_scenes import live_pixels, switch_off

SIDE = 128


@pytest.fixture
def box():
    """A box with Blender's own UVs, a cross, smaller than the image; each side has another color."""
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.margin = False, 6
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    layer = box.data.uv_layers[0]
    uvs = np.empty(48, np.float32)
    layer.data.foreach_get("uv", uvs)
    layer.data.foreach_set("uv", 0.1 + 0.8 * uvs)
    image = bpy.data.images.new("Target", SIDE, SIDE, float_buffer=True, alpha=False)
    box.data.materials.append(scenes.add_material(image=image, linked=True, mean_free_path=(0.002,) * 3))
    for angle, color in ((10, (1, 0.1, 0.1)), (80, (0.1, 1, 0.1)), (-80, (0.1, 0.1, 1))):
        scenes.add_sun(angle, 30, color=color)
    scenes.add_world((0.1, 0.1, 0.1, 1))
    return box


@pytest.mark.usefixtures("live_switched_off")
def test_adjacent_faces_lie_beyond_the_edges_of_islands(box):
    settings = bpy.context.scene.beamspread
    extended = scenes.bake(box)[0].copy()
    settings.margin_type = "ADJACENT_FACES"
    adjacent = scenes.bake(box)[0].copy()
    coordinates = np.array([layer.uv for layer in box.data.uv_layers[0].data]) * SIDE
    inside = np.zeros((SIDE, SIDE), bool)
    for face in box.data.polygons:
        low, high = (bound(coordinates[list(face.loop_indices)], axis=0) for bound in (np.min, np.max))
        inside[int(low[1]) : int(np.ceil(high[1])), int(low[0]) : int(np.ceil(high[0]))] = True
    np.testing.assert_array_equal(adjacent[inside], extended[inside])
    is_changed = (np.abs(adjacent - extended) > 0.01 * extended.max()).any(axis=-1)
    assert is_changed.sum() > 200
    # Each texel beyond an edge has a color of some face: none is black or a mean of two.
    faces = adjacent[inside].reshape(-1, 3)
    brightest = faces.max()
    distances = np.abs(adjacent[is_changed][:, None] - faces[None, ::7]).max(axis=2).min(axis=1)
    assert (distances < 0.02 * brightest).mean() > 0.95
    settings.use_live = True
    bpy.data.objects["Sun"].data.energy *= 1.5
    live = live_pixels(box.data.materials[0]).copy()
    switch_off()
    np.testing.assert_allclose(live, scenes.bake(box)[0], rtol=1e-4, atol=1e-6)


def test_another_type_makes_a_bake_out_of_date(box):
    def status():
        stale.refresh(bpy.context)
        return state.rows[Target("Cube", "Medium")].status

    scenes.bake(box)
    assert status() == Status.BAKED
    bpy.context.scene.beamspread.margin_type = "ADJACENT_FACES"
    assert status() == Status.STALE
    bpy.context.scene.beamspread.margin_type = "EXTEND"
    assert status() == Status.BAKED
