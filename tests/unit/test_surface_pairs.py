"""The solver `surface`, all pairs: against sums in NumPy."""

import _native_test
import numpy as np
import pytest

ALBEDO = (0.9, 0.95, 0.6)


def waves(count=400):
    """Samples of a wavy surface at random places, with random tangents; every second one is lit from anywhere."""
    random = np.random.default_rng(3)
    x, y = random.uniform(-1, 1, (2, count))
    normal = np.stack([-0.6 * np.cos(2 * x), 0.9 * np.sin(3 * y), np.ones(count)], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = np.cross(normal, random.normal(size=(count, 3)))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    position = np.stack([x, y, 0.3 * np.sin(2 * x) + 0.3 * np.cos(3 * y)], 1)
    area = random.uniform(0.5, 1, count) / count * 1e-3  # far smaller than distances: points
    samples = np.column_stack([position, normal, tangent, area]).astype(np.float32)
    cosine, azimuth = random.uniform(0.1, 1, count), random.uniform(0, 2 * np.pi, count)
    sine = np.sqrt(1 - cosine**2)
    travel = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine], 1).astype(np.float32)
    irradiance = (random.uniform(0, 9, (count, 3)) * (np.arange(count)[:, None] % 2)).astype(np.float32)
    return samples, travel, irradiance


NODES = [-0.5, 0.0, 0.5, 2.0]


def summed_pairs(samples, travel, irradiance, paths):
    """Luminance by `ExponentialSource`, pair by pair, and the curvature of the pairs: [from][to]."""
    position, normal, tangent, area = np.split(samples.astype(float), [3, 6, 9], axis=1)
    way = position[None] - position[:, None]
    chord = np.linalg.norm(way, axis=-1) + np.eye(len(way))
    leaving, entering = np.einsum("jc,ijc->ij", normal, way), -np.einsum("ic,ijc->ij", normal, way)
    total = entering + leaving
    mean = np.copysign(2 * np.sqrt(np.maximum(entering * leaving, 0)), total)
    # Across edges, and where the first channel's light diffuses.
    is_edge = np.interp(np.abs(total) / chord, [0.25, 0.75], [0, 1])
    is_diffuse = np.interp(chord * NODES[-1] / paths[0], [3, 6], [0, 1])
    curvature = (total + is_edge * is_diffuse * (mean - total)) / chord**2
    binormal = np.cross(normal, tangent)
    x, y = np.einsum("ijc,ic->ij", way, tangent), np.einsum("ijc,ic->ij", way, binormal)
    fade = np.minimum(np.hypot(x, y) / (0.5 * chord), 1)  # of harmonics where a chord is steep
    azimuth = np.arctan2(y, x)
    azimuth -= np.arctan2(travel[:, 1], travel[:, 0])[:, None]
    angle = np.degrees(np.arccos(-travel[:, 2].astype(float)))
    nodes = np.arange(0, 91, 15)
    luminance = []
    for c, (albedo, path) in enumerate(zip(ALBEDO, paths)):
        r, k = chord / path, np.clip(curvature * path, NODES[0], NODES[-1])
        kernel = sum(
            (np.interp(angle, nodes, np.sin(np.radians(nodes)) ** m) / (m + 1))[:, None]
            * (1 + (m + 1) * k) * (fade * r / (1 + r)) ** m * np.exp(-r) * np.cos(m * azimuth)
            for m in range(4)
        )  # fmt: skip
        kernel *= albedo / (2 * np.pi * path**2) * (1 - np.eye(len(way)))
        luminance.append((area[:, 0] * irradiance[:, c]) @ kernel / np.pi)
    return np.stack(luminance, 1), curvature, fade


@pytest.mark.parametrize("is_colored", [True, False], ids=["colored", "gray"])
def test_pairs_choose_kernels_by_chord_azimuth_and_curvature(is_colored):
    """Tables are linear over 16 steps of an octave: 1e-3 at most, measured 4e-4."""
    samples, travel, irradiance = waves()
    paths, color = (0.3, 0.2, 0.5), [1.0, 0.5, 0.25]
    if not is_colored:
        irradiance = np.repeat(irradiance[:, :1], 3, axis=1)
    source = _native_test.ExponentialSource(NODES)
    field = _native_test.SurfaceField(
        samples, [source] * 3, list(ALBEDO), list(paths), tolerance=1e-4, is_colored=is_colored, is_direct=True
    )
    dark = 100
    field.add(travel[:dark], irradiance[:dark], color)
    field.add(travel[dark:], irradiance[dark:], color, dark)
    expected, curvature, fade = summed_pairs(samples, travel, irradiance * np.array(color, np.float32), paths)
    assert (np.abs(curvature * 0.5) > 0.5).mean() > 0.1
    assert fade.min() < 0.5
    # A sample's light at itself is a small part in between; it is known exactly.
    samples_dark = irradiance.max(axis=1) == 0
    error = np.abs(field.solve() - expected)[samples_dark]
    assert (error / expected[samples_dark].max(axis=0)).max() < 1e-3
