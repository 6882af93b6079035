"""Materials: presets, checks and base colours."""

import math

import pytest
from beamspread import Material, presets
from beamspread.core.errors import MaterialError
from beamspread.core.job import Surface
from beamspread.core.material import albedo_from_reflectance, check_thickness

GOOD = {"albedo": (0.9, 0.5, 0.0), "mean_free_path": (1e-3, 2e-3, 3e-3)}


def test_presets_follow_from_the_measured_coefficients():
    marble = presets()["marble"]
    assert marble.mean_free_path[0] == pytest.approx(1e-3 / (2.19 + 0.0021))
    assert marble.albedo[2] == pytest.approx(3.00 / (3.00 + 0.0071))
    assert (marble.anisotropy, marble.ior) == (0, 1.5)
    assert "Jensen2001" in marble.source
    assert "anisotropy 0" in marble.source


def test_every_preset_can_be_baked():
    assert len(presets()) == 12
    for material in presets().values():
        material.check()


def test_preset_without_measured_absorption_says_what_it_assumes():
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
        ({"ior": 0.9}, ["IOR", "0.9", "1 or more"]),
        ({"ior": math.inf}, ["IOR", "inf"]),
    ],
)
def test_check_names_what_is_wrong(values, words):
    with pytest.raises(MaterialError) as caught:
        Material(**(GOOD | values)).check()
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize("thickness", [-1.0, math.nan, math.inf])
def test_thickness_out_of_range(thickness):
    with pytest.raises(MaterialError, match="thickness"):
        check_thickness(thickness)


def test_albedo_from_reflectance_inverts():
    albedo = albedo_from_reflectance((0.1, 0.5, 0.0), lambda albedo: 0.9 * albedo**3)
    assert [0.9 * a**3 for a in albedo] == pytest.approx([0.1, 0.5, 0.0], abs=1e-9)


def test_too_bright_a_colour_says_how_bright_it_may_be():
    with pytest.raises(MaterialError, match=r"green is 0\.95.*0\.900"):
        albedo_from_reflectance((0.1, 0.95, 0.1), lambda albedo: 0.9)


def test_base_color_makes_the_albedo_irrelevant():
    Surface(Material(albedo=(1, 1, 1), mean_free_path=(1, 1, 1)), base_color=(0.5, 0.5, 0.5)).check()
    with pytest.raises(MaterialError, match="albedo"):
        Surface(Material(albedo=(1, 1, 1), mean_free_path=(1, 1, 1))).check()
