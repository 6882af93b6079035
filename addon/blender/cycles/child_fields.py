"""Light that arrives at coarse nodes on planes and bodies, by direction, path traced by Cycles with the materials.

Part of the child process (child.py).
"""

import math

import bpy
import numpy as np

from .. import compat
from .child_filter import Cloud, Grid, filter_map, insides, smooth
from .child_ghost import add_ghost, draw_anew

# Samples of each half, node and stratum in the first round, which shows how much there is to find. More take longer
# where there is little; the first of a round lies in the middle of its node, so that a single one shows no difference.
FIRST_SAMPLES = 2

# Most samples of a round, relative to all before. Larger values take fewer rounds, each of which builds up the scene
# anew, and overshoot where the first rounds have overestimated the noise.
MAX_GROWTH = 7

# Most samples of a bake, after which there is progress.
MAX_ROUND = 16

# Samples of each half, node and stratum for the strata's parts of an irradiance that is known: without other light, and
# at least. More take longer and leave less noise in directions.
PARTS_SAMPLES, MIN_PARTS_SAMPLES = 8, 2

# Part of the time until that irradiance is known.
TOTALS_PART = 0.5

# Fraction of the unoccluded light below which a surface counts as dim: the number of samples falls in proportion.
# Larger values leave dark surfaces noisier.
DIM = 0.01


def fields(request, scene, progress) -> dict:
    """Task `fields`: radiance_0, radiance_1, ... of the charts, float32 (K, rows, columns, 3), and noise.
    Nodes of bodies are (K, N, 1, 3).

    `light` is "INDIRECT" or "DIRECT". `only` names the objects whose light counts; none: all. With `by_lamps` a white
    diffuse surface of one stratum replaces the mirrors, so that Cycles samples lamps of any size; with
    `totals_by_lamps` it finds the irradiance, and mirrors the strata's parts of it. Light below the fraction
    `negligible` of the unoccluded light `open`, W/m^2, is not refined.

    Radiance is the cosine-weighted mean of each stratum. The noise is the root mean square error of the irradiance over
    the result, which smooths by a Gaussian of `variance` (squared nodes) or as much as one, relative to the mean of all
    irradiance: this one and `direct`, W/m^2. Rounds go on until it is below
    `tolerance`, or until each node and stratum has `most_samples`; their number does not depend on time, so that every
    run gives the same result. The irradiance is filtered, and the strata follow in proportion.
    """
    for name, color in request["reflectances"].items():
        material = bpy.data.materials.get(name)
        if material is not None:  # the copy has only materials that the scene uses
            make_diffuse(material, color, request["textures"].get(name))
    if not request["with_world"]:
        scene.world = None
    set_up(scene, request["light"])
    if request["only"]:
        shine_alone(scene, request["only"])
    if not request["totals_by_lamps"]:
        charts, facts = refine(request, scene, progress)
    else:
        most = len(request["strata"]) * request["most_samples"]
        whole = request | {"strata": [[0.0, 1.0, 0.0, 1.0]], "by_lamps": True, "most_samples": most}
        totals, facts = refine(whole, scene, lambda fraction: progress(TOTALS_PART * fraction))
        # Noise counts against all light.
        share = facts["irradiance"] / max(facts["irradiance"] + request["direct"], 1e-30)
        samples = max(MIN_PARTS_SAMPLES, math.ceil(PARTS_SAMPLES * share**2))
        charts = charts_of(request, baker_of(request, scene).bake(samples))
        for chart, total in zip(charts, totals):
            chart.clean = total.clean
    result = {f"radiance_{n}": chart.radiance() for n, chart in enumerate(charts)}
    return {name: np.asarray(value) for name, value in (result | facts).items()}


