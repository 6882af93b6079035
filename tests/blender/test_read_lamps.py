"""Lamps with a size against Cycles, and the properties of a lamp that are read."""

import math

import bpy
import numpy as np
import pytest
import scenes
from _native_test import is_delta
from beamspread.core.scene.lights import AreaLight, PointLight, SpotLight, SunLight
from cycles_truth import add_receiver, cycles_irradiance, our_irradiance, read
from mathutils import Euler, Matrix
from nodes import Nodes

ABOVE = Matrix.Translation((0.3, -0.2, 0.9)) @ Euler((0.35, 0.25, 0.4)).to_matrix().to_4x4()
KINDS = {
    "sun": ("SUN", {"angle": 0.3}),
    "point": ("POINT", {"shadow_soft_size": 0.3}),
    "spot": ("SPOT", {"shadow_soft_size": 0.2, "spot_size": 1.4, "spot_blend": 0.4}),
    "square": ("AREA", {"size": 0.8}),
    "rectangle": ("AREA", {"shape": "RECTANGLE", "size": 1.1, "size_y": 0.3}),
    "disk": ("AREA", {"shape": "DISK", "size": 0.7}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 1.2, "size_y": 0.4, "spread": 2.5}),
}
needs_4_5 = pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="came in Blender 4.5")


def add_lamp(kind, matrix=ABOVE, name="Lamp", **options):
    return scenes.add_lamp(None, 20, kind, name, matrix, radius=None, color=(1, 0.5, 0.25), **options)


def the_light():
    illumination = read()
    assert (illumination.messages, len(illumination.lights)) == ((), 1)
    return illumination.lights[0]


def assert_agrees(samples=512, whole=0.004, each=0.005):
    """Means of 8 x 8 texels within 1 %, the sum closer. At borders Cycles samples only a part of a texel."""
    plane, image = add_receiver(Matrix())
    cycles = cycles_irradiance(plane, image, samples)
    ours, _ = our_irradiance(plane)
    bpy.data.objects.remove(plane)
    cycles, ours = (np.nan_to_num(one).reshape(8, 8, 8, 8, 3).mean(axis=(1, 3))[1:-1, 1:-1] for one in (cycles, ours))
    assert ours.max() > 0
    np.testing.assert_allclose(ours, cycles, rtol=0.01, atol=each * ours.max())
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), cycles.sum(axis=(0, 1)), rtol=whole)


@pytest.mark.parametrize(("kind", "options"), KINDS.values(), ids=KINDS.keys())
def test_kinds(kind, options):
    add_lamp(kind, **options)
    assert_agrees()


SCALES = {"stretched": (1.6, 0.5, 1.2, 1), "mirrored": (-1.3, 0.8, 1, 1), "inverted": (-0.7, -1, -1, 1)}


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES.keys())
@pytest.mark.parametrize("name", ["sun", "point", "spot", "rectangle", "ellipse"])
def test_scaled(name, scale):
    kind, options = KINDS[name]
    turn = Matrix.Rotation(math.pi, 4, "X") if scale[2] < 0 else Matrix()
    add_lamp(kind, ABOVE @ turn @ Matrix.Diagonal(scale), **options)
    assert_agrees()


def test_an_area_below_a_mirroring_parent():
    lamp = add_lamp("AREA", Matrix.Translation((0.2, 0, -0.9)) @ Matrix.Rotation(2.7, 4, "X"), size=0.7)
    parent = bpy.data.objects.new("Parent", None)
    bpy.context.collection.objects.link(parent)
    parent.matrix_world = Matrix.Diagonal((1, 1, -1, 1)) @ Matrix.Rotation(0.2, 4, "Y")
    lamp.parent = parent
    assert_agrees()


@pytest.mark.parametrize("name", ["sun", "point", "rectangle"])
def test_penumbra(name):
    """A wall, whose half-shadow is as wide as the lamp."""
    kind, options = KINDS[name]
    scenes.add_blocker(0.5)
    add_lamp(kind, ABOVE @ Matrix.Rotation(0.3, 4, "Y"), **options)
    assert_agrees(whole=0.005, each=0.015)


def test_fields():
    matrix = Matrix.Translation((1, 2, 3)) @ Matrix.Diagonal((2, 3, 4, 1))
    frame = ((2, 0, 0), (0, 3, 0), (0, 0, 4))
    lamps = {name: add_lamp(*kind[:1], matrix, name=name, **kind[1]) for name, kind in KINDS.items()}
    lights = {light.name: light for light in read().lights}
    assert set(lights) == set(lamps)
    sun, point, spot = (lights[name] for name in ("sun", "point", "spot"))
    assert [type(one) for one in (sun, point, spot)] == [SunLight, PointLight, SpotLight]
    assert (sun.direction, sun.angle) == ((0, 0, -1), pytest.approx(0.3))
    assert (point.position, point.radius) == ((1, 2, 3), pytest.approx(0.3))
    assert (spot.frame, spot.radius, spot.blend) == (frame, pytest.approx(0.2), pytest.approx(0.4))
    for name, size_y, is_round, spread in (
        ("square", 0.8, False, math.pi),
        ("rectangle", 0.3, False, math.pi),
        ("disk", 0.7, True, math.pi),
        ("ellipse", 0.4, True, 2.5),
    ):
        area = lights[name]
        assert isinstance(area, AreaLight)
        assert (area.size_x, area.size_y) == pytest.approx((KINDS[name][1]["size"], size_y))
        assert (area.is_round, area.spread, area.frame) == (is_round, pytest.approx(spread), frame)


@pytest.mark.parametrize(
    ("kind", "option"), [("SUN", "angle"), ("POINT", "shadow_soft_size"), ("SPOT", "shadow_soft_size")]
)
def test_without_size(kind, option):
    add_lamp(kind, **{option: 0})
    assert is_delta(the_light().native())


