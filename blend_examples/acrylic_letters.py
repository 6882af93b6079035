"""The scene acrylic_letters: a sign of acrylic letters on a wall, lit from the side. Lengths are metres.

The letters are Blender's text converted to a mesh: fronts of acrylic, with holes, and sides of painted metal. Every
second letter stands farther off the wall and shades its neighbour. The first bake makes a UV map for the fronts. Light
spreads some 8 mm inside the acrylic.
"""

import math

import bmesh
import bpy
import scene_parts as parts
from mathutils import Matrix, Vector

MM, CM = 0.001, 0.01
SIGN, SIZE, BOLD, THICKNESS = "BAOBAB", 0.30, 10 * MM, 24 * MM
STEP = 0.20  # from letter to letter
NEAR, FAR = 20 * MM, 64 * MM  # from the wall to the backs


def build():
    scene = parts.empty_scene("Acrylic letters", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 768
    acrylic, _ = parts.medium_material(
        "Acrylic",
        color_mode="BASE_COLOR",
        base_color=(0.80, 0.80, 0.76),
        mean_free_path=(0.8 * MM, 0.8 * MM, 0.8 * MM),
        anisotropy=0.8,
        ior=1.5,
    )
    metal = parts.plain_material("Red enamel", (0.50, 0.05, 0.03), roughness=0.35)
    letters(acrylic, metal)
    wall()
    along = Vector((0.78, 0.38, -0.50)).normalized()
    parts.spot_lamp("Lamp", (0, -5 * CM, 0), along, 1.9, 66, 340.0, (1.0, 0.74, 0.46), 0.4, 1 * CM)
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.30, 0.45, 1.0, 1.0), 0.35
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 3
    parts.camera((-0.30, -1.32, 0.10), (0.01, 0.0, -0.03), lens=36)


def letters(acrylic, metal):
    """One mesh of all letters: texts, converted, set upright and joined."""
    whole = bmesh.new()
    for number, letter in enumerate(SIGN):
        curve = bpy.data.curves.new(letter, "FONT")
        curve.body, curve.size, curve.offset, curve.extrude = letter, SIZE, BOLD, THICKNESS / 2
        curve.align_x = curve.align_y = "CENTER"
        text = parts.link(letter, curve)
        mesh = bpy.data.meshes.new_from_object(text.evaluated_get(bpy.context.evaluated_depsgraph_get()))
        for face in mesh.polygons:
            face.material_index = 0 if face.normal.z > 0.9 else 1
        x, depth = (number - (len(SIGN) - 1) / 2) * STEP, (NEAR, FAR)[number % 2] + THICKNESS / 2
        mesh.transform(Matrix.Translation((x, -depth, 0)) @ Matrix.Rotation(math.radians(90), 4, "X"))
        whole.from_mesh(mesh)
        bpy.data.objects.remove(text)
        bpy.data.meshes.remove(mesh)
    mesh = bpy.data.meshes.new("Letters")
    whole.to_mesh(mesh)
    whole.free()
    mesh.materials.append(acrylic)
    mesh.materials.append(metal)
    parts.link("Letters", mesh)


def wall():
    plaster = parts.plain_material("Plaster", (0.16, 0.30, 0.34), roughness=0.9, specular=0.1)
    parts.box("Wall", (-2, 0, -1.2), (2, 0.1, 1.2), plaster)
