"""The scene round_soap: a worn bar of soap with round edges, lit from one side. Lengths are metres.

The edges are as round as the light in the soap spreads, so light goes round them: the faces that look away from the
lamp are bright along their edges and dark in their middle. The soap does not refract, so that paths can be traced
through it (compare.sh does that).
"""

import math

import bpy
import scene_parts as parts
from mathutils import Vector

MM = 0.001
LENGTH, WIDTH, HEIGHT = 74 * MM, 48 * MM, 24 * MM


def build():
    scene = parts.empty_scene("Round soap", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    soap, _ = parts.medium_material(
        "Soap",
        color_mode="ALBEDO",
        albedo=(0.995, 0.985, 0.94),
        mean_free_path=(1.2 * MM, 1.1 * MM, 1.0 * MM),
        anisotropy=0.0,
        ior=1.0,
    )
    half = Vector((LENGTH, WIDTH, HEIGHT)) / 2
    bar = parts.box("Round soap", -half, half, soap)
    bar.location, bar.rotation_euler = (0, 0, HEIGHT / 2), (0, 0, math.radians(-20))
    bevel = bar.modifiers.new("Round edges", "BEVEL")
    bevel.width, bevel.segments = 8 * MM, 8
    bpy.context.view_layer.objects.active = bar
    bpy.ops.object.modifier_apply(modifier=bevel.name)  # later Blenders round corners otherwise
    for face in bar.data.polygons:
        face.use_smooth = True
    bar.data.use_auto_smooth, bar.data.auto_smooth_angle = True, math.radians(40)
    tile = parts.plain_material("Tile", (0.10, 0.13, 0.15), roughness=0.3)
    parts.box("Tile", (-0.4, -0.3, -0.02), (0.4, 0.3, 0.0), tile)
    parts.area_lamp("Lamp", (-0.26, 0.16, 0.11), (0, 0, 0.01), (0.03, 0.03), 1.6, (1.0, 0.86, 0.66))
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.42, 0.60, 1.0, 1.0), 0.06
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((0.06, -0.20, 0.115), (0.0, 0.0, 0.009), lens=62)
