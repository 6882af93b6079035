"""Margin: baked texels stay, the rings around them continue their border."""

import numpy as np
import pytest
from beamspread.core.bake.margin import extend_margin
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
