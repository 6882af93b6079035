"""Shadow border on a scattering half-space, path traced by Cycles: the independent truth for the `obstacle` example.

    blender -b --factory-startup --python blend_examples/cycles_slab.py -- blend_examples/cycles_edge.csv --seconds 3600

The medium is the paper's (Henyey-Greenstein g = 0.8, single-scattering albedo R G B = 0.6 0.9 0.3, index-matched), as a
box so wide and thick that its ends cannot be seen (see SLAB). A sun at 55 degrees shines along +u. A black sheet
hangs one mean free path above the surface and shades one half of it with a sharp, straight, endless border at u = 0:

    direction "toward": lit where u < 0, so the light travels towards the shadow (the foot of the obstacle);
    direction "away":   lit where u > 0, so it travels away from the shadow (the far end of the obstacle's shadow).

Exitance is measured by a "ghost": a white diffuse sheet just above the surface, facing it, that only glossy rays can
see. Nothing in the scene is glossy, so it blocks nothing, and its baked diffuse pass is exitance / pi. The picture does
not change along the border, so texels along v are averaged. Runs with different seeds give the standard errors;
`--resume FILE.npz` keeps them between calls.
"""

import argparse
import math
import os
import sys
import tempfile
import time

import bpy
import numpy as np

ANISOTROPY = 0.8
ALBEDO = (0.6, 0.9, 0.3)
ANGLE_DEG = 55.0
IRRADIANCE = math.cos(math.radians(ANGLE_DEG))  # of a sun of strength 1 W/m^2

# In mean free paths (1 m here). Light of albedo 0.9 falls by e in about 3.4 mean free paths, so 25 down and up again,
# or 200 sideways, is nothing.
SLAB_WIDTH, SLAB_DEPTH = 400.0, 25.0
HALF_RANGE = 18.0  # the profile runs from -HALF_RANGE to +HALF_RANGE
BINS, ROWS = 144, 8
SHEET_HEIGHT = 1.0
GHOST_HEIGHT = 1e-4


def mesh_object(name, corners, faces, uvs=None):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    if uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap")
        for loop, uv in zip(layer.data, uvs):
            loop.uv = uv
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def material(name, build):
    """A material with only an output node, filled by `build(nodes, links, output)`."""
    result = bpy.data.materials.new(name)
    result.use_nodes = True
    nodes = result.node_tree.nodes
    nodes.clear()
    build(nodes, result.node_tree.links, nodes.new("ShaderNodeOutputMaterial"))
    return result


def medium_nodes(nodes, links, output):
    scatter, absorption = nodes.new("ShaderNodeVolumeScatter"), nodes.new("ShaderNodeVolumeAbsorption")
    for node in (scatter, absorption):
        node.inputs["Color"].default_value = (*ALBEDO, 1.0)
        node.inputs["Density"].default_value = 1.0
    scatter.inputs["Anisotropy"].default_value = ANISOTROPY
    add = nodes.new("ShaderNodeAddShader")
    links.new(scatter.outputs[0], add.inputs[0])
    links.new(absorption.outputs[0], add.inputs[1])
    links.new(add.outputs[0], output.inputs["Volume"])


def diffuse_nodes(colour):
    def build(nodes, links, output):
        bsdf = nodes.new("ShaderNodeBsdfDiffuse")
        bsdf.inputs["Color"].default_value = (colour, colour, colour, 1.0)
        links.new(bsdf.outputs[0], output.inputs["Surface"])

    return build


def add_slab():
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    slab = bpy.context.object
    slab.scale = (SLAB_WIDTH, SLAB_WIDTH, SLAB_DEPTH)
    slab.location = (0.0, 0.0, -SLAB_DEPTH / 2)
    slab.data.materials.append(material("Medium", medium_nodes))


def add_sun():
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 1.0, 0.0
    sun = bpy.data.objects.new("Sun", light)
    sun.rotation_euler = (0.0, math.radians(-ANGLE_DEG), 0.0)  # shines along (sin, 0, -cos)
    bpy.context.collection.objects.link(sun)


def add_sheet():
    """The occluder; its `scale.x` of +1 or -1 chooses the half that it shades."""
    far = SLAB_WIDTH
    sheet = mesh_object("Sheet", [(0, -far, 0), (far, -far, 0), (far, far, 0), (0, far, 0)], [(0, 1, 2, 3)])
    sheet.location = (-SHEET_HEIGHT * math.tan(math.radians(ANGLE_DEG)), 0.0, SHEET_HEIGHT)
    sheet.data.materials.append(material("Black", diffuse_nodes(0.0)))
    return sheet


def add_ghost(low, high, columns, rows):
    """A ghost over a rectangle and the image that its light is baked to; it alone is selected."""
    # One triangle holds the whole texture: Cycles mirrors samples of a texel that leave the triangle of its centre,
    # which in texels that a quad's diagonal crosses moves them far along u.
    (x, y), (width, depth) = low, (high[0] - low[0], high[1] - low[1])
    corners = [(x, y, 0), (x, y + 2 * depth, 0), (x + 2 * width, y, 0)]  # normal down
    ghost, image = make_ghost(corners, [(0, 1, 2)], [(0, 0), (0, 2), (2, 0)], columns, rows)
    ghost.location.z = GHOST_HEIGHT
    return ghost, image


