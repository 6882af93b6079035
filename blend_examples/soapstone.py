"""The scene soapstone: breakfast in a garden, on a polished table of soapstone, lit by an image of its surroundings.

No lamp: the light is Blender's own studio HDRI `sunrise` (Greg Zaal, HDRI Haven, CC0), a sun 8 degrees high in a wide
blue sky over a meadow; it is packed into the file. Light spreads some 3 mm inside this stone, wider than the rods of
the toast rack, whose shadows glow, and narrower than the cups. Lengths are metres.
"""

import math
from pathlib import Path

import bpy
import scene_parts as parts
from mathutils import Vector

MM = 0.001
WIDTH, DEPTH, THICKNESS = 0.52, 0.34, 0.02
HDRI = "sunrise.exr"
SUN_AZIMUTH_DEG = 148.0  # where the image's sun is to stand, from +x to +y
IMAGE_SUN_AZIMUTH_DEG = -36.0  # where it stands in the image as it is

# Turned shapes as in marble_floor.py: radius,height in millimetres.
CUP = "0,1 13,1 13,0 14,0 14,2 24,8 32,22 36,42 37,56 37,56 35,56 35,56 34,42 30,24 22,11 0,6"
SAUCER = "0,1.5 22,1.5 22,0 24,0 24,2 40,6 58,11 58,11 58,12.2 58,12.2 40,8 24,4.5 0,4"
BOWL = "0,1 24,1 24,0 26,0 26,2 48,14 64,34 70,52 70,52 68,52.6 68,52.6 61,35 46,17 24,6 0,4.5"
VASE = (
    "0,0 0,0 30,0 30,0 33,4 40,28 42,52 36,80 22,104 14,122 13,140 18,152 18,152 16.6,152 16.6,152 11.8,140 11.8,120 "
    "0,100"
)
ORANGE = "0,0 12,1.4 24,8 31,20 32.5,32 31,43 24,55 12,62 0,63.4"


def build():
    scene = parts.empty_scene("Soapstone", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.view_settings.exposure = 0.1
    scene.beamspread.resolution = 512
    stone, _ = parts.medium_material(
        "Soapstone",
        color_mode="BASE_COLOR",
        base_color=(0.30, 0.38, 0.34),
        mean_free_path=(0.5 * MM, 0.45 * MM, 0.4 * MM),
        anisotropy=0.8,
        ior=1.5,
    )
    parts.plane("Table top", WIDTH, DEPTH, stone)
    edge = parts.plain_material("Edge", (0.16, 0.20, 0.18), roughness=0.5)
    parts.box("Slab", (-WIDTH / 2, -DEPTH / 2, -THICKNESS), (WIDTH / 2, DEPTH / 2, -0.1 * MM), edge)
    breakfast()
    surroundings(scene.world)
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((0.03, -0.56, 0.40), (-0.005, -0.012, 0.012), lens=48)


def surroundings(world):
    tree = world.node_tree
    new, link = tree.nodes.new, tree.links.new
    place, turn, image = new("ShaderNodeTexCoord"), new("ShaderNodeMapping"), new("ShaderNodeTexEnvironment")
    folder = Path(bpy.utils.system_resource("DATAFILES", path="studiolights/world"))
    image.image = bpy.data.images.load(str(folder / HDRI))
    image.image.pack()
    image.image.filepath_raw = image.image.packed_files[0].filepath = f"//{HDRI}"
    turn.inputs["Rotation"].default_value[2] = math.radians(IMAGE_SUN_AZIMUTH_DEG - SUN_AZIMUTH_DEG)
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = 1.0
    link(place.outputs["Generated"], turn.inputs["Vector"])
    link(turn.outputs["Vector"], image.inputs["Vector"])
    link(image.outputs["Color"], background.inputs["Color"])
    for column, node in enumerate((place, turn, image, background)):
        node.location = (280 * column - 900, 0)


def breakfast():
    china = parts.plain_material("China", (0.80, 0.79, 0.76), roughness=0.12)
    glaze = parts.plain_material("Blue glaze", (0.05, 0.13, 0.30), roughness=0.15)
    peel = parts.plain_material("Orange peel", (0.80, 0.26, 0.02), roughness=0.45)
    steel = parts.plain_material("Steel", (0.62, 0.61, 0.58), roughness=0.2, metallic=1.0)
    for name, profile, material, x, y, z in (
        ("Saucer", SAUCER, china, -0.165, -0.085, 0),
        ("Cup", CUP, china, -0.165, -0.085, 4),
        ("Bowl", BOWL, glaze, 0.165, -0.075, 0),
        ("Orange", ORANGE, peel, 0.115, 0.055, 0),
        ("Vase", VASE, china, 0.185, 0.115, 0),
    ):
        parts.lathe(name, parts.rounded(profile), material, (x, y, z * MM), MM)
    toast_rack(steel, center=Vector((-0.14, 0.075, 0)))


def toast_rack(steel, center):
    """Arches of wire in a row, on two rails."""
    radius, half, height, step = 1.5 * MM, 34 * MM, 55 * MM, 17 * MM
    along = Vector((math.cos(math.radians(50)), math.sin(math.radians(50)), 0))
    across = Vector((-along.y, along.x, 0))
    up = Vector((0, 0, 1))
    for index in range(5):
        foot = center + (index - 2) * step * along
        arch = [
            foot + half * math.cos(a) * across + (height * math.sin(a) + 6 * MM) * up for a in steps(0, math.pi, 18)
        ]
        parts.wire(f"Arch {index + 1}", arch, radius, steel)
    for side in (-1, 1):
        rail = [center + side * half * across + x * along + 6 * MM * up for x in (-2.6 * step, 2.6 * step)]
        parts.wire(f"Rail {side}", rail, radius, steel)
        for end in (-1, 1):
            low = center + side * half * across + end * 2.4 * step * along
            parts.wire(f"Foot {side} {end}", [low, low + 6 * MM * up], 1.6 * radius, steel)


def steps(first, last, count):
    return [first + (last - first) * step / count for step in range(count + 1)]
