"""Margin: baked texels stay, the rings around them continue their border."""

import numpy as np
import pytest
from beamspread.core.bake.margin import NEIGHBOURS, STRAIGHT, WHOLE, extend_margin, fill_margin, part_in_shared
from beamspread.core.native import native


def test_constant_extends_as_constant():
    baked = np.zeros((8, 9), bool)
    baked[3:5, 4] = True
    texture = np.where(baked[..., None], np.float32([1, 2, 3]), np.float32(-7))
    extended = extend_margin(texture, baked, 2)
    ring = np.zeros_like(baked)
    ring[1:7, 2:7] = True
    assert np.array_equal(extended[ring], np.tile(np.float32([1, 2, 3]), (ring.sum(), 1)))
    assert (extended[~ring] == -7).all()


def test_baked_texels_are_kept():
    rng = np.random.default_rng(1)
    texture = rng.random((16, 16, 3), np.float32)
    baked = rng.random((16, 16)) > 0.5
    extended = extend_margin(texture, baked, 5)
    assert np.array_equal(extended[baked], texture[baked])
    assert extended.dtype == np.float32


def test_first_ring_is_the_mean_of_its_baked_neighbours():
    texture = np.zeros((3, 3, 1), np.float32)
    texture[0, :, 0] = [1, 2, 6]
    baked = np.zeros((3, 3), bool)
    baked[0] = True
    assert extend_margin(texture, baked, 1)[1, :, 0] == pytest.approx([1.5, 3, 4])


@pytest.mark.parametrize("corners", [4, 32])
@pytest.mark.parametrize("turn", [0.1, np.pi / 4])
def test_the_margin_of_a_round_or_turned_chart_is_not_darkened_by_texels_across_its_edge(corners, turn):
    angles = turn + 2 * np.pi * np.arange(corners) / corners
    polygon = 32.3 + 20.2 * np.column_stack([np.cos(angles), np.sin(angles)])
    coverage = native.coverage(polygon, np.array([corners], np.uint32), 64, 64)
    # Evenly lit, without any spread: each texel has the light of its part inside.
    light = np.float32([1, 2, 3])
    texture = coverage[..., None] * light
    extended = extend_margin(texture, coverage, 4)
    assert np.array_equal(extended[coverage > 0], texture[coverage > 0])
    beyond = (extended > 0).any(axis=-1) & (coverage == 0)
    # Four rings around it, each at least as long as the chart's four sides would be.
    assert beyond.sum() > 4 * 4 * np.sqrt(2) * 20.2
    # Sums of up to eight float32 values; WHOLE lets in texels of 1 % less.
    assert extended[beyond] == pytest.approx(np.broadcast_to(light, (beyond.sum(), 3)), rel=0.01)


@pytest.mark.parametrize("fill", [True, False])
def test_nothing_to_do(fill):
    texture = np.ones((4, 4, 3), np.float32)
    assert np.array_equal(extend_margin(texture, np.full((4, 4), fill), 3), texture)


def test_negative_margin_is_refused():
    with pytest.raises(ValueError, match="margin is -1"):
        extend_margin(np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool), -1)


def test_each_island_continues_itself():
    labels = np.full((12, 16), -1, np.int32)
    labels[3:9, 2:6], labels[3:9, 8:13] = 0, 1
    coverage = np.float32(labels >= 0)
    texture = np.where(labels[..., None] == 1, np.float32([5, 0]), np.float32([0, 7])) * coverage[..., None]
    extended = extend_margin(texture, coverage, 2, labels)
    expected = np.zeros((12, 16, 2), np.float32)
    expected[1:11, :7], expected[1:11, 7:15] = [0, 7], [5, 0]
    np.testing.assert_array_equal(extended, expected)


def test_texels_across_an_edge_continue_their_own_island():
    """Two islands side by side; the texels at their common border are half of the one and half of the other."""
    labels = np.zeros((6, 8), np.int32)
    labels[:, 4:] = 1
    coverage = np.ones((6, 8), np.float32)
    coverage[:, 3:5], coverage[0] = 0.6, 0
    labels[0] = -1
    texture = np.where(labels[..., None] == 1, np.float32([5, 0]), np.float32([0, 7])) * coverage[..., None]
    above = extend_margin(texture, coverage, 1, labels)[0]
    np.testing.assert_allclose(above[:4], np.tile(np.float32([0, 7]), (4, 1)), rtol=1e-6)
    np.testing.assert_allclose(above[4:], np.tile(np.float32([5, 0]), (4, 1)), rtol=1e-6)


def one_ring(values: dict, islands: dict, shape: tuple[int, int]) -> tuple[dict, dict]:
    """Values and islands of the texels beside known ones, texel by texel; known are those of `values`."""
    found, continued = {}, {}
    for texel in np.ndindex(shape):
        if texel in values:
            continue
        beside = [((texel[0] + dy, texel[1] + dx), (dy, dx) in STRAIGHT) for dy, dx in NEIGHBOURS]
        beside = [(other, is_straight) for other, is_straight in beside if other in values]
        own = islands[texel]
        for is_first in (True, False):
            candidates = [islands[other] for other, is_straight in beside if is_straight == is_first]
            own = min(candidates) if own is None and candidates else own
        same = [values[other] for other, _ in beside if islands[other] == own]
        if same:
            found[texel], continued[texel] = np.mean(same, axis=0), own
    return found, continued