def make_ghost(corners, faces, uvs, columns, rows):
    """A mesh of white faces that only bakes see, and the image that its light is baked to; it alone is selected."""
    ghost = mesh_object("Ghost", corners, faces, uvs)
    ghost.visible_camera = ghost.visible_diffuse = ghost.visible_transmission = False
    ghost.visible_volume_scatter = ghost.visible_shadow = False
    white = material("White", diffuse_nodes(1.0))
    ghost.data.materials.append(white)
    target = white.node_tree.nodes.new("ShaderNodeTexImage")
    target.image = bpy.data.images.new("Exitance", columns, rows, float_buffer=True, is_data=True)
    white.node_tree.nodes.active = target
    for obj in bpy.context.scene.objects:
        obj.select_set(obj == ghost)
    bpy.context.view_layer.objects.active = ghost
    return ghost, target.image


def set_up_cycles(samples):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.bake.margin = 0
    world = bpy.data.worlds.new("Black")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    scene.world = world
    cycles = scene.cycles
    cycles.samples = samples
    cycles.use_denoising = False
    cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    for name in (
        "max_bounces",
        "diffuse_bounces",
        "glossy_bounces",
        "transmission_bounces",
        "volume_bounces",
        "transparent_max_bounces",
    ):
        setattr(cycles, name, 1024)


def bake_texels(image, seed):
    """L / E: float64 (ROWS, BINS, 3), a texel in ten thousand nan."""
    bpy.context.scene.cycles.seed = seed
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, use_clear=True)
    pixels = np.empty(BINS * ROWS * 4, np.float32)
    image.pixels.foreach_get(pixels)
    rows = pixels.reshape(ROWS, BINS, 4)[:, :, :3].astype(np.float64)
    rows[~np.isfinite(rows)] = np.nan
    return rows / IRRADIANCE


def bake_profile(image, seed):
    """L / E, averaged along the border: float64 (BINS, 3)."""
    return np.nanmean(bake_texels(image, seed), axis=0)


def write_csv(path, runs, samples, command):
    centres = (np.arange(BINS) + 0.5) / BINS * 2 * HALF_RANGE - HALF_RANGE
    total = {name: len(profiles) * ROWS * samples for name, profiles in runs.items()}
    lines = [
        f"# Made by: {command}",
        f"# Blender {bpy.app.version_string}, Cycles volume path tracing; half-space, HG g {ANISOTROPY}, index-matched,"
        f" albedo R G B {ALBEDO}, sun at {ANGLE_DEG} degrees travelling along +u.",
        "# toward: lit where u < 0; away: lit where u > 0. u in mean free paths, bins of "
        f"{2 * HALF_RANGE / BINS} around u_mfp.",
        "# r g b: luminance over irradiance at lit places, L / E in 1/sr; *_se: standard error of the mean.",
        f"# Samples per bin: {total}; in { ({k: len(v) for k, v in runs.items()}) } runs.",
        "direction,u_mfp,r,g,b,r_se,g_se,b_se",
    ]
    for name, profiles in runs.items():
        stack = np.array(profiles)
        mean = stack.mean(axis=0)
        error = stack.std(axis=0, ddof=1) / math.sqrt(len(stack))
        for u, m, e in zip(centres, mean, error):
            lines.append(f"{name},{u:.3f}," + ",".join(f"{x:.4e}" for x in m) + "," + ",".join(f"{x:.1e}" for x in e))
    handle, part = tempfile.mkstemp(dir=os.path.dirname(os.path.abspath(path)))
    with os.fdopen(handle, "w") as file:
        file.write("\n".join(lines) + "\n")
    os.chmod(part, 0o644)
    os.replace(part, path)


def build_scene(samples):
    """The whole scene; the sheet and the image of the ghost."""
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    set_up_cycles(samples)
    add_slab()
    add_sun()
    half_v = HALF_RANGE * ROWS / BINS
    sheet, (_, image) = add_sheet(), add_ghost((-HALF_RANGE, -half_v), (HALF_RANGE, half_v), BINS, ROWS)
    return sheet, image


def main():
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    parser = argparse.ArgumentParser(prog="cycles_slab.py")
    parser.add_argument("csv")
    parser.add_argument("--seconds", type=float, default=3600.0, help="stop after this time")
    parser.add_argument("--samples", type=int, default=1024, help="per texel and run")
    parser.add_argument("--resume", metavar="FILE.npz", help="runs so far; read if it is there, written after each")
    options = parser.parse_args(arguments)

    sheet, image = build_scene(options.samples)
    runs = {"toward": [], "away": []}
    if options.resume and os.path.exists(options.resume):
        with np.load(options.resume) as stored:
            runs = {name: list(stored[name]) for name in runs}
    command = f"blender -b --factory-startup --python blend_examples/cycles_slab.py -- {' '.join(arguments)}"
    end = time.monotonic() + options.seconds
    while time.monotonic() < end or len(runs["away"]) < 2:
        for name, side in (("toward", 1.0), ("away", -1.0)):
            sheet.scale.x = side
            bpy.context.view_layer.update()
            runs[name].append(bake_profile(image, seed=len(runs[name]) + 1 + (100000 if side < 0 else 0)))
        if options.resume:
            np.savez(options.resume + ".part.npz", **{name: np.array(profiles) for name, profiles in runs.items()})
            os.replace(options.resume + ".part.npz", options.resume)
        write_csv(options.csv, runs, options.samples, command)


if __name__ == "__main__":
    main()
