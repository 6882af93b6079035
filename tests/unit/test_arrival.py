"""Irradiance and direction of arriving light, without a medium; bakes that no light reaches."""

import math
from dataclasses import replace

import beamspread
import numpy as np
import pytest
from beamspread.core.bake.bake_settings import COMBINED, DIRECTION, IRRADIANCE, OUTPUTS
from beamspread.core.bake.runner import Bake
from beamspread.core.bake.surface import Surface
from beamspread.core.material import Material
from beamspread.core.scene.illumination import Mesh
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight, WorldLight
from beamspread.core.target import Target

from bakes import SETTINGS, bake_job, square
from helpers import travel

SIZE = 24
MATERIAL = Material(albedo=(0.9, 0.8, 0.7), mean_free_path=(0.02,) * 3, anisotropy=0.0)
SUN = SunLight("Sun", 2.0, (1.0, 0.5, 0.25), True, tuple(travel(60, 30).tolist()))
LAMP = PointLight("Lamp", 40.0, (0.2, 0.4, 0.6), True, (0.1, -0.2, 0.8))
ROOF = Mesh(np.array([[-9, -9, 1], [9, -9, 1], [0, 18, 1]], float), np.array([[0, 1, 2]], np.uint32))
# Sums of a few float32 numbers.
ROUNDING = 1e-5


def job(lights, layer=COMBINED, grid=None, occluders=None, thickness=0.0, material=MATERIAL):
    surface = Surface(material, thickness)
    return bake_job(lights, occluders, surface, replace(SETTINGS, layer=layer), grid or square(SIZE))


def arriving(*lights, **options):
    return tuple(job(lights, layer, **options).run().texture for layer in (IRRADIANCE, DIRECTION))


def lamp_light():
    """E and the way of travel of `LAMP` at the middles of texels: P / (4 pi r^2) times the cosine, by hand."""
    middles = (np.arange(SIZE) + 0.5) / SIZE - 0.5
    x, y = np.meshgrid(middles, middles)
    way = np.stack([x, y, np.zeros_like(x)], -1) - LAMP.position
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    return LAMP.strength * -way[..., 2:] / (4 * math.pi * distance**3) * LAMP.color, way / distance


def test_a_sun_arrives_with_its_cosine_color_and_direction():
    irradiance, direction = arriving(SUN)
    assert irradiance == pytest.approx(np.broadcast_to([1, 0.5, 0.25], irradiance.shape), rel=ROUNDING)
    assert direction == pytest.approx(np.broadcast_to(travel(60, 30), direction.shape), abs=ROUNDING)


def test_means_take_the_falloff_at_the_centers_of_texels():
    """The truth is the middle one of the 9 x 9 fine texels in a coarse texel: the light is far from these."""
    area = AreaLight("Area", 10.0, (1.0, 1.0, 1.0), True, (0.06, 0.06, 0.1), np.eye(3), 0.05, 0.05, False, math.pi)

    def irradiance(grid, **options):
        arriving = [(area.at(grid), [1.0] * 3, None)]
        return beamspread.native.bake_arrival(grid.surface(), arriving, rays=64, **options)[0]

    coarse, fine = square(9), irradiance(square(81))[4::9, 4::9]
    np.testing.assert_allclose(irradiance(coarse, at_centers=True), fine, rtol=0.01)
    assert np.abs(irradiance(coarse) / fine - 1).max() > 0.05


def test_light_of_several_lights_adds_up_and_its_ways_are_weighed_with_its_power():
    lamp, way = lamp_light()
    sun = 2 * math.cos(math.radians(60)) * np.array(SUN.color)
    irradiance, direction = arriving(SUN, LAMP)
    # Texels are means of 2 x 2 points: at most pitch^2 / 8 times the second derivative away from the middle, which is
    # below 12 / height^2 of the light: (1 / 24)^2 / 8 * 12 / 0.8^2 = 0.4 %.
    assert irradiance == pytest.approx(lamp + sun, rel=4e-3)
    flow = lamp.mean(axis=-1, keepdims=True) * way + sun.mean() * travel(60, 30)
    assert direction == pytest.approx(flow / np.linalg.norm(flow, axis=-1, keepdims=True), abs=4e-3)
    assert np.linalg.norm(direction, axis=-1) == pytest.approx(np.ones((SIZE, SIZE)), abs=ROUNDING)


def test_axes_are_those_of_the_texture():
    """Seen from below, the rows run the other way."""
    below = replace(SUN, direction=tuple((travel(60, 30) * [1, 1, -1]).tolist()))
    turned = replace(square(SIZE), origin=(-0.5, 0.5, 0.0), y_axis=(0.0, -1.0, 0.0), normal=(0.0, 0.0, -1.0))
    _, direction = arriving(below, grid=turned)
    assert direction[3, 5] == pytest.approx(travel(60, 30) * [1, -1, 1], abs=ROUNDING)


