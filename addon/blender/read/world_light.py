"""Light of the world: a panorama of the radiance from each direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...core.errors import NotSupportedError
from ...core.scene.lights import WorldLight
from ...core.scene.lights.sky_sun import directions
from .. import compat
from .image_nodes import MAX_WIDTH, Images
from .nodes import InputSocket, Links, surface_of
from .shading import ON_NO_PATH, ShadingPoints

# Size in texels of a panorama without images: a quarter of a degree per texel.
WIDTH, HEIGHT = 1440, 720
# Rows that are evaluated together; more take more memory.
ROWS = 64


Keep = Callable[[InputSocket, Callable[[], WorldLight | None]], WorldLight | None]
"""Returns the light of a color, which it reads by the function unless the nodes before the color are as before."""


def read_world(
    view_layer,
    world,
    images: Images,
    check: Callable[[], None] | None = None,
    keep: Keep = lambda _color, read: read(),
) -> tuple[WorldLight | None, NotSupportedError | None]:
    """Light of a world, None if there is none or it is dark, and the reason why it is left out, if so.

    A background of constant strength keeps its panorama while the strength changes.
    """
    if world is None or not view_layer.use_sky or not world.cycles_visibility.diffuse:
        return None, None
    if not compat.uses_nodes(world):
        return _even(world.name, np.array(world.color)), None
    surface = surface_of(world.node_tree)
    if surface is None:
        return None, None
    strength, wanted = _strength_and_color(surface)
    try:
        light = keep(wanted, lambda: _panorama(world.name, wanted, images, check))
        return light and replace(light, name=world.name, strength=strength), None
    except NotSupportedError as error:
        return None, error.with_traceback(None)


def _strength_and_color(surface: InputSocket) -> tuple[float, InputSocket]:
    """Strength and color of a background whose strength is a number; 1 and the surface itself for all others."""
    source = Links().source(surface)
    if source.node.bl_idname != "ShaderNodeBackground":
        return 1.0, surface
    strength, color = source.input("Strength"), source.input("Color")
    if strength.socket.is_linked or not color.socket.is_linked or not strength.socket.default_value > 0:
        return 1.0, surface
    return strength.socket.default_value, color


def _even(name: str, color: np.ndarray) -> WorldLight | None:
    """Light of one radiance from all directions."""
    if not color.any():
        return None
    return WorldLight(name, 1.0, tuple(color.tolist()), True, np.ones((1, 1, 3), np.float32), _rows(np.eye(3)))


def _rows(matrix: np.ndarray) -> tuple:
    return tuple(tuple(row) for row in matrix.tolist())


def _panorama(name: str, surface: InputSocket, images: Images, check: Callable[[], None] | None) -> WorldLight | None:
    probes = np.concatenate([np.eye(3), directions(3, 2, slice(None))])
    points = _points(images, probes, check)
    points.lookups = []
    light = points.value(surface)
    if light.ndim == 1:
        return _even(name, light)
    to_image, width, height = _finest(points.lookups, probes)
    texels = np.empty((height, width, 3), np.float32)
    for first in range(0, height, ROWS):
        rows = slice(first, first + ROWS)
        # Rows of the matrix are the image's axes in the world.
        towards = directions(width, height, rows) @ to_image
        light = _points(images, towards, check).value(surface)
        texels[rows] = light.reshape(-1, width, 3) if light.ndim > 1 else light
    if not texels.any():
        return None
    return WorldLight(name, 1.0, (1.0, 1.0, 1.0), True, _without_noise(texels), _rows(to_image.T))


def _finest(lookups: list, probes: np.ndarray) -> tuple[np.ndarray, int, int]:
    """Rotation from the world to the finest image that is rotated and nothing else, and the panorama's size.

    In the frame of that image the panorama has the image's texels, so that a sun of one texel keeps its power.
    """
    rotation, width, height = np.eye(3), 0, 0
    for pixels, towards in lookups:
        matrix = towards[:3].T
        is_rotation = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-5) and np.linalg.det(matrix) > 0
        if is_rotation and np.allclose(probes @ matrix.T, towards, atol=1e-5) and pixels.shape[1] > width:
            rotation, (height, width) = matrix, pixels.shape[:2]
    if not width:
        return rotation, *((MAX_WIDTH, MAX_WIDTH // 2) if lookups else (WIDTH, HEIGHT))
    # Cycles interpolates between the texels of a coarse image.
    return rotation, width * -(-WIDTH // width), height * -(-HEIGHT // height)


def _points(images: Images, towards: np.ndarray, check: Callable[[], None] | None) -> ShadingPoints:
    """Points in these directions as a diffuse surface sees them; a world's nodes know only the direction."""
    outputs = {
        ("ShaderNodeTexCoord", "Generated"): towards,
        ("ShaderNodeTexCoord", "Normal"): -towards,
        ("ShaderNodeNewGeometry", "Position"): towards,
        ("ShaderNodeNewGeometry", "Normal"): -towards,
        ("ShaderNodeNewGeometry", "Incoming"): -towards,
    }
    path = {("ShaderNodeLightPath", name): np.ones(1) for name in ("Is Diffuse Ray", "Is Reflection Ray")}
    return ShadingPoints(ON_NO_PATH | outputs | path, images, check=check)


def _without_noise(texels: np.ndarray) -> np.ndarray:
    """Texels not below 0: resampled HDRIs have a few such values. More of them stay, and the light reports them."""
    below = np.minimum(texels, 0)
    return np.maximum(texels, 0) if -below.sum(dtype=float) < 1e-3 * texels.sum(dtype=float) else texels
