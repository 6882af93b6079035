"""Renders an example with light that Cycles traces through its slab as a volume, all else being the same:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python with_volume.py -- \
        OUT.png OUT.csv SAMPLES BAKED.exr...

The slab is a box below the plane, wide and deep enough to have no ends, of a medium without a step in refraction, which
paths can be traced through. A texture of the base color goes straight down. Where a table is around the plane, a black
sheet takes its place. A ghost above the plane measures the emitted light, as in cycles_slab.py, and the Beamspread node
shows it. OUT.csv gets means over blocks of the ghost's texels. Prints how far each BAKED.exr, a bake of the same plane,
is off in the mean over texels of the ghost, and over blocks of them, which have less noise.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import beamspread  # noqa: E402
import cycles_slab  # noqa: E402

COLUMNS = 208  # of the ghost; half of those of a texture
PASSES = 8  # of which the scatter gives the noise
BLOCKS = 1, 4, 16
WRITTEN = 4  # texels along the side of blocks in the file
ENDS = 40  # of the box beyond the plane and below it, in mean free paths
HEIGHT = 0.01  # of the ghost above the plane, in mean free paths
STEP = 0.5  # with which Cycles looks for changes of the albedo, in mean free paths
DARK = 1e-6  # 1 - the largest albedo


def albedos(node):
    """Albedo of each texel of the texture at the base color, or of the node, (rows, columns, 3)."""
    medium = node.surface().resolve("final")
    links = node.inputs["Base Color"].links
    if not links:
        return np.array(medium.albedo).reshape(1, 1, 3)
    image = links[0].from_node.image
    encoded = pixels(image)
    color = np.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)  # sRGB
    library = beamspread.library(beamspread.Medium(medium.anisotropy, medium.ior))
    known = 1 - np.geomspace(1, DARK, 400)
    return np.interp(color, [library.diffuse_reflectance(albedo) for albedo in known], known)


def volume(node, place):
    """Medium of a node whose texture lies at the texture coordinates that `place(nodes, links)` gives."""
    if node.ior != 1.0:
        raise SystemExit("with_volume.py takes a medium of ior 1")
    albedo = albedos(node)

    def build(nodes, links, output):
        add, shaders = nodes.new("ShaderNodeAddShader"), []
        for index, kind in enumerate(("ShaderNodeVolumeScatter", "ShaderNodeVolumeAbsorption")):
            shaders.append(nodes.new(kind))
            shaders[index].inputs["Color"].default_value = (*albedo[0, 0], 1.0)
            shaders[index].inputs["Density"].default_value = 1 / node.mean_free_path[0]
            links.new(shaders[index].outputs[0], add.inputs[index])
        shaders[0].inputs["Anisotropy"].default_value = node.anisotropy
        links.new(add.outputs[0], output.inputs["Volume"])
        if albedo.shape[:2] == (1, 1):
            return
        texture = nodes.new("ShaderNodeTexImage")
        texture.image, texture.extension, texture.interpolation = stored("Albedo", albedo), "EXTEND", "Closest"
        links.new(place(nodes, links), texture.inputs["Vector"])
        for shader in shaders:
            links.new(texture.outputs["Color"], shader.inputs["Color"])

    return cycles_slab.material("Medium", build)


def stored(name, values):
    """A new image of values (rows, columns, 3)."""
    image = bpy.data.images.new(name, *values.shape[1::-1], float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.dstack([values, np.ones(values.shape[:2])]).astype(np.float32).ravel())
    return image


def add_box(low, high, node):
    """The slab below a rectangle."""

    def place(nodes, links):
        at, scaled = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeVectorMath")
        scaled.operation = "MULTIPLY_ADD"
        scaled.inputs[1].default_value = (*(1 / (high - low)), 0)
        scaled.inputs[2].default_value = (*(-low / (high - low)), 0)
        links.new(at.outputs["Position"], scaled.inputs[0])
        return scaled.outputs["Vector"]

    ends, sides = ENDS * max(node.mean_free_path), high - low
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    box = bpy.context.object
    box.scale = (*(sides + 2 * ends), ends)
    box.location = (*((low + high) / 2), -ends / 2)
    box.data.materials.append(volume(node, place))
    bpy.context.view_layer.update()
    return box


def add_sheet(low, high, node):
    """A black sheet around a rectangle, which covers the slab."""
    far, height = 2 * ENDS * max(node.mean_free_path), HEIGHT / 2 * min(node.mean_free_path)
    (x0, y0), (x1, y1) = low, high
    outer = [(x0 - far, y0 - far), (x1 + far, y0 - far), (x1 + far, y1 + far), (x0 - far, y1 + far)]
    corners = [*outer, (x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    faces = [(i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i) for i in range(4)]
    sheet = cycles_slab.mesh_object("Sheet", [(*corner, height) for corner in corners], faces)
    sheet.data.materials.append(cycles_slab.material("Black", cycles_slab.diffuse_nodes(0.0)))
    return sheet


def below(height):
    """Meshes that render and lie below a height, where the slab comes."""
    meshes = (obj for obj in bpy.data.objects if obj.type == "MESH" and not obj.hide_render)
    return [obj for obj in meshes if max((obj.matrix_world @ v.co).z for v in obj.data.vertices) <= height]


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


def traced(image, body, node, samples):
    """Exitance / pi of each pass, where a body has the medium of a node.

    Channels with other mean free paths have paths of their own: paths that all share have weights of much variance.
    """
    lengths, result = np.array(node.mean_free_path), None
    cycles = bpy.context.scene.cycles
    sides = np.ptp([body.matrix_world @ vertex.co for vertex in body.data.vertices], axis=0)
    for length in np.unique(lengths):
        for shader in body.data.materials[0].node_tree.nodes:
            if "Density" in shader.inputs:
                shader.inputs["Density"].default_value = 1 / length
        # Steps are a tenth of the mean side of a box, times the rate.
        cycles.volume_step_rate, cycles.volume_max_steps = STEP * length / (sides.mean() / 10), 4096
        passes = bake(image, samples)
        result = passes if result is None else np.where(lengths == length, passes, result)
    return result


def resampled(texture, shape):
    """Mean over the texels of a coarser grid, of which an array of finer ones is left."""
    rows, columns = (np.arange(size) * part // size for size, part in zip(texture.shape, shape))
    total, count = np.zeros((*shape, 3)), np.zeros((*shape, 1))
    np.add.at(total, (rows[:, None], columns[None]), texture)
    np.add.at(count, (rows[:, None], columns[None]), 1)
    return total / count


def in_blocks(passes, size):
    """Means over blocks of `size` squared texels, and their standard errors."""
    rows, columns = passes.shape[1] // size, passes.shape[2] // size
    blocks = passes[:, : rows * size, : columns * size].reshape(PASSES, rows, size, columns, size, 3)
    blocks = np.nanmean(blocks, axis=(2, 4))
    return blocks.mean(axis=0), blocks.std(axis=0, ddof=1) / np.sqrt(PASSES)


def noise_in(mean, error):
    """Mean error that noise alone gives, over the mean."""
    # The mean absolute value of Gaussian noise is sqrt(2 / pi) of its deviation.
    return np.sqrt(2 / np.pi) * error.mean() / mean.mean()


def compare(baked, passes, size):
    """Print the mean error over blocks of `size` squared texels of the ghost, and the share of Cycles' noise in it."""
    truth, error = in_blocks(passes, size)
    off = abs(resampled(baked, truth.shape[:2]) - truth).mean() / truth.mean()
    shape = "{} x {}".format(*truth.shape)
    print(f"{shape} blocks: off by {off:.2%} in the mean, by noise of Cycles alone {noise_in(truth, error):.2%}")


