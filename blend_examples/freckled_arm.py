"""The scene freckled_arm: skin with freckles, in low sun. Lengths are meters.

Light from the skin around passes below freckles, red light farther than blue: they are soft and warm, and small ones
fade. A texture that multiplies light keeps all of them sharp. The arm is a body: red light goes on into its shade, and
past the border of a shadow. The ior is 1, so that Cycles can trace paths through the skin, too (with_volume_round.py).
"""

import math

import numpy as np
import scene_parts as parts

MM = 0.001
RADIUS = 28 * MM
LENGTH = math.pi * RADIUS
BARE = 0.75 * LENGTH  # the arm goes on in sleeves
FACETS = 128
TEXELS = 256, 128  # around and along the arm


def build():
    scene = parts.empty_scene("Freckled arm", 400, 300, samples=128, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = max(TEXELS)
    # Skin1 of Jensen et al. 2001; 1 / mm.
    lengths = [MM / (scattering + absorption) for scattering, absorption in ((0.74, 0.032), (0.88, 0.17), (1.01, 0.48))]
    skin, node = parts.medium_material("Skin", color_mode="BASE_COLOR", mean_free_path=lengths, anisotropy=0.0, ior=1.0)
    parts.paint(skin, node, "Freckles", freckles())
    tube("Arm", RADIUS, -LENGTH / 2, LENGTH / 2, skin).data.polygons.foreach_set("use_smooth", [True] * FACETS)
    clothes()
    parts.sun("Low sun", parts.direction(64, 0), 5.0, (1.0, 0.86, 0.70))
    parts.sun("Light of the room", parts.direction(40, 70), 0.3, (0.7, 0.8, 1.0))
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 3, 1, 2
    parts.camera((0.018, -0.130, 0.105), (-0.003, -0.010, 0.033), lens=52)


def tube(name, radius, start, end, material):
    """A tube along x on the table; its map starts below it, goes up in front, and along it."""
    turn = 2 * np.pi * np.arange(FACETS) / FACETS
    across = np.stack([-np.sin(turn), 1 - np.cos(turn)], -1) * radius
    across[:, 1] += RADIUS - radius
    corners = [(x, *place) for x in (start, end) for place in across]
    faces = [(i, FACETS + i, FACETS + (i + 1) % FACETS, (i + 1) % FACETS) for i in range(FACETS)]
    obj = parts.mesh_object(name, corners, faces, material)
    places = [[(u, 0), (u, 1), (u + 1, 1), (u + 1, 0)] for u in range(FACETS)]
    layer = obj.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", (np.array(places, np.float32) / (FACETS, 1)).ravel())
    return obj


def clothes():
    """Sleeves at both ends of the arm, a plaited band around it, and a cloth below."""
    wool = parts.plain_material("Wool", (0.05, 0.07, 0.10), roughness=0.9, specular=0.1)
    leather = parts.plain_material("Leather", (0.035, 0.014, 0.008), roughness=0.7, specular=0.2)
    cloth = parts.plain_material("Cloth", (0.06, 0.055, 0.05), roughness=0.9, specular=0.1)
    for side in (-1, 1):
        sleeve = tube(f"Sleeve {side}", RADIUS + 1.5 * MM, *sorted((side * BARE / 2, side * 0.3)), wool)
        sleeve.modifiers.new("Thickness", "SOLIDIFY").thickness = 1.2 * MM
    turns = np.linspace(0, 2 * math.pi, 97)
    for strand in (0, 1):
        ring = []
        for turn in turns:
            swing = math.pi * strand + 14 * turn
            radius = RADIUS + 1.9 * MM + 0.7 * MM * math.sin(swing)
            x = -16 * MM + 3 * MM * math.sin(turn) + 1.1 * MM * math.cos(swing)
            ring.append((x, -radius * math.sin(turn), RADIUS - radius * math.cos(turn)))
        parts.wire(f"Band {strand + 1}", ring, 1.1 * MM, leather)
    parts.box("Table", (-1, -1, -0.02), (1, 1, 0), cloth)


def freckles():
    """Freckles of several sizes, more of them where many are, on skin of uneven color."""
    columns, rows = TEXELS
    around, generator = 2 * np.pi * RADIUS, np.random.default_rng(11)
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns * around, (np.arange(rows) + 0.5) / rows * LENGTH)

    def spots(count, least, most, scatter):
        """1 in spots of radii between two lengths, 0 outside of them, around random middles."""
        part = np.zeros((rows, columns))
        for middle in generator.random((count, 2)) * (around, LENGTH):
            radius, tone = np.exp(generator.uniform(*np.log((least, most)))), generator.uniform(0.6, 1.0)
            for lobe in generator.normal(size=(3, 2)) * scatter * radius + middle:
                far = np.hypot((x - lobe[0] + around / 2) % around - around / 2, y - lobe[1])
                part = np.maximum(part, tone * np.clip((radius - far) / (0.5 * MM) + 0.5, 0, 1))
        return part

    part = np.maximum(spots(420, 0.35 * MM, 0.8 * MM, 0.5), spots(110, 0.8 * MM, 1.5 * MM, 0.6))
    flush = spots(60, 3 * MM, 8 * MM, 0.5)
    skin, red, freckle = np.array([0.66, 0.46, 0.36]), np.array([0.64, 0.40, 0.30]), np.array([0.20, 0.085, 0.045])
    color = skin + flush[..., None] * (red - skin)
    return color + part[..., None] * (freckle - color)
