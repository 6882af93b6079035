"""Scenes whose light was once lost without a word: a batch bakes it as Cycles does, or names the light."""

import math

import bpy
import numpy as np
import pytest
from beamspread.core.native import native
from cycles_truth import TEXELS, add_receiver, cycles_irradiance
from mathutils import Euler, Matrix
from nodes import Nodes
from scenes import (
    add_blocker,
    add_lamp,
    add_material,
    add_mesh,
    add_plane,
    add_sun,
    add_world,
    glowing_material,
    run_batch,
)

# Noise of Cycles: that of a texel is at most 1 / sqrt(1024) = 3 % of its light where light is partly hidden or varies
# by as much as its mean, on average below 1 %; that of the sum of 64 x 64 texels below 0.1 %.
SAMPLES = 1024
TOTAL = 0.01
TEXEL = 0.02


def add_light(kind, place=(0.3, -0.2, 1.0), energy=50.0, euler=(0, 0, 0), **properties):
    matrix = Matrix.LocRotScale(place, Euler(euler), None)
    return add_lamp(None, energy, kind, kind.title(), matrix, radius=None, **properties)


def area():
    add_light("AREA", euler=(0.4, 0.3, 0), shape="RECTANGLE", size=0.8, size_y=0.3, color=(1, 0.5, 0.2))


def sky_and_sun():
    nodes, background = add_world(strength=0.5, name="Sky")
    sky = nodes.add("TexSky", sky_type="NISHITA", sun_disc=False, sun_elevation=math.radians(25))
    nodes.set(background.inputs["Color"], sky.outputs[0])
    add_sun(65, 30, strength=2.0)
    add_blocker(0.5)


def soft_sun():
    """Seen through the half-shadow of a card, a third of the plane wide."""
    add_sun(40, 20, strength=2.0).data.angle = math.radians(5)
    add_plane("Card", (0.9, 0.9), Matrix.Translation((-1.6, -0.5, 2.2)))


def soft_point():
    add_light("POINT", place=(-0.4, 0.0, 0.8), shadow_soft_size=0.3)
    add_blocker(0.3)


def glowing_panel():
    matrix = Matrix.Translation((0.1, 0.2, 0.6)) @ Matrix.Rotation(2.6, 4, "X")
    add_plane("Panel", (0.7, 0.4), matrix, material=glowing_material(4.0, (0.3, 0.6, 1, 1)))


def leaf_card():
    """A card with stripes of alpha, which let the sun and a colourless part of it through."""
    nodes = Nodes(bpy.data.materials.new("Leaf"))
    image = bpy.data.images.new("Alpha", 8, 8, alpha=True)
    values = np.zeros((8, 8, 4), np.float32)
    values[:, :4, 3], values[:4, 4:, 3] = 1.0, 0.5
    image.pixels.foreach_set(values.ravel())
    texture = nodes.add("TexImage", image=image, interpolation="Closest")
    nodes.set(nodes.of_type("BSDF_PRINCIPLED").inputs["Alpha"], texture.outputs["Alpha"])
    add_plane("Leaf", (1, 1), Matrix.Translation((0, 0, 0.4)), material=nodes.owner)
    add_sun(20, 70, strength=2.0)


SCENES = [area, sky_and_sun, soft_sun, soft_point, glowing_panel, leaf_card]


@pytest.fixture(autouse=True)
def without_margin():
    bpy.context.scene.beamspread.margin = 0


def compared(tmp_path):
    """The batch's messages about the receiver, its irradiance, and Cycles' irradiance."""
    plane, image = add_receiver(Matrix())
    expected = cycles_irradiance(plane, image, SAMPLES)
    plane.data.materials[0] = add_material()
    arguments = ["--pass", "irradiance", "--no-indirect", "--resolution", str(TEXELS), "--output", str(tmp_path)]
    (record,) = run_batch(*arguments).bakes
    assert record.status == "written", record.message
    return record, native.read_exr(record.path)[0], expected


def agree(ours, expected):
    sums = ours.sum(axis=(0, 1)), expected.sum(axis=(0, 1))
    return sums[0] == pytest.approx(sums[1], rel=TOTAL) and abs(ours - expected).mean() <= TEXEL * expected.mean()


@pytest.mark.parametrize("add", SCENES, ids=[add.__name__ for add in SCENES])
def test_light_arrives_as_in_cycles(add, tmp_path):
    add()
    record, ours, expected = compared(tmp_path)
    assert expected.mean() > 0.1
    assert agree(ours, expected), (ours.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), record.message)
    assert (record.left_out, record.dark) == ([], False)


@pytest.mark.skipif(bpy.app.version < (4, 0, 0), reason="light linking came with Blender 4.0")
def test_a_light_linked_elsewhere_does_not_count(tmp_path):
    elsewhere = bpy.data.collections.new("Elsewhere")
    elsewhere.objects.link(add_mesh("Other", [(9, 9, 9), (9, 8, 9), (8, 9, 9)], [(0, 1, 2)]))
    add_sun(30, strength=5.0).light_linking.receiver_collection = elsewhere
    add_sun(50, 90, strength=1.0)
    _, ours, expected = compared(tmp_path)
    assert expected == pytest.approx(np.full_like(expected, math.cos(math.radians(50))), rel=1e-3)
    assert ours == pytest.approx(expected, rel=1e-3)


def blackbody(nodes, emission):
    nodes.set(emission.inputs["Color"], nodes.add("Blackbody", {0: 2500.0}).outputs[0])


def gobo(nodes, emission):
    checker = nodes.add("TexChecker", {"Vector": nodes.add("TexCoord").outputs["Normal"]})
    nodes.set(emission.inputs["Color"], checker.outputs["Color"])


def ies(nodes, emission):
    text = bpy.data.texts.new("lamp.ies")
    angles = " ".join(str(10 * step) for step in range(10))
    candela = " ".join(str(1000 - 100 * step) for step in range(10))
    header = "IESNA:LM-63-1995\nTILT=NONE\n1 1000 1 10 1 1 2 0 0 0\n1 1 100\n"
    text.write(f"{header}{angles}\n0\n{candela}\n")
    nodes.set(emission.inputs["Strength"], nodes.add("TexIES", ies=text).outputs[0])


@pytest.mark.parametrize("add", [blackbody, gobo, ies])
def test_nodes_of_a_lamp_are_understood_or_named(add, tmp_path):
    nodes = Nodes(add_light("SPOT", spot_size=1.2, shadow_soft_size=0.0, energy=100.0).data)
    add(nodes, nodes.of_type("EMISSION"))
    record, ours, expected = compared(tmp_path)
    assert expected.mean() > 0.01
    if record.left_out:
        (sentence,) = record.left_out
        assert "'Spot'" in sentence
        assert sentence in record.message
    else:
        assert agree(ours, expected), (ours.mean(axis=(0, 1)), expected.mean(axis=(0, 1)))
