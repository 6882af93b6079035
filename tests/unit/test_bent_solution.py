"""Luminance of meshes that bend where few texels are solved: against the luminance of all, by all pairs."""

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.native import native

from bent_shapes import ball, cube, cut_texels, from_steps, hills
from shapes import FACES, SQUARE, occluders

WHITE = [1.0, 1.0, 1.0]
CARD = occluders((0.6 * SQUARE + (0, 0.2, 0.9), FACES))
LIGHTS = {
    "lamp": (native.PointLight((0.3, 0.2, 2.0), 0.0, "sphere"), [1.0, 1.0, 1.0], None),
    "shadow": (native.SunLight((0.3, 0.2, -1), 0.0), [1.0, 0.8, 0.5], CARD),
}
SIDE = 96
TEXEL = 2 / SIDE
TOLERANCE = 5e-3


@pytest.fixture(scope="module")
def ldf():
    return library(Medium(0.8, 1.0))


def baked(texels, ldf, path, lights, solver="fft", **options):
    """Luminance with mean free paths of up to `path` texels, and the share of texels that are solved."""
    shares = []
    surface = native.Surface(texels.native(), **options)
    media = [ldf] * 3, [0.95, 0.9, 0.6], [path * TEXEL, 0.8 * path * TEXEL, 0.6 * path * TEXEL]
    result = native.bake_luminance([surface], [lights], *media, solver, TOLERANCE, rays=64, report_solved=shares.extend)
    return result[0], shares[0]


def errors(texels, ldf, path, lights, **options):
    """Errors of texels relative to the largest luminance, and the share that is solved."""
    truth, all_of_them = baked(texels, ldf, path, lights, "direct", **options)
    result, share = baked(texels, ldf, path, lights, **options)
    assert all_of_them == 1
    return np.abs(result - truth) / truth.max(axis=(0, 1)), share


@pytest.mark.parametrize(("path", "most"), [(0.1, 0.8), (2.0, 0.75), (8.0, 0.7)])
@pytest.mark.parametrize("light", LIGHTS)
def test_few_texels_tell_the_others_within_the_tolerance(light, path, most, ldf):
    """Hills and sharp shadows; that of the solver's clusters is part of it: worst texels and root mean square."""
    differences, share = errors(hills(SIDE), ldf, path, [LIGHTS[light]])
    assert share < most
    assert differences.max() < 2 * TOLERANCE
    assert np.sqrt((differences**2).mean()) < 0.2 * TOLERANCE


def test_where_light_spreads_far_most_texels_are_interpolated(ldf):
    _, share = baked(hills(2 * SIDE, turns=0.5), ldf, 16, [LIGHTS["lamp"]])
    assert share < 0.25


