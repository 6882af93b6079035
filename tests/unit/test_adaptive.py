"""The adaptive solver: within its tolerance of the direct one, and the squares that it finds."""

import math

import numpy as np
import pytest
from beamspread import Medium, adaptive_beams, convolve, simulate
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import lamp, travel

ALBEDO = (0.6, 0.9, 0.3)
SLANTED = travel(55)
PATHS = [0.01, 0.3, 1.0, 5.0, 40.0, 400.0]  # mean free paths in texels

# Errors relative to `tolerance`, of the sum over texels and of the worst one. Single-precision results are off by 1e-7.
ROUNDING = 1e-6


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(0.8), [0, 15, 30, 45, 60, 75, 88], 20_000)


@pytest.fixture(scope="module")
def others():
    return [
        simulate(Medium(0.0, ior=1.4), [0, 30, 60, 85], 5000),
        simulate(Medium(0.5, thickness=4), [0, 30, 60], 5000),
    ]


def fig9(size=120):
    """A round obstacle in the middle of a lit plane, a fifth of it dark, as in the paper's Fig. 8 and 9."""
    y, x = np.mgrid[:size, :size] + 0.5 - size / 2
    return (np.hypot(x, y) > 0.26 * size).astype(np.float32)


def assert_within(tolerance, adaptive, direct):
    for channel in range(direct.shape[2]):
        exact = direct[..., channel].astype(np.float64)
        error = np.abs(adaptive[..., channel] - exact)
        assert error.sum() <= (tolerance + ROUNDING) * exact.sum()
        assert error.max() <= (tolerance + ROUNDING) * exact.max()


def compare(irradiance, direction, ldf, path, tolerance, pitch=1.0):
    arguments = (irradiance, direction, ldf, ALBEDO, path, pitch)
    direct = convolve(*arguments, solver="direct")
    assert_within(tolerance, convolve(*arguments, solver="adaptive", tolerance=tolerance), direct)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    height=st.integers(1, 80),
    width=st.integers(1, 80),
    lit=st.sampled_from([0.02, 0.5, 0.98, 1.0]),
    angle=st.floats(0, 87),
    azimuth=st.floats(-180, 180),
    path=st.sampled_from(PATHS),
    tolerance=st.sampled_from([1e-1, 1e-2, 1e-3, 1e-4]),
)
def test_error_is_below_the_tolerance(library, seed, height, width, lit, angle, azimuth, path, tolerance):
    rng = np.random.default_rng(seed)
    light = (0.5 + rng.random((height, width, 3))) * (rng.random((height, width, 1)) < lit)
    compare(light.astype(np.float32), travel(angle, azimuth), library, path, tolerance)


