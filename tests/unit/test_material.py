"""Materials: presets, checks and base colours."""

import math

import beamspread
import numpy as np
import pytest
from beamspread import Material, presets
from beamspread.core.bake.surface import Surface
from beamspread.core.errors import MaterialError
from beamspread.core.ldf.albedo import MAX_ALBEDO, albedo_from_color, albedo_from_reflectance
from beamspread.core.material import check_thickness

GOOD = {"albedo": (0.9, 0.5, 0.0), "mean_free_path": (1e-3, 2e-3, 3e-3)}


def coefficients(material):
    """sigma_s and sigma_a per mm, (2, 3)."""
    extinction = 1e-3 / np.array(material.mean_free_path)
    return extinction * np.array(material.albedo), extinction * (1 - np.array(material.albedo))


def test_marble_has_the_coefficients_of_jensens_table():
    marble = presets()["marble"]
    scattering, absorption = coefficients(marble)
    assert scattering == pytest.approx([2.19, 2.62, 3.00])
    assert absorption == pytest.approx([0.0021, 0.0041, 0.0071])
    assert (marble.anisotropy, marble.anisotropy_rgb, marble.ior) == (0, None, 1.5)
    assert "Jensen et al. 2001" in marble.source
    assert "anisotropy 0" in marble.source


def test_regular_milk_has_the_coefficients_of_narasimhans_table():
    milk = presets()["regular_milk"]
    scattering, absorption = coefficients(milk)
    assert scattering == pytest.approx([18.2052, 20.3826, 22.3698])
    # Printed for 15 ml in 23 litres of water, in 1e-2 per mm: extinction less scattering, two digits at most.
    assert absorption == pytest.approx(np.array([0.0001, 0.0003, 0.0013]) * 1e-2 * 23000 / 15, rel=1e-3)
    assert milk.anisotropy_rgb == (0.750, 0.714, 0.681)
    assert milk.anisotropy == pytest.approx(0.715)
    assert milk.ior == 1.33
    assert "Narasimhan et al. 2006" in milk.source


@pytest.mark.parametrize(
    ("name", "reduced"),
    [
        ("lowfat_milk", [0.89187, 1.5136, 2.532]),
        ("regular_milk", [4.5513, 5.8294, 7.136]),
        ("espresso", [0.72378, 0.84557, 1.0247]),
        ("white_grapefruit_juice", [0.22826, 0.23998, 0.32748]),
        ("gatorade", [0.0024574, 0.003007, 0.0037325]),
    ],
)
def test_reduced_scattering_agrees_with_other_users_of_the_table(name, reduced):
    """The values of pbrt's table of media, per mm; the columns for sigma_s and g must belong together."""
    material = presets()[name]
    assert coefficients(material)[0] * (1 - np.array(material.anisotropy_rgb)) == pytest.approx(reduced, rel=1e-4)


def test_every_preset_can_be_baked_and_says_where_it_is_from():
    assert len(presets()) == 12 + 17
    for material in presets().values():
        material.check()
        assert all(1e-5 < length < 0.1 for length in material.mean_free_path)
        assert all(0 <= g <= 0.95 for g in material.channel_anisotropy)
        assert material.ior in (1.3, 1.33, 1.5)
        assert "200" in material.source


def test_one_anisotropy_keeps_absorption_and_reduced_scattering():
    milk = presets()["regular_milk"]
    similar = milk.with_one_anisotropy()
    assert similar.channel_anisotropy == (milk.anisotropy,) * 3
    before, after = coefficients(milk), coefficients(similar)
    assert after[1] == pytest.approx(before[1])
    assert after[0] * (1 - milk.anisotropy) == pytest.approx(before[0] * (1 - np.array(milk.anisotropy_rgb)))
    marble = presets()["marble"]
    assert marble.with_one_anisotropy() is marble


def test_preset_without_measured_absorption_states_its_assumption():
    assert "assumed" in presets()["spectralon"].source
    assert "assumed" not in presets()["marble"].source


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"albedo": (0.5, 1.0, 0.5)}, ["albedo", "green", "1", "below 1"]),
        ({"albedo": (-0.1, 0.5, 0.5)}, ["albedo", "red", "-0.1"]),
        ({"albedo": (0.5, 0.5, math.nan)}, ["albedo", "blue", "nan"]),
        ({"mean_free_path": (1, -2, 1)}, ["mean free path", "green", "-2", "above 0"]),
        ({"mean_free_path": (1, 1, 0)}, ["mean free path", "blue", "0"]),
        ({"mean_free_path": (math.inf, 1, 1)}, ["mean free path", "red", "inf"]),
        ({"anisotropy": 1.0}, ["anisotropy", "1"]),
        ({"anisotropy": -1.5}, ["anisotropy", "-1.5"]),
        ({"anisotropy_rgb": (0.5, 0.5, 1.0)}, ["anisotropy", "1"]),
        ({"ior": 0.9}, ["IOR", "0.9", "1 or more"]),
        ({"ior": math.inf}, ["IOR", "inf"]),
    ],
)
def test_check_names_the_fault(values, words):
    with pytest.raises(MaterialError) as caught:
        Material(**(GOOD | values)).check()
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize("thickness", [-1.0, math.nan, math.inf])
def test_thickness_out_of_range(thickness):
    with pytest.raises(MaterialError, match="thickness"):
        check_thickness(thickness)


