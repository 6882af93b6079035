"""The world's light: suns in its image become lights of their own, and the rest needs few terms."""

import math

import numpy as np
import pytest
from _native_test import irradiance
from beamspread.core.bake import spread_light
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.material import Material
from beamspread.core.messages import Level
from beamspread.core.native import native
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import SunLight, WorldLight
from beamspread.core.scene.lights.sky_sun import REACH, directions
from beamspread.core.scene.occluders import Mesh

from bakes import bake, square
from shapes import FACES

TILTED = np.array([[6, 2, -3], [-3, 6, -2], [2, 3, 6]]) / 7  # a rotation
ROWS = tuple(map(tuple, TILTED.tolist()))
WIDTH, HEIGHT = 1440, 720
TOWARDS = directions(WIDTH, HEIGHT, slice(None)).reshape(HEIGHT, WIDTH, 3)


def disk(toward, angle, radiance, sky=(0.3, 0.5, 0.9)):
    """Even sky with a disk of a full angle, radians: averages of 3 x 3 points in each texel."""
    fine = directions(3 * WIDTH, 3 * HEIGHT, slice(None)) @ np.asarray(toward, float)
    share = (fine > math.cos(angle / 2)).reshape(HEIGHT, 3, WIDTH, 3).mean((1, 3))
    return (np.array(sky) + share[..., None] * np.array(radiance)).astype(np.float32)


def direction(azimuth, elevation):
    across = math.cos(elevation)
    return np.array([across * math.cos(azimuth), across * math.sin(azimuth), math.sin(elevation)])


def world(image, strength=1.0, color=(1.0, 1.0, 1.0), to_world=ROWS):
    return WorldLight("Sky", strength, color, True, image, to_world)


@pytest.mark.parametrize("elevation", [0.1, 0.8, 1.5])
@pytest.mark.parametrize("degrees", [0.5, 1.0])
def test_a_sun_is_a_light_of_its_own(degrees, elevation):
    """Texels are a quarter of a degree wide, and those at the disk's border make it wider: the mean square distance
    from its middle grows by a third of the square of their side.
    """
    toward, angle = direction(2.0, elevation), math.radians(degrees)
    image = disk(toward, angle, (3e4, 2e4, 1e4))
    sky, sun = world(image, 2.0, (1.0, 0.5, 0.25)).parts()
    assert isinstance(sun, SunLight)
    assert sky.radiance.max() == np.float32(0.9)
    np.testing.assert_allclose(sun.direction, -TILTED @ toward, atol=math.radians(0.05))
    solid_angle = math.pi * math.sin(angle / 2) ** 2
    np.testing.assert_allclose(sun.rgb() / (2 * solid_angle), (3e4, 1e4, 0.25e4), rtol=0.05)
    assert sun.angle == pytest.approx(math.hypot(angle, math.radians(0.25) * math.sqrt(8 / 3)), rel=0.1)


def test_parts_add_up_to_the_world():
    """To rounding, for surfaces that face the sun and for others: a disk of one degree is narrow."""
    toward = direction(-1.0, 0.5)
    whole = world(disk(toward, math.radians(1.0), (3e4, 2e4, 1e4)))
    sky, sun = whole.parts()
    for normal in (TILTED @ toward, TILTED[:, 2], (0.0, 0.0, 1.0)):
        facing = tuple(np.asarray(normal, float) / np.linalg.norm(normal))
        expected = light_on(whole, facing)
        assert light_on(sun, facing).max() > 0.1 * expected.max()
        np.testing.assert_allclose(light_on(sky, facing) + light_on(sun, facing), expected, rtol=2e-4)


def light_on(light, normal):
    return np.array(irradiance(light.native(), (0.0, 0.0, 0.0), normal)) * light.rgb()