def test_a_soft_falloff_is_a_disk():
    lamp = add_lamp("POINT", shadow_soft_size=0.4)
    if not hasattr(lamp.data, "use_soft_falloff"):
        assert the_light().shape == "disk"
        return
    for soft in (True, False):
        lamp.data.use_soft_falloff = soft
        assert the_light().shape == ("disk" if soft else "sphere")
        assert_agrees()


def portal(lamp):
    lamp.data.cycles.is_portal = True


def no_power(lamp):
    lamp.data.energy = 0


def black(lamp):
    lamp.data.color = (0, 0, 0)


def not_for_diffuse(lamp):
    lamp.visible_diffuse = False


def hidden(lamp):
    lamp.hide_render = True


def without_shader(lamp):
    Nodes(lamp.data, clear=True)


DARK = [portal, no_power, black, not_for_diffuse, hidden, without_shader]


@pytest.mark.parametrize("darken", DARK)
def test_dark_lamps(darken):
    darken(add_lamp("AREA", size=0.5))
    plane, image = add_receiver(Matrix(), texels=4)
    if darken is not portal:  # of a portal without a world Cycles 4.5 crashes
        assert cycles_irradiance(plane, image, 16).max() == 0
    illumination = read()
    assert (illumination.lights, illumination.messages) == ((), ())


def zero_size(lamp):
    lamp.data.size = 0


def flat(lamp):
    lamp.scale = (1, 0, 1)


def nothing(lamp):
    lamp.scale = (0, 0, 0)


def flat_along_its_axis(lamp):
    lamp.scale = (1, 1, 0)


@pytest.mark.parametrize("shrink", [zero_size, flat, nothing, flat_along_its_axis])
@pytest.mark.parametrize("kind", ["AREA", "POINT", "SUN", "SPOT"])
def test_no_size_at_all(kind, shrink):
    """True if the light agrees with Cycles, or a message names the node."""
    lamp = add_lamp(kind, size=0.5) if kind == "AREA" else add_lamp(kind)
    if kind != "AREA" and shrink is zero_size:
        pytest.skip("lamps without a size have tests of their own")
    shrink(lamp)
    illumination = read()
    plane, image = add_receiver(Matrix())
    cycles = np.nan_to_num(cycles_irradiance(plane, image, 64))
    ours, _ = our_irradiance(plane)
    if not illumination.lights:
        (warning,) = illumination.messages
        assert "'Lamp' is left out" in warning.text
    elif cycles.any():
        bpy.data.objects.remove(plane)
        assert_agrees()
    else:
        assert not ours.any()


@needs_4_5
@pytest.mark.parametrize(("kind", "options"), KINDS.values(), ids=KINDS.keys())
def test_exposure_temperature_and_normalize(kind, options):
    lamp = add_lamp(kind, ABOVE @ Matrix.Diagonal((1.5, 1.2, 1, 1)), **options)
    lamp.data.exposure, lamp.data.use_temperature, lamp.data.temperature = 1.5, True, 3000
    lamp.data.normalize = False
    assert_agrees()


@needs_4_5
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN"])
def test_normalize_without_size(kind):
    lamp = add_lamp(kind, **({"angle": 0} if kind == "SUN" else {"shadow_soft_size": 0}))
    lamp.data.normalize = False
    assert_agrees()


def link_emission(lamp, kind, output=0, inputs=(), socket="Color", **properties):
    """Link a new node to an input of the lamp's emission."""
    nodes = Nodes(lamp.data)
    nodes.set(nodes.of_type("EMISSION").inputs[socket], nodes.add(kind, inputs, **properties).outputs[output])


def test_nodes_that_fold():
    lamp = add_lamp("POINT", shadow_soft_size=0.2)
    link_emission(lamp, "Blackbody", 0, {0: 2500})
    link_emission(lamp, "LightFalloff", "Quadratic", {"Strength": 3}, "Strength")
    assert_agrees()


@pytest.mark.parametrize("output", ["Linear", "Constant", "Quadratic"])
def test_a_falloff_of_another_kind_is_left_to_cycles(output):
    link_emission(add_lamp("POINT"), "LightFalloff", output, {"Smooth": 1}, "Strength")
    illumination = read()
    text = "The light 'Lamp' is baked without its nodes. The node 'Light Falloff' is not supported."
    assert {name: str(message) for name, message in illumination.by_cycles.items()} == {"Lamp": text}
    assert [*map(str, illumination.messages)] == [text]
    assert len(illumination.lights) == 1


@pytest.mark.parametrize("kind", ["TexIES", "TexImage", "TexNoise"])
def test_gobos_and_profiles_are_left_to_cycles(kind):
    image = {"image": bpy.data.images.new("Gobo", 4, 4)} if kind == "TexImage" else {}
    link_emission(add_lamp("SPOT"), kind, **image)
    assert list(read().by_cycles) == ["Lamp"]


def test_holdout_and_indirect_collections_light_all_the_same():
    lamp = add_lamp("AREA", size=0.5)
    bpy.context.scene.collection.children.link(scenes.new_collection("Away", lamp))
    layer = bpy.context.view_layer.layer_collection.children["Away"]
    layer.holdout = layer.indirect_only = True
    assert_agrees()


def test_instances_and_their_visibility():
    lamp = add_lamp("POINT", Matrix())
    holder = scenes.add_instancer(scenes.new_collection("Instanced", lamp), Matrix.Translation((0, 0, 1)))
    assert_agrees()
    holder.visible_diffuse = False
    plane, image = add_receiver(Matrix(), texels=4)
    assert bool(read().lights) == cycles_irradiance(plane, image, 16).any()
