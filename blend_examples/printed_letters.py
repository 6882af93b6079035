"""The scene printed_letters: an eye chart in milky acrylic, in low sun. Lengths are meters.

Ink goes as deep as light does. Light of the acrylic passes through thin strokes, so that small letters fade; large ones
are darker than their color, and so is the acrylic near them. A texture that multiplies light keeps all of them alike.
The ior is 1, so that Cycles can trace paths through the acrylic, too (with_volume.py).
"""

import math

import bpy
import numpy as np
import scene_parts as parts

MM = 0.001
SIDE = 80 * MM
TEXELS = 480
SAMPLES = 4  # of each texel, along either axis
# Letters, height of capitals and their lower border from the middle of the plate, in mm.
ROWS = (
    ("E", 19.0, 16.5),
    ("F P", 13.0, -0.5),
    ("T O Z", 8.6, -12.5),
    ("L P E D", 5.6, -21.0),
    ("P E C F D", 3.7, -27.5),
    ("E D F C Z P", 2.5, -33.0),
)
RED_ROW = 2
BOLD = 0.012  # how far outlines are moved, over the font's size
CAPITAL = 0.729  # height of capitals of Blender's font, over its size


def build():
    scene = parts.empty_scene("Printed letters", 400, 300, samples=128, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = TEXELS
    acrylic, node = parts.medium_material(
        "Acrylic", color_mode="BASE_COLOR", mean_free_path=(1.0 * MM,) * 3, anisotropy=0.0, ior=1.0
    )
    parts.paint(acrylic, node, "Eye chart", chart())
    parts.plane("Eye chart", SIDE, SIDE, acrylic)
    wood = parts.plain_material("Table", (0.045, 0.024, 0.014), roughness=0.5, specular=0.1)
    parts.table_around(SIDE, SIDE, wood)
    glasses()
    parts.sun("Low sun", parts.direction(52, -22), 4.2, (1.0, 0.88, 0.72))
    parts.sun("Light of the room", parts.direction(20, 120), 0.25, (0.7, 0.8, 1.0))
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 3, 1, 2
    parts.camera((0.008, -0.080, 0.108), (-0.005, -0.005, 0.0), lens=39)


def chart():
    """Rows of letters, smaller and smaller: dark blue in white, one row red."""
    dark, red = (coverage([row for row in ROWS if (row is ROWS[RED_ROW]) == is_red]) for is_red in (False, True))
    color = np.array([0.85, 0.84, 0.80]) * np.ones((TEXELS, TEXELS, 1))
    for part, ink in ((dark, (0.03, 0.035, 0.06)), (red, (0.42, 0.03, 0.025))):
        color += part[..., None] * (np.array(ink) - color)
    return color


def coverage(rows):
    """Part of each texel that letters cover, rows upward."""
    count = TEXELS * SAMPLES
    at = ((np.arange(count) + 0.5) / count - 0.5) * SIDE / MM
    inside = np.zeros((count, count), bool)
    for text, height, bottom in rows:
        for corners in triangles(text, height / CAPITAL):
            corners = corners + (0, bottom)
            low, high = (np.searchsorted(at, bound) for bound in (corners.min(axis=0), corners.max(axis=0)))
            x, y = at[None, low[0] : high[0]], at[low[1] : high[1], None]
            ways = np.roll(corners, -1, axis=0) - corners
            sides = [way[0] * (y - corner[1]) - way[1] * (x - corner[0]) for way, corner in zip(ways, corners)]
            within = np.all([side >= 0 for side in sides], axis=0) | np.all([side <= 0 for side in sides], axis=0)
            inside[low[1] : high[1], low[0] : high[0]] |= within
    return inside.reshape(TEXELS, SAMPLES, TEXELS, SAMPLES).mean(axis=(1, 3))


def triangles(text, size):
    """Corners (3, 2) of the triangles of a line of letters around x = 0, its foot at y = 0."""
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size, curve.offset, curve.align_x = text, size, BOLD * size, "CENTER"
    obj = parts.link(text, curve)
    mesh = bpy.data.meshes.new_from_object(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    mesh.calc_loop_triangles()
    found = [np.array([mesh.vertices[index].co[:2] for index in face.vertices]) for face in mesh.loop_triangles]
    bpy.data.objects.remove(obj)
    bpy.data.meshes.remove(mesh)
    bpy.data.curves.remove(curve)
    return found


def glasses():
    """A pair of glasses, which stands on the table at the left of the plate and shades it."""
    horn = parts.plain_material("Horn", (0.03, 0.012, 0.006), roughness=0.3)
    x, height, radius = -SIDE / 2 - 6 * MM, 17 * MM, 15 * MM
    turns = np.linspace(0, 2 * math.pi, 49)
    for side in (-1, 1):
        middle = side * 19 * MM
        ring = [(x, middle + radius * math.cos(turn), height + radius * math.sin(turn)) for turn in turns]
        parts.wire(f"Rim {side}", ring, 1.6 * MM, horn)
        hinge = middle + side * radius
        temple = [(x, hinge, height + 3 * MM), (x - 60 * MM, hinge, height + 2 * MM), (x - 75 * MM, hinge, 2 * MM)]
        parts.wire(f"Temple {side}", temple, 1.3 * MM, horn)
    bridge = [(x, 4.2 * MM * math.cos(turn), height + 4 * MM * math.sin(turn)) for turn in turns[:25]]
    parts.wire("Bridge", bridge, 1.6 * MM, horn)
