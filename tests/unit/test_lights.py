"""Many lights, their colours and directions: all add up to the same moments."""

import numpy as np
import pytest
from _native_test import light_from_point
from beamspread import Cancelled, Medium, _native, convolve, convolve_lights, library
from scipy.ndimage import uniform_filter

import helpers

SIZE = 200  # up to 192 x 192 texels all terms are kept
PATHS = (4.0, 3.0, 2.0)
ALBEDO = (0.99, 0.98, 0.95)
TOLERANCE = 5e-3


@pytest.fixture(scope="module")
def ldf():
    return library(Medium(0.8, 1.4))


def lamp(x, y, height, size=SIZE):
    """Irradiance and directions of a point lamp, lengths in texels."""
    return helpers.lamp(size, x / size - 0.5, y / size - 0.5, height / size)


def lamps(count, size=SIZE):
    """Positions, colours and beams of some lamps."""
    rng = np.random.default_rng(5)
    places = rng.uniform((0.05, 0.05, 0.05), (0.95, 0.95, 0.3), (count, 3)) * size
    return [(place, rng.uniform(0.1, 1, 3), *lamp(*place, size)) for place in places]


def solve(lights, ldf, tolerance=TOLERANCE, solver="fft", channels=3, **options):
    rest = [ldf] * channels, list(ALBEDO[:channels]), list(PATHS[:channels]), (1.0, 1.0)
    return _native.convolve(lights, *rest, solver, tolerance, 0, None, **options)


def assert_within(tolerance, result, expected):
    nearby = uniform_filter(expected, (17, 17, 0), mode="nearest")
    error = np.abs(result - expected)
    assert (error / (tolerance * nearby + 1e-5 * expected.max((0, 1)))).max() <= 1


def test_many_lamps_of_any_color_are_the_sum_of_each(ldf):
    lights = [_native.PlaneLight(beams, travel, color.tolist()) for _, color, beams, travel in lamps(12)]
    apart = sum(solve([light], ldf, 1e-5) for light in lights)
    assert_within(TOLERANCE, solve(lights, ldf), apart)


def test_the_color_counts_in_the_brightness():
    """Irradiance is that of a colour of 1: many weak lamps of much of it don't decide about the strong one's terms."""
    clear = library(Medium(0.8, 1.0))
    lights = [_native.PlaneLight(*lamp(60, 90, 4), [1.0, 1.0, 1.0])]
    for x in (20, 70, 120, 170):
        beams, travel = lamp(x, 150, 150)
        lights.append(_native.PlaneLight(np.float32(1e6) * beams, travel, [1e-9] * 3))
    assert_within(TOLERANCE, solve(lights, clear), solve(lights, clear, 1e-5))


def test_light_from_a_point_is_light_with_a_direction_per_texel(ldf):
    for place, color, beams, travel in lamps(2):
        point = solve([light_from_point(beams, place, color.tolist())], ldf)
        # Directions per texel are rounded to single precision.
        assert point == pytest.approx(solve([_native.PlaneLight(beams, travel, color.tolist())], ldf), rel=1e-4)


@pytest.mark.parametrize("solver", ["direct", "adaptive"])
def test_other_solvers_take_the_same_lights(ldf, solver):
    size = 40
    lights = [light_from_point(beams, place, color.tolist()) for place, color, beams, _ in lamps(3, size)] + [
        _native.PlaneLight(np.ones((size, size), np.float32), np.array((0.6, 0, -0.8), np.float32), [0.2, 0.0, 1.0])
    ]
    result = solve(lights, ldf, 1e-3, solver)
    expected = solve(lights, ldf, 1e-5)
    assert np.abs(result - expected).sum() <= 2e-3 * expected.sum()