def test_the_border_of_the_mesh_is_as_bright_as_its_inside():
    """A texel that lies inside by a third shows the light on that third, as renderers' bakes do."""
    part = replace(square(SIZE), coverage=np.full((SIZE, SIZE), 1 / 3, np.float32))
    whole, third = arriving(SUN, LAMP), arriving(SUN, LAMP, grid=part)
    assert all(np.array_equal(one, other) for one, other in zip(whole, third))


def test_shadow_is_dark_and_has_no_direction():
    irradiance, direction = arriving(SUN, occluders=ROOF)
    assert not irradiance.any()
    assert not direction.any()
    free = arriving(replace(SUN, cast_shadow=False), occluders=ROOF)
    assert np.array_equal(free[0], arriving(SUN)[0])


def test_convolve_makes_the_luminance_of_both_passes():
    luminance, irradiance, direction = (job([LAMP], layer).run().texture for layer in (COMBINED, IRRADIANCE, DIRECTION))
    ldf = beamspread.library(beamspread.Medium(g=0.0, ior=1.0), quality="preview")
    medium = ldf, MATERIAL.albedo, MATERIAL.mean_free_path
    again = beamspread.convolve(irradiance, direction, *medium, pitch=1 / SIZE)
    # Both keep every term of so small a plane.
    assert again == pytest.approx(luminance, rel=1e-3)


def no_simulation(*_arguments, **_options):
    raise AssertionError("simulated")


@pytest.fixture
def without_media(monkeypatch):
    """Loading an LDF fails."""
    monkeypatch.setattr("beamspread.core.bake.layers.library", no_simulation)
    monkeypatch.setattr("beamspread.core.ldf.albedo.library", no_simulation)


COLORED = Surface(MATERIAL, base_color=(0.5, 0.4, 0.3))


def test_arriving_light_needs_no_medium(without_media):
    for layer in (IRRADIANCE, DIRECTION):
        assert replace(job([SUN], layer), surface=COLORED).run().texture.any()


@pytest.mark.parametrize("layer", OUTPUTS.values())
@pytest.mark.parametrize(
    "lights", [(), (replace(SUN, direction=(0.0, 0.0, 1.0)),), (replace(LAMP, position=(0, 0, -1.0)),)]
)
def test_a_surely_dark_bake_takes_no_simulation(lights, layer, without_media):
    one = Bake(Target("Plane"), replace(job(lights, layer), surface=COLORED))
    one.run()
    assert one.error == ""
    assert one.is_dark
    assert one.texture.shape == (SIZE, SIZE, 3)
    assert not one.texture.any()
    (warning,) = one.messages
    assert "black" in warning.text


def test_the_medium_is_checked_in_the_dark_too():
    with pytest.raises(beamspread.core.errors.MaterialError, match="albedo"):
        job([], material=replace(MATERIAL, albedo=(1.0, 0.5, 0.5))).run()


@pytest.mark.parametrize("layer", OUTPUTS.values())
def test_a_bake_in_the_shadow_is_dark_and_says_so(layer):
    dark, lit = (Bake(Target("Plane"), job([SUN], layer, occluders=roof)) for roof in (ROOF, None))
    for one in (dark, lit):
        one.run()
    assert (dark.is_dark, lit.is_dark) == (True, False)
    assert [("No light reaches 'Plane'" in warning.text) for warning in dark.messages] == [True]
    assert not lit.messages


def test_a_medium_that_absorbs_all_light_is_not_dark():
    one = Bake(Target("Plane"), job([SUN], material=replace(MATERIAL, albedo=(0.0, 0.0, 0.0))))
    one.run()
    assert not one.texture.any()
    assert not one.is_dark
    assert not one.messages


@pytest.mark.parametrize(
    ("width", "samples", "remedy"),
    [(0.3, 4, "Raise Samples to "), (0.5, 9, "Raise Samples to 16."), (0.004, 4, "Widen the gaps")],
)
def test_noise_of_light_through_gaps_is_named_with_a_way_out_that_helps(width, samples, remedy):
    """Below a plate with a slit; the number of samples that is named is enough. 15 have 512 rays as 12 do."""
    rows = tuple(map(tuple, np.eye(3)))
    world = WorldLight("World", 1.0, (1.0, 1.0, 1.0), True, np.ones((4, 8, 3), np.float32), rows)
    corners = [(x, y, 1.0) for x0, x1 in ((-30, -width / 2), (width / 2, 30)) for x in (x0, x1) for y in (-30, 30)]
    plate = Mesh(np.array(corners, float), np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]], np.uint32))

    def noise_of(samples):
        settings = replace(SETTINGS, samples=samples, layer=IRRADIANCE)
        done = bake_job([world], plate, Surface(MATERIAL), settings, square(SIZE)).run()
        return [message for message in done.illumination.messages if "of noise" in message.text]

    (message,) = noise_of(samples)
    assert message.remedy.startswith(remedy)
    if remedy.startswith("Raise"):
        assert not noise_of(int(message.remedy.strip(".").rsplit(" ", 1)[1]))
