"""The scene paper_shade: a lamp with a shade of paper, a bulb inside, on a table before a wall. Lengths are metres.

The shade is one sheet without a thickness of its own; the node has it. The bulb lights its inside, which is its front,
since a Screw modifier turns normals inward: the light comes through, and returns from the inside again and again. Both
faces have an image. The paper does not refract, so that paths can be traced through it (compare.sh does that, through a
shade of the same thickness).
"""

import scene_parts as parts

MM = 0.001
# Turned shapes as in marble_floor.py: radius,height in millimetres.
SHADE = "96,0 95,15 92,40 84,75 72,105 60,122"
STAND = "0,0 0,0 55,0 55,0 55,4 52,7 12,11 6,20 5,60 6,120 5,120 0,120"
SHADE_HEIGHT, BULB_HEIGHT = 105 * MM, 145 * MM


def build():
    scene = parts.empty_scene("Paper shade", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    paper, _ = parts.medium_material(
        "Paper",
        color_mode="ALBEDO",
        albedo=(0.999, 0.996, 0.98),
        mean_free_path=(0.06 * MM, 0.06 * MM, 0.06 * MM),
        anisotropy=0.0,
        ior=1.0,
        thickness=0.5 * MM,
        side="BOTH",
    )
    parts.lathe("Shade", parts.rounded(SHADE, 8), paper, (0, 0, SHADE_HEIGHT), MM)
    brass = parts.plain_material("Stand", (0.10, 0.075, 0.05), roughness=0.4)
    parts.lathe("Stand", parts.rounded(STAND), brass, (0, 0, 0), MM)
    wood = parts.plain_material("Table", (0.14, 0.085, 0.05), roughness=0.5)
    parts.box("Table", (-0.8, -0.5, -0.02), (0.8, 0.30, 0.0), wood)
    plaster = parts.plain_material("Wall", (0.30, 0.33, 0.36), roughness=0.9, specular=0.1)
    parts.box("Wall", (-0.8, 0.30, -0.02), (0.8, 0.34, 0.9), plaster)
    bulb = parts.point_lamp("Bulb", (0, 0, BULB_HEIGHT), 2.2, (1.0, 0.75, 0.45))
    bulb.data.shadow_soft_size = 15 * MM
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.45, 0.6, 1.0, 1.0), 0.05
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 12, 8, 3
    parts.camera((-0.16, -0.62, 0.30), (0.0, 0.0, 0.135), lens=50)
