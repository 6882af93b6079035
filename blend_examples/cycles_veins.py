"""A medium whose albedo differs from place to place, path traced by Cycles: the independent truth for maps of albedos.

    blender -b --factory-startup --python-exit-code 1 --python blend_examples/cycles_veins.py -- SAMPLES

Veins or a checker of 48 x 48 squares, one mean free path (1 m) wide, repeat over the half-space of cycles_slab.py and
go straight down. A sun at 60 degrees lights it evenly. Cycles marches through the volume in steps of half a mean free
path and evaluates the albedo at a random point of each. Prints how far `convolve` is off: in the sum, and in the mean
over the squares, with the noise of Cycles, which the scatter of eight runs gives.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import beamspread  # noqa: E402
import cycles_slab as slab  # noqa: E402

SIDE, RUNS, STEP = 48, 8, 0.5
ANGLE_DEG = 60.0


def veins():
    y, x = np.mgrid[:SIDE, :SIDE] * (2 * np.pi / SIDE)
    return 0.87 + 0.12 * np.abs(np.sin(3 * x + 1.3 * np.sin(2 * y)) * np.sin(2 * y + x))


def checker():
    y, x = np.mgrid[:SIDE, :SIDE] // 8
    return np.where((x + y) % 2, 0.7, 0.99)


def medium_of(albedo):
    """A node tree of the medium; the image repeats in x and y of the object."""
    image = bpy.data.images.new("Albedo", SIDE, SIDE, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.dstack([albedo] * 3 + [np.ones_like(albedo)]).astype(np.float32).ravel())

    def build(nodes, links, output):
        place, scale = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath")
        texture, add = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeAddShader")
        scale.operation, scale.inputs["Scale"].default_value = "SCALE", 1 / SIDE
        texture.image, texture.interpolation = image, "Closest"
        links.new(place.outputs["Position"], scale.inputs[0])
        links.new(scale.outputs["Vector"], texture.inputs["Vector"])
        for index, kind in enumerate(("ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption")):
            shader = nodes.new(kind)
            shader.inputs["Density"].default_value = 1.0
            links.new(texture.outputs["Color"], shader.inputs["Color"])
            links.new(shader.outputs[0], add.inputs[index])
        nodes["Volume Scatter"].inputs["Anisotropy"].default_value = slab.ANISOTROPY
        links.new(add.outputs[0], output.inputs["Volume"])

    return slab.material("Textured medium", build)


def scene_of(albedo, samples):
    """The image that the light of one tile is baked to."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    slab.set_up_cycles(samples)
    slab.add_slab()
    box = bpy.context.object
    box.data.materials.clear()
    box.data.materials.append(medium_of(albedo))
    # Steps are a tenth of the mean side of a box, times the rate.
    sides = 2 * slab.SLAB_WIDTH + slab.SLAB_DEPTH
    bpy.context.scene.cycles.volume_step_rate = STEP / (sides / 3 / 10)
    bpy.context.scene.cycles.volume_max_steps = 4096
    slab.add_sun()
    bpy.data.objects["Sun"].rotation_euler = (0.0, math.radians(-ANGLE_DEG), 0.0)
    return slab.add_ghost((0, 0), (SIDE, SIDE), SIDE, SIDE)[1]


def traced(albedo, samples):
    """Exitance over irradiance of each run, [run][row][column]."""
    image, runs = scene_of(albedo, samples // RUNS), []
    for seed in range(RUNS):
        bpy.context.scene.cycles.seed = seed + 1
        bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, use_clear=True)
        values = np.empty(SIDE * SIDE * 4, np.float32)
        image.pixels.foreach_get(values)
        runs.append(np.pi * values.reshape(SIDE, SIDE, 4)[..., 0] / math.cos(math.radians(ANGLE_DEG)))
    return np.array(runs)


def ours(albedo):
    """The middle one of 5 x 5 tiles."""
    travel = math.sin(math.radians(ANGLE_DEG)), 0.0, -math.cos(math.radians(ANGLE_DEG))
    library = beamspread.library(beamspread.Medium(slab.ANISOTROPY))
    tiles = np.tile(albedo, (5, 5))
    both = [
        beamspread.convolve(np.ones_like(tiles), travel, library, values, 1.0, 1.0, noise=0.005)[..., 0]
        for values in (tiles, np.full_like(tiles, tiles.mean()))
    ]
    return [np.pi * values[2 * SIDE : 3 * SIDE, 2 * SIDE : 3 * SIDE] for values in both]


def main():
    samples = int(sys.argv[sys.argv.index("--") + 1])
    for name, albedo in (("veins", veins()), ("checker", checker())):
        runs = traced(albedo, samples)
        truth, noise = runs.mean(axis=0), runs.std(axis=0, ddof=1) / math.sqrt(RUNS)
        found, one_albedo = ours(albedo)
        # The mean absolute value of Gaussian noise is sqrt(2 / pi) of its deviation.
        expected = math.sqrt(2 / math.pi) * noise.mean() / truth.mean()
        total, of_sum = found.mean() / truth.mean() - 1, noise.mean() / SIDE / truth.mean()
        print(
            f"{name}: sum {total:+.2%} (noise {of_sum:.2%}), off by "
            f"{abs(found - truth).mean() / truth.mean():.2%} in the mean, by noise of Cycles alone {expected:.2%}; "
            f"one albedo: {abs(one_albedo - truth).mean() / truth.mean():.2%}"
        )


main()
