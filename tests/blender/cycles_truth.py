"""The irradiance of a white diffuse plane, by Cycles and by the add-on."""

import math

import bpy
import numpy as np
import scenes
from beamspread.blender.read.geometry import read_polygons
from beamspread.blender.read.lights import read_illumination
from beamspread.core.native import native
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from mathutils import Euler, Matrix

TEXELS = 64
# Cycles samples each texel at random places; with this many their mean is that of the texel to 0.1 %.
CYCLES_SAMPLES = 256
# From each texel of ours, where something casts shadows.
RAYS = 256

TILTED = Matrix.Translation((0.3, -0.2, 0.5)) @ Euler((0.5, -0.4, 0.8)).to_matrix().to_4x4()
PLANES = {
    "plain": Matrix(),
    "tilted": TILTED,
    "stretched": TILTED @ Matrix.Diagonal((1.6, 0.6, 1, 1)),
    "mirrored": TILTED @ Matrix.Diagonal((-1.3, 0.9, 1, 1)),
    "upside_down": TILTED @ Matrix.Diagonal((1, 1, -1, 1)),
    "inverted": TILTED @ Matrix.Diagonal((-0.7, -1, -1, 1)),
    "flat": TILTED @ Matrix.Diagonal((1, 1.2, 0.001, 1)),
    "far_and_small": Matrix.Translation((40, -30, 20)) @ TILTED @ Matrix.Diagonal((0.1, 0.1, 0.1, 1)),
}


def target_material(color, texels):
    """Diffuse, with an image that Cycles bakes into."""
    material = scenes.diffuse_material(color, "Target")
    image = bpy.data.images.new("Target", texels, texels, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    material.node_tree.nodes.active = texture
    return material, image


def add_receiver(world, uvs=scenes.SQUARE_UVS, texels=TEXELS):
    material, image = target_material((1, 1, 1), texels)
    return scenes.add_plane("Receiver", (2, 2), world, uvs, material), image


def frame_of(plane):
    """The plane's frame without scale, z along the normal of its lit side."""
    bpy.context.view_layer.update()
    world = plane.matrix_world
    normal = (world.to_3x3().inverted().transposed().col[2]).normalized()
    x_axis = world.col[0].to_3d().normalized()
    axes = Matrix((x_axis, normal.cross(x_axis), normal)).transposed().to_4x4()
    return Matrix.Translation(world.translation) @ axes @ Matrix.Scale(world.col[0].length, 4)


def cycles_irradiance(plane, image, samples=CYCLES_SAMPLES):
    return cycles_bake(plane, image, {"DIRECT"}, samples)


def cycles_bake(floor, image, passes, samples):
    """Irradiance: pi times the radiance that Cycles bakes."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = samples, False, False
    scene.cycles.sample_clamp_indirect = 0
    scenes.select(floor)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter=passes, margin=0, use_clear=True)
    return math.pi * scenes.pixels(image)


def around(values):
    """Each texel's 3 x 3 neighbourhood, (9, H, W); the image's border is repeated."""
    padded = np.pad(values, 1, mode="edge")
    height, width = values.shape
    return np.stack([padded[i : i + height, j : j + width] for i in range(3) for j in range(3)])


def lamp_over(plane, kind, euler, place=(0.3, -0.2, 1.1), scale=(1, 1, 1), power=30, **options):
    """An orange lamp, placed relative to the side of the plane that its normal points to."""
    matrix = frame_of(plane) @ Matrix.LocRotScale(place, Euler(euler), scale)
    return scenes.add_lamp(None, power, kind, kind, matrix, **({"color": (1, 0.5, 0.25)} | options))


def read():
    """All light of the scene."""
    bpy.context.view_layer.update()
    return read_illumination(bpy.context.evaluated_depsgraph_get())


def our_irradiance(plane, texels=TEXELS):
    """The same by the add-on, and the coverage of the texels."""
    illumination, depsgraph = read().lighting(plane.name), bpy.context.evaluated_depsgraph_get()
    polygons = read_polygons(plane.evaluated_get(depsgraph), plane.data.materials[0].name)
    receiver = build_receiver(flatten(polygons), texels, texels, plane.name)
    grid = receiver.charts[0].grid
    total, _ = native.bake_arrival(grid.surface(), illumination.native_lights(grid), samples=8, rays=RAYS)
    return receiver.to_texture([total * grid.coverage[..., None]]), receiver.coverage