def test_the_detail_of_a_texture_stays_where_light_spreads_less_than_a_texel(ldf):
    """Colors of single texels are far above what steps of four texels tell."""
    colors = np.ones((SIDE, SIDE, 3), np.float32)
    colors[SIDE // 2 :, ::2] = 0.1
    differences, share = errors(hills(SIDE), ldf, 0.1, [LIGHTS["lamp"]], color_in=colors)
    assert differences.max() < 2 * TOLERANCE
    assert 0.5 < share < 0.9


@pytest.mark.parametrize("dot", [(42, 42), (41, 42), (45, 47)])
def test_a_dot_of_light_between_the_first_texels_is_not_missed(dot, ldf):
    """A texel that alone is lit, two rows or columns from those that are solved first."""
    colors = np.zeros((SIDE, SIDE, 3), np.float32)
    colors[dot] = 1
    differences, share = errors(hills(SIDE), ldf, 0.05, [LIGHTS["lamp"]], color_in=colors)
    assert differences.max() < 2 * TOLERANCE
    assert share < 0.3


def test_sharp_edges_and_islands_are_not_smoothed(ldf):
    """A cube whose islands end within texels: texels of five others' planes are no neighbors."""
    texels, covered = cut_texels(cube(0.7), SIDE)
    differences, _ = errors(texels, ldf, 1.0, list(LIGHTS.values()), coverage=covered.astype(np.float32))
    assert differences.max() < 2 * TOLERANCE


def test_texels_that_touch_in_the_texture_alone_are_no_neighbors(ldf):
    """Two strips under the same sun that meet in the texture, one far below: light is lost at the edges of both."""
    texels = hills(SIDE, height=0.0)
    texels.positions[:, 50:] -= (0, 0, 50)
    sun = native.SunLight((0.3, 0.2, -1), 0.0)
    differences, share = errors(texels, ldf, 0.2, [(sun, WHITE, None)])
    assert differences.max() < 2 * TOLERANCE
    assert share < 0.6


@pytest.mark.parametrize("path", [0.05, 0.16, 0.4])
def test_even_light_stays_even_where_texels_grow(path, ldf):
    """A flat mesh whose square texels grow along its diagonal, under a sun. Disks of samples are a quarter of an octave
    apart: where samples take the next one, luminance is off by .4 %; by 2 % if all neighbors count as alike.
    """
    line = (np.arange(SIDE) + 0.5) * TEXEL - 1
    at = line + 1j * line[:, None]
    growth = 0.1 * np.exp(-0.25j * np.pi)
    place, step = at + growth * at**2, (1 + 2 * growth * at) * TEXEL  # a conformal map: squares stay squares
    texels = from_steps(*[np.stack([v.real, v.imag, 0 * v.real], -1) for v in (place, step, 1j * step)])
    result, _ = baked(texels, ldf, path, [(native.SunLight((0.2, 0.1, -1), 0.0), WHITE, None)], "direct")
    inside = result[30:-30, 30:-30]
    assert np.abs(inside / np.median(inside, axis=(0, 1)) - 1).max() < 5e-3


@pytest.mark.parametrize(("path", "mean"), [(0.1, 0.01), (0.5, 0.0075)])
def test_light_turns_with_a_ball_around_its_pole(path, mean, ldf):
    """A ball by longitude and latitude below a sun on its axis: rows of texels are even, but for their facets. Narrow
    texels share samples: .8 and .6 % of scatter measured, 3.8 % in the row where they begin to; 1.5 and 1.0 % if each
    is divided.
    """
    texels, covered = cut_texels(ball(96, 48), 384, 192)
    surface = native.Surface(texels.native(), covered)
    unit = np.sqrt(texels.areas[texels.areas > 0].mean())
    media = [ldf] * 3, [0.95, 0.9, 0.6], [path * unit, 0.8 * path * unit, 0.6 * path * unit]
    sun = native.SunLight((0.0, 0.0, -1.0), 0.0), WHITE, None
    rows = native.bake_luminance([surface], [[sun]], *media)[0][-32:-4]
    scatter = (rows.std(axis=1) / rows.mean(axis=1)).max(axis=1)
    assert scatter.mean() < mean
    assert scatter.max() < 0.045
    means = rows.mean(axis=1)
    assert np.abs(np.diff(means, axis=0) / means[1:]).max() < 0.06


def test_a_ball_has_no_band_where_texels_begin_to_be_long():
    """A UV sphere in an image of its mean proportions below a sun on its axis: texels are 1.4 times as wide as high at
    the equator, and square in the middle. Those of a facet's two triangles differ, so that whole ones and pieces lie
    side by side: rows scatter by .05 %, and by 3.2 % if all have the own light of a lattice.
    """
    ldf = library(Medium(0.0, 1.5))
    texels, covered = cut_texels(ball(64, 32), 256, 178)
    path = 0.04 * np.sqrt(texels.areas[texels.areas > 0].mean())
    sun = native.SunLight((0.0, 0.0, -1.0), 0.0), WHITE, None
    surface = native.Surface(texels.native(), covered)
    rows = native.bake_luminance([surface], [[sun]], [ldf] * 3, [0.999, 0.998, 0.99], [path] * 3)[0][100:120]
    assert (rows.std(axis=1) / rows.mean(axis=1)).max() < 2e-3


def test_narrow_texels_keep_their_light_where_they_are(ldf):
    """A quarter of a ball's texels in the shade: its border turns around the pole."""
    texels, covered = cut_texels(ball(96, 48), 384, 192)
    colors = np.ones((192, 384, 3), np.float32)
    colors[:, 100:300] = 0
    lamp = native.SunLight((0.0, 0.0, -1.0), 0.0), WHITE, None
    unit = np.sqrt(texels.areas[texels.areas > 0].mean())
    media = [ldf] * 3, [0.95, 0.9, 0.6], [0.05 * unit, 0.04 * unit, 0.03 * unit]
    lit, dark = (
        native.bake_luminance([native.Surface(texels.native(), covered, color_in=c)], [[lamp]], *media)[0]
        for c in (np.ones_like(colors), colors)
    )
    part = dark[-24:-4, :, 2] / lit[-24:-4, :, 2]
    assert np.abs(part[:, 340:380] - 1).max() < 0.02
    assert part[:, 150:250].max() < 0.02


def test_same_bits_for_any_number_of_threads(ldf):
    surface, lights = native.Surface(hills(SIDE).native()), [list(LIGHTS.values())]
    media = [ldf] * 3, [0.95, 0.9, 0.6], [TEXEL] * 3
    one, two = (native.bake_luminance([surface], lights, *media, threads=threads)[0] for threads in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_progress_rises_and_ends(ldf):
    seen = []
    surface = native.Surface(hills(SIDE).native())
    media = [ldf] * 3, [0.95, 0.9, 0.6], [2 * TEXEL] * 3
    native.bake_luminance([surface], [[LIGHTS["shadow"]]], *media, progress=lambda part: seen.append(part) or True)
    assert seen == sorted(seen)
    assert seen[-1] == 1
