"""What arrives at coarse grids on planes, by direction, path traced by Cycles with the artist's materials.

Part of the child process (child.py).
"""

import traceback

import bpy
import compat
import numpy as np
from child_denoise import Denoiser
from child_ghost import add_ghost, draw_anew

# Samples per node and stratum of the first two rounds, from which the noise follows. Later rounds take twice as many
# as the one before, since each prepares the scene anew. Nothing depends on how long it takes, or each run would differ.
LOOK = 4

# How much noisier irradiance may be than it is wanted, where a denoiser follows. Measured in a room and beside a wall,
# 64 x 64 nodes (tests/bench/bounced.py): errors of 7 and 5 % become 2.4 and 2.3 %, and 19, 14 and 10 % 8, 6 and 5 %.
DENOISED = 2.0


def fields(request, scene, progress) -> dict:
    """The task `fields`: radiance_0, radiance_1, ... of the charts, float32 (K, rows, columns, 3), and noise.

    `light` is "INDIRECT" or "DIRECT", `only` names the objects whose light counts, none: all. With `by_lamps` a white
    diffuse surface stands in place of the mirrors, for which Cycles looks for lamps however small; it has one stratum.
    The mean `irradiance`, W/m^2, is that of the first two rounds; there are no others if it is less than the part
    `negligible` of `direct`.

    Radiance is each stratum's mean by the cosine. The noise is that of the irradiance, the root of its mean square over
    all nodes, as part of its mean. What bounces is smooth: a denoiser takes noise out of its irradiance, and strata
    follow in proportion.
    """
    for name, color in request["reflectances"].items():
        material = bpy.data.materials.get(name)
        if material is not None:  # the copy has those that the scene uses
            make_diffuse(material, color, request["textures"].get(name))
    set_up(scene, request["light"])
    if request["only"]:
        shine_alone(scene, request["only"])
    ghost, image = add_ghost(request["charts"], request["strata"], request["by_lamps"])
    scene.collection.objects.link(ghost)
    baker = Baker(scene, ghost, image, "DIFFUSE" if request["by_lamps"] else "GLOSSY", request["light"])
    looks = [baker.bake(LOOK), baker.bake(LOOK)]
    mean, samples, count = Mean(), 2 * LOOK, 2 * LOOK
    for look in looks:
        mean.add(look, LOOK)
    looks = [np.nan_to_num(look) for look in looks]
    found = np.pi * float(np.mean([mean_radiance(request, look) for look in looks]))
    # The mean of both has noise / sqrt(2); it falls by the root of the samples.
    noise = noise_of(request, *looks) / np.sqrt(2)
    denoise = working_denoiser(request, mean) if request["light"] == "INDIRECT" else None
    gain = DENOISED if denoise else 1.0
    allowed = gain * allowed_noise(request, found)
    most = samples if found < request["negligible"] * request["direct"] else request["most_samples"]
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
    result["noise"] = np.array(noise * np.sqrt(2 * LOOK / samples) / gain)
    result["samples"], result["irradiance"] = np.array(samples), np.array(found)
    return result


def working_denoiser(request, mean):
    """None where there is none, or where it fails."""
    if not compat.has_denoiser():
        return None
    try:
        denoise = Denoiser()
        denoise(irradiances(request, split(request, np.maximum(mean.values(), 0))))
    except Exception:  # noqa: BLE001 - more samples do instead, whatever it is
        traceback.print_exc()
        return None
    return denoise


def irradiances(request, parts) -> list:
    """Over pi, of each chart from its strata's radiance."""
    _, reach, _, part = np.transpose(request["strata"])
    return [np.tensordot(np.float32(reach * part), values, 1) for values in parts]


def with_irradiance(request, parts, wanted) -> list:
    """The strata, in each node and channel in proportion."""
    ratios = [
        np.divide(new, old, out=np.zeros_like(old), where=old > 0)
        for new, old in zip(wanted, irradiances(request, parts))
    ]
    return [values * ratio for values, ratio in zip(parts, ratios)]


def make_diffuse(material, color, texture) -> None:
    """A plain diffuse surface, as bright as the medium under it, or as what its texture shows.

    `texture` names an input: the group nodes around a node, the node, the socket. None: there is none.
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
    """What the input of a node in nested groups is linked to, led out to the tree; None if it has no link."""
    around = []
    for name in groups:
        around.append((tree, tree.nodes[name]))
        tree = tree.nodes[name].node_tree
    # The add-on is not at work here: its node is one of an unknown kind.
    links = (one for one in tree.links if one.to_node == tree.nodes[node] and one.to_socket.name == socket)
    source = next((link.from_socket for link in links), None)
    for outer, group in reversed(around if source is not None else []):
        add_output(tree, socket)
        for end in [one for one in tree.nodes if one.type == "GROUP_OUTPUT"]:
            # The last one is empty, for what is to come.
            tree.links.new([one for one in end.inputs if one.name == socket][-1], source)
        source = [one for one in group.outputs if one.name == socket][-1]
        tree = outer
    return source


def add_output(tree, name: str) -> None:
    compat.add_output_socket(tree, "NodeSocketColor", name)
    if not any(node.type == "GROUP_OUTPUT" for node in tree.nodes):
        tree.nodes.new("NodeGroupOutput")


def within_one(tree, source):
    """The colour, from 0 to 1: what is brighter would reflect more than arrives."""
    for operation, limit in (("MINIMUM", 1.0), ("MAXIMUM", 0.0)):
        cut = tree.nodes.new("ShaderNodeVectorMath")
        cut.operation = operation
        cut.inputs[1].default_value = (limit,) * 3
        tree.links.new(cut.inputs[0], source)
        source = cut.outputs[0]
    return source


def shine_alone(scene, names) -> None:
    """Switch off all light but that of these objects; whoever asks for it has seen to it that it is linked there."""
    scene.world = None
    for name in names:
        linking = compat.light_linking(bpy.data.objects[name])
        if linking is not None:
            linking.receiver_collection = None
    own = {slot.material for name in names for slot in bpy.data.objects[name].material_slots}
    for obj in bpy.data.objects:  # instances of collections show others than the scene's
        if obj.type == "LIGHT" and obj.name not in names:
            obj.hide_render = True
    trees = [one.node_tree for one in bpy.data.materials if one.node_tree and one not in own]
    for tree in [*trees, *bpy.data.node_groups]:
        used_by_own = any(
            tree is getattr(node, "node_tree", None) for one in own if one for node in one.node_tree.nodes
        )
        for node in () if used_by_own else tree.nodes:
            for socket in node.inputs if node.type in {"EMISSION", "BSDF_PRINCIPLED"} else ():
                if socket.name in {"Strength", "Emission Strength"}:
                    for link in list(socket.links):
                        tree.links.remove(link)
                    socket.default_value = 0.0


def without_limits(scene) -> None:
    """Cycles without clamps, exposure, or what stops early."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
    cycles.film_exposure = 1.0
    cycles.time_limit = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0


