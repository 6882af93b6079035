"""The scene low_sun: evening sun through a small window onto a slab of amber, let into a table. Lengths are metres.

In this medium light goes on for 9 to 13 mm (transport mean free path of green and red) before it forgets its direction,
a good part of the panes' 22 mm: it runs on into the shadow behind each pane, before the pane the shadow stays dark. Its
ior is 1, so that the closures of renderers, which treat a step in refraction differently, can be compared.
"""

import math

import scene_parts as parts

MM = 0.001
WIDTH, DEPTH = 190 * MM, 116 * MM
ANGLE_DEG = 70.0
ROWS, COLUMNS = 3, 3
# Sizes of the light on the slab: from pane to pane along it and across, and the bars in between.
ALONG, BAR_ALONG = 56 * MM, 34 * MM
ACROSS, BAR_ACROSS = 36 * MM, 11 * MM


def build():
    scene = parts.empty_scene("Low sun", 540, 320, samples=256, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 760
    amber, _ = parts.medium_material(
        "Amber", color_mode="ALBEDO", albedo=(0.97, 0.9, 0.6), mean_free_path=(1.6 * MM,) * 3, anisotropy=0.9, ior=1.0
    )
    parts.plane("Slab", WIDTH, DEPTH, amber)
    wood = parts.plain_material("Table", (0.018, 0.011, 0.008), roughness=0.5, specular=0.1)
    parts.table_around(WIDTH, DEPTH, wood)
    window()
    parts.sun("Low sun", parts.direction(ANGLE_DEG, 0), 28.0, (1.0, 0.86, 0.68))
    parts.sun("Light of the room", parts.direction(25, 110), 0.06, (0.6, 0.75, 1.0), shadow=False)
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 3, 1, 2
    parts.camera((0.0, -0.21, 0.30), (-0.007, -0.003, 0.0), lens=58)


def window():
    """Stands at the slab's left end; its bars are as high as their shadows are long, over the angle's tangent."""
    wood = parts.plain_material("Window", (0.06, 0.038, 0.023), roughness=0.6)
    slope, x, y = math.tan(math.radians(ANGLE_DEG)), -WIDTH / 2 - 4 * MM, COLUMNS * ACROSS / 2
    height = (ROWS * ALONG + BAR_ALONG) / slope
    for row in range(ROWS + 1):
        low = row * ALONG / slope
        parts.box(f"Bar {row + 1}", (x - MM, -y, low), (x, y, low + BAR_ALONG / slope), wood)
    for side in (-1, 1):
        parts.box(f"Wall {side}", (x - MM, min(side * y, side), 0), (x, max(side * y, side), 2.0), wood)
    parts.box("Wall above", (x - MM, -y, height), (x, y, 2.0), wood)
    for column in range(COLUMNS + 1):
        middle = column * ACROSS - y
        low, high = middle - BAR_ACROSS / 2, middle + BAR_ACROSS / 2
        parts.box(f"Post {column + 1}", (x - 2 * MM, low, 0), (x + MM, high, height), wood)
