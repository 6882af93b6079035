"""Radiance of the world by direction, rendered by an equirectangular camera in an empty scene.

Part of the child process (child.py).
"""

import math
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

from .. import compat

# Outputs of Light Path nodes for light on a receiver. Cycles sets no flag when it samples the world, and those of a
# diffuse ray else.
LIGHT_PATH = {"Is Diffuse Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0}

# Progress in the status text of engines.
SAMPLES = re.compile(r"\bSample (\d+)/(\d+)")

# Side in texels of tiles, and the number of tiles with the largest range of radiance, as around a sun of few texels,
# that are rendered again with more samples.
TILE, TILES = 32, 12

# Fraction of the time that the whole panorama takes; its uneven tiles take the rest.
FIRST_SHARE = 0.7

# Rows of a panorama without detail, at least, and the fraction of its light that may change its texel at each step
# toward that. More rows and less change: slower bakes.
MIN_HEIGHT, MAX_LOSS = 256, 5e-3

# Nodes of worlds without detail, models of the sky that have no sun, and how many times a panorama of such a world is
# smaller. Larger: faster, less exact.
SMOOTH_NODES = {"OUTPUT_WORLD", "BACKGROUND", "TEX_SKY", "RGB", "VALUE"}
SMOOTH_SKIES = {"PREETHAM", "HOSEK_WILKIE"}
SMALLER = 4


def panorama(request, scene, progress) -> dict:
    """Task `world`; the request has width, height, samples and fine_samples."""
    world = compat.original_world(bpy.context.view_layer, scene)
    size = request["width"], request["height"]
    if world is None or not lights_diffuse(world):
        return {"radiance": np.zeros((size[1], size[0], 3), np.float32)}
    for tree in trees_of(world):
        fix_light_path(tree)
    without_volume(world)
    studio = bpy.data.scenes.new("Studio")
    studio.world = world
    studio.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    set_up(studio, *size)
    if is_smooth(world):
        smaller = smooth_panorama(studio, request["samples"])
        if smaller is not None:
            return {"radiance": smaller}
    with counting_samples(lambda done: progress(FIRST_SHARE * done)):
        progress(f"span 0.0 {FIRST_SHARE}")  # the parent counts the samples that Cycles prints before Blender 5.0
        radiance = render(studio, request["samples"])
    progress(FIRST_SHARE)
    tiles = uneven_tiles(radiance)
    for number, (row, column) in enumerate(tiles):
        refine(studio, radiance, row, column, request["fine_samples"])
        progress(FIRST_SHARE + (1 - FIRST_SHARE) * (number + 1) / len(tiles))
    return {"radiance": coarsened(radiance)}


@contextmanager
def counting_samples(progress) -> Iterator[None]:
    """Call `progress` with the finished fraction of the samples that Cycles reports to handlers (Blender 5.0 on)."""

    def count(text, *_) -> None:
        if isinstance(text, str) and (match := SAMPLES.search(text)):
            progress(int(match[1]) / max(int(match[2]), 1))

    bpy.app.handlers.render_stats.append(count)
    try:
        yield
    finally:
        bpy.app.handlers.render_stats.remove(count)


def lights_diffuse(world) -> bool:
    """True if the world is visible to diffuse surfaces."""
    visibility = getattr(world, "cycles_visibility", None)
    return bool(getattr(visibility, "diffuse", True))


def trees_of(world) -> list:
    """The world's node tree and the groups in it."""
    trees, waiting = [], [world.node_tree] if world.node_tree else []
    while waiting:
        tree = waiting.pop()
        if tree not in trees:
            trees.append(tree)
            waiting += [node.node_tree for node in tree.nodes if getattr(node, "node_tree", None)]
    return trees


def is_smooth(world) -> bool:
    """True if no node of the world shows detail."""
    nodes = [node for tree in trees_of(world) for node in tree.nodes]
    return all(
        node.type in SMOOTH_NODES and (node.type != "TEX_SKY" or node.sky_type in SMOOTH_SKIES) for node in nodes
    )


def smooth_panorama(studio, samples: int) -> np.ndarray | None:
    """Radiance of a world without detail, from a smaller panorama; None if that would lose light."""
    settings = studio.render
    size = settings.resolution_x, settings.resolution_y
    settings.resolution_x, settings.resolution_y = (side // SMALLER for side in size)
    if settings.resolution_y > MIN_HEIGHT:
        radiance = coarsened(render(studio, samples))
        if len(radiance) < settings.resolution_y:  # the smaller panorama is still finer than it need be
            return radiance
    settings.resolution_x, settings.resolution_y = size
    return None


def fix_light_path(tree) -> None:
    """Replace Light Path nodes by their values for a ray of a diffuse surface, since camera rays render the world."""
    for node in [node for node in tree.nodes if node.bl_idname == "ShaderNodeLightPath"]:
        for socket in node.outputs:
            for target in [link.to_socket for link in socket.links]:
                value = tree.nodes.new("ShaderNodeValue")
                value.outputs[0].default_value = LIGHT_PATH.get(socket.name, 0.0)
                tree.links.new(target, value.outputs[0])
        tree.nodes.remove(node)


def without_volume(world) -> None:
    """Remove the world's volume, which would hide the background."""
    for node in world.node_tree.nodes if world.node_tree else ():
        if node.bl_idname == "ShaderNodeOutputWorld":
            for link in list(node.inputs["Volume"].links):
                world.node_tree.links.remove(link)


def set_up(studio, width: int, height: int) -> None:
    """Set up a panoramic camera and linear EXR output."""
    data = bpy.data.cameras.new("Panorama")
    compat.set_panorama(data)
    camera = bpy.data.objects.new("Panorama", data)
    # Upright, along +X: the image then equals an environment texture.
    camera.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
    studio.collection.objects.link(camera)
    studio.camera = camera
    render_settings, cycles = studio.render, studio.cycles
    render_settings.engine = "CYCLES"
    render_settings.resolution_x, render_settings.resolution_y = width, height
    render_settings.resolution_percentage = 100
    render_settings.film_transparent = False
    render_settings.use_compositing = render_settings.use_sequencer = False
    render_settings.image_settings.file_format = "OPEN_EXR"
    render_settings.image_settings.color_mode = "RGB"
    render_settings.image_settings.color_depth = "32"
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.use_auto_tile = False  # tiles go through a file, which takes as long as the panorama, and hide the samples
    cycles.film_exposure = 1.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.pixel_filter_type = "BOX"
    cycles.max_bounces = 0


def render(studio, samples: int) -> np.ndarray:
    """Radiance, float32 (height, width, 3), row 0 at the bottom; with a render border, only the part in it."""
    studio.cycles.samples = samples
    with tempfile.TemporaryDirectory() as folder:
        studio.render.filepath = str(Path(folder) / "world.exr")
        bpy.ops.render.render(write_still=True, scene=studio.name)
        image = bpy.data.images.load(studio.render.filepath)
        image.colorspace_settings.name = "Non-Color"
        values = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(values)
        radiance = values.reshape(image.size[1], image.size[0], image.channels)[..., :3].copy()
        bpy.data.images.remove(image)
    return np.nan_to_num(radiance, nan=0.0, posinf=0.0, neginf=0.0)


def coarsened(radiance: np.ndarray) -> np.ndarray:
    """The radiance with means of 2 x 2 texels, as often as they hardly differ from the texels."""
    while min(radiance.shape[:2]) > MIN_HEIGHT:
        height, width, _ = radiance.shape
        solid = np.sin((np.arange(height) + 0.5) / height * np.pi).astype(np.float32)
        blocks = radiance.reshape(height // 2, 2, width // 2, 2, 3)
        means = blocks.mean(axis=(1, 3))
        lost = np.abs(blocks - means[:, None, :, None]).sum(axis=(2, 3, 4)).ravel() @ solid
        if lost > MAX_LOSS * (radiance.sum(axis=(1, 2)) @ solid):
            break
        radiance = means
    return radiance


def uneven_tiles(radiance: np.ndarray) -> list:
    """First row and column of the tiles in which few samples may miss most of the light."""
    height, width, _ = radiance.shape
    rows, columns = height // TILE, width // TILE
    if not rows or not columns:
        return []
    solid = np.sin((np.arange(height) + 0.5) / height * np.pi)[:, None]
    weighted = radiance.mean(axis=2) * solid
    tiles = weighted[: rows * TILE, : columns * TILE].reshape(rows, TILE, columns, TILE)
    spread = np.ptp(tiles, axis=(1, 3))
    # In these tiles the error of a texel may be a thousandth of all light.
    worst = [
        index for index in np.argsort(spread, axis=None)[::-1][:TILES] if spread.flat[index] > 1e-4 * weighted.sum()
    ]
    return [(int(index) // columns * TILE, int(index) % columns * TILE) for index in worst]


def refine(studio, radiance: np.ndarray, row: int, column: int, samples: int) -> None:
    """Render one tile again, in place."""
    height, width, _ = radiance.shape
    settings = studio.render
    settings.use_border = settings.use_crop_to_border = True
    settings.border_min_x, settings.border_max_x = column / width, (column + TILE) / width
    settings.border_min_y, settings.border_max_y = row / height, (row + TILE) / height
    tile = render(studio, samples)
    if tile.shape[:2] != (TILE, TILE):
        raise RuntimeError(f"a tile of {TILE} texels came as {tile.shape}")
    radiance[row : row + TILE, column : column + TILE] = tile
