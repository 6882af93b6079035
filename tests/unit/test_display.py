"""Exposure, PNG files, read by Pillow, and Radiance files."""

import io

import numpy as np
import pytest
from beamspread.core.display import auto_exposure, hdr, png, png_exposure, to_srgb
from PIL import Image

from plain_hdr import decoded_hdr


def test_exposure_is_the_largest_power_of_two_that_fits():
    assert auto_exposure(np.zeros((2, 2, 3))) == 1
    assert auto_exposure(np.full((2, 2, 3), 1.0)) == 1
    assert auto_exposure(np.full((2, 2, 3), 1.001)) == 0.5
    assert auto_exposure(np.full((2, 2, 3), 8.0)) == 0.125
    assert auto_exposure(np.array([np.nan, np.inf, 3.0])) == 0.25


@pytest.mark.parametrize("exposure", [1.0, 0.25])
def test_eight_bits_are_rounded_up_or_down_and_keep_means(exposure):
    texture = np.random.default_rng(2).random((64, 48, 3), np.float32) * 0.02
    picture = Image.open(io.BytesIO(png(texture, 8, exposure)))
    assert (picture.mode, picture.size) == ("RGB", (48, 64))
    stored = np.asarray(picture, float)[::-1]
    exact = 255 * to_srgb(texture * exposure).astype(float)
    assert np.abs(stored - exact).max() < 1
    # 9216 roundings, whose errors have a standard deviation of .4, if they are random: 5 sigma.
    assert abs((stored - exact).mean()) < 5 * 0.4 / np.sqrt(stored.size)
    assert picture.info.get("beamspread:exposure") == (None if exposure == 1 else "0.25")


@pytest.mark.parametrize("level", [3e-5, 3e-4, 0.03])
def test_areas_far_below_a_digit_keep_their_mean(level):
    """A disk of light in the dark, up to a tenth of the first digit: random rounding is 4 % off."""
    up, across = np.mgrid[:128, :128] / 128 - 0.5
    texture = np.float32(level) * np.float32(np.hypot(up, across) < 0.4)[..., None] * np.ones(3, np.float32)
    stored = np.asarray(Image.open(io.BytesIO(png(texture))), float) / 255
    linear = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    assert linear.mean(axis=(0, 1)) == pytest.approx(texture.mean(axis=(0, 1)), rel=0.01)


def test_sixteen_bits_are_exact():
    texture = np.linspace(0, 1.5, 5 * 7 * 3, dtype=np.float32).reshape(5, 7, 3)
    content = png(texture, 16, 0.5)
    assert content[24:26] == b"\x10\x02"  # bits, RGB
    rows = content.split(b"IDAT")[1]
    import zlib

    lines = np.frombuffer(zlib.decompressobj().decompress(rows), np.uint8).reshape(5, 1 + 7 * 6)[::-1, 1:]
    numbers = lines.copy().view(">u2").astype(float).reshape(5, 7, 3)
    assert np.abs(numbers - 65535 * to_srgb(texture * 0.5).astype(float)).max() <= 0.51
    Image.open(io.BytesIO(content)).verify()  # checksums


def test_black_and_white_stay_and_row_0_is_the_lowest():
    texture = np.zeros((2, 3, 3), np.float32)
    texture[0] = 1
    shown = np.asarray(Image.open(io.BytesIO(png(texture))))
    assert (shown[0] == 0).all()
    assert (shown[1] == 255).all()


def test_the_exposure_is_in_the_file():
    texture = np.zeros((2, 2, 3), np.float32)
    assert png_exposure(png(texture, 8, 2**-20)) == 2**-20
    assert png_exposure(png(texture)) == 1
    with pytest.raises(ValueError, match="bits = 12"):
        png(texture, 12)


@pytest.mark.parametrize("width", [1, 7, 8, 127, 128, 129, 300])
def test_radiance_files_hold_each_value_to_a_digit_of_the_largest_channel(width):
    texture = np.random.default_rng(3).random((5, width, 3), np.float32) * np.float32([40, 1, 0.01])
    texture[2, 0] = 0
    found, header = decoded_hdr(hdr(texture, 0.5))
    assert header == [b"#?RADIANCE", b"FORMAT=32-bit_rle_rgbe", b"EXPOSURE=0.5"]
    digit = 2.0 ** np.frexp(0.5 * texture.max(axis=2))[1] / 256
    # Two digits where the largest channel rounds up to a power of two.
    assert np.all(np.abs(found - 0.5 * texture) < 2 * digit[..., None] + 1e-30)
    assert np.mean(np.abs(found - 0.5 * texture) < digit[..., None] + 1e-30) > 0.99
    assert (found[2, 0] == 0).all()


@pytest.mark.parametrize("weak", [0.2, 0.02, 0.004])
def test_radiance_files_keep_the_mean_of_channels_far_below_the_largest(weak):
    """Cut off to whole digits, they would be 1, 9 and 48 % too dark."""
    texture = (0.5 + np.random.default_rng(4).random((128, 96, 1))) * np.float32([3.9, 3.9 * weak, 3.9])
    found, _ = decoded_hdr(hdr(texture.astype(np.float32)))
    assert found.mean(axis=(0, 1)) == pytest.approx(texture.mean(axis=(0, 1)), rel=0.004)


def test_radiance_files_hold_no_negative_and_no_infinite_values():
    texture = np.float32([[[-1, 2, 0.5], [np.inf, 1, 1], [np.nan, 1, 1e-35], [255.999, 1, 1]]])
    found, _ = decoded_hdr(hdr(texture))
    assert found[0, 0] == pytest.approx([0, 2, 0.5])
    assert found[0, 1, 0] == pytest.approx(1e38, rel=0.01)
    assert found[0, 2] == pytest.approx([0, 1, 0])
    assert found[0, 3, 0] == pytest.approx(256, abs=1)
    assert not decoded_hdr(hdr(np.full((2, 9, 3), 1e-36, np.float32)))[0].any()
