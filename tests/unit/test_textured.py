"""`convolve` with an albedo of each texel."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from beamspread import LdfSample, Medium, convolve, convolve_lights, library, luminance, presets
from beamspread.core.bake.directions import (
    ANGLES,
    AZIMUTHS,
    MAX_OWN,
    NEAR_ANGLES,
    NEAR_AZIMUTHS,
    beams_of,
    is_near,
)
from beamspread.core.native import native

LDF = library(Medium(0.8))
LIGHT, DOWN = np.ones((48, 40)), (0.6, 0.0, -0.8)
STRIPES = np.where(np.arange(40) % 10 < 5, 0.95, 0.8) * np.ones((48, 1))


def test_a_map_of_one_albedo_is_that_albedo():
    ours = convolve(LIGHT, DOWN, LDF, np.full((48, 40, 3), 0.75), 1.0, 1.0)
    np.testing.assert_array_equal(ours, convolve(LIGHT, DOWN, LDF, 0.75, 1.0, 1.0))


def test_a_ratio_of_one_without_noise():
    """Where the map is nearly even, paths with it and without it differ as little, however few they are."""
    nearly = np.full((48, 40), 0.75)
    nearly[20, 20] += 1e-6
    ours = convolve(LIGHT, DOWN, LDF, nearly, 1.0, 1.0, noise=0.1)
    np.testing.assert_allclose(ours, convolve(LIGHT, DOWN, LDF, 0.75, 1.0, 1.0), rtol=1e-4)


def test_the_same_bits_for_any_number_of_threads():
    one, three = (convolve(LIGHT, DOWN, LDF, STRIPES, 1.0, 1.0, noise=0.05, threads=threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)


def test_the_estimated_error_is_the_error():
    """Against 64 times as many walks with other numbers: between .6 and 1.6 times, at the noise of each number."""
    factor, even = np.ones((48, 40), np.float32), convolve(LIGHT, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0]

    def with_walks(walks, seed):
        arguments = LDF.medium, (1.0, 1.0), np.float32(STRIPES), factor, 0.9, np.ascontiguousarray(even)
        lights = [(np.float32(LIGHT), DOWN)]
        return native.textured(*arguments, lights, "reflected", 1e-6, walks, seed)

    truth, _, walks = with_walks(16384, 5)
    assert walks >= 16382
    for number in (128, 256, 1024):
        found, error, _ = with_walks(number, 1)
        actual = np.sqrt(((found - truth) ** 2).mean()) / truth.mean()
        assert 0.6 * actual < error < 1.6 * actual


def test_errors_count_where_the_light_is():
    """A spot on a plane that is dark elsewhere has a mean of a fifth of its root mean square: relative to the mean its
    error would be five times as large, and take 20 times as many walks as that of even light.
    """
    y, x = np.mgrid[:160, :160] - 80
    light = np.exp(-(x**2 + y**2) / 200).astype(np.float32)
    albedo = np.where(np.arange(160) % 10 < 5, 0.95, 0.8) * np.ones((160, 1))
    even = np.ascontiguousarray(convolve(light, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0])
    arguments = LDF.medium, (1.0, 1.0), np.float32(albedo), np.ones_like(light), 0.9, even, [(light, DOWN)], "reflected"
    truth = np.mean([native.textured(*arguments, 1e-6, 8192, seed)[0] for seed in (7, 8)], axis=0)
    found, errors, walks = zip(*(native.textured(*arguments, 0.03, 8192, seed) for seed in range(4)))
    actual = np.sqrt(np.mean([((one - truth) ** 2).mean() for one in found]) / (truth**2).mean())
    assert 0.6 * actual < np.mean(errors) < 1.6 * actual
    assert max(errors) < 0.03
    everywhere = np.ones_like(light)
    convention = np.ascontiguousarray(convolve(everywhere, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0])
    alike = *arguments[:5], convention, [(everywhere, DOWN)], "reflected"
    assert np.mean(walks) < 5 * np.mean([native.textured(*alike, 0.03, 8192, seed)[2] for seed in range(4)])


def test_the_sum_has_less_noise_than_texels():
    """Under a sun errors of texels of the same paths are alike. An even albedo, and a convention with another one: at
    2 % of noise of a texel the sum should have an eighth of that; its noise would be .6 % as soon as texels are exact.
    """
    light = np.ones((64, 64), np.float32)
    truth = convolve(light, DOWN, LDF, 0.95, 0.05, 1.0)[..., 0].mean(dtype=float)
    other = np.ascontiguousarray(convolve(light, DOWN, LDF, 0.9, 0.05, 1.0)[..., 0])
    arguments = LDF.medium, (0.05, 0.05), np.full_like(light, 0.95), np.ones_like(light), 0.9, other, [(light, DOWN)]
    found = [native.textured(*arguments, "reflected", 0.02, 8192, seed)[0].mean(dtype=float) for seed in range(12)]
    assert np.sqrt(np.mean((np.array(found) / truth - 1) ** 2)) < 0.004


def test_light_that_hardly_follows_the_factor_has_little_noise():
    """Dark stripes in a bright medium, in which light spreads farther than they are wide: it leaves them nearly as
    bright as around them. With the factor of light that leaves as it is, the error of as many paths is 4.7 %.
    """
    bright, dark, border = 0.99993, 0.91, 0.9958  # colors of .82, .07 and .44
    number = np.arange(128)
    albedo = np.where(number // 21 % 2 == 0, bright, dark)
    albedo[np.flatnonzero(np.diff(number // 21 % 2)) + 1] = border
    errors = []
    result = convolve(
        np.ones((128, 128)),
        (0, 0, -1),
        library(Medium(0.8, 1.5)),
        np.broadcast_to(albedo, (128, 128)).astype(np.float32),
        2.0,
        1.0,
        report_noise=errors.append,
    )
    assert errors[0] < 0.03
    # No line stands out at a border: light falls from the middle of a bright stripe to that of a dark one.
    profile = result.mean(axis=0)[52:74]
    assert (np.diff(profile) < 0.02 * profile.max()).all()


def test_more_noise_is_allowed_and_reported():
    errors = []
    for noise in (0.06, 0.02):
        convolve(LIGHT, DOWN, LDF, STRIPES, 1.0, 1.0, noise=noise, report_noise=errors.append)
    assert errors[1] < 0.02 < errors[0] < 0.06


def test_channels_have_their_own_maps_and_paths():
    maps = np.stack([STRIPES, np.full_like(STRIPES, 0.5), np.full_like(STRIPES, 0.9)], -1)
    ours = convolve(LIGHT, DOWN, LDF, maps, (1.0, 2.0, 3.0), 1.0, noise=0.05)
    even = convolve(LIGHT, DOWN, LDF, (0.5, 0.5, 0.9), (1, 2, 3), 1.0)
    np.testing.assert_allclose(ours[..., 1:], even[..., 1:], rtol=1e-5)
    assert ours[24, 5:35, 0].std() > 0.1 * ours[24, 5:35, 0].mean()


def test_luminance_of_a_material_with_a_map():
    ours = luminance(LIGHT, DOWN, presets()["marble"], 1e-3, albedo=STRIPES, quality="preview")
    assert ours.shape == (48, 40, 3)
    assert (ours > 0).all()


def test_black_and_nearly_white_side_by_side():
    ink = np.where(np.arange(40) < 20, 0.0, 0.9999) * np.ones((48, 1))
    ours = convolve(LIGHT, DOWN, LDF, ink, 2.0, 1.0, noise=0.1)[..., 0]
    assert np.isfinite(ours).all()
    assert ours.min() >= 0
    assert ours[24, 35] > 4 * ours[24, 5]


@pytest.mark.parametrize(("near", "most"), [(False, ANGLES * AZIMUTHS), (True, NEAR_ANGLES * NEAR_AZIMUTHS)])
def test_beams_have_all_the_light(near, most):
    y, x = (np.mgrid[:48, :40] + 0.5) - 22
    way = np.stack([x, y, np.full_like(x, -10)], -1)
    way = np.float32(way / np.linalg.norm(way, axis=-1, keepdims=True))
    light = np.random.default_rng(1).random((48, 40, 3)).astype(np.float32)
    lights = [(light, way), (2 * light, np.float32(DOWN))]
    beams = beams_of(lights, near)
    assert most / 2 < len(beams) <= most + MAX_OWN
    np.testing.assert_allclose(sum(part for part, _ in beams), 3 * light, rtol=1e-5)
    for _, direction in beams:
        assert np.linalg.norm(direction) == pytest.approx(1)
        assert direction[2] < 0


def test_azimuths_are_as_dense_in_half_of_the_light():
    """Below a near lamp they are 30 degrees apart, also where half of its light is in a shadow."""
    y, x = (np.mgrid[:48, :40] + 0.5) - 22
    way = np.stack([x, y, np.full_like(x, -10)], -1)
    light = np.broadcast_to(np.float32(x > 0)[..., None], (48, 40, 3))
    beams = beams_of([(light, np.float32(way / np.linalg.norm(way, axis=-1, keepdims=True)))], near=True)
    azimuths = np.unique([np.degrees(np.arctan2(y, x)).round(1) for _, (x, y, _) in beams])
    assert np.ptp(azimuths) > 120
    # Steps are 30 degrees for light from all around, up to 36 for light from a part of it.
    assert np.diff(azimuths).max() < 36
    np.testing.assert_allclose(sum(part for part, _ in beams), light, rtol=1e-5)


@pytest.mark.parametrize(("height", "near"), [(5.0, True), (20.0, True), (100.0, False)])
def test_lamps_are_near_where_directions_change_while_light_spreads(height, near):
    """Light spreads over four texels here: 20 texels are five such lengths, 100 are 25. A sky is never near."""
    y, x = (np.mgrid[:48, :40] + 0.5) - 22
    way = np.stack([x, y, np.full_like(x, -height)], -1)
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    assert is_near([(distance[..., 0] ** -3, way / distance)], (48.0, 40.0), 4.0) == near
    assert not is_near([(np.ones((48, 40)), np.broadcast_to(DOWN, (48, 40, 3)))], (48.0, 40.0), 4.0)


def test_last_bits_of_the_light_change_no_direction():
    """Hosts differ in them. Light from a lamp near the middle of a plane, at whose texels directions differ by 1e-6."""
    rows, columns = np.mgrid[:48, :40] - 20.3
    way = np.stack([columns, rows, np.full_like(rows, -9.0)], -1)
    noise = 1e-5 * np.random.default_rng(3).standard_normal(way.shape)
    light = np.ones((48, 40, 3), np.float32)
    ours, others = (
        beams_of([(light, np.float32(values / np.linalg.norm(values, axis=-1, keepdims=True)))])
        for values in (way, way + noise)
    )
    for (_, one), (_, other) in zip(ours, others, strict=True):
        np.testing.assert_array_equal(one, other)


def test_no_lights_are_named():
    with pytest.raises(ValueError, match="lights"):
        convolve_lights([], LDF, STRIPES, 1.0, 1.0)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"albedo": np.full((48, 40), 1.0)}, "albedo"),
        ({"albedo": np.full((48, 40), -0.1)}, "albedo"),
        ({"albedo": np.full((48, 40), np.nan)}, "albedo"),
        ({"albedo": np.full((40, 48), 0.5)}, "albedo"),
        ({"albedo": np.full((48, 40, 2), 0.5)}, "albedo"),
        ({"albedo": STRIPES, "noise": 0.0}, "noise"),
        ({"albedo": STRIPES, "side": "transmitted"}, "side"),
        ({"albedo": STRIPES, "ldf": LdfSample(np.ones((8, 8), np.float32), 1.0, 0.0, 0.9)}, "ldf"),
    ],
)
def test_bad_input_is_named(arguments, name):
    arguments = {"ldf": LDF, **arguments}
    with pytest.raises(ValueError, match=name):
        convolve(LIGHT, DOWN, arguments.pop("ldf"), arguments.pop("albedo"), 1.0, 1.0, **arguments)


def test_lights_share_the_walks():
    """Eight lights of one direction have the noise of one, in as many walks."""
    factor, even = np.ones((48, 40), np.float32), convolve(LIGHT, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0]

    def error(parts):
        lights = [(np.full((48, 40), 1 / parts, np.float32), DOWN)] * parts
        arguments = LDF.medium, (1.0, 1.0), np.float32(STRIPES), factor, 0.9, np.ascontiguousarray(even)
        _, found, walks = native.textured(*arguments, lights, "reflected", 1e-6, 512)
        assert walks == 512
        return found

    assert 0.6 < error(8) / error(1) < 1.6


def test_lights_count_by_what_enters():
    """Light from above on bright stripes and light at 85 degrees, of which .4 enters, on dark ones: they leave the dark
    stripes as if each shone alone. Bound: 5 %, of which noise is 2; 18 % off where both lights count alike.
    """
    rows = np.arange(48)[:, None] // 4 % 2 * np.ones((48, 40))
    slanted = (0.0, math.sin(math.radians(85)), -math.cos(math.radians(85)))
    lights = [(rows, DOWN), (1 - rows, slanted)]

    def dark(*lights):
        result = convolve_lights(lights, library(Medium(0.8, 1.5)), np.where(rows, 0.95, 0.3), 1.0, 1.0)
        return result[..., 0][8:-8][rows[8:-8] == 0].mean(dtype=float)

    assert dark(*lights) == pytest.approx(sum(map(dark, lights)), rel=0.05)


def test_lights_of_one_angle_turn_the_same_walks():
    """Four spots before bright squares, all of it turned by 90 degrees from one to the next. The same light leaves each
    quarter, within 5 %, twice the noise of sums; all that goes one way is 90 % off. Walks are more, too.
    """
    albedo, spot = np.full((32, 32), 0.3), np.zeros((32, 32))
    albedo[10:22, 18:30], spot[10:22, 8:18] = 0.98, 1
    ways = (0.96, 0.0, -0.28), (0.0, -0.96, -0.28), (-0.96, 0.0, -0.28), (0.0, 0.96, -0.28)

    def quarters(values):
        turned = [np.rot90(each, number) for number, each in enumerate(values)]
        return np.ascontiguousarray(np.block([turned[:2], turned[2:]]), np.float32)

    lights = [(quarters([spot * (k == number) for k in range(4)]), way) for number, way in enumerate(ways)]
    even, factor = convolve_lights(lights, LDF, 0.8, 3.0, 1.0)[..., 0], np.ones((64, 64), np.float32)
    arguments = LDF.medium, (3.0, 3.0), quarters([albedo] * 4), factor, 0.8, np.ascontiguousarray(even)
    found, _, walks = native.textured(*arguments, lights, "reflected", 1e-6, 4096, 3, max_more=1.5)
    assert walks == 6144
    sums = found.reshape(2, 32, 2, 32).sum(axis=(1, 3), dtype=float)
    assert np.abs(sums / sums.mean() - 1).max() < 0.05


def test_walks_belong_to_the_lights_that_shine_there():
    """Eight lights, each on rows of its own: 1.2 times the noise of one, in as many walks. Bound: 1.6, since two
    numbers differ by a tenth. Where each has the same part of the walks in all rows, it is 4.4 times.
    """
    height = 2048
    stripes = np.float32(np.where(np.arange(64) % 10 < 5, 0.95, 0.8) * np.ones((height, 1)))
    factor, light = np.ones_like(stripes), np.ones_like(stripes)
    even = np.ascontiguousarray(convolve(light, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0])

    def error(parts):
        belongs = np.arange(height)[:, None] * parts // height
        lights = [(np.where(belongs == part, light, 0), DOWN) for part in range(parts)]
        arguments = LDF.medium, (1.0, 1.0), stripes, factor, 0.9, even, lights, "reflected", 1e-6, 128
        return np.mean([native.textured(*arguments, seed)[1] for seed in range(2)])

    assert 0.7 < error(8) / error(1) < 1.6


@pytest.mark.parametrize("size", [(24, 20), (12, 10), (30, 7)])
def test_light_of_other_texels_is_that_of_the_nearest(size):
    """Maps with a half or a fourth of the texels along a side are kept as they are."""
    light = np.random.default_rng(1).random(size).astype(np.float32)
    rows, columns = ((np.arange(count) + 0.5) * known // count for count, known in zip((48, 40), size))
    whole = light[rows.astype(int)[:, None], columns.astype(int)]
    even = np.ascontiguousarray(convolve(whole, DOWN, LDF, 0.9, 1.0, 1.0)[..., 0])
    arguments = LDF.medium, (1.0, 1.0), np.float32(STRIPES), np.ones((48, 40), np.float32), 0.9, even
    one, other = (native.textured(*arguments, [(of, DOWN)], "reflected", 1e-6, 64)[0] for of in (whole, light))
    np.testing.assert_array_equal(one, other)


def test_channels_of_maps_coverage_and_a_result_in_place():
    """A channel of maps gives what that channel alone gives. Coverage dims the light that enters."""
    random = np.random.default_rng(2)
    light, part = random.random((48, 40, 3), np.float32), random.random((48, 40), np.float32)
    even = np.ascontiguousarray(convolve(light, DOWN, LDF, 0.9, 1.0, 1.0))
    maps = np.repeat(np.float32(STRIPES)[..., None], 3, axis=2) ** np.float32([1, 2, 3])
    factor = random.uniform(0.5, 1, maps.shape).astype(np.float32)
    rest, result = ("reflected", 1e-6, 64), even.copy()
    native.textured(
        *(LDF.medium, (1.0, 1.0), maps, factor, 0.9, result, [(light, DOWN)], *rest),
        channel=1,
        coverage=part,
        result=result,
    )
    alone, factor_alone, even_alone, less = (
        np.ascontiguousarray(values[..., 1]) for values in (maps, factor, even, light * part[..., None])
    )
    arguments = LDF.medium, (1.0, 1.0), alone, factor_alone, 0.9, even_alone, [(less, DOWN)]
    # Products of light and coverage are rounded in another order.
    np.testing.assert_allclose(result[..., 1], native.textured(*arguments, *rest)[0], rtol=1e-5)
    np.testing.assert_array_equal(result[..., ::2], even[..., ::2])


def test_the_bench_runs_in_small():
    bench = Path(__file__).resolve().parents[1] / "bench" / "textured.py"
    done = subprocess.run([sys.executable, str(bench), "32"], capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) == 4
