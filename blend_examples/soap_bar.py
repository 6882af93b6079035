"""The scene soap_bar: a bar of soap on a wire rack, close to a lamp. Lengths are metres.

The bar is a box with a bevel modifier and without a UV map: its first bake makes one. Light spreads some 4 mm inside,
and crosses the edges; the sprig's shadow on the bar glows.
"""

import math

import scene_parts as parts
from mathutils import Vector

MM = 0.001
LENGTH, WIDTH, HEIGHT = 84 * MM, 56 * MM, 26 * MM
RACK = 9 * MM  # height of the bar's lower face
LAMP = (-80 * MM, -50 * MM, 78 * MM)
BUD = "0,0 1.9,1.4 2.5,3.6 1.8,6 0,7.6"


def build():
    scene = parts.empty_scene("Soap bar", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    soap, node = parts.medium_material(
        "Soap",
        color_mode="BASE_COLOR",
        base_color=(0.76, 0.52, 0.26),
        mean_free_path=(1.1 * MM, 1.0 * MM, 0.9 * MM),
        anisotropy=0.0,
        ior=1.5,
    )
    node.inputs["Roughness"].default_value = 0.35
    half = Vector((LENGTH, WIDTH, HEIGHT)) / 2
    bar = parts.box("Soap bar", -half, half, soap)
    bar.location, bar.rotation_euler = (0, 0, RACK + HEIGHT / 2), (0, 0, math.radians(-14))
    bevel = bar.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 1.2 * MM, 3
    bathroom()
    lavender()
    parts.point_lamp("Lamp", LAMP, 1.0, (1.0, 0.66, 0.36)).data.shadow_soft_size = 1.5 * MM
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.42, 0.60, 1.0, 1.0), 0.25
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((0.085, -0.20, 0.145), (-0.010, -0.002, 0.022), lens=50)


def bathroom():
    stone = parts.plain_material("Slate", (0.10, 0.105, 0.11), roughness=0.45)
    steel = parts.plain_material("Steel", (0.62, 0.61, 0.58), roughness=0.2, metallic=1.0)
    parts.box("Shelf", (-0.6, -0.35, -0.03), (0.6, 0.35, 0.0), stone)
    radius = 1.4 * MM
    for index in range(7):
        x = (index - 3) * 13 * MM
        path = [(x, -32 * MM, RACK - radius), (x, 32 * MM, RACK - radius)]
        parts.wire(f"Wire {index + 1}", path, radius, steel)
    for side in (-1, 1):
        y = side * 26 * MM
        ends = [(-44 * MM, y, 0), (-44 * MM, y, RACK - 3 * radius), (44 * MM, y, RACK - 3 * radius), (44 * MM, y, 0)]
        parts.wire(f"Rail {side}", ends, radius, steel)


def lavender():
    """A sprig that lies across the bar."""
    green = parts.plain_material("Stalk", (0.10, 0.16, 0.06), roughness=0.6)
    violet = parts.plain_material("Lavender", (0.20, 0.12, 0.42), roughness=0.7)
    top = RACK + HEIGHT
    start, end = Vector((0.056, -0.034, top - 1 * MM)), Vector((-0.024, 0.000, top + 8 * MM))
    parts.wire("Stalk", [start.lerp(end, index / 4) for index in range(5)], 1.1 * MM, green)
    along = (end - start).normalized()
    across = along.cross(Vector((0, 0, 1))).normalized()
    up = across.cross(along)
    for index in range(18):
        ring, turn = index // 3, index % 3 * math.tau / 3 + index // 3
        out = math.cos(turn) * across + math.sin(turn) * up
        bud = parts.lathe(f"Bud {index + 1}", parts.rounded(BUD, 3), violet, start.lerp(end, 0.70 + 0.055 * ring), MM)
        bud.rotation_euler = (0.8 * out + along).to_track_quat("Z", "Y").to_euler()