def rings(values: dict, islands: dict, shape: tuple[int, int], count: int) -> dict:
    """`values` with those of `count` rings around them."""
    values, islands = dict(values), dict(islands)
    for _ in range(count):
        found, continued = one_ring(values, islands, shape)
        values.update(found)
        islands.update(continued)
    return values


@pytest.mark.parametrize("seed", range(8))
def test_rings_around_islands_of_any_shape_follow_their_definition(seed):
    rng, shape = np.random.default_rng(seed), (15, 18)
    coverage, labels = np.zeros(shape, np.float32), np.full(shape, -1, np.int32)
    for label in range(5):
        row, column = rng.integers(0, 14, 2)
        part = slice(row, row + 4), slice(column, column + 4)
        is_inside = rng.random(coverage[part].shape) < 0.8
        cut = np.where(rng.random(is_inside.shape) < 0.5, 1, rng.random(is_inside.shape))
        coverage[part], labels[part] = np.where(is_inside, cut, 0), np.where(is_inside, label, -1)
    texture = rng.random((*shape, 3), np.float32)
    islands = {texel: labels[texel] if labels[texel] >= 0 else None for texel in np.ndindex(shape)}
    own = {texel: texture[texel] for texel in np.ndindex(shape)}
    whole = rings({texel: own[texel] for texel in own if coverage[texel] > WHOLE}, islands, shape, 2)
    baked = {texel: whole.get(texel, own[texel]) for texel in own if coverage[texel] > 0}
    expected = {**own, **rings(baked, islands, shape, 3), **{texel: own[texel] for texel in baked}}
    extended = extend_margin(texture, coverage, 3, labels)
    for texel in own:  # sums of up to eight float32 values, ring after ring
        assert extended[texel] == pytest.approx(expected[texel], rel=1e-5), texel


def test_margins_in_place_are_those_of_a_copy_in_wide_and_narrow_parts_of_an_image():
    rng = np.random.default_rng(4)
    for columns in (slice(3, 9), slice(3, 60)):
        coverage = np.zeros((20, 64), np.float32)
        coverage[5:9, columns] = 1
        texture = rng.random((20, 64, 3), np.float32)
        extended = extend_margin(texture, coverage, 2)
        assert (extended != texture).any(axis=-1).sum() == 8 * (columns.stop - columns.start + 4) - coverage.sum()
        fill_margin(texture, coverage, 2)
        np.testing.assert_array_equal(texture, extended)


def test_textures_that_cannot_be_filled_are_refused():
    texture, coverage = np.zeros((4, 5, 3), np.float32), np.ones((4, 5), np.float32)
    with pytest.raises(ValueError, match=r"'texture' is float64 .*writable float32 \(H, W, C\)"):
        native.fill_margin(texture.astype(float), coverage, 1, WHOLE, 2)
    with pytest.raises(ValueError, match=r"'coverage' is .*\(5, 4\)"):
        native.fill_margin(texture, coverage.reshape(5, 4), 1, WHOLE, 2)
    with pytest.raises(ValueError, match=r"'labels' is int64"):
        native.fill_margin(texture, coverage, 1, WHOLE, 2, np.zeros((4, 5), np.int64))
    with pytest.raises(ValueError, match=r"'known' is float32"):
        native.fill_rings(texture, coverage, 1)
    texture.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        native.fill_rings(texture, coverage > 0, 1)


def test_parts_of_a_shared_image_are_the_same_whichever_is_baked():
    rng = np.random.default_rng(3)
    # Blocks with a random coverage, some of which touch or overlap.
    surfaces = np.zeros((5, 40, 40), np.float32)
    for surface in surfaces:
        row, column = rng.integers(0, 24, 2)
        surface[row : row + 8, column : column + 10] = rng.random((8, 10))
    nothing = np.zeros((40, 40), np.float32)
    parts = [
        part_in_shared(
            surface,
            np.max([nothing, *surfaces[:number]], axis=0),
            np.max([nothing, *surfaces[number + 1 :]], axis=0),
            4,
        )
        for number, surface in enumerate(surfaces)
    ]
    covered = surfaces.max(axis=0) > 0
    reached = np.pad(covered, 4)
    within = np.any([reached[y : y + 40, x : x + 40] for y in range(9) for x in range(9)], axis=0)
    count = np.sum(parts, axis=0)
    np.testing.assert_array_equal(count, within)
    for part, surface in zip(parts, surfaces):
        assert part[(surface > 0) & (surface == surfaces.max(axis=0))].all()
        assert not part[covered & (surface == 0)].any()
