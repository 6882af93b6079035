"""Light that arrives at coarse grids on planes, by direction, path traced by Cycles with the artist's materials.

Part of the child process (child.py).
"""

import traceback

import bpy
import compat
import numpy as np
from child_denoise import Denoiser
from child_ghost import add_ghost, draw_anew

# Samples per node and stratum of each of the first two rounds, which measure the noise. Later rounds take twice as many
# as the round before. The number of rounds does not depend on time, so that every run gives the same result.
FIRST_SAMPLES = 4

# Factor by which a denoiser reduces noise (docs/tuning.md); sampling stops that much earlier.
DENOISED = 2.0


def fields(request, scene, progress) -> dict:
    """Task `fields`: radiance_0, radiance_1, ... of the charts, float32 (K, rows, columns, 3), and noise.

    `light` is "INDIRECT" or "DIRECT". `only` names the objects whose light counts; none: all. With `by_lamps` a white
    diffuse surface of one stratum replaces the mirrors, so that Cycles samples lamps of any size. The mean
    `irradiance`, W/m^2, is that of the first two rounds. There are no more rounds if it is below the fraction
    `negligible` of `direct`.

    Radiance is the cosine-weighted mean of each stratum. The noise is the root mean square error of the irradiance over
    all nodes, relative to its mean. Bounced light is smooth: a denoiser removes noise from its irradiance, and the
    strata follow in proportion.
    """
    for name, color in request["reflectances"].items():
        material = bpy.data.materials.get(name)
        if material is not None:  # the copy has only materials that the scene uses
            make_diffuse(material, color, request["textures"].get(name))
    if not request.get("with_world", True):
        scene.world = None
    set_up(scene, request["light"])
    if request["only"]:
        shine_alone(scene, request["only"])
    ghost, image = add_ghost(request["charts"], request["strata"], request["by_lamps"])
    scene.collection.objects.link(ghost)
    baker = Baker(scene, ghost, image, "DIFFUSE" if request["by_lamps"] else "GLOSSY", request["light"])
    rounds = [baker.bake(FIRST_SAMPLES), baker.bake(FIRST_SAMPLES)]
    mean, samples, count = Mean(), 2 * FIRST_SAMPLES, 2 * FIRST_SAMPLES
    for pixels in rounds:
        mean.add(pixels, FIRST_SAMPLES)
    rounds = [np.nan_to_num(pixels) for pixels in rounds]
    irradiance = np.pi * float(np.mean([mean_radiance(request, pixels) for pixels in rounds]))
    # The mean of both rounds has noise / sqrt(2), which falls by the root of the samples.
    noise = noise_of(request, *rounds) / np.sqrt(2)
    denoise = working_denoiser(request, mean) if request["light"] == "INDIRECT" else None
    gain = DENOISED if denoise else 1.0
    allowed = gain * allowed_noise(request, irradiance)
    most = samples if irradiance < request["negligible"] * request["direct"] else request["most_samples"]
    wanted = int(min(np.ceil(samples * (noise / allowed) ** 2), most))
    progress(samples / max(wanted, samples))
    while samples < wanted:
        count = min(count, wanted - samples)
        mean.add(baker.bake(count), count)
        samples, count = samples + count, 2 * count
        progress(samples / wanted)
    parts = split(request, np.maximum(mean.values(), 0))
    if denoise:
        parts = with_irradiance(request, parts, denoise(irradiances(request, parts)))
    result = {f"radiance_{n}": part for n, part in enumerate(parts)}
    result["noise"] = np.array(noise * np.sqrt(2 * FIRST_SAMPLES / samples) / gain)
    result["samples"], result["irradiance"] = np.array(samples), np.array(irradiance)
    return result


def working_denoiser(request, mean):
    """Denoiser of this Blender, None if it has none or it fails."""
    if not compat.has_denoiser():
        return None
    try:
        denoise = Denoiser()
        denoise(irradiances(request, split(request, np.maximum(mean.values(), 0))))
    except Exception:  # noqa: BLE001 - more samples replace it
        traceback.print_exc()
        return None
    return denoise


def irradiances(request, parts) -> list:
    """Irradiance over pi of each chart, from the radiance of its strata."""
    _, reach, _, part = np.transpose(request["strata"])
    return [np.tensordot(np.float32(reach * part), values, 1) for values in parts]