def refine(request, scene, progress) -> tuple:
    """The charts once their noise is low enough, and noise, samples and irradiance by these names."""
    baker = baker_of(request, scene)
    mean, samples, count, wanted = Mean(), 0, FIRST_SAMPLES, math.inf
    while True:
        for part in [MAX_ROUND] * (count // MAX_ROUND) + [count % MAX_ROUND] * (count % MAX_ROUND > 0):
            mean.add(baker.bake(part), part)
            samples += part
            progress(samples / max(wanted, samples))
        charts = charts_of(request, mean.values())
        nodes = np.array([chart.clean[..., 0].size for chart in charts])
        irradiance, noise, blur = (
            float(nodes @ values / nodes.sum())
            for values in zip(*((chart.clean.mean(), chart.noise, chart.blur) for chart in charts))
        )
        irradiance *= np.pi
        total = max(irradiance + request["direct"], 1e-30)
        error = np.pi * np.sqrt(noise + blur) / total
        limit = request["most_samples"] / 2 * min(1.0, total / (DIM * request["open"] + 1e-30))
        wanted = min(samples * (error / request["tolerance"]) ** 2, limit)
        if irradiance < request["negligible"] * request["open"] or samples >= wanted:
            break
        count = int(min(np.ceil(wanted) - samples, MAX_GROWTH * samples))
    baker.remove()
    return charts, {"noise": error, "samples": 2 * samples, "irradiance": irradiance}


class Chart:
    """Light on one chart.

    Attributes
    ----------
    clean : irradiance over pi, without noise as far as possible, float32 (rows, columns, 3).
    noise, blur : mean squares of its errors.
    """

    def __init__(self, request, neighbors, first, second) -> None:
        _, reach, _, part = np.transpose(request["strata"])
        halves = [np.tensordot(np.float32(reach * part), values, 1) for values in (first, second)]
        self._radiance = (first + second) / 2
        self._neighbors = neighbors
        self._inside = insides(self._radiance, neighbors)
        self._noisy = (halves[0] + halves[1]) / 2
        self.clean, self.noise, self.blur = filter_map(*halves, self._inside, request["variance"], neighbors)

    def radiance(self):
        """Radiance of the strata, in proportion to the clean irradiance; dark nodes have their neighbors' mean."""
        weights = (~self._inside).astype(np.float32)
        radiance, noisy, lit = self._radiance, self._noisy, self._noisy > 0
        for passes in (1, 4, 16, 64):
            if lit[~self._inside].all():
                break
            wide = np.stack([smooth(values, weights, passes, self._neighbors) for values in self._radiance])
            wide_noisy = smooth(self._noisy, weights, passes, self._neighbors)
            radiance, noisy = np.where(lit, radiance, wide), np.where(lit, noisy, wide_noisy)
            lit = noisy > 0
        return radiance * np.divide(self.clean, noisy, out=np.zeros_like(noisy), where=noisy > 0)


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


def may_glow() -> bool:
    """True if any surface or volume may emit light."""
    waiting = [material.node_tree for material in bpy.data.materials if material.node_tree]
    trees = []
    for tree in waiting:
        trees.append(tree)
        inner = (getattr(node, "node_tree", None) for node in tree.nodes)
        waiting += [group for group in inner if group is not None and group not in waiting]
    return any(_glows(node) for tree in trees for node in tree.nodes)


def _glows(node) -> bool:
    if node.type == "BSDF_PRINCIPLED":
        color = next(node.inputs[name] for name in ("Emission Color", "Emission") if name in node.inputs)
        strength = node.inputs["Emission Strength"]
        is_dark = not color.is_linked and not any(color.default_value[:3])
        return not is_dark and (strength.is_linked or strength.default_value != 0)
    linked = node.type == "OUTPUT_MATERIAL" and node.inputs["Surface"].is_linked
    source = node.inputs["Surface"].links[0].from_socket if linked else None
    return node.type in {"EMISSION", "VOLUME_PRINCIPLED", "SCRIPT", "EEVEE_SPECULAR"} or (
        source is not None and source.type != "SHADER"
    )


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


def baker_of(request, scene):
    """Baker of a new ghost in the scene: of two tiles for each stratum, halves of the samples."""
    ghost, image = add_ghost(request["charts"], [*request["strata"], *request["strata"]], request["by_lamps"])
    scene.collection.objects.link(ghost)
    return Baker(scene, ghost, image, "DIFFUSE" if request["by_lamps"] else "GLOSSY", request["light"])


def charts_of(request, pixels) -> list:
    """The light on each chart, from the pixels of an image."""
    halves = halves_of(request, np.maximum(pixels, 0))
    return [Chart(request, neighbors_of(chart), *pair) for chart, pair in zip(request["charts"], halves)]


def neighbors_of(chart):
    """The neighbors of the nodes of a chart, found once."""
    if "positions" not in chart:
        return Grid()
    if "neighbors" not in chart:
        first = (np.array(chart[name])[:, 0] for name in ("positions", "normals"))
        chart["neighbors"] = Cloud(*first, chart["spacing"])
    return chart["neighbors"]


class Baker:
    """Bakes the ghost, any number of times."""

    def __init__(self, scene, ghost, image, kind, light="") -> None:
        self.scene, self.ghost, self.image, self.kind, self.light = scene, ghost, image, kind, light
        self.rounds, self.may_glow = 0, may_glow()
        view_layer = bpy.context.view_layer
        view_layer.update()  # else the ghost can't be selected
        for obj in view_layer.objects:
            obj.select_set(obj == ghost)
        view_layer.objects.active = ghost
        self.options = {"margin": 0, "use_clear": True, "use_selected_to_active": False, "target": "IMAGE_TEXTURES"}
        if "view_from" in bpy.ops.object.bake.get_rna_type().properties:
            self.options["view_from"] = "ABOVE_SURFACE"

    def remove(self) -> None:
        """Remove the ghost from the scene."""
        bpy.data.objects.remove(self.ghost)

    def bake(self, samples: int) -> np.ndarray:
        """Pixels of the image, float32 (height, width, 3), NaN included."""
        self.rounds += 1
        draw_anew(self.ghost, self.rounds)
        self.scene.cycles.seed, self.scene.cycles.samples = self.rounds, samples
        if self.light == "INDIRECT" and compat.indirect_bakes_lack_lamps() and not self.may_glow:
            return self.bake_passes({"DIRECT", "INDIRECT"})  # mirrors see no other direct light
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


def halves_of(request, pixels) -> list:
    """Both halves of the samples of each chart, (K, rows, columns, 3), from the pixels of the image.

    Nodes of a mesh that bends are (K, N, 1, 3).
    """
    halves, row, count = [], 0, len(request["strata"])
    for chart in request["charts"]:
        columns, rows = chart["nodes"]
        block = pixels[row : row + rows, : 2 * count * columns].reshape(rows, 2, count, columns, 3)
        block = np.ascontiguousarray(block.transpose(1, 2, 0, 3, 4))
        if "positions" in chart:
            block = block.reshape(2, count, -1, 1, 3)[:, :, : len(chart["positions"])]
        halves.append(block)
        row += rows
    return halves
