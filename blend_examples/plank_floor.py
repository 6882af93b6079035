"""The scene plank_floor: a floor of maple planks under a window that lets a low sun and the sky in. Lengths are metres.

The planks are faces of one mesh. Their UV map repeats a small texture of wood, shifted from plank to plank, so faces
overlap in it: the first bake makes another map for its image, and the texture keeps this one. Light spreads some 1 cm
inside the wood, which softens the shadows of the window's bars and of the leaves before it.
"""

import math

import bpy
import numpy as np
import scene_parts as parts
from mathutils import Vector

MM, CM = 0.001, 0.01
WIDTH, DEPTH, HEIGHT = 1.9, 1.68, 2.3
PLANK, PLANK_LENGTH, GAP = 0.14, 0.95, 3 * MM
TILE = 0.35  # side of the repeated texture
# The window in the left wall: from where to where, along the wall and up.
WINDOW_Y, WINDOW_Z = (-0.62, 0.62), (0.50, 1.90)
WALL = 0.16


def build():
    scene = parts.empty_scene("Plank floor", 540, 360, samples=96, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.view_settings.exposure = 0.6
    scene.beamspread.resolution = 320
    wood, node = parts.medium_material(
        "Maple",
        color_mode="BASE_COLOR",
        mean_free_path=(2.8 * MM, 2.2 * MM, 1.6 * MM),
        anisotropy=0.8,
        ior=1.5,
        texture_blur=0.2,
    )
    wood.cycles.sample_as_light = False  # its light is dim and large
    node.inputs["Roughness"].default_value = 0.25
    texture = wood.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.location = grain(256), (-320, 0)
    wood.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    planks(wood)
    room()
    plant()
    # For Cycles alone, which finds the sky through it with less noise.
    size = WINDOW_Y[1] - WINDOW_Y[0], WINDOW_Z[1] - WINDOW_Z[0]
    place = (-WIDTH / 2 - WALL, sum(WINDOW_Y) / 2, sum(WINDOW_Z) / 2)
    portal = parts.area_lamp("Portal", place, (0, *place[1:]), size, 1.0)
    portal.data.cycles.is_portal = True
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.45, 0.66, 1.0, 1.0), 1.6
    lamp = parts.sun("Sun", parts.direction(56, -14), 9.0, (1.0, 0.80, 0.58))
    lamp.data.angle = math.radians(0.53)
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 6, 4, 3
    scene.cycles.sample_clamp_indirect = 0.8
    parts.camera((0.86, -0.74, 1.28), (-0.40, 0.20, 0.18), lens=25)


def grain(size):
    """A texture of wood that repeats: rings, seen along the trunk, and pores."""
    generator = np.random.default_rng(5)
    x, y = np.meshgrid((np.arange(size) + 0.5) / size, (np.arange(size) + 0.5) / size)
    bend = np.zeros((size, size))
    for k in (1, 2, 3):
        slant = generator.normal() * np.sin(2 * np.pi * y)
        bend += generator.normal() / k * np.sin(2 * np.pi * (k * x + generator.random()) + slant)
    rings = 0.5 + 0.5 * np.sin(2 * np.pi * (9 * y + 0.35 * bend))
    waves = np.fft.fftfreq(size) * size
    streaks = np.exp(-((waves[None] / 6) ** 2) - ((waves[:, None] / 70) ** 2))
    pores = np.fft.ifft2(np.fft.fft2(generator.standard_normal((size, size))) * streaks).real
    tone = np.clip(0.62 * rings + 0.20 * pores / pores.std() + 0.1, 0, 1)[..., None]
    colors = (1 - tone) * np.array([0.77, 0.60, 0.41]) + tone * np.array([0.88, 0.74, 0.55])
    image = bpy.data.images.new("Maple", size, size)
    image.pixels.foreach_set(np.dstack([colors, np.ones((size, size))]).astype(np.float32).ravel())
    image.pack()
    return image


def planks(material):
    """One mesh; the planks run away from the window's wall, and their ends are staggered."""
    generator, corners, uvs = np.random.default_rng(2), [], []
    rows = round(DEPTH / PLANK)
    for row in range(rows):
        y = -DEPTH / 2 + row * PLANK
        x = -WIDTH / 2 - (0.13 + 0.37 * row) % 1.0 * PLANK_LENGTH
        while x < WIDTH / 2:
            low, high = max(x, -WIDTH / 2), min(x + PLANK_LENGTH, WIDTH / 2) - GAP
            if high - low > 5 * CM:
                box = np.array([(low, y), (high, y), (high, y + PLANK - GAP), (low, y + PLANK - GAP)])
                corners += [(*corner, 0.0) for corner in box]
                uvs += [tuple(uv) for uv in box / TILE + generator.integers(-4, 5, 2) + generator.random(2)]
            x += PLANK_LENGTH
    faces = [tuple(range(first, first + 4)) for first in range(0, len(corners), 4)]
    obj = parts.mesh_object("Planks", corners, faces, material)
    layer = obj.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.array(uvs, np.float32).ravel())


