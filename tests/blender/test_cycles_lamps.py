"""Lamps and glowing meshes that only Cycles understands, and their linking."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import cycles_light
from beamspread.core.messages import Level
from cycles_truth import cycles_bake, target_material
from indirect_scenes import TEXELS, add_wall, blocks, jobs_of
from mathutils import Matrix
from nodes import Nodes

pytestmark = pytest.mark.usefixtures("few_nodes")


def test_a_lamp_that_only_cycles_understands(monkeypatch):
    """Light and shadow of a checkered lamp beside a plain one against a bake: means of 4 x 4 texels within 2 % of E."""
    monkeypatch.setattr(cycles_light, "NOISE", 0.002)  # of a node: means of 16 have .05 %
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
