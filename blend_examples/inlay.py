"""The scene inlay: a table top of alabaster, inlaid with a dark stone, by a candle. Lengths are meters.

Narrow pieces of the dark stone let the light of the alabaster through, and its edges are soft; points of stars fade. A
texture that multiplies light cuts them out of paper. The ior is 1, so that Cycles can trace paths through the stones,
too (with_volume.py).
"""

import numpy as np
import scene_parts as parts

MM = 0.001
SIDE = 90 * MM
TEXELS = 512
SAMPLES = 4  # of each texel, along either axis
POINTS = 12


def build():
    scene = parts.empty_scene("Inlay", 540, 360, samples=128, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    stone, node = parts.medium_material(
        "Inlay", color_mode="BASE_COLOR", mean_free_path=(1.5 * MM,) * 3, anisotropy=0.0, ior=1.0
    )
    parts.paint(stone, node, "Inlay", pattern())
    parts.plane("Table top", SIDE, SIDE, stone)
    wood = parts.plain_material("Frame", (0.018, 0.011, 0.008), roughness=0.5, specular=0.1)
    parts.table_around(SIDE, SIDE, wood)
    brass = parts.plain_material("Brass", (0.35, 0.22, 0.07), roughness=0.35, metallic=1.0)
    tray = "0,0 12,0 12,0 13,1.5 13,1.5 12,1.5 11,1 5,1 5,1 5,9 5,9 4.4,9 4.4,9 0,9"
    parts.lathe("Candlestick", parts.rounded(tray), brass, (-22 * MM, 26 * MM, 0), MM)
    parts.point_lamp("Candle", (-22 * MM, 26 * MM, 24 * MM), 0.09, (1.0, 0.76, 0.48))
    parts.sun("Light of the room", parts.direction(30, 200), 0.12, (0.6, 0.75, 1.0))
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 3, 1, 2
    parts.camera((0.012, -0.125, 0.098), (0.0, -0.006, 0.0), lens=50)


def pattern():
    """A star within a ring of triangles, in a border of small diamonds."""
    at = (np.arange(TEXELS * SAMPLES) + 0.5) / (TEXELS * SAMPLES) * 2 - 1
    x, y = np.meshgrid(at, at)
    radius, turn = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi) * POINTS
    zigzag = 2 * np.abs(turn - np.floor(turn) - 0.5)  # 0 in the middle of a point, 1 between two
    star = (radius < 0.62 * (1 - 0.62 * zigzag)) & (radius > 0.1)
    fine = 4 * turn
    teeth = np.abs(fine - np.floor(fine) - 0.5) * 2
    ring = (radius > 0.66) & (radius < 0.78 - 0.11 * teeth)
    edge = np.maximum(np.abs(x), np.abs(y))
    along = np.where(np.abs(x) > np.abs(y), y, x) * 14
    diamonds = np.abs(along - np.floor(along) - 0.5) + np.abs(edge - 0.91) * 10 < 0.42
    lines = (np.abs(edge - 0.845) < 0.006) | (np.abs(edge - 0.975) < 0.006)
    dark = (star | ring | diamonds | lines).reshape(TEXELS, SAMPLES, TEXELS, SAMPLES).mean(axis=(1, 3))[..., None]
    return (1 - dark) * np.array([0.62, 0.56, 0.46]) + dark * np.array([0.10, 0.13, 0.105])
