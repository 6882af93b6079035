"""The scene stage: coloured spots through haze onto a floor of milky acrylic. Lengths are metres.

Every light has a size, so shadows are soft far from their occluders. The haze is cards, as stages and games have it:
flat pictures of clouds whose alpha lets part of the light through, in patches, and one of slats, a gobo, that lets it
through in stripes. Light spreads some 7 cm inside the floor, as wide as the gaps between the stripes. The ior is 1, so
that Cycles can trace paths through the floor, too (with_volume.py).
"""

import math

import scene_parts as parts
from mathutils import Vector

CM = 0.01
WIDTH, DEPTH = 5.2, 3.2
# Name, place of the lamp, where its beam meets the floor, colour, full cone in degrees.
SPOTS = (
    ("Amber", (-2.9, 1.2, 2.6), (-1.25, -0.45, 0), (1.0, 0.42, 0.08), 25),
    ("Magenta", (-1.3, 1.5, 3.0), (-0.15, 0.35, 0), (1.0, 0.06, 0.45), 24),
    ("Cyan", (1.6, 1.5, 3.0), (0.55, -0.55, 0), (0.06, 0.55, 1.0), 24),
    ("White", (3.1, 1.0, 2.4), (1.55, 0.25, 0), (1.0, 0.90, 0.76), 25),
)
WATTS, RADIUS, BLEND = 650.0, 6 * CM, 0.25


def build():
    scene = parts.empty_scene("Stage", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    acrylic, _ = parts.medium_material(
        "Milky acrylic",
        color_mode="ALBEDO",
        albedo=(0.985, 0.98, 0.975),
        mean_free_path=(0.8 * CM,) * 3,
        anisotropy=0.8,
        ior=1.0,
    )
    parts.plane("Stage floor", WIDTH, DEPTH, acrylic)
    for name, place, target, color, cone_deg in SPOTS:
        along = Vector(target) - Vector(place)
        parts.spot_lamp(name, target, along.normalized(), along.length, cone_deg, WATTS, color, BLEND, RADIUS)
    parts.area_lamp("House light", (0, -2.5, 4.5), (0, 0, 0), (4.0, 1.0), 30.0, (0.45, 0.55, 1.0))
    cards()
    furniture()
    scene.cycles.transparent_max_bounces = 16
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 2
    parts.camera((0.0, -5.4, 2.5), (0.0, -0.05, 0.45), lens=40)


def cards():
    """Each stands across a beam, facing its lamp."""
    haze = parts.card_material("Haze", (0.75, 0.75, 0.78), parts.clouds(256, thin=0.05, thick=0.9))
    gobo = parts.card_material("Slats", (0.02, 0.02, 0.02), parts.slats(512, count=7))
    for (name, place, target, _, _), part, side, material in (
        (SPOTS[0], 0.62, 1.0, haze),
        (SPOTS[1], 0.45, 0.62, gobo),
        (SPOTS[3], 0.70, 1.1, haze),
    ):
        lamp, floor = Vector(place), Vector(target)
        card = parts.upright_card(f"Card of {name}", side, side, material)
        card.location = lamp + part * (floor - lamp)
        parts.aim(card, lamp - card.location)


def furniture():
    """Targets of the beams: a microphone, a stool, a wall at the back."""
    black = parts.plain_material("Black steel", (0.03, 0.03, 0.032), roughness=0.35, metallic=1.0)
    wood = parts.plain_material("Stool", (0.35, 0.20, 0.10), roughness=0.4)
    cloth = parts.plain_material("Curtain", (0.10, 0.012, 0.016), roughness=0.9, specular=0.1)
    parts.wire("Stand", [(0.62, -0.3, 0.02), (0.62, -0.3, 1.35)], 1.2 * CM, black)
    parts.lathe("Foot", [(0, 0), (14, 0), (14, 1), (13, 2), (2, 3), (0, 3)], black, (0.62, -0.3, 0), CM)
    parts.wire("Microphone", [(0.62, -0.3, 1.35), (0.60, -0.42, 1.40)], 2.4 * CM, black)
    for index in range(3):
        azimuth = math.radians(40 + 120 * index)
        foot = Vector((-1.25 + 0.24 * math.cos(azimuth), -0.35 + 0.24 * math.sin(azimuth), 0.02))
        head = Vector((-1.25 + 0.10 * math.cos(azimuth), -0.35 + 0.10 * math.sin(azimuth), 0.62))
        parts.wire(f"Leg {index + 1}", [foot, head], 1.8 * CM, wood)
    parts.lathe("Seat", [(0, 62), (19, 62), (19, 62), (20, 64), (19, 66), (0, 66)], wood, (-1.25, -0.35, 0), CM)
    folds, y = 56, DEPTH / 2 + 0.25
    outline = [(x, y + 0.05 * math.cos(math.pi * index)) for index, x in enumerate(even(-3.4, 3.4, folds))]
    corners = [(x, y, z) for z in (0.0, 3.2) for x, y in outline]
    count = len(outline)
    faces = [(i, i + 1, i + 1 + count, i + count) for i in range(count - 1)]
    parts.mesh_object("Curtain", corners, faces, cloth)


def even(first, last, count):
    return [first + (last - first) * step / count for step in range(count + 1)]
