"""What arrives at coarse grids on planes, by direction, path traced by Cycles with the artist's materials.

Part of the child process (child.py).
"""

import time

import bpy
import numpy as np
from child_ghost import add_ghost

# Samples per node and stratum of the first two looks, from which noise and speed follow.
LOOK = 4

# A round is no shorter than this, as each prepares the scene anew, unless that takes no time.
ROUND_SECONDS = 4.0


def fields(request, scene, progress) -> dict:
    """The task `fields`: radiance_0, radiance_1, ... of the charts, float32 (K, rows, columns, 3), and noise.

    Radiance is each stratum's mean by the cosine. The noise is that of the irradiance, the root of its mean square over
    all nodes, as part of its mean.
    """
    for name, color in request["reflectances"].items():
        make_diffuse(bpy.data.materials[name], color)
    set_up(scene)
    ghost, image = add_ghost(request["charts"], request["strata"])
    scene.collection.objects.link(ghost)
    baker = Baker(scene, ghost, image, request["light"])
    looks = [baker.bake(LOOK), baker.bake(LOOK)]
    spent = baker.seconds
    progress(0.05)
    noise = noise_of(request, *looks)
    # The mean of both has noise / sqrt(2); it falls by the root of the samples.
    wanted = 2 * LOOK * (noise / np.sqrt(2) / request["noise"]) ** 2
    affordable = 2 * LOOK * request["seconds"] / max(spent, 1e-3)
    missing = int(np.ceil(min(wanted, affordable))) - 2 * LOOK
    total, samples = sum(looks) * LOOK, 2 * LOOK
    if missing > 0:
        seconds = spent / (2 * LOOK) * missing
        rounds = int(np.clip(seconds / ROUND_SECONDS, 1, 32))
        for number in range(rounds):
            count = missing // rounds + (number < missing % rounds)
            if count:
                total, samples = total + count * baker.bake(count), samples + count
            progress(0.05 + 0.95 * (number + 1) / rounds)
    result = {f"radiance_{n}": part for n, part in enumerate(split(request, total / samples))}
    result["noise"] = np.array(noise / np.sqrt(2) * np.sqrt(2 * LOOK / samples))
    result["samples"] = np.array(samples)
    return result


def make_diffuse(material, color) -> None:
    """A plain diffuse surface, as bright as the medium under it."""
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output.inputs["Surface"], diffuse.outputs[0])


def set_up(scene) -> None:
    """The artist's materials and bounces, but no clamps, no exposure, nothing that stops early."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
    cycles.film_exposure = 1.0
    cycles.time_limit = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    # The mirror stands for a diffuse surface: it uses up a glossy bounce in place of a diffuse one.
    cycles.glossy_bounces += 1
    cycles.diffuse_bounces -= 1


class Baker:
    """Bakes the ghost again and again."""

    def __init__(self, scene, ghost, image, light) -> None:
        self.scene, self.image, self.light = scene, image, light
        self.rounds, self.seconds = 0, 0.0
        view_layer = bpy.context.view_layer
        for obj in view_layer.objects:
            obj.select_set(obj == ghost)
        view_layer.objects.active = ghost
        self.options = {"margin": 0, "use_clear": True, "use_selected_to_active": False, "target": "IMAGE_TEXTURES"}
        if "view_from" in bpy.ops.object.bake.get_rna_type().properties:
            self.options["view_from"] = "ABOVE_SURFACE"

    def bake(self, samples: int) -> np.ndarray:
        """Float32 (height, width, 3) of the image."""
        start = time.monotonic()
        self.rounds += 1
        self.scene.cycles.seed, self.scene.cycles.samples = self.rounds, samples
        bpy.ops.object.bake(type="GLOSSY", pass_filter={self.light}, **self.options)
        values = np.empty(len(self.image.pixels), np.float32)
        self.image.pixels.foreach_get(values)
        self.seconds += time.monotonic() - start
        pixels = values.reshape(self.image.size[1], self.image.size[0], self.image.channels)[..., :3]
        # A texel in ten thousand may come as no number.
        return np.nan_to_num(pixels, nan=0.0, posinf=0.0, neginf=0.0)


def split(request, pixels) -> list:
    """(K, rows, columns, 3) of each chart from the image."""
    parts, row, count = [], 0, len(request["strata"])
    for chart in request["charts"]:
        columns, rows = chart["nodes"]
        block = pixels[row : row + rows, : count * columns].reshape(rows, count, columns, 3)
        parts.append(np.ascontiguousarray(block.transpose(1, 0, 2, 3)))
        row += rows
    return parts


def noise_of(request, one, other) -> float:
    """Of the irradiance in `one`, from its difference to `other`."""
    _, reach, _, part = np.transpose(request["strata"])
    weights = reach * part
    square, mean = [], []
    for a, b in zip(split(request, one), split(request, other)):
        a, b = (np.tensordot(weights, values.mean(axis=3), 1).ravel() for values in (a, b))
        square.append((a - b) ** 2 / 2)
        mean.append((a + b) / 2)
    total = np.concatenate(mean).mean()
    return float(np.sqrt(np.concatenate(square).mean()) / total) if total > 0 else 0.0
