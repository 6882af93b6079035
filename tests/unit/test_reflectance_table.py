"""Reflectances of whole maps of albedos, against the library asked one albedo at a time."""

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.ldf.albedo import MAX_ALBEDO
from beamspread.core.ldf.reflectance_table import reflectance_table

MEDIA = [Medium(0.8), Medium(0.9, 1.5), Medium(0.0, 1.3)]


@pytest.mark.parametrize("medium", MEDIA, ids=str)
def test_a_table_is_the_library(medium):
    """Within 5e-5: steps of the table and its polynomial."""
    known = library(medium)
    albedos = np.concatenate([[0, MAX_ALBEDO], 1 - np.random.default_rng(3).uniform(size=50) ** 4])
    truth = [known.diffuse_reflectance(min(albedo, MAX_ALBEDO)) for albedo in albedos]
    table = reflectance_table(known)
    np.testing.assert_allclose(table.reflectance(albedos), truth, atol=5e-5)
    # Back within the same error of the reflectance.
    np.testing.assert_allclose(table.reflectance(table.albedo(truth)), truth, atol=1e-4)


def test_reflectances_beyond_the_medium_get_its_ends():
    table = reflectance_table(library(Medium(0.8, 1.4)))
    np.testing.assert_allclose(table.albedo([0.0, 1.0]), [0.0, MAX_ALBEDO], atol=1e-6)