def write(file, passes, samples):
    """Means over blocks of texels."""
    mean, error = in_blocks(passes, WRITTEN)
    rows, columns = mean.shape[:2]
    lines = [
        f"# Blender {bpy.app.version_string}, Cycles volume path tracing of {Path(bpy.data.filepath).name}"
        f" (compare.sh, {samples} samples): exitance / pi.",
        f"# {rows} x {columns} blocks of texels, rows upward; noise alone gives a mean error of"
        f" {noise_in(mean, error):.2%}.",
        "row,column,r,g,b",
    ]
    for row, column in np.ndindex(rows, columns):
        lines.append(f"{row},{column}," + ",".join(f"{value:.4g}" for value in mean[row, column]))
    Path(file).write_text("\n".join(lines) + "\n", encoding="utf-8")


def measured(ghost_image, body, node, table, samples, files, part=np.s_[:]):
    """Exitance / pi of the texels of a ghost; `part` of the texels of baked files shows them."""
    passes = traced(ghost_image, body, node, samples // PASSES)
    write(table, passes, samples)
    exitance = np.nanmean(passes, axis=0)
    for file in files:
        baked = pixels(bpy.data.images.load(str(Path(file).resolve())))[part]
        print(f"{file}: sum {baked.mean() / exitance.mean() - 1:+.2%}")
        for size in BLOCKS:
            compare(baked, passes, size)
    return exitance


def render(node, exitance, picture):
    """Render the scene with light that a node shows."""
    node.image = stored("Paths", exitance)
    bpy.context.scene.render.filepath = str(Path(picture).resolve())
    bpy.ops.render.render(write_still=True)


def beamspread_node(obj):
    """The node of an object, or None."""
    trees = [slot.material.node_tree for slot in obj.material_slots if slot.material]
    return next((node for tree in trees for node in tree.nodes if node.bl_idname == "BeamspreadNode"), None)


def main():
    picture, table, samples, *files = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        meshes = (obj for obj in bpy.data.objects if obj.type == "MESH" and obj.data.uv_layers)
        plane = next(obj for obj in meshes if beamspread_node(obj))
        node = beamspread_node(plane)
        corners = np.array([vertex.co[:2] for vertex in plane.data.vertices])
        around = [obj for obj in below(plane.location.z) if obj != plane]
        for obj in (plane, *around):
            obj.hide_render = True
        low, high = corners.min(axis=0), corners.max(axis=0)
        added = [add_box(low, high, node)] + ([add_sheet(low, high, node)] if around else [])
        columns = albedos(node).shape[1] // 2 or COLUMNS
        rows = round(columns * (high[1] - low[1]) / (high[0] - low[0]))
        ghost, image = cycles_slab.add_ghost(low, high, columns, rows)
        ghost.location.z = HEIGHT * min(node.mean_free_path)
        exitance = measured(image, added[0], node, table, int(samples), files)
        for obj in (*added, ghost):
            bpy.data.objects.remove(obj)
        for obj in (plane, *around):
            obj.hide_render = False
        render(node, exitance, picture)
    finally:
        beamspread.unregister()


if __name__ == "__main__":
    main()
