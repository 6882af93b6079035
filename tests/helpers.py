"""Helpers that several test modules share."""

import csv
from pathlib import Path

import numpy as np


def travel(angle, azimuth=0.0):
    """Unit vectors (..., 3) along which light travels in a plane's frame: degrees from the normal, and from +u."""
    theta, beta = np.broadcast_arrays(np.radians(angle), np.radians(azimuth))
    return np.stack([np.sin(theta) * np.cos(beta), np.sin(theta) * np.sin(beta), -np.cos(theta)], -1)


def adding_doubling_table():
    """Rows of reference/adding_doubling.csv, which its README describes: {column: number}."""
    with (Path(__file__).parent / "reference" / "adding_doubling.csv").open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


# Lamps that are hard for the fft solver: places in widths of the plane.
LAMPS = {
    "lamp": [(0.1, -0.2, 0.1)],
    "high": [(0.1, 0.05, 0.4)],
    "aside": [(0.3, 0.0, 0.1)],
    "grazing": [(-0.2, 0.1, 0.01)],
    "outside": [(0.8, 0.1, 0.02)],
    "beside": [(0.2, -0.2, 0.02)],
    "two lamps": [(-0.02, -0.2, 0.05), (0.22, 0.15, 0.05)],
}


def lamp(shape, x=0.0, y=0.0, height=0.3):
    """Irradiance and directions of a point lamp over texels; lengths in widths of the plane, from its middle.

    `shape` is the number of texels of a square's side, or height and width.
    """
    rows, columns = np.broadcast_to(shape, 2)
    across, along = ((np.arange(count) + 0.5 - 0.5 * count) / columns for count in (columns, rows))
    field = np.stack([*np.meshgrid(across - x, along - y), np.full((rows, columns), -height)], -1)
    distance = np.linalg.norm(field, axis=-1, keepdims=True)
    return (height / distance[..., 0] ** 3).astype(np.float32), (field / distance).astype(np.float32)


def noise(size, rng, waves):
    """Smooth noise of standard deviation 1."""
    frequencies = np.hypot(*np.meshgrid(*[np.fft.fftfreq(size) * size] * 2))
    spectrum = np.fft.fft2(rng.normal(size=(size, size))) * np.exp(-0.5 * (frequencies / waves) ** 2)
    smooth = np.fft.ifft2(spectrum).real
    return smooth / smooth.std()


def lights_of(kind, size, rng):
    """Irradiance and directions of each: one of LAMPS, or even light from "smooth", "blocks" or "texels"."""
    if kind in LAMPS:
        return [lamp(size, *place) for place in LAMPS[kind]]
    if kind == "smooth":  # few texels have extreme angles
        angle, azimuth = np.clip(45 + 20 * noise(size, rng, 3), 0, 89), np.degrees(2 * noise(size, rng, 3))
        directions = travel(angle, azimuth)
    else:
        side = {"texels": 1, "blocks": 8}[kind]
        shape = size // side, size // side
        directions = np.kron(travel(rng.uniform(0, 89, shape), rng.uniform(0, 360, shape)), np.ones((side, side, 1)))
    return [(np.ones((size, size), np.float32), directions.astype(np.float32))]


def lit_texels(kind, size, rng):
    """float32 (size, size), 1 where it is lit: "none" has no shadows."""
    lit = np.zeros((size, size), np.float32)
    if kind == "texels":
        lit[rng.random(lit.shape) < 0.3] = 1
    elif kind == "blocks":
        lit = np.kron(rng.random((8, 8)) < 0.6, np.ones((size // 8, size // 8))).astype(np.float32)
    else:
        part = {"none": np.s_[:], "half": np.s_[:, : size // 2], "stripes": np.s_[:, ::8], "corner": np.s_[:33, :33]}
        lit[part[kind]] = 1
    return lit


def gather_beams(grid, light, occluders=None, samples=4, **options):
    """Irradiance and mean direction of travel of a light without a size, on a native `ReceiverGrid`.

    Irradiance is (H, W), or (H, W, 3) past colored occluders. Directions are float64 unit vectors (H, W, 3), and
    (0, 0, -1) in the dark.
    """
    from beamspread.core.native import native

    irradiance, flow = native.gather_rays(grid, light, occluders, samples=samples, **options)
    if occluders is None or not occluders.is_colored:
        irradiance = np.ascontiguousarray(irradiance[..., 0])
    flow = flow.astype(float)
    length = np.linalg.norm(flow, axis=-1, keepdims=True)
    direction = np.where(length > 0, flow / np.maximum(length, np.finfo(float).tiny), (0, 0, -1))
    return irradiance, direction
