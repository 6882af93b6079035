"""The scene marble_head: a small head of translucent marble between a low sun and the sky. Lengths are metres.

Blender's own monkey, 5 cm tall, smooth by a subdivision. Its ears are some transport mean free paths thick: they glow
where the sun is behind them, and their inner folds stay brighter than those of a diffuse surface. The stone does not
refract, so that paths can be traced through it (compare.sh does that).
"""

import math

import bpy
import scene_parts as parts

MM = 0.001


def build():
    scene = parts.empty_scene("Marble head", 540, 400, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 512
    marble, _ = parts.medium_material(
        "Marble",
        color_mode="ALBEDO",
        albedo=(0.995, 0.992, 0.985),
        mean_free_path=(0.55 * MM, 0.5 * MM, 0.45 * MM),
        anisotropy=0.0,
        ior=1.0,
    )
    bpy.ops.mesh.primitive_monkey_add(size=0.05)
    head = bpy.context.object
    head.name = "Head"
    bpy.ops.object.shade_smooth()
    head.data.materials.append(marble)
    smooth = head.modifiers.new("Subdivision", "SUBSURF")
    smooth.levels = smooth.render_levels = 2
    head.location, head.rotation_euler = (0, 0, 0.0255), (math.radians(-14), 0, math.radians(24))
    stone = parts.plain_material("Plinth", (0.16, 0.15, 0.145), roughness=0.6)
    parts.box("Plinth", (-0.3, -0.2, -0.02), (0.3, 0.3, 0.0), stone)
    parts.sun("Low sun", parts.direction(72, -128), 7.0, (1.0, 0.80, 0.55))
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.45, 0.62, 1.0, 1.0), 0.22
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((0.02, -0.16, 0.06), (0.0, 0.0, 0.0245), lens=70)