def set_up(scene, light) -> None:
    """The artist's materials and bounces."""
    without_limits(scene)
    cycles = scene.cycles
    # The mirror stands for a diffuse surface: it uses up a glossy bounce in place of a diffuse one.
    cycles.glossy_bounces += 1
    cycles.diffuse_bounces -= 1
    for obj in bpy.data.objects:
        # What mirrors meet of a lamp behind something see-through would count as indirect.
        obj.visible_glossy = obj.visible_diffuse and not (light == "INDIRECT" and obj.type == "LIGHT")
    if light == "INDIRECT" and scene.world is not None:
        scene.world.cycles_visibility.glossy = False


class Mean:
    """Of bakes of one image by their samples. A texel in ten thousand may come as no number: its other bakes count."""

    def __init__(self) -> None:
        self._total, self._samples = 0.0, 0.0

    def add(self, pixels, samples: int) -> None:
        self._total = self._total + np.nan_to_num(samples * pixels, nan=0.0)
        self._samples = self._samples + samples * np.isfinite(pixels)

    def values(self) -> np.ndarray:
        return np.float32(self._total / np.maximum(self._samples, 1))


class Baker:
    """Bakes the ghost again and again."""

    def __init__(self, scene, ghost, image, kind, light="") -> None:
        self.scene, self.ghost, self.image, self.kind, self.light = scene, ghost, image, kind, light
        self.rounds = 0
        view_layer = bpy.context.view_layer
        view_layer.update()  # before, the ghost can't be selected
        for obj in view_layer.objects:
            obj.select_set(obj == ghost)
        view_layer.objects.active = ghost
        self.options = {"margin": 0, "use_clear": True, "use_selected_to_active": False, "target": "IMAGE_TEXTURES"}
        if "view_from" in bpy.ops.object.bake.get_rna_type().properties:
            self.options["view_from"] = "ABOVE_SURFACE"

    def bake(self, samples: int) -> np.ndarray:
        """Float32 (height, width, 3) of the image; NaN where Cycles finds no number."""
        self.rounds += 1
        draw_anew(self.ghost, self.rounds)
        self.scene.cycles.seed, self.scene.cycles.samples = self.rounds, samples
        if self.light == "INDIRECT" and compat.indirect_bakes_lack_lamps():
            # With the same seed both bakes follow the same paths, so direct light cancels without noise.
            return self.bake_passes({"DIRECT", "INDIRECT"}) - self.bake_passes({"DIRECT"})
        return self.bake_passes({self.light})

    def bake_passes(self, passes: set) -> np.ndarray:
        """As the scene is now."""
        bpy.ops.object.bake(type=self.kind, pass_filter=passes, **self.options)
        values = np.empty(len(self.image.pixels), np.float32)
        self.image.pixels.foreach_get(values)
        pixels = values.reshape(self.image.size[1], self.image.size[0], self.image.channels)[..., :3]
        return np.where(np.isfinite(pixels), pixels, np.nan)


def split(request, pixels) -> list:
    """(K, rows, columns, 3) of each chart from the image."""
    parts, row, count = [], 0, len(request["strata"])
    for chart in request["charts"]:
        columns, rows = chart["nodes"]
        block = pixels[row : row + rows, : count * columns].reshape(rows, count, columns, 3)
        parts.append(np.ascontiguousarray(block.transpose(1, 0, 2, 3)))
        row += rows
    return parts


def mean_radiance(request, pixels) -> np.ndarray:
    """Of each node, by the cosine over the hemisphere."""
    _, reach, _, part = np.transpose(request["strata"])
    return np.concatenate(
        [np.tensordot(reach * part, values.mean(axis=3), 1).ravel() for values in split(request, pixels)]
    )


def allowed_noise(request, found: float) -> float:
    """Of the irradiance found, as part of it; where there is much light besides, more of it goes unseen."""
    least, most = request["noise"]
    return float(np.clip(request["noise_of_all"] * (1 + request["direct"] / found), least, most)) if found > 0 else most


def noise_of(request, one, other) -> float:
    """Of the irradiance in `one`, from its difference to `other`."""
    one, other = mean_radiance(request, one), mean_radiance(request, other)
    total = (one + other).mean() / 2
    return float(np.sqrt(((one - other) ** 2 / 2).mean()) / total) if total > 0 else 0.0
