"""Scenes whose light Cycles finds, and their bakes."""

import bpy
import scenes
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.core.target import Target

TEXELS, GREY = 32, 0.5


def add_wall(color=(0.9, 0.6, 0.3)):
    """It stands on the floor, in the light, and leans a little."""
    corners = [(-0.8, 0.3, 0), (0.8, 0.3, 0), (0.8, 0.4, 0.9), (-0.8, 0.4, 0.9)]
    wall = scenes.add_mesh("Wall", corners, [(0, 1, 2, 3)])
    wall.data.materials.append(scenes.diffuse_material(color))
    return wall


def add_ball():
    """A smooth ball of a radius of 1 that floats above the floor."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16, location=(0, 0, 1.5))
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.data.materials.append(scenes.add_material())
    return ball


def add_scene(material=None):
    floor = scenes.add_plane(
        "Floor", material=material or scenes.add_material(color_mode="BASE_COLOR", base_color=(GREY,) * 3)
    )
    add_wall()
    scenes.add_sun(40, 60, 3.0)
    return floor


def jobs_of(*objects, output="IRRADIANCE"):
    targets = [Target(obj.name, obj.data.materials[0].name) for obj in objects]
    settings = bpy.context.scene.beamspread.for_bake(output=output)
    return list(prepare_scene(bpy.context, targets, settings, TEXELS))


def baked(floor, indirect, output):
    bpy.context.scene.beamspread.use_indirect = indirect
    (bake,) = jobs_of(floor, output=output)
    bake.run()
    assert not bake.error
    return bake.texture


def irradiance(floor, indirect):
    return baked(floor, indirect, "IRRADIANCE")


def blocks(values):
    """Means of 4 x 4 texels."""
    return values.reshape(TEXELS // 4, 4, TEXELS // 4, 4, 3).mean(axis=(1, 3))
