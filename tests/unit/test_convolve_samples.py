"""convolve with LdfSamples: their kernels against those of the library that the samples come from."""

import math

import numpy as np
import pytest
from beamspread import LdfSample, Medium, convolve, interpolate, simulate

from helpers import travel

ANGLES = (0.0, 20.0, 40.0, 60.0)
SOLVERS = ("direct", "fft", "adaptive")


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(0.8), list(ANGLES), 20_000)


@pytest.fixture(scope="module")
def samples(library):
    return [LdfSample.from_library(library, t, a, 101, 0.25) for t in ANGLES for a in (0.8, 0.9)]


def one_texel(size=25):
    light = np.zeros((size, size), np.float32)
    light[size // 2, size // 2] = 1.0
    return light


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("pitch", [1.0, 2.5])
@pytest.mark.parametrize("azimuth", [0, 70, 200])
def test_kernels_are_those_of_the_library(library, samples, solver, pitch, azimuth):
    """Tolerance: the blur of the image's rings and texels, and the 1 % of the light outside of it."""
    direction = travel(40, azimuth)
    result = convolve(one_texel(), direction, samples, 0.9, 1.0, pitch, solver=solver)
    expected = convolve(one_texel(), direction, library, 0.9, 1.0, pitch, solver="direct")
    assert np.abs(result - expected).sum() < 0.04 * expected.sum()
    assert np.abs(result - expected).max() < 0.04 * expected.max()


@pytest.mark.parametrize("ratio", [0.1, 1.0, 30.0])
def test_power_is_kept(samples, ratio):
    """For texels far smaller and far larger than the sample's; irradiance 1 on one texel is the texel's area."""
    size = max(7, int(60 / ratio)) | 1
    light = one_texel(size)
    pitch = 0.25 * ratio * 2e-3
    sample = next(s for s in samples if (s.angle, s.albedo) == (20, 0.9))
    luminance = convolve(light, travel(20, 30), sample, 0.9, 2e-3, pitch)[..., 0]
    power = luminance.sum(dtype=np.float64) * math.pi
    if ratio * 0.25 * size > 40:  # the whole image fits in
        assert power == pytest.approx(sample.power, rel=1e-5)
    else:  # its middle does, to half a texel; rings blur the border of that
        middle = sample.image[20:81, 20:81].sum(dtype=np.float64) * 0.25**2
        assert power == pytest.approx(middle, rel=0.01)


@pytest.mark.parametrize("solver", ["fft", "adaptive"])
def test_changing_directions(samples, solver):
    rng = np.random.default_rng(0)
    light = (rng.random((16, 20)) > 0.6).astype(np.float32)
    y, x = np.mgrid[0:16, 0:20]
    field = np.stack([x - 9.0, y - 7.0, np.full(x.shape, -12.0)], -1)
    field /= np.linalg.norm(field, axis=-1, keepdims=True)
    expected = convolve(light, field, samples, (0.8, 0.85, 0.9), 1.0, 1.0, solver="direct")
    result = convolve(light, field, samples, (0.8, 0.85, 0.9), 1.0, 1.0, solver=solver)
    assert np.abs(result - expected).sum() < 1e-3 * expected.sum()


def test_directions_between_nodes_of_the_interpolation(samples):
    """A field of one direction is the uniform one, up to linear interpolation over five degrees."""
    field = np.broadcast_to(travel(33, 50), (25, 25, 3))
    uniform = convolve(one_texel(), travel(33, 50), samples, 0.9, 1.0, 1.0)
    result = convolve(one_texel(), field, samples, 0.9, 1.0, 1.0, solver="direct")
    assert np.abs(result - uniform).sum() < 0.01 * uniform.sum()


@pytest.mark.parametrize("method", ["angular", "adaptive", "planar"])
def test_methods(samples, method):
    between = interpolate(samples, 30, 0.85, method=method)
    expected = convolve(one_texel(), travel(30, 0), between, 0.85, 1.0, 1.0)
    result = convolve(one_texel(), travel(30, 0), samples, 0.85, 1.0, 1.0, interpolation=method)
    assert result == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())


def test_channels_of_their_own(library, samples):
    direction = travel(20, 0)
    sources, albedos = (library, samples, samples[:4]), (0.9, 0.9, 0.8)
    mixed = convolve(one_texel(), direction, sources, albedos, 1.0, 1.0, solver="direct")
    for channel, (source, albedo) in enumerate(zip(sources, albedos)):
        alone = convolve(one_texel(), direction, source, albedo, 1.0, 1.0, solver="direct")
        assert np.array_equal(mixed[..., channel], alone[..., channel])


def test_three_samples_are_samples(samples):
    """Not one per channel."""
    three = [s for s in samples if s.albedo == 0.9][:3]
    expected = convolve(one_texel(), travel(30, 0), interpolate(three, 30, 0.9), 0.9, 1.0, 1.0)
    result = convolve(one_texel(), travel(30, 0), three, 0.9, 1.0, 1.0)
    assert result == pytest.approx(expected, rel=1e-4, abs=1e-6 * expected.max())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"direction": travel(70, 0)}, "'angle' is 70; allowed: 0 <= angle <= 60"),
        ({"albedo": 0.95}, "'albedo' is 0.95; allowed: 0.8 <= albedo <= 0.9, the span of the samples"),
        ({"interpolation": "best"}, "'method' is 'best'"),
        ({"ldf": []}, "'ldf' is"),
        ({"ldf": "samples"}, "'ldf' is 'samples'"),
        ({"ldf": [[], [], []]}, "'ldf' is"),
    ],
)
@pytest.mark.parametrize("solver", SOLVERS)
def test_errors(samples, changes, message, solver):
    arguments = {"direction": travel(20, 0), "ldf": samples, "albedo": 0.9} | changes
    with pytest.raises(ValueError, match=message):
        convolve(one_texel(), mean_free_path=1.0, pitch=1.0, solver=solver, **arguments)


def test_samples_of_several_media_are_refused(samples):
    others = [LdfSample(s.image, s.pitch, s.angle, s.albedo, 0, 0.5) for s in samples]
    with pytest.raises(ValueError, match="'g' is None"):
        convolve(one_texel(), travel(20, 0), samples + others, 0.9, 1.0, 1.0)


def test_samples_that_return_more_than_arrives_are_named():
    """5 % are noise: three standard errors of a total that a thousand photons tell."""

    def solve(image, pitch=1.0):
        sample = LdfSample(image, pitch, 0, 0.5)
        return convolve(np.ones((3, 3)), (0, 0, -1), sample, 0.5, 1.0, 1.0)

    assert solve(np.full((2, 2), 1.0499 / 4)).max() > 0.1
    for image, pitch, power in (
        (np.full((2, 2), 0.2651), 1.0, "1.06"),
        (np.full((2, 2), 1e30), 1e18, ""),
        (np.array([[10.0] + 20 * [-0.9]]), 0.1, "-0.08"),
    ):
        with pytest.raises(ValueError, match=f"'ldf' is a sample of power {power}.*allowed: 0 to 1.05"):
            solve(image, pitch)