def with_irradiance(request, parts, wanted) -> list:
    """Strata scaled to the wanted irradiance, in each node and channel."""
    ratios = [
        np.divide(new, old, out=np.zeros_like(old), where=old > 0)
        for new, old in zip(wanted, irradiances(request, parts))
    ]
    return [values * ratio for values, ratio in zip(parts, ratios)]


def make_diffuse(material, color, texture) -> None:
    """Replace a material by a diffuse one with the color of its medium or of its texture.

    `texture` names an input: the group nodes around a node, the node, the socket. None: no texture.
    """
    tree = material.node_tree
    source = texture and linked_source(tree, *texture)
    if source is None:
        tree.nodes.clear()
    else:
        for node in [node for node in tree.nodes if node.type == "OUTPUT_MATERIAL"]:
            tree.nodes.remove(node)
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*color, 1)
    if source is not None:
        tree.links.new(diffuse.inputs["Color"], within_one(tree, source))
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output.inputs["Surface"], diffuse.outputs[0])


def linked_source(tree, groups, node: str, socket: str):
    """Output that is linked to the input of a node in nested groups, led out to the tree; None without a link."""
    around = []
    for name in groups:
        around.append((tree, tree.nodes[name]))
        tree = tree.nodes[name].node_tree
    # The add-on is not registered here: its node is of an unknown type.
    links = (link for link in tree.links if link.to_node == tree.nodes[node] and link.to_socket.name == socket)
    source = next((link.from_socket for link in links), None)
    for outer, group in reversed(around if source is not None else []):
        add_output(tree, socket)
        for end in [inner for inner in tree.nodes if inner.type == "GROUP_OUTPUT"]:
            tree.links.new([inner for inner in end.inputs if inner.name == socket][-1], source)
        source = [output for output in group.outputs if output.name == socket][-1]
        tree = outer
    return source


def add_output(tree, name: str) -> None:
    compat.add_output_socket(tree, "NodeSocketColor", name)
    if not any(node.type == "GROUP_OUTPUT" for node in tree.nodes):
        tree.nodes.new("NodeGroupOutput")


def within_one(tree, source):
    """Color clipped to 0..1: a brighter one would reflect more light than arrives."""
    for operation, limit in (("MINIMUM", 1.0), ("MAXIMUM", 0.0)):
        cut = tree.nodes.new("ShaderNodeVectorMath")
        cut.operation = operation
        cut.inputs[1].default_value = (limit,) * 3
        tree.links.new(cut.inputs[0], source)
        source = cut.outputs[0]
    return source


def shine_alone(scene, names) -> None:
    """Switch off all light but that of these objects, which the caller knows to be linked to the receiver."""
    scene.world = None
    for name in names:
        linking = compat.light_linking(bpy.data.objects[name])
        if linking is not None:
            linking.receiver_collection = None
    shining = {slot.material for name in names for slot in bpy.data.objects[name].material_slots}
    for obj in bpy.data.objects:  # collections instance objects that are not in the scene
        if obj.type == "LIGHT" and obj.name not in names:
            obj.hide_render = True
    trees = [material.node_tree for material in bpy.data.materials if material.node_tree and material not in shining]
    for tree in [*trees, *bpy.data.node_groups]:
        is_used = any(
            tree is getattr(node, "node_tree", None)
            for material in shining
            if material
            for node in material.node_tree.nodes
        )
        for node in () if is_used else tree.nodes:
            for socket in node.inputs if node.type in {"EMISSION", "BSDF_PRINCIPLED"} else ():
                if socket.name in {"Strength", "Emission Strength"}:
                    for link in list(socket.links):
                        tree.links.remove(link)
                    socket.default_value = 0.0