@pytest.mark.parametrize(
    ("degrees", "radiance"),
    [(4.0, 9e3), (1.0, 3e3)],
    ids=["a wide lamp", "a spot with little light"],
)
def test_other_bright_places_stay_part_of_the_sky(degrees, radiance):
    light = world(disk(direction(2.0, 0.8), math.radians(degrees), (radiance,) * 3))
    assert light.parts() == (light,)


def test_coarse_images_dark_ones_and_wrong_ones_have_no_sun():
    coarse = np.zeros((32, 64, 3), np.float32)
    coarse[20, 7] = 1e4
    dark = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    endless, unknown = dark.copy(), dark.copy()
    endless[400, 7], unknown[400, 7] = np.inf, np.nan
    for image in (coarse, dark, endless, unknown):
        light = world(image)
        assert light.parts() == (light,)


def test_suns_have_one_kernel():
    assert pytest.approx(native.SunLight.max_parallel_angle, rel=1e-12) == 2 * REACH
    image = disk(direction(2.0, 0.8), math.radians(1.2), (9e3,) * 3)
    assert all(light.is_parallel for light in world(image).parts()[1:])
    assert len(world(image).parts()) == 2


def test_two_suns():
    image = disk(direction(2.0, 0.8), 0.01, (9e4,) * 3) + disk(direction(-2.0, 0.3), 0.01, (5e4,) * 3)
    lights = Illumination([world(image)]).lights
    assert [type(light) for light in lights] == [WorldLight, SunLight, SunLight]
    assert lights[1].strength > lights[2].strength
    assert Illumination(lights).lights == lights  # nothing is left to divide
    assert Illumination([]).lit_by([world(image)]).lights[1:] == lights[1:]


def test_a_world_of_nothing_but_a_sun_is_a_sun():
    image = disk(direction(2.0, 0.8), math.radians(0.5), (3e4,) * 3, sky=(0.0, 0.0, 0.0))
    assert [type(light) for light in Illumination([world(image)]).lights] == [SunLight]


def test_a_bake_says_that_a_sun_is_a_disk():
    """Other worlds and suns need no words."""
    light = world(disk(direction(2.0, 0.8), math.radians(0.5), (3e4,) * 3))
    for illumination in (Illumination([light]), Illumination([]).lit_by([light])):
        ((level, text),) = [(message.level, message.text) for message in illumination.messages]
        degrees = math.degrees(illumination.lights[1].angle)
        assert (level, text) == (Level.INFO, f"The sun in 'Sky' is baked as a disk of {degrees:.2g}°.")
        assert Illumination(illumination.lights).messages == ()


def test_a_sky_needs_few_terms(monkeypatch):
    """A wall hides half of a bright sky with a gradient: against nearly all terms, with the same rays.

    Dropped terms carry noise of rays, too, which cancels in blocks of 48 texels. A tolerance twenty times as large errs
    by 1.6e-3 there.
    """
    grid = square(240, 1.0)
    corners = np.array([(-1, 0.1, 0), (1, 0.1, 0), (1, 0.1, 0.6), (-1, 0.1, 0.6)], float)
    image = (0.2 + 3 * np.maximum(TOWARDS @ direction(1.5, 0.4), 0) ** 4)[..., None] * np.array((1.0, 0.9, 0.7))
    light = world(image.astype(np.float32), to_world=tuple(map(tuple, np.eye(3).tolist())))
    illumination = Illumination([light], Mesh(corners, FACES))
    material = Material(albedo=(0.99, 0.9, 0.6), mean_free_path=(0.01,) * 3, anisotropy=0.8, ior=1.4)
    settings = BakeSettings(samples=2)
    baked = {}
    for tolerance in (1e-5, 5e-3):
        monkeypatch.setattr(spread_light, "TOLERANCE", tolerance)
        baked[tolerance] = bake(grid, illumination, material, 0.0, settings).reshape(5, 48, 5, 48, 3).mean((1, 3))
    np.testing.assert_allclose(baked[5e-3], baked[1e-5], rtol=1e-3)
