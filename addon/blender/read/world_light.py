"""The world as light: a panorama of what its nodes give in every direction."""

from __future__ import annotations

import numpy as np

from ...core.scene.lights import WorldLight
from .. import compat
from .image_texture import NotUnderstoodError
from .node_links import Wanted
from .places import ON_NO_PATH, Places
from .shaders import radiance, surface_of
from .textures import MOST_WIDE, Images

# Of worlds whose nodes give every direction a value of its own: a quarter of a degree per texel.
WIDTH, HEIGHT = 1440, 720
# Rows that are evaluated together, which bounds the memory.
ROWS = 64


def read_world(view_layer, world, images: Images) -> tuple[WorldLight | None, str]:
    """The light of a world, or None if it is dark or there is none; and why only Cycles knows how it shines, if so."""
    if world is None or not view_layer.use_sky or not world.cycles_visibility.diffuse:
        return None, ""
    if not compat.uses_nodes(world):
        return _even(world.name, np.array(world.color)), ""
    surface = surface_of(world.node_tree)
    if surface is None:
        return None, ""
    try:
        return _panorama(world.name, surface, images), ""
    except NotUnderstoodError as error:
        return None, str(error)


def _even(name: str, color: np.ndarray) -> WorldLight | None:
    """The same light from everywhere."""
    if not color.any():
        return None
    return WorldLight(name, 1.0, tuple(color.tolist()), True, np.ones((1, 1, 3), np.float32), _rows(np.eye(3)))


def _rows(matrix: np.ndarray) -> tuple:
    return tuple(tuple(row) for row in matrix.tolist())


def _panorama(name: str, surface: Wanted, images: Images) -> WorldLight | None:
    probes = np.concatenate([np.eye(3), directions(3, 2, slice(None))])
    places = _places(images, probes)
    places.lookups = []
    light = radiance(places, surface)
    if light.ndim == 1:
        return _even(name, light)
    to_image, width, height = _finest(places.lookups, probes)
    texels = np.empty((height, width, 3), np.float32)
    for first in range(0, height, ROWS):
        rows = slice(first, first + ROWS)
        # Rows of the matrix are the image's axes in the world.
        towards = directions(width, height, rows) @ to_image
        light = radiance(_places(images, towards), surface)
        texels[rows] = light.reshape(-1, width, 3) if light.ndim > 1 else light
    if not texels.any():
        return None
    return WorldLight(name, 1.0, (1.0, 1.0, 1.0), True, _without_noise(texels), _rows(to_image.T))


def _finest(lookups: list, probes: np.ndarray) -> tuple[np.ndarray, int, int]:
    """The turn from the world to the finest image that is looked up turned alone, and the panorama's size.

    In that image's frame the panorama's texels are the image's own: a sun of one texel keeps its place and its power.
    """
    turn, own_width, own_height = np.eye(3), 0, 0
    for pixels, towards in lookups:
        matrix = towards[:3].T
        is_turn = np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-5) and np.linalg.det(matrix) > 0
        if is_turn and np.allclose(probes @ matrix.T, towards, atol=1e-5) and pixels.shape[1] > own_width:
            turn, (own_height, own_width) = matrix, pixels.shape[:2]
    if not own_width:
        return turn, *((MOST_WIDE, MOST_WIDE // 2) if lookups else (WIDTH, HEIGHT))
    # Cycles is linear between the texels of a coarse image.
    return turn, own_width * -(-WIDTH // own_width), own_height * -(-HEIGHT // own_height)


def directions(width: int, height: int, rows: slice) -> np.ndarray:
    """Unit vectors (N, 3) to the centres of some rows of an equirectangular image; see `WorldLight`."""
    azimuth = np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    elevation = np.pi * ((np.arange(height)[rows] + 0.5) / height - 0.5)
    towards = np.empty((len(elevation), width, 3))
    towards[..., 0] = np.cos(elevation)[:, None] * np.cos(azimuth)
    towards[..., 1] = np.cos(elevation)[:, None] * np.sin(azimuth)
    towards[..., 2] = np.sin(elevation)[:, None]
    return towards.reshape(-1, 3)


def _places(images: Images, towards: np.ndarray) -> Places:
    """Seen by a diffuse surface in these directions, of which a world's nodes know only the direction."""
    one = np.ones(1)
    places = {
        ("ShaderNodeTexCoord", "Generated"): towards,
        ("ShaderNodeTexCoord", "Normal"): -towards,
        ("ShaderNodeNewGeometry", "Position"): towards,
        ("ShaderNodeNewGeometry", "Normal"): -towards,
        ("ShaderNodeNewGeometry", "Incoming"): -towards,
    }
    path = {("ShaderNodeLightPath", name): one for name in ("Is Diffuse Ray", "Is Reflection Ray")}
    return Places(ON_NO_PATH | places | path, images)


def _without_noise(texels: np.ndarray) -> np.ndarray:
    """Files of HDRIs have a few values just below 0, of resampling; more of them are a fault that the light names."""
    below = np.minimum(texels, 0)
    return np.maximum(texels, 0) if -below.sum(dtype=float) < 1e-3 * texels.sum(dtype=float) else texels
