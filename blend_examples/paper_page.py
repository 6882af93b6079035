"""The scene paper_page: a curled sheet of paper before a lamp, with grass between. Lengths are metres.

The lamp lights the back of the sheet. Its light comes through, and grass near to the paper throws sharper shadows than
grass farther away. A weak sky lights the front. The paper does not refract, so that paths can be traced through it
(compare.sh does that, through a sheet of the same thickness).
"""

import math
import random

import scene_parts as parts

MM = 0.001
WIDTH, HEIGHT, THICKNESS = 148 * MM, 210 * MM, 0.4 * MM
COLUMNS, ROWS = 48, 24
BLADES = 9


def build():
    scene = parts.empty_scene("Paper page", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    paper, _ = parts.medium_material(
        "Paper",
        color_mode="ALBEDO",
        albedo=(0.999, 0.998, 0.99),
        mean_free_path=(0.05 * MM, 0.05 * MM, 0.05 * MM),
        anisotropy=0.0,
        ior=1.0,
        thickness=THICKNESS,
    )
    page(paper)
    wood = parts.plain_material("Table", (0.12, 0.08, 0.055), roughness=0.6)
    parts.box("Table", (-0.6, -0.5, -0.02), (0.6, 0.6, -0.2 * MM), wood)
    grass()
    parts.point_lamp("Lamp", (0.03, 0.20, 0.12), 2.6, (1.0, 0.72, 0.42)).data.shadow_soft_size = 8 * MM
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.45, 0.62, 1.0, 1.0), 0.12
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((-0.12, -0.52, 0.21), (0.0, 0.0, 0.10), lens=52)


def page(paper):
    """A sheet that stands on the table in an S, its front toward -y; u runs along it and v up."""
    corners = []
    for row in range(ROWS + 1):
        for column in range(COLUMNS + 1):
            along = column / COLUMNS - 0.5
            bend = 26 * MM * math.sin(2 * math.pi * along) * (1 - 0.3 * row / ROWS)
            corners.append((along * WIDTH * 0.9, bend, row / ROWS * HEIGHT))
    step, faces = COLUMNS + 1, []
    for row in range(ROWS):
        for column in range(COLUMNS):
            first = row * step + column
            faces.append((first, first + 1, first + step + 1, first + step))
    sheet = parts.mesh_object("Page", corners, faces, paper)
    layer = sheet.data.uv_layers.new(name="UVMap")
    for loop, corner in zip(layer.data, (loop.vertex_index for loop in sheet.data.loops)):
        loop.uv = (corner % step) / COLUMNS * WIDTH / HEIGHT, corner // step / ROWS
    for face in sheet.data.polygons:
        face.use_smooth = True
    return sheet


def grass():
    """Blades that rise from the table behind the page, the nearest 20 mm and the farthest 70 mm away."""
    green, chance = parts.plain_material("Grass", (0.10, 0.20, 0.04), roughness=0.5), random.Random(4)
    for number in range(BLADES):
        x, y = (number / (BLADES - 1) - 0.5) * 0.13, chance.uniform(50, 95) * MM
        lean, tall = chance.uniform(-0.05, 0.05), chance.uniform(0.10, 0.19)
        points = [(x + lean * t**2, y + 0.01 * math.sin(3 * t + number), tall * t) for t in (n / 10 for n in range(11))]
        parts.wire(f"Blade {number + 1}", points, 1.3 * MM, green)
