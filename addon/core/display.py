"""Files of 8 and 16 bits: PNG, with sRGB encoding and an exposure that brings values to 1 or below, and Radiance HDR.

An *exposure* is the factor that texels of a file were multiplied by; the radiance is the decoded value divided by it.
"""

from __future__ import annotations

import math
import struct
import zlib

import numpy as np

EXPOSURE = "beamspread:exposure"
"""Attribute of EXR files and text of PNG files: the exposure of the file. HDR files have their own EXPOSURE line."""

AUTO = "auto"
"""Exposure by the largest value."""

_SMALLEST_HDR, _LARGEST_HDR = 1e-32, 1e38
"""Values that Radiance files hold at least and at most; smaller ones are 0 there."""

R2_STEPS = 0.7548776662466927, 0.5698402909980532
"""Inverse of the root of x^3 = x + 1, and its square."""


def auto_exposure(texture: np.ndarray) -> float:
    """Largest power of two, at most 1, that brings all finite values to 1 or below.

    A power of two changes no digit of a value, and is a whole number of stops.
    """
    finite = texture[np.isfinite(texture)]
    largest = float(finite.max(initial=0.0))
    return 1.0 if largest <= 1 else 0.5 ** math.ceil(math.log2(largest))


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Encode linear values with the sRGB transfer function (IEC 61966-2-1), clipped to 0..1."""
    clipped = np.clip(linear, 0, 1)
    return np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055).astype(np.float32)


def png(texture: np.ndarray, bits: int = 8, exposure: float = 1.0) -> bytes:
    """Content of a PNG file: linear RGB (height, width, 3), row 0 at the bottom, times the exposure, as sRGB.

    Blender writes no text into a PNG of 16 bits, so the chunks are made here (ISO/IEC 15948); zlib packs them.

    Parameters
    ----------
    bits : of each number, 8 or 16.
    exposure : also stored as the file's text `EXPOSURE`, unless it is 1.

    8 bits are rounded up or down in the proportion of the values, so that dark areas keep their mean and show no bands.
    """
    if bits not in (8, 16):
        raise ValueError(f"bits = {bits}, must be 8 or 16")
    height, width = texture.shape[:2]
    encoded = to_srgb(np.nan_to_num(texture[::-1] * np.float32(exposure)))
    threshold = _spread_thresholds(width, height) if bits == 8 else np.float32(0.5)
    numbers = np.floor(encoded * np.float32(2**bits - 1) + threshold).astype(np.uint8 if bits == 8 else ">u2")
    rows = numbers.reshape(height, -1).view(np.uint8)
    unfiltered = np.zeros((height, 1), np.uint8)  # type of filter of each row
    text = f"{EXPOSURE}\0{exposure!r}".encode("latin-1")
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)),
        (b"sRGB", b"\0"),
        *([(b"tEXt", text)] if exposure != 1 else []),
        (b"IDAT", zlib.compress(np.hstack([unfiltered, rows]).tobytes(), 6)),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, content) for kind, content in chunks)


def hdr(texture: np.ndarray, exposure: float = 1.0) -> bytes:
    """Content of a Radiance file: linear RGB (height, width, 3), row 0 at the bottom, times the exposure.

    A texel has 8 bits for each channel and one exponent for all (G. Ward, "Real Pixels", Graphics Gems II, 1991). Bits
    are rounded up or down in the proportion of the values, so that means stay where readers take a number n of the
    exponent e as n 2^(e - 136): engines do. Ward's own readers and Blender take it as (n + .5) 2^(e - 136).
    """
    height, width = texture.shape[:2]
    values = np.clip(np.nan_to_num(texture[::-1] * np.float32(exposure)), 0, _LARGEST_HDR).astype(np.float64)
    thresholds, largest = _spread_thresholds(width, height), values.max(axis=2)
    exponents = np.frexp(largest)[1]
    # One more where the largest channel would be rounded to 256.
    exponents += (np.ldexp(values, 8 - exponents[..., None]) + thresholds).max(axis=2) >= 256
    texels = np.zeros((height, width, 4), np.uint8)
    is_lit = largest > _SMALLEST_HDR
    texels[..., :3] = np.floor(np.ldexp(values, 8 - exponents[..., None]) + thresholds) * is_lit[..., None]
    texels[..., 3] = (exponents + 128) * is_lit
    lines = ["#?RADIANCE", "FORMAT=32-bit_rle_rgbe", *([f"EXPOSURE={exposure!r}"] if exposure != 1 else []), ""]
    return "\n".join([*lines, f"-Y {height} +X {width}", ""]).encode("ascii") + _scanlines(texels)


def _scanlines(texels: np.ndarray) -> bytes:
    """Texels (height, width, 4) in the form that readers expect for their width; no runs are looked for."""
    height, width = texels.shape[:2]
    if not 8 <= width < 2**15:
        return texels.tobytes()
    channels = np.moveaxis(texels, 2, 1)  # of each line one after the other, in blocks of up to 128 after their length
    starts = np.arange(0, width, 128)
    lengths = np.minimum(width - starts, 128).astype(np.uint8)
    counts = np.broadcast_to(lengths, (height, 4, len(starts)))
    lines = np.insert(channels, starts, counts, axis=2).reshape(height, -1)
    start = np.tile(np.array([2, 2, width >> 8, width & 255], np.uint8), (height, 1))
    return np.hstack([start, lines]).tobytes()


def _spread_thresholds(width: int, height: int) -> np.ndarray:
    """Numbers from 0 to 1 that fill each part of an image evenly, (height, width, 3).

    Sequence R2 along columns and rows (M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018):
    means of areas have a tenth of the error that random numbers leave.
    """
    across, up = (np.arange(count) * step % 1 for count, step in zip((width, height), R2_STEPS))
    channel = np.arange(3) / 3
    return (across[:, None] + channel + up[:, None, None]).astype(np.float32) % np.float32(1)


def png_exposure(content: bytes) -> float:
    """Exposure of a PNG file; 1 if the file names none."""
    return float(_texts(content).get(EXPOSURE, "1"))


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _texts(content: bytes) -> dict[str, str]:
    """Texts of a PNG file by their keywords."""
    found, start = {}, 8
    while start + 8 <= len(content):
        size, kind = struct.unpack(">I4s", content[start : start + 8])
        if kind == b"tEXt":
            keyword, _, text = content[start + 8 : start + 8 + size].decode("latin-1").partition("\0")
            found[keyword] = text
        start += size + 12
    return found
