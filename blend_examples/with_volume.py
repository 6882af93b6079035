"""Renders an example with light that Cycles traces through its slab as a volume, all else being the same:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python with_volume.py -- OUT.png OURS.exr SAMPLES

The slab is a box below the plane, wide and deep enough to have no ends, of a medium without a step in refraction, which
paths can be traced through. A ghost above it measures the emitted light, as in cycles_slab.py, and the Beamspread node
shows it. Prints how far OURS.exr, a bake of the same plane, is off: mean over texels of the ghost, and over blocks of
them, which have less noise.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import beamspread  # noqa: E402
import cycles_slab  # noqa: E402

COLUMNS = 208
PASSES = 8  # of which the scatter gives the noise
BLOCK = 16
ENDS = 40  # of the box beyond the plane and below it, in mean free paths


def medium(node):
    """Slab of cycles_slab.py with the node's values."""
    length = node.mean_free_path[0]
    if node.ior != 1.0 or set(node.mean_free_path) != {length}:
        raise SystemExit("with_volume.py takes a medium of ior 1 and of one mean free path")

    def build(nodes, links, output):
        scatter, absorption = nodes.new("ShaderNodeVolumeScatter"), nodes.new("ShaderNodeVolumeAbsorption")
        for shader in (scatter, absorption):
            shader.inputs["Color"].default_value = (*node.albedo, 1.0)
            shader.inputs["Density"].default_value = 1 / length
        scatter.inputs["Anisotropy"].default_value = node.anisotropy
        add = nodes.new("ShaderNodeAddShader")
        links.new(scatter.outputs[0], add.inputs[0])
        links.new(absorption.outputs[0], add.inputs[1])
        links.new(add.outputs[0], output.inputs["Volume"])

    return cycles_slab.material("Medium", build)


def add_box(low, high, node):
    ends = ENDS * node.mean_free_path[0]
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.scale = (high[0] - low[0] + 2 * ends, high[1] - low[1] + 2 * ends, ends)
    box.location = (*((low + high) / 2), -ends / 2)
    box.data.materials.append(medium(node))
    return box


def pixels(image):
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[..., :3].astype(float)


def bake(image, samples):
    """Exitance / pi of each pass."""
    scene = bpy.context.scene
    cycles, kept = scene.cycles, scene.cycles.samples
    cycles.max_bounces = cycles.volume_bounces = 1024
    # A clamp, as new scenes have one, takes from the bright rest of the light: 2 % of the stage's.
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.use_adaptive_sampling, cycles.samples, scene.render.bake.margin = False, samples, 0
    passes = []
    for seed in range(PASSES):
        cycles.seed = seed + 1
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, use_clear=True)
        passes.append(pixels(image))
    cycles.samples = kept
    return np.array(passes)


def resampled(texture, shape):
    """Mean over the texels of a coarser grid, of which an array of finer ones is left."""
    rows, columns = (np.arange(size) * part // size for size, part in zip(texture.shape, shape))
    total, count = np.zeros((*shape, 3)), np.zeros((*shape, 1))
    np.add.at(total, (rows[:, None], columns[None]), texture)
    np.add.at(count, (rows[:, None], columns[None]), 1)
    return total / count


def compare(baked, passes, size):
    """Print the mean error over blocks of `size` squared texels of the ghost, and the share of Cycles' noise in it."""
    rows, columns = passes.shape[1] // size, passes.shape[2] // size
    blocks = passes[:, : rows * size, : columns * size].reshape(PASSES, rows, size, columns, size, 3)
    blocks = np.nanmean(blocks, axis=(2, 4))
    truth, noise = blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / np.sqrt(PASSES)
    off = abs(resampled(baked, (rows, columns)) - truth).mean() / truth.mean()
    # The mean absolute value of Gaussian noise is sqrt(2 / pi) of its deviation.
    expected = np.sqrt(2 / np.pi) * noise.mean() / truth.mean()
    print(f"{rows} x {columns} blocks: off by {off:.2%} in the mean, by noise of Cycles alone {expected:.2%}")


def main():
    picture, ours, samples = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        plane = next(obj for obj in bpy.data.objects if obj.type == "MESH" and obj.data.uv_layers and _node(obj))
        node = _node(plane)
        corners = np.array([vertex.co[:2] for vertex in plane.data.vertices])
        plane.hide_render = True
        box = add_box(corners.min(axis=0), corners.max(axis=0), node)
        low, high = corners.min(axis=0), corners.max(axis=0)
        rows = round(COLUMNS * (high[1] - low[1]) / (high[0] - low[0]))
        ghost, image = cycles_slab.add_ghost(low, high, COLUMNS, rows)
        passes = bake(image, int(samples) // PASSES)
        exitance = np.nanmean(passes, axis=0)
        baked = pixels(bpy.data.images.load(str(Path(ours).resolve())))
        for size in (1, BLOCK):
            compare(baked, passes, size)
        print(f"sum: {baked.mean() / exitance.mean() - 1:+.2%}")
        for obj in (box, ghost):
            bpy.data.objects.remove(obj)
        plane.hide_render = False
        image.pixels.foreach_set(np.dstack([exitance, np.ones(exitance.shape[:2])]).astype(np.float32).ravel())
        node.image = image
        bpy.context.scene.render.filepath = str(Path(picture).resolve())
        bpy.ops.render.render(write_still=True)
    finally:
        beamspread.unregister()


def _node(obj):
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material]
    return next((node for tree in trees for node in tree.nodes if node.bl_idname == "BeamspreadNode"), None)


main()