def test_albedo_from_reflectance_inverts():
    for value in (0.0, 0.1, 0.5, 0.899):
        assert 0.9 * albedo_from_reflectance(value, lambda albedo: 0.9 * albedo**3) ** 3 == pytest.approx(
            value, abs=1e-9
        )


def test_a_color_that_a_medium_cannot_reflect_becomes_its_extreme():
    assert albedo_from_reflectance(0.95, lambda albedo: 0.2 + 0.7 * albedo) == MAX_ALBEDO
    assert albedo_from_reflectance(0.1, lambda albedo: 0.2 + 0.7 * albedo) == 0


MEDIA = [(0.95, 1.0, math.inf), (0.8, 1.4, math.inf), (0.0, 1.6, 2.0), (-0.5, 1.0, 10.0)]


@pytest.fixture(params=MEDIA, ids=str)
def noisy(request, monkeypatch):
    """A medium and its library, of few photons: the inversion has to be exact for a noisy one as well."""
    medium = beamspread.Medium(*request.param)
    simulated = beamspread.simulate(medium, [0, 25, 50, 70, 80, 88], 500)
    monkeypatch.setattr("beamspread.core.ldf.albedo.library", lambda *_arguments, **_options: simulated)
    return medium, simulated


def test_color_to_albedo_and_back(noisy):
    medium, simulated = noisy
    darkest, brightest = simulated.diffuse_reflectance(0.0), simulated.diffuse_reflectance(MAX_ALBEDO)
    colors = np.linspace(0, 1, 13)
    albedos = np.array([albedo_from_color(color, medium)[0] for color in colors])
    assert (np.diff(albedos) >= 0).all()
    assert (np.diff(albedos)[(colors[1:] < brightest) & (colors[:-1] > darkest)] > 0).all()
    back = [simulated.diffuse_reflectance(albedo) for albedo in albedos]
    assert back == pytest.approx(np.clip(colors, darkest, brightest), abs=1e-9)
    assert 0.9999 < albedos[-1] <= MAX_ALBEDO


def test_diffuse_reflectance_is_the_mean_over_the_hemisphere(noisy):
    """To 1e-4, against Gauss-Legendre with many more points."""
    _, simulated = noisy
    x, weights = np.polynomial.legendre.leggauss(300)
    mu = (x + 1) / 2
    for albedo in (0.2, 0.9, 0.9999):
        totals = [simulated.reflectance(angle, albedo) for angle in np.degrees(np.arccos(mu))]
        assert simulated.diffuse_reflectance(albedo) == pytest.approx((weights * mu * totals).sum(), abs=1e-4)


def test_colors_may_be_numbers_or_arrays(noisy):
    medium, _ = noisy
    grey = albedo_from_color(0.125, medium)
    assert grey == albedo_from_color(np.full(3, 0.125, np.float32), medium) == albedo_from_color([0.125] * 3, medium)
    assert [type(value) for value in grey] == [float] * 3


@pytest.mark.parametrize(
    "color", [(0.1, 1.01, 0.1), -0.5, math.nan, (0.5, 0.5), "red", [[0.5, 0.5, 0.5]], None, 0.5 + 0.1j]
)
def test_values_that_are_no_color_are_refused(color):
    with pytest.raises(ValueError, match=r"argument 'color' is .*; allowed: .* 0 to 1"):
        albedo_from_color(color, beamspread.Medium())


def test_masked_colors_are_refused():
    with pytest.raises(ValueError, match="'color' is an array with masked values"):
        albedo_from_color(np.ma.masked_less([0.1, 0.5, 0.5], 0.2), beamspread.Medium())


def test_base_color_makes_the_albedo_irrelevant():
    Surface(Material(albedo=(1, 1, 1), mean_free_path=(1, 1, 1)), base_color=(0.5, 0.5, 0.5)).check()
    with pytest.raises(MaterialError, match="albedo"):
        Surface(Material(albedo=(1, 1, 1), mean_free_path=(1, 1, 1))).check()


@pytest.mark.parametrize("value", [1.3, -0.1, math.nan])
def test_base_color_out_of_range(value):
    with pytest.raises(MaterialError, match=r"base color's green is .* between 0 and 1"):
        Surface(Material(**GOOD), base_color=(0.5, value, 0.5)).check()


def test_media_differ_where_anisotropy_or_thickness_in_mean_free_paths_does():
    marble, milk = presets()["marble"], presets()["regular_milk"]
    assert marble.medium() == beamspread.Medium(g=marble.anisotropy, ior=marble.ior)
    assert [medium.g for medium in milk.medium()] == list(milk.anisotropy_rgb)
    slabs = marble.medium(thickness=0.01)
    assert [slab.thickness for slab in slabs] == pytest.approx([0.01 / length for length in marble.mean_free_path])


@pytest.mark.parametrize("thickness", [0, -1, math.nan])
def test_a_thickness_that_is_no_length_is_refused(thickness):
    with pytest.raises(ValueError, match=r"argument 'thickness' is .*allowed: metres above 0"):
        presets()["marble"].medium(thickness)