def room():
    plaster = parts.plain_material("Plaster", (0.74, 0.71, 0.66), roughness=0.9, specular=0.1)
    paint = parts.plain_material("White paint", (0.80, 0.80, 0.78), roughness=0.4)
    dark = parts.plain_material("Subfloor", (0.03, 0.022, 0.016), roughness=0.9, specular=0.1)
    x, y, far = WIDTH / 2, DEPTH / 2, WALL
    parts.box("Subfloor", (-x - far, -y - far, -5 * CM), (x + far, y + far, -12 * MM), dark)
    parts.box("Ceiling", (-x - far, -y - far, HEIGHT), (x + far, y + far, HEIGHT + far), plaster)
    parts.box("Wall behind", (-x - far, y, -2 * CM), (x + far, y + far, HEIGHT), plaster)
    parts.box("Wall in front", (-x - far, -y - far, -2 * CM), (x + far, -y, HEIGHT), plaster)
    parts.box("Wall right", (x, -y, -2 * CM), (x + far, y, HEIGHT), plaster)
    (y0, y1), (z0, z1) = WINDOW_Y, WINDOW_Z
    for name, low, high in (
        ("below", (-y, -2 * CM), (y, z0)),
        ("above", (-y, z1), (y, HEIGHT)),
        ("on the left", (-y, z0), (y0, z1)),
        ("on the right", (y1, z0), (y, z1)),
    ):
        parts.box(f"Wall {name}", (-x - far, *low), (-x, *high), plaster)
    parts.box("Sill", (-x - far, y0 - 3 * CM, z0 - 3 * CM), (-x + 6 * CM, y1 + 3 * CM, z0 + 5 * MM), paint)
    middle, bar = -x - far / 2, 2.2 * CM
    for index in range(4):
        at = y0 + (y1 - y0) * index / 3
        parts.box(f"Post {index + 1}", (middle - bar, at - bar, z0), (middle + bar, at + bar, z1), paint)
    for index in range(4):
        at = z0 + (z1 - z0) * index / 3
        parts.box(f"Bar {index + 1}", (middle - 0.8 * bar, y0, at - bar), (middle + 0.8 * bar, y1, at + bar), paint)
    for name, low, high in (
        ("behind", (-x, y - 1.5 * CM, 0), (x, y, 8 * CM)),
        ("left", (-x, -y, 0), (-x + 1.5 * CM, y - 1.5 * CM, 8 * CM)),
    ):
        parts.box(f"Skirting {name}", low, high, paint)


def plant():
    """A pot on the sill, with leaves on thin stalks."""
    clay = parts.plain_material("Terracotta", (0.52, 0.21, 0.11), roughness=0.8, specular=0.2)
    leaf = parts.plain_material("Leaf", (0.07, 0.20, 0.05), roughness=0.5)
    place = Vector((-WIDTH / 2 - 2 * CM, 0.30, WINDOW_Z[0] + 5 * MM))
    parts.lathe(
        "Pot", parts.rounded("0,0 0,0 45,0 45,0 62,92 62,92 68,92 68,110 68,110 60,110 56,96 0,94"), clay, place, MM
    )
    generator = np.random.default_rng(11)
    corners, faces = [], []
    for index in range(26):
        azimuth, rise = generator.random() * math.tau, math.radians(generator.uniform(25, 80))
        out = Vector((math.cos(azimuth) * math.cos(rise), math.sin(azimuth) * math.cos(rise), math.sin(rise)))
        tip = place + Vector((0, 0, 0.10)) + out * generator.uniform(0.14, 0.40)
        side = out.cross(Vector((0, 0, 1))).normalized() * generator.uniform(0.022, 0.036)
        length = (out + Vector((0, 0, -0.35))).normalized() * generator.uniform(0.09, 0.14)
        first = len(corners)
        corners += [tip, tip + 0.45 * length + side, tip + length, tip + 0.45 * length - side]
        faces.append((first, first + 1, first + 2, first + 3))
        if index % 3 == 0:
            parts.wire(f"Stalk {index // 3 + 1}", [place + Vector((0, 0, 0.09)), tip], 2 * MM, leaf, sides=6)
    parts.mesh_object("Leaves", corners, faces, leaf)