def test_suns_of_many_directions_share_a_basis(ldf):
    """Few have a kernel each, many are moments like lamps."""
    rng = np.random.default_rng(6)
    theta, beta = np.radians(rng.uniform(5, 80, 9)), rng.uniform(0, 2 * np.pi, 9)
    travels = np.stack([np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), -np.cos(theta)], -1)
    lights = []
    for travel in travels.astype(np.float32):
        beams = np.zeros((SIZE, SIZE), np.float32)
        y, x = rng.integers(0, SIZE // 2, 2)
        beams[y : y + SIZE // 2, x : x + SIZE // 2] = rng.uniform(0.1, 1)
        lights.append(_native.PlaneLight(beams, travel, rng.uniform(0.1, 1, 3).tolist()))
    apart = sum(solve([light], ldf) for light in lights)  # one direction is exact
    assert_within(TOLERANCE, solve(lights, ldf), apart)


def test_suns_of_one_direction_and_several_colors(ldf):
    rng = np.random.default_rng(7)
    travel = np.array((0.6, 0, -0.8), np.float32)
    red, blue = rng.random((2, 60, 60), np.float32)
    together = solve([_native.PlaneLight(red, travel, [1, 0, 0.5]), _native.PlaneLight(blue, travel, [0, 0.3, 1])], ldf)
    channels = np.stack([red, 0.3 * blue, 0.5 * red + blue], -1)
    assert together == pytest.approx(convolve(channels, travel, ldf, ALBEDO, PATHS, 1.0), rel=1e-4)


def test_channels_of_an_array_that_differ_by_a_factor_are_one_light():
    beams = np.random.default_rng(8).random((5, 7), np.float32)
    travel = np.array((0, 0, -1), np.float32)
    factors = np.array((0.25, 1, 0.5), np.float32)
    assert len(_native.PlaneLight.of_channels(beams, travel, 3)) == 1
    assert len(_native.PlaneLight.of_channels(beams[..., None] * factors, travel, 3)) == 1
    mixed = beams[..., None] * factors
    mixed[2, 3, 0] *= 1.001
    assert len(_native.PlaneLight.of_channels(mixed, travel, 3)) == 3


def test_lights_without_end_are_the_same_for_any_number_of_threads(ldf):
    lights = [_native.PlaneLight(beams, travel, color.tolist()) for _, color, beams, travel in lamps(3)]
    rest = [ldf] * 3, list(ALBEDO), list(PATHS), (1.0, 1.0), "fft", TOLERANCE
    one, three = (_native.convolve(lights, *rest, threads, None) for threads in (1, 3))
    assert one.tobytes() == three.tobytes()


def test_the_choice_of_terms_can_be_cancelled():
    """Which comes first and is half of the work; progress is reported every twentieth of a second."""
    clear = library(Medium(0.8, 1.0))
    seen = []

    def progress(fraction):
        seen.append(fraction)
        return fraction < 0.02

    with pytest.raises(Cancelled):
        convolve(*lamp(60, 90, 10), clear, 0.9, PATHS, 1.0, threads=1, progress=progress)
    assert seen[-1] < 0.5


@pytest.mark.parametrize("solver", ["fft", "adaptive", "direct"])
@pytest.mark.parametrize("power", [1e-20, 1e30])
def test_the_scale_of_the_light_does_not_matter(ldf, solver, power):
    size = 24
    beams, travel = lamp(8, 12, 6, size)
    beams /= beams.max()
    plain = convolve(beams, travel, ldf, ALBEDO, PATHS, 1.0, solver=solver)
    scaled = convolve(np.float32(power) * beams, travel, ldf, ALBEDO, PATHS, 1.0, solver=solver)
    assert scaled / power == pytest.approx(plain, rel=1e-4)


@pytest.mark.parametrize(
    ("argument", "value", "options"),
    [
        ("irradiance", "1e\\+31|9.9+e\\+30", {"irradiance": 1e31}),
        ("mean_free_path", "2e\\+08", {"mean_free_path": 2e8}),
        ("pitch", "2000", {"pitch": (1.0, 2000.0), "mean_free_path": 1.0}),
        ("pitch", "None", {"pitch": None}),
        ("mean_free_path", "nan", {"mean_free_path": float("nan")}),
    ],
)
def test_unsupported_arguments_of_solvers_are_named(ldf, argument, value, options):
    given = {"irradiance": 1.0, "mean_free_path": 1.0, "pitch": 1.0} | options
    beams = np.full((8, 8), given.pop("irradiance"), np.float32)
    with pytest.raises(ValueError, match=f"'{argument}' is .*({value})"):
        convolve(beams, (0, 0, -1), ldf, 0.9, **given)


def test_lights_of_other_shapes_are_named(ldf):
    down = (0, 0, -1)
    with pytest.raises(ValueError, match="'irradiance' is 1 x 8"):
        convolve_lights([(np.ones((8, 8)), down), (np.ones((1, 8)), down)], ldf, 0.9, 1.0, 1.0)
