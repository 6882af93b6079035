"""Blender's lamps. A new kind is a function here and its line in `READERS`."""

from __future__ import annotations

import math

import numpy as np

from ...core.errors import NotSupportedError
from ...core.scene.lights import (
    AreaLight,
    Light,
    PointLight,
    SpotLight,
    SunLight,
)
from .. import compat
from .nodes import surface_of
from .shading import ShadingPoints


def _frame(axes: np.ndarray) -> tuple:
    return tuple(tuple(row) for row in axes[:3, :3].T.tolist())


def _position(axes: np.ndarray) -> tuple:
    return tuple(axes[:3, 3].tolist())


def _sun(data, axes: np.ndarray, common: tuple) -> Light:
    with np.errstate(invalid="ignore"):  # a scale of zero; see Light.fault
        travel = -axes[:3, 2] / np.linalg.norm(axes[:3, 2])
    return SunLight(*common, tuple(travel.tolist()), data.angle, compat.sun_disk())


def _point(data, axes: np.ndarray, common: tuple) -> Light:
    return PointLight(*common, _position(axes), data.shadow_soft_size, compat.round_lamp_shape(data))


def _spot(data, axes: np.ndarray, common: tuple) -> Light:
    cone = _frame(axes), data.spot_size, data.spot_blend, compat.spot_falloff()
    return SpotLight(*common, _position(axes), *cone, data.shadow_soft_size, compat.round_lamp_shape(data))


def _area(data, axes: np.ndarray, common: tuple) -> Light:
    size_y = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    is_round = data.shape in ("DISK", "ELLIPSE")
    if not axes[:3, 2].any() and compat.flat_area_lamps_shine():
        axes[:3, 2] = np.cross(axes[:3, 0], axes[:3, 1])
    name, strength, *rest = common
    brighter = name, strength * compat.area_lamp_factor(), *rest
    return AreaLight(*brighter, _position(axes), _frame(axes), data.size, size_y, is_round, data.spread)


# Functions of the light data, the matrix to the world, and (name, strength, color, shadow), by Blender's type.
READERS = {"SUN": _sun, "POINT": _point, "SPOT": _spot, "AREA": _area}


def is_portal(data) -> bool:
    """True for a lamp that only guides Cycles to the light of the world."""
    return data.type == "AREA" and data.cycles.is_portal


def fault(light: Light) -> str:
    """The sentence that says why a light can't be baked; a spot's cone depends on the lamp's scale."""
    if isinstance(light, SpotLight) and np.linalg.matrix_rank(light.frame) < 3:
        return f"The scale of '{light.name}' is 0."
    return light.fault()


def read_lamp(obj, matrix) -> tuple[Light | None, NotSupportedError | None]:
    """The light, None if it is dark, and the reason why its nodes are ignored, if so."""
    data, axes = obj.data, np.array(matrix, dtype=float)
    color, reason = np.array(compat.light_color(data)), None
    if compat.lamp_uses_nodes(data):
        surface = surface_of(data.node_tree)
        try:
            color = color * (0 if surface is None else ShadingPoints().value(surface))
        except NotSupportedError as error:
            reason = error
    strength = compat.light_strength(data) * _area_factor(data, axes)
    if strength == 0 or not color.any():
        return None, None
    common = obj.name, strength, tuple(color.tolist()), compat.light_casts_shadow(data)
    return READERS[data.type](data, axes, common), reason


def _area_factor(data, axes: np.ndarray) -> float:
    """Factor of a light without `normalize` (Blender 4.5 on): its area as measured in Cycles."""
    if getattr(data, "normalize", True):
        return 1.0
    if data.type == "SUN":
        return math.pi * math.sin(0.5 * data.angle) ** 2 or 1.0
    if data.type == "AREA":
        size_y = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
        part = 0.25 * math.pi if data.shape in ("DISK", "ELLIPSE") else 1.0
        return part * data.size * size_y * math.prod(np.linalg.norm(axes[:3, :2], axis=0))
    # A lamp without a radius has one watt per steradian and square meter.
    return 4 * math.pi * data.shadow_soft_size**2 or 4.0
