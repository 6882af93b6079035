"""The scene jade_bowl: a bowl of jade with a candle in it, on a table. Lengths are metres.

The wall of the bowl is three transport mean free paths thick: the light of the flame comes through it, most of all low
down, where it falls on the wall at right angles. The jade does not refract, so that paths can be traced through it
(compare.sh does that). The bowl has no UV map: its first bake makes one.
"""

import scene_parts as parts

MM = 0.001
# Turned shapes as in marble_floor.py: radius,height in millimetres.
BOWL = "0,1.5 15,1.5 15,0 17,0 20,0 22,2 38,12 50,28 56,44 58,52 57,55 54,56 51,55 49,52 47,44 41,30 30,19 18,12 0,9.5"
CANDLE = "0,0 0,0 11,0 11,0 11,16 9.5,17.5 0,17"
FLAME = "0,0 1.6,1.2 2.2,3.4 1.5,6.8 0,11"
FLAME_HEIGHT = 32 * MM


def build():
    scene = parts.empty_scene("Jade bowl", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    jade, _ = parts.medium_material(
        "Jade",
        color_mode="ALBEDO",
        albedo=(0.90, 0.985, 0.93),
        mean_free_path=(2.4 * MM, 2.4 * MM, 2.4 * MM),
        anisotropy=0.0,
        ior=1.0,
    )
    bowl = parts.lathe("Jade bowl", parts.rounded(BOWL, 8), jade, (0, 0, 0), MM)
    bowl.modifiers["Lathe"].use_normal_flip = True
    wood = parts.plain_material("Table", (0.055, 0.035, 0.025), roughness=0.35)
    parts.box("Table", (-0.5, -0.3, -0.02), (0.5, 0.4, -0.05 * MM), wood)
    wax = parts.plain_material("Candle", (0.75, 0.70, 0.58), roughness=0.5)
    parts.lathe("Candle", parts.rounded(CANDLE), wax, (0, 0, 10 * MM), MM)
    flame = parts.glowing_material("Flame", (1.0, 0.6, 0.2), (1.0, 0.55, 0.16), 60.0)
    parts.lathe("Flame", parts.rounded(FLAME), flame, (0, 0, FLAME_HEIGHT - 4 * MM), MM).visible_shadow = False
    parts.point_lamp("Candlelight", (0, 0, FLAME_HEIGHT + 2 * MM), 0.22, (1.0, 0.62, 0.28)).data.shadow_soft_size = (
        2 * MM
    )
    parts.area_lamp("Window", (-0.5, -0.25, 0.45), (0, 0, 0.03), (0.3, 0.3), 1.1, (0.62, 0.78, 1.0))
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((0.07, -0.25, 0.155), (0.0, 0.0, 0.024), lens=58)
