"""Interpolation of images, beside plain loops."""

import math

import numpy as np
import pytest
from beamspread.core.scene.lights import WorldLight
from beamspread.core.scene.sampling import bilinear, nearest, resized

IMAGE = np.random.default_rng(1).random((5, 7, 3)).astype(np.float32)
POSITIONS = np.random.default_rng(2).uniform(-9, 16, (2, 300))


def texel(image, column, row, extension):
    """The texel of a column and a row anywhere in the plane."""
    height, width = image.shape[:2]
    if extension == "CLIP" and not (0 <= column < width and 0 <= row < height):
        return np.zeros(3)
    if extension == "REPEAT":
        return image[row % height, column % width]
    if extension == "MIRROR":
        column, row = column % (2 * width), row % (2 * height)
        return image[min(row, 2 * height - 1 - row), min(column, 2 * width - 1 - column)]
    return image[min(max(row, 0), height - 1), min(max(column, 0), width - 1)]


def blend(image, x, y, extension):
    column, row = math.floor(x - 0.5), math.floor(y - 0.5)
    right, up = x - 0.5 - column, y - 0.5 - row
    corners = [(0, 0, (1 - right) * (1 - up)), (1, 0, right * (1 - up)), (0, 1, (1 - right) * up), (1, 1, right * up)]
    return sum(weight * texel(image, column + i, row + j, extension) for i, j, weight in corners)


@pytest.mark.parametrize("extension", ["EXTEND", "REPEAT", "MIRROR", "CLIP"])
def test_positions_anywhere_in_the_plane(extension):
    smooth = bilinear(IMAGE, *POSITIONS, extension, extension)
    coarse = nearest(IMAGE, *POSITIONS, extension, extension)
    for number, (x, y) in enumerate(POSITIONS.T):
        np.testing.assert_allclose(smooth[number], blend(IMAGE, x, y, extension), atol=1e-6)
        np.testing.assert_array_equal(coarse[number], texel(IMAGE, math.floor(x), math.floor(y), extension))


@pytest.mark.parametrize("is_smooth", [True, False])
@pytest.mark.parametrize("size", [(5, 7), (10, 21), (3, 2), (6, 7)])
@pytest.mark.parametrize("extension", ["EXTEND", "REPEAT"])
def test_resized_is_the_interpolation_at_the_new_texels(size, extension, is_smooth):
    rows, columns = ((np.arange(count) + 0.5) * known / count for count, known in zip(size, IMAGE.shape))
    at = tuple(axis.ravel() for axis in np.meshgrid(columns, rows))
    expected = (bilinear if is_smooth else nearest)(IMAGE, *at, extension, extension)
    np.testing.assert_allclose(resized(IMAGE, *size, extension, is_smooth), expected.reshape(*size, 3), atol=1e-6)


@pytest.mark.parametrize("extension", ["EXTEND", "REPEAT", "MIRROR", "CLIP"])
def test_centers_of_texels_have_their_values(extension):
    """But for rounding of positions; a hundredth of a texel away values blend."""
    image = np.random.default_rng(2).random((5, 7, 3))
    y, x = (axis.ravel() for axis in np.mgrid[-2:8, -3:10])
    expected = nearest(image, x + 0.5, y + 0.5, extension, extension)
    for shift in (0.0, 1e-9, -1e-9):
        np.testing.assert_allclose(
            bilinear(image, x + 0.5 + shift, y + 0.5, extension, extension), expected, atol=1e-12
        )
    assert np.abs(bilinear(image, x + 0.51, y + 0.5, extension, extension) - expected).max() > 1e-3


def test_a_coarse_world_has_means_of_texels():
    """By slices where blocks fit into the image, else by sums of what is there."""
    for rows, step in ((24, 3), (25, 3)):
        light = WorldLight(
            "Sky", 1.0, (1, 1, 1), True, np.random.default_rng(4).random((rows, 2 * rows, 3), np.float32), np.eye(3)
        )
        coarse = light.coarse(9 if rows % step else 8)
        expected = [
            [light.radiance[y : y + step, x : x + step].mean((0, 1)) for x in range(0, 2 * rows, step)]
            for y in range(0, rows, step)
        ]
        np.testing.assert_allclose(coarse.radiance, expected, rtol=1e-5)
