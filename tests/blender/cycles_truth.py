"""The irradiance of a white diffuse plane, by Cycles and by the add-on."""

import math

import bpy
import numpy as np
import scenes
from beamspread.blender.read.geometry import read_polygons
from beamspread.blender.read.lights import read_illumination
from beamspread.core.bake.gather import Gatherer
from beamspread.core.bake.settings import BakeSettings
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.uv_map import fit_uv_maps

TEXELS = 64
# Cycles samples each texel at random places; with this many their mean is that of the texel to 0.1 %.
CYCLES_SAMPLES = 256
# From each texel of ours, where something casts shadows.
RAYS = 256


def white_material(texels=TEXELS):
    """White, diffuse, with an image to bake into."""
    image = bpy.data.images.new("Bake", texels, texels, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    material = bpy.data.materials.new("White")
    if bpy.app.version < (5, 0, 0):  # later ones always use nodes, and warn
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    output, diffuse = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    diffuse.inputs["Roughness"].default_value = 0
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    nodes.active = texture
    return material, image


def add_receiver(world, uvs=scenes.SQUARE_UVS, texels=TEXELS):
    material, image = white_material(texels)
    return scenes.add_plane("Receiver", (2, 2), world, uvs, material), image


def cycles_irradiance(plane, image, samples=CYCLES_SAMPLES):
    """Pi times what Cycles bakes."""
    scene = bpy.context.scene
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scenes.select(plane)
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT"}, margin=0, use_clear=True)
    return math.pi * scenes.pixels(image)


def around(values):
    """Each texel's 3 x 3 neighbourhood, (9, H, W); the image's border is repeated."""
    padded = np.pad(values, 1, mode="edge")
    height, width = values.shape
    return np.stack([padded[i : i + height, j : j + width] for i in range(3) for j in range(3)])


def our_irradiance(plane):
    """The same by the add-on, and the coverage of the texels."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    illumination = read_illumination(depsgraph).lighting(plane.name)
    polygons = read_polygons(plane.evaluated_get(depsgraph), plane.data.materials[0].name)
    receiver = build_receiver(fit_uv_maps(polygons), TEXELS, TEXELS)
    grid = receiver.charts[0].grid
    gatherer = Gatherer(grid, illumination, BakeSettings(samples=8))
    total = np.zeros((grid.height, grid.width, 3), np.float32)
    for light in illumination.lights:
        total += gatherer.totals(light, RAYS)[0] * light.rgb()
    return receiver.to_texture([total]), receiver.coverage
