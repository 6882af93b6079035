"""The scene shop_window: a perfumer's window at night, bottles on a shelf of alabaster. Lengths are metres.

Two area lamps, a long one over the window and a round one from the side, and a sign of glowing tubes, whose colour runs
over the stone beside it. The back wall is pale: a good part of the light comes to the shelf by way of it. Light spreads
some 1 cm inside the alabaster.
"""

import math

import scene_parts as parts

MM, CM = 0.001, 0.01
WIDTH, DEPTH, HEIGHT = 1.20, 0.56, 0.80
SIGN, LETTER, STEP, TUBE = "PARFUM", 0.13, 0.135, 2.5 * MM
STROKES = {  # across and up
    "P": "0,0 0,1 .4,1 .6,.87 .6,.63 .4,.5 0,.5",
    "A": "0,0 .3,1 .6,0 / .12,.36 .48,.36",
    "R": "0,0 0,1 .4,1 .6,.87 .6,.63 .4,.5 0,.5 / .3,.5 .6,0",
    "F": "0,0 0,1 .55,1 / 0,.5 .45,.5",
    "U": "0,1 0,.25 .1,.06 .3,0 .5,.06 .6,.25 .6,1",
    "M": "0,0 .05,1 .32,.35 .6,1 .65,0",
}

FLACON = "0,0 0,0 30,0 30,0 33,3 33,3 33,62 33,62 30,68 12,74 12,74 12,84 12,84 17,85 17,85 17,110 17,110 15,112 0,112"
ROUND = "0,0 0,0 18,0 18,0 30,8 40,26 40,44 32,62 14,74 10,80 10,90 10,90 14,91 14,91 19,104 14,118 0,122"
TALL = "0,0 0,0 17,0 17,0 18.5,2 18.5,2 16,120 16,120 8,128 7,136 7,136 10,137 10,137 10,168 10,168 9,170 0,170"
JAR = "0,0 0,0 36,0 36,0 38,3 38,3 38,34 38,34 36,36 36,36 39,37 39,37 39,56 39,56 37,58 0,58"
BOWL = "0,3 20,3 20,0 24,0 24,3 46,16 58,36 60,46 60,46 57,46 57,46 44,20 22,8 0,7"


def build():
    scene = parts.empty_scene("Shop window", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    alabaster, _ = parts.medium_material(
        "Alabaster",
        color_mode="BASE_COLOR",
        base_color=(0.78, 0.74, 0.66),
        mean_free_path=(1.4 * MM, 1.3 * MM, 1.1 * MM),
        anisotropy=0.8,
        ior=1.5,
    )
    parts.plane("Shelf", WIDTH, DEPTH, alabaster)
    window()
    goods()
    sign()
    parts.area_lamp("Strip", (0.1, 0.02, HEIGHT - 2 * CM), (0.1, 0.06, 0), (0.9, 0.04), 1.3, (1.0, 0.80, 0.58))
    side = parts.area_lamp(
        "Soft box", (-0.56, -0.22, 0.30), (0.05, 0.0, 0.02), (0.16, 0.16), 2.2, (0.55, 0.72, 1.0), "DISK"
    )
    side.data.spread = math.radians(110)
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 5, 3, 3
    parts.camera((0.16, -1.25, 0.56), (0.0, 0.0, 0.17), lens=46)


def window():
    plaster = parts.plain_material("Plaster", (0.62, 0.58, 0.54), roughness=0.9, specular=0.1)
    wood = parts.plain_material("Dark wood", (0.045, 0.028, 0.020), roughness=0.4)
    x, y, far = WIDTH / 2, DEPTH / 2, 0.9
    parts.box("Back wall", (-x, y, 0), (x, y + 2 * CM, HEIGHT), plaster)
    parts.box("Ceiling", (-x, -y, HEIGHT), (x, y + 2 * CM, HEIGHT + 2 * CM), plaster)
    parts.box("Left", (-far, -y - CM, -0.5), (-x, y, far), wood)
    parts.box("Right", (x, -y - CM, -0.5), (far, y, far), wood)
    parts.box("Lintel", (-x, -y - CM, HEIGHT - 7 * CM), (x, -y + CM, far), wood)
    parts.box("Sill", (-x, -y - 2 * CM, -0.5), (x, -y, 0), wood)


def goods():
    glass = parts.plain_material("Amber glass", (0.30, 0.10, 0.015), roughness=0.08)
    milk = parts.plain_material("Milk glass", (0.80, 0.80, 0.78), roughness=0.15)
    jade = parts.plain_material("Green glass", (0.03, 0.16, 0.09), roughness=0.08)
    gold = parts.plain_material("Gold", (0.85, 0.58, 0.25), roughness=0.2, metallic=1.0)
    for name, profile, material, x, y in (
        ("Flacon", FLACON, glass, -0.30, -0.02),
        ("Round flacon", ROUND, milk, -0.14, 0.09),
        ("Tall flacon", TALL, jade, 0.02, -0.04),
        ("Jar", JAR, milk, -0.18, -0.13),
        ("Bowl", BOWL, gold, 0.20, -0.10),
        ("Second flacon", FLACON, jade, 0.40, -0.02),
        ("Second tall one", TALL, glass, 0.31, 0.10),
    ):
        parts.lathe(name, parts.rounded(profile), material, (x, y, 0), MM)


def sign():
    """Letters bent from glowing tube, before the back wall."""
    glow = parts.glowing_material("Neon", (0.02, 0.02, 0.02), (1.0, 0.06, 0.16), 60.0)
    glow.cycles.sample_as_light = True
    middle = 0.5 * (len(SIGN) - 1 + 0.6)
    for place, letter in enumerate(SIGN):
        for number, stroke in enumerate(STROKES[letter].split(" / ")):
            points = [tuple(float(value) for value in point.split(",")) for point in stroke.split()]
            path = [((place + x - middle) * STEP, DEPTH / 2 - 2.5 * CM, 0.22 + y * LETTER) for x, y in points]
            parts.wire(f"Sign {place + 1} {letter} {number + 1}", path, TUBE, glow, sides=4)