ROWS, COLUMNS = np.mgrid[:75, :106]
MASKS = {
    "checkerboard": (ROWS + COLUMNS) % 2,
    "checkerboard of 8": (ROWS // 8 + COLUMNS // 8) % 2,
    "stripes": COLUMNS % 2,
    "thin stripes": (ROWS + COLUMNS) % 7 == 0,
    "one texel": (ROWS == 30) & (COLUMNS == 71),
    "corner texel": (ROWS == 74) & (COLUMNS == 105),
    "empty": ROWS < 0,
    "full": ROWS >= 0,
    "half": COLUMNS > 40,
    "gradient": 1 + ROWS / 75 + COLUMNS / 53,
    "bump": np.exp(-((ROWS - 40.0) ** 2 + (COLUMNS - 40.0) ** 2) / 500),
    "two levels": 1 + 3 * (COLUMNS > 40),
    "row": (ROWS >= 0)[:1],
    "column": (ROWS >= 0)[:, :1],
    "single": (ROWS >= 0)[:1, :1],
}


@pytest.mark.parametrize("path", [0.01, 1.0, 5.0, 400.0])
@pytest.mark.parametrize("mask", MASKS)
def test_masks(library, mask, path):
    for tolerance in (1e-2, 1e-3):
        compare(MASKS[mask].astype(np.float32), SLANTED, library, path, tolerance)


@pytest.mark.parametrize("path", [0.3, 3.0, 30.0])
@pytest.mark.parametrize("shape", [(40, 40), (1, 90), (37, 64)])
def test_lamps(library, shape, path):
    light, direction = lamp(shape, height=0.2)
    for mask in (np.ones(shape), np.indices(shape).sum(0) % 2, np.arange(shape[1]) < 20):
        compare((light * mask).astype(np.float32), direction, library, path, 1e-2)


@pytest.mark.parametrize(("height", "mask"), [(0.02, "all"), (0.2, "random"), (0.06, "half")])
def test_radii_that_are_tried(library, height, mask):
    """Planes so large that near radii below the bound are tried: eight points would be 4 times the tolerance off.

    `direct` would take minutes; up to 192 x 192 texels, `fft` keeps all terms.
    """
    light, direction = lamp(190, height=height)
    if mask != "all":
        light *= np.random.default_rng(2).random(light.shape) < 0.95 if mask == "random" else np.arange(190) < 180
    arguments = (light, direction, library, 0.9, 4.0, 1.0)
    exact = convolve(*arguments, tolerance=1e-7)
    assert_within(2e-3, convolve(*arguments, solver="adaptive", tolerance=2e-3), exact)


def test_a_long_plane(library):
    """Coarser grids of coarser grids, along one axis only."""
    light = np.random.default_rng(1).random((2, 3000)).astype(np.float32)
    for path in (1.0, 50.0):
        compare(light, travel(70, 200), library, path, 1e-3)


@pytest.mark.parametrize("azimuth", [0, 37])
@pytest.mark.parametrize("tolerance", [1e-1, 1e-3])
def test_narrow_kernels_on_several_levels(library, tolerance, azimuth):
    """Grazing light's lobe is narrower than the points of coarse grids where these are taken too soon."""
    light = np.random.default_rng(5).random((150, 260)) < 0.5
    compare(light.astype(np.float32), travel(85, azimuth), library, 40.0, tolerance)


def test_texels_need_not_be_square(library):
    for pitch in ((1.0, 0.2), (0.1, 1.0)):
        compare(fig9(90)[:, :70], travel(60, 30), library, 3.0, 1e-3, pitch)


def test_channels_may_have_media_of_their_own(library, others):
    light = np.stack([fig9(64), 2 * fig9(64)[::-1], np.ones((64, 64), np.float32)], -1)
    compare(light, travel(50, 10), [library, *others], (1.0, 3.0, 10.0), 1e-3)


def test_energy_is_kept(library):
    """All light in the middle of a plane comes back: the kernels' power is that of the library."""
    light = np.zeros((201, 201), np.float32)
    light[90:111, 90:111] = math.pi / 21**2
    result = convolve(light, SLANTED, library, ALBEDO, 0.5, 1.0, solver="adaptive", tolerance=1e-3)
    for channel, albedo in enumerate(ALBEDO):
        # 90 texels are 180 mean free paths: next to nothing of these albedos gets farther.
        assert result[..., channel].sum() == pytest.approx(library.reflectance(55, albedo), rel=1e-3)


def test_light_that_does_not_reach_is_zero(library):
    dark = convolve(np.zeros((9, 12), np.float32), SLANTED, library, ALBEDO, 1.0, 1.0, solver="adaptive")
    assert dark.shape == (9, 12, 3)
    assert not dark.any()


@pytest.mark.parametrize("exponent", [-100, 66, 96])
def test_light_of_any_power(library, exponent):
    """A power of two times the light is as much times the result, bit for bit."""
    light, direction = lamp((20, 33))
    for d in (SLANTED, direction):
        once, scaled = (
            convolve(np.ldexp(light, e), d, library, ALBEDO, 4.0, 1.0, solver="adaptive") for e in (0, exponent)
        )
        assert np.array_equal(np.ldexp(once, exponent), scaled)


def covered(beams, shape):
    """How many beams light each texel."""
    count = np.zeros(shape, int)
    for beam in beams:
        assert beam["row"] + beam["size"] <= shape[0]
        assert beam["column"] + beam["size"] <= shape[1]
        count[beam["row"] : beam["row"] + beam["size"], beam["column"] : beam["column"] + beam["size"]] += 1
    return count


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), height=st.integers(1, 40), width=st.integers(1, 40), lit=st.floats(0.5, 1))
def test_every_lit_texel_is_in_one_beam(seed, height, width, lit):
    light = (np.random.default_rng(seed).random((height, width)) < lit).astype(np.float32)
    beams = adaptive_beams(light, SLANTED)
    assert np.array_equal(covered(beams, light.shape), light)
    assert beams["power"].sum() == pytest.approx(light.sum())


def largest_squares(mask, y=0, x=0, size=64):
    """Top-down search by its definition."""
    part = mask[y : y + size, x : x + size]
    if not part.any():
        return []
    if part.size == size * size and part.all():
        return [(y, x, size)]
    half = size // 2
    return [s for dy in (0, half) for dx in (0, half) for s in largest_squares(mask, y + dy, x + dx, half)]


def test_beams_are_the_largest_squares():
    mask = fig9(50)[:, :37]
    beams = adaptive_beams(mask, SLANTED, pitch=(0.5, 0.25))
    found = sorted(zip(beams["row"].tolist(), beams["column"].tolist(), beams["size"].tolist()))
    assert found == sorted(largest_squares(mask))
    assert beams["power"] == pytest.approx(beams["size"] ** 2 * 0.125)


def test_uneven_light_splits_squares():
    light = np.ones((32, 32), np.float32)
    assert len(adaptive_beams(light, SLANTED)) == 1
    light[:, 16:] = 2
    assert sorted(adaptive_beams(light, SLANTED)["size"]) == [16] * 4
    light[5, 5] = 1.0001
    assert len(adaptive_beams(light, SLANTED, tolerance=1e-3)) == 4
    assert len(adaptive_beams(light, SLANTED, tolerance=1e-5)) > 4


def test_uneven_direction_splits_squares():
    light = np.ones((32, 32), np.float32)
    direction = np.empty((32, 32, 3), np.float32)
    direction[:, :16], direction[:, 16:] = travel(30, 0), travel(30, 5)
    assert sorted(adaptive_beams(light, direction)["size"]) == [16] * 4


def test_the_papers_scene_needs_few_beams():
    """The paper goes from 45600 to 4107 beams on a scene like this one."""
    mask = fig9(240)
    assert len(adaptive_beams(mask, SLANTED)) < mask.sum() / 20


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"irradiance": np.ones((2, 2, 3))}, r"'irradiance' is of shape \(2, 2, 3\)"),
        ({"irradiance": np.full((2, 2), np.nan)}, "'irradiance' is nan"),
        ({"direction": (0, 0, 1)}, "'direction' is with z = 1"),
        ({"tolerance": 0}, "'tolerance' is 0"),
        ({"pitch": (1, 2, 3)}, r"'pitch' is of shape \(3,\)"),
    ],
)
def test_bad_arguments_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        adaptive_beams(**{"irradiance": np.ones((2, 2)), "direction": SLANTED, **change})