def without_limits(scene) -> None:
    """Set Cycles to use neither clamps and exposure nor anything that stops early."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
    cycles.film_exposure = 1.0
    cycles.time_limit = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0


def set_up(scene, light) -> None:
    """Set Cycles to the artist's materials and bounces, for mirrors instead of a diffuse surface."""
    without_limits(scene)
    cycles = scene.cycles
    # The mirror replaces a diffuse surface: it takes a glossy bounce instead of a diffuse one.
    cycles.glossy_bounces += 1
    cycles.diffuse_bounces -= 1
    for obj in bpy.data.objects:
        # Mirrors would count lamps behind transparent surfaces as indirect light.
        obj.visible_glossy = obj.visible_diffuse and not (light == "INDIRECT" and obj.type == "LIGHT")
    if light == "INDIRECT" and scene.world is not None:
        scene.world.cycles_visibility.glossy = False


class Mean:
    """Mean of bakes of one image, weighted by samples. A texel in ten thousand may be NaN: its other bakes count."""

    def __init__(self) -> None:
        self._total, self._samples = 0.0, 0.0

    def add(self, pixels, samples: int) -> None:
        self._total = self._total + np.nan_to_num(samples * pixels, nan=0.0)
        self._samples = self._samples + samples * np.isfinite(pixels)

    def values(self) -> np.ndarray:
        return np.float32(self._total / np.maximum(self._samples, 1))


class Baker:
    """Bakes the ghost, any number of times."""

    def __init__(self, scene, ghost, image, kind, light="") -> None:
        self.scene, self.ghost, self.image, self.kind, self.light = scene, ghost, image, kind, light
        self.rounds = 0
        view_layer = bpy.context.view_layer
        view_layer.update()  # else the ghost can't be selected
        for obj in view_layer.objects:
            obj.select_set(obj == ghost)
        view_layer.objects.active = ghost
        self.options = {"margin": 0, "use_clear": True, "use_selected_to_active": False, "target": "IMAGE_TEXTURES"}
        if "view_from" in bpy.ops.object.bake.get_rna_type().properties:
            self.options["view_from"] = "ABOVE_SURFACE"

    def bake(self, samples: int) -> np.ndarray:
        """Pixels of the image, float32 (height, width, 3), NaN included."""
        self.rounds += 1
        draw_anew(self.ghost, self.rounds)
        self.scene.cycles.seed, self.scene.cycles.samples = self.rounds, samples
        if self.light == "INDIRECT" and compat.indirect_bakes_lack_lamps():
            # With the same seed both bakes follow the same paths, so direct light cancels without noise.
            return self.bake_passes({"DIRECT", "INDIRECT"}) - self.bake_passes({"DIRECT"})
        return self.bake_passes({self.light})

    def bake_passes(self, passes: set) -> np.ndarray:
        """Pixels of one bake with the current settings; infinity becomes NaN."""
        bpy.ops.object.bake(type=self.kind, pass_filter=passes, **self.options)
        values = np.empty(len(self.image.pixels), np.float32)
        self.image.pixels.foreach_get(values)
        pixels = values.reshape(self.image.size[1], self.image.size[0], self.image.channels)[..., :3]
        return np.where(np.isfinite(pixels), pixels, np.nan)


def split(request, pixels) -> list:
    """Parts (K, rows, columns, 3) of the image, for each chart."""
    parts, row, count = [], 0, len(request["strata"])
    for chart in request["charts"]:
        columns, rows = chart["nodes"]
        block = pixels[row : row + rows, : count * columns].reshape(rows, count, columns, 3)
        parts.append(np.ascontiguousarray(block.transpose(1, 0, 2, 3)))
        row += rows
    return parts


def mean_radiance(request, pixels) -> np.ndarray:
    """Cosine-weighted mean radiance over the hemisphere, for each node."""
    _, reach, _, part = np.transpose(request["strata"])
    return np.concatenate(
        [np.tensordot(reach * part, values.mean(axis=3), 1).ravel() for values in split(request, pixels)]
    )


def allowed_noise(request, irradiance: float) -> float:
    """Allowed noise of the irradiance, relative to it; it grows with the direct light beside it."""
    low, high = request["noise"]
    if irradiance <= 0:
        return high
    return float(np.clip(request["noise_of_all"] * (1 + request["direct"] / irradiance), low, high))


def noise_of(request, first, second) -> float:
    """Relative noise of the irradiance in one round, from the difference of two."""
    first, second = mean_radiance(request, first), mean_radiance(request, second)
    total = (first + second).mean() / 2
    return float(np.sqrt(((first - second) ** 2 / 2).mean()) / total) if total > 0 else 0.0
