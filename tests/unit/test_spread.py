"""Spread of light in texels, and the side of new images."""

import math
from dataclasses import replace

import beamspread as bs
import numpy as np
import pytest
from beamspread.core.bake.spread import (
    MAX_OFFERED,
    MAX_SIDE,
    MIN_SIDE,
    Spread,
    diffuse_notes,
    extent,
    image_length,
    side_for,
    spread_lengths,
    transport_paths,
)
from beamspread.core.bake.surface import Surface
from beamspread.core.scene.polygons import Polygons

MARBLE = bs.presets()["marble"]
DENSITY = 512.0


def test_spread_is_the_diffuse_mean_free_path():
    """Jensen et al. 2001, Fig. 5: reduced scattering and absorption of marble, 1/mm."""
    expected = [1e-3 / math.sqrt(3 * a * (a + s)) for s, a in ((2.19, 0.0021), (2.62, 0.0041), (3.00, 0.0071))]
    np.testing.assert_allclose(spread_lengths(Surface(MARBLE)), expected, rtol=1e-12)


def test_similar_media_spread_as_far():
    """The same absorption and reduced scattering, with forward scattering of .8."""
    scattering, absorption, path = 5.0, 0.1, 1e-3
    material = bs.Material((scattering / (scattering + absorption),) * 3, (path / (scattering + absorption),) * 3, 0.8)
    expected = path / math.sqrt(3 * absorption * (absorption + 0.2 * scattering))
    np.testing.assert_allclose(spread_lengths(Surface(material)), expected, rtol=1e-12)


@pytest.mark.parametrize("thickness", [0.0, 0.002])
@pytest.mark.parametrize("name", ["marble", "skin1", "ketchup"])
def test_a_base_color_spreads_as_far_as_its_albedo(name, thickness):
    """Reflectances are interpolated between 24 albedos: the length is off by less than 2 %."""
    surface = Surface(bs.presets()[name], thickness)
    colored = replace(surface, base_color=tuple(surface.reflectance()))
    np.testing.assert_allclose(spread_lengths(colored), spread_lengths(surface), rtol=0.02)


def test_thin_slabs_spread_less_and_thick_ones_as_a_half_space():
    half_space = spread_lengths(Surface(MARBLE))
    thin, thick = (spread_lengths(Surface(MARBLE, thickness)) for thickness in (0.001, 1.0))
    assert max(thin) < 0.001
    np.testing.assert_allclose(thick, half_space, rtol=1e-3)


@pytest.mark.parametrize(
    ("length", "side"),
    [(0.05, 512), (1.0, 512), (2.0, 1024), (3.9, 2048), (9.0, 4096), (34.0, 4096), (36.0, 2048), (1e4, 2048)],
)
def test_side_of_new_images_of_marble(length, side):
    """512 texels per meter up to 2048, more for two texels in 5.6 mm; 8.5 mm of 35 m are less than a texel of 4096."""
    assert side_for(length, Surface(MARBLE), DENSITY) == side


def test_textures_get_more_texels_and_density_counts():
    assert side_for(0.05, Surface(MARBLE), DENSITY, is_textured=True) == 1024
    assert side_for(1.0, Surface(MARBLE), 1500.0) == 2048
    assert MIN_SIDE <= side_for(1.0, Surface(MARBLE), 1e-3) <= side_for(1.0, Surface(MARBLE), 1e6) <= MAX_SIDE


def test_bent_surfaces_get_no_more_texels_than_their_light_shows():
    """Three texels in a transport mean free path of 5 cm on 8 m, 480, where density asks for 4096.

    Between 512 and 1024 texels, a shadow's border on such a cube differs by .2 % of the brightest texel on average.
    """
    soft = Surface(bs.Material(albedo=(0.9995,) * 3, mean_free_path=(0.01,) * 3, anisotropy=0.8, ior=1.4))
    np.testing.assert_allclose(transport_paths(soft), 0.01 / (1 - 0.9995 * 0.8))
    assert side_for(8.0, soft, DENSITY) == 2048
    assert side_for(8.0, soft, DENSITY, is_bent=True) == 512
    assert side_for(8.0, soft, DENSITY, is_textured=True, is_bent=True) == 2048
    assert side_for(8.0, replace(soft, thickness=0.02), DENSITY, is_bent=True) == 2048
    assert side_for(3.9, Surface(MARBLE), DENSITY, is_bent=True) == 2048  # its light is as sharp as .5 mm


def test_length_of_an_image_by_areas():
    """Two squares of 2 x 2, each on a quarter of the image; without UVs a new map fills 60 %."""
    square = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], float)
    uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) / 2
    normals = np.array([(0.0, 0, 1)] * 2)
    polygons = Polygons(
        np.concatenate([square, square + 3]), np.concatenate([uvs, uvs + 0.5]), np.arange(0, 9, 4), normals
    )
    assert image_length([polygons]) == pytest.approx(4.0)
    assert image_length([replace(polygons, uvs=None)]) == pytest.approx(math.sqrt(8 / 0.6))
    assert image_length([replace(polygons, uvs=10 * polygons.uvs)]) == pytest.approx(math.sqrt(8 / 0.6))
    lost = np.concatenate([polygons.uvs[:4], polygons.uvs[4:] * (1, 1e-14)])
    assert image_length([replace(polygons, uvs=lost)]) == pytest.approx(math.sqrt(8 / 0.6))


def test_a_diffuse_bake_is_named_with_a_side_that_shows_the_spread():
    spread = Spread.of(9.0, Surface(MARBLE), (1024, 1024))
    assert spread.texels == pytest.approx(8.509e-3 * 1024 / 9, rel=1e-3)
    (message,) = spread.messages("Wall")
    assert str(message) == (
        "The light inside 'Wall' spreads over 0.97 texels, so this is a diffuse bake. "
        "Choose a Resolution of 4096, and Resize the image if there is one."
    )
    better = Spread.of(9.0, Surface(MARBLE), (spread.better_side,) * 2)
    assert better.texels >= 2
    assert better.messages("Wall") == []


def test_materials_of_an_object_have_one_note():
    surface, size = Surface(MARBLE), (1024, 1024)
    spreads = [Spread.of(length, surface, size) for length in (9.0, 20.0, 1e3, 1.0)]
    (message,) = diffuse_notes("Room", spreads)
    assert str(message) == (
        "The light inside 'Room' spreads over at most 0.97 texels, so this is a diffuse bake. "
        "Choose a Resolution of 8192, and Resize the image if there is one."
    )
    assert diffuse_notes("Room", spreads[3:]) == []
    assert extent(spreads[:2]) == "0.44 to 0.97 texels"
    assert extent(spreads[2:3]) == "less than 0.01 texels"
    assert extent(spreads[3:]) == "8.7 texels"


def test_no_side_is_offered_where_none_helps():
    (message,) = Spread.of(1e3, Surface(MARBLE), (1024, 1024)).messages("Hill")
    assert f"Even {MAX_OFFERED} texels" in message.remedy
