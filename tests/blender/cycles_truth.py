"""What Cycles makes of a scene: the irradiance of a white diffuse plane."""

import math

import bpy
import numpy as np
import scenes

TEXELS = 64
# Cycles samples each texel at random places; with this many their mean is that of the texel to 0.1 %.
CYCLES_SAMPLES = 256


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
