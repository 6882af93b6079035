"""Margin: baked texels stay, the rings around them continue their border."""

import numpy as np
import pytest
from beamspread.core.bake.margin import extend_margin


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


@pytest.mark.parametrize("fill", [True, False])
def test_nothing_to_do(fill):
    texture = np.ones((4, 4, 3), np.float32)
    assert np.array_equal(extend_margin(texture, np.full((4, 4), fill), 3), texture)


def test_negative_margin_is_refused():
    with pytest.raises(ValueError, match="margin is -1"):
        extend_margin(np.zeros((2, 2, 3), np.float32), np.ones((2, 2), bool), -1)
