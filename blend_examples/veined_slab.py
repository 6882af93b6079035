"""The scene veined_slab: a slab of veined onyx behind a small balustrade, in low sun. Lengths are metres.

Light from the stone around a thin vein passes through it and washes it out; wide veins stay dark and darken their
neighborhood. A texture that multiplies light keeps every vein. The ior is 1, so that Cycles can trace paths through the
onyx, too (with_volume.py).
"""

import numpy as np
import scene_parts as parts

MM = 0.001
WIDTH, DEPTH = 150 * MM, 100 * MM
TEXELS = 480, 320
BALUSTER = "0,0 5,0 5,0 5,2 5,2 2.6,4 2.2,7 4.2,14 4.4,17 3.2,22 1.9,28 2.6,31 2.6,32 4,33 4,33 4,36 4,36 0,36"


def build():
    scene = parts.empty_scene("Veined slab", 540, 360, samples=128, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 720
    onyx, node = parts.medium_material(
        "Onyx", color_mode="BASE_COLOR", mean_free_path=(2 * MM,) * 3, anisotropy=0.0, ior=1.0
    )
    parts.paint(onyx, node, "Onyx", veins())
    parts.plane("Slab", WIDTH, DEPTH, onyx)
    surroundings()
    parts.sun("Low sun", parts.direction(66, -24), 6.5, (1.0, 0.88, 0.72))
    parts.sun("Light of the room", parts.direction(20, 120), 0.15, (0.7, 0.8, 1.0))
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 3, 1, 2
    parts.camera((0.05, -0.185, 0.158), (-0.003, -0.003, 0.006), lens=50)


def veins():
    """Bands of two tones, and dark veins where a random surface crosses 0."""
    columns, rows = TEXELS
    generator = np.random.default_rng(8)
    x, y = np.meshgrid(np.arange(columns) / rows, np.arange(rows) / rows)

    def waves(low, high):
        """A random surface of waves, from `low` to `high` across the slab's depth, of deviation 1."""
        total = np.zeros((rows, columns))
        for _ in range(60):
            number, way = np.exp(generator.uniform(np.log(low), np.log(high))), generator.uniform(0, 2 * np.pi)
            phase = 2 * np.pi * (number * (x * np.cos(way) + y * np.sin(way)) + generator.random())
            total += np.sin(phase) / number
        return total / total.std()

    bands = 0.5 + 0.5 * np.sin(2 * np.pi * (1.6 * x + 0.9 * y + 0.22 * waves(0.5, 4)))
    thick = np.exp(-((waves(0.7, 6) / 0.17) ** 2))
    thin = 0.7 * np.exp(-((waves(1.5, 9) / 0.09) ** 2))
    light, warm, dark = np.array([0.84, 0.80, 0.71]), np.array([0.80, 0.67, 0.42]), np.array([0.23, 0.10, 0.04])
    part = np.maximum(thick, thin)[..., None]
    return (1 - part) * (warm + (light - warm) * bands[..., None]) + part * dark


def surroundings():
    wood = parts.plain_material("Table", (0.018, 0.011, 0.008), roughness=0.5, specular=0.1)
    stone = parts.plain_material("Balusters", (0.16, 0.13, 0.10), roughness=0.6)
    parts.table_around(WIDTH, DEPTH, wood)
    count, at = 7, -WIDTH / 2 - 7 * MM
    for number in range(count):
        place = at, (number - (count - 1) / 2) * 16 * MM, 0
        parts.lathe(f"Baluster {number + 1}", parts.rounded(BALUSTER), stone, place, MM)
    parts.box("Rail", (at - 4 * MM, -56 * MM, 36 * MM), (at + 4 * MM, 56 * MM, 40 * MM), stone)
