"""The light of a scene. A new kind is a function here, its line in `READERS`, and its class in core."""

from __future__ import annotations

import numpy as np

from ...core.scene.illumination import Illumination
from ...core.scene.lights import Light, PointLight, SpotLight, SunLight
from .. import compat
from .occluders import OccluderReader
from .visible import render_visible_names, renders


def _sun(_data, axes: np.ndarray, common: tuple) -> SunLight:
    with np.errstate(invalid="ignore"):  # a scale of zero; see Light.fault
        travel = -axes[:3, 2] / np.linalg.norm(axes[:3, 2])
    return SunLight(*common, tuple(travel.tolist()))


def _point(_data, axes: np.ndarray, common: tuple) -> PointLight:
    return PointLight(*common, tuple(axes[:3, 3].tolist()))


def _spot(data, axes: np.ndarray, common: tuple) -> SpotLight:
    frame = tuple(tuple(row) for row in axes[:3, :3].T.tolist())
    cone = frame, data.spot_size, data.spot_blend, compat.spot_falloff()
    return SpotLight(*common, tuple(axes[:3, 3].tolist()), *cone)


# By Blender's type: (light data, matrix to the world, name, strength, color and shadow) -> Light.
READERS = {"SUN": _sun, "POINT": _point, "SPOT": _spot}


def read_illumination(depsgraph) -> Illumination:
    """Lights and shadow casters of all objects and instances that render."""
    visible = render_visible_names(depsgraph.view_layer)
    lights, warnings, occluders = [], [], OccluderReader()
    for instance in depsgraph.object_instances:
        if not renders(instance, visible):
            continue
        obj = instance.object
        if obj.type == "LIGHT":
            lights.append(_read_light(obj, instance.matrix_world, warnings))
        else:
            occluders.add(instance)
    return Illumination(
        [light for light in lights if light is not None],
        occluders.occluders(),
        tuple(dict.fromkeys(warnings + occluders.warnings)),
        compat.transparent_bounces(depsgraph.scene),
    )


def _read_light(obj, matrix, warnings: list[str]) -> Light | None:
    """The light, or None if it is dark or left out; `warnings` then has a sentence that says so."""
    data = obj.data
    strength, color = compat.light_strength(data), compat.light_color(data)
    if data.use_nodes and data.node_tree is not None:
        factor, node_color, understood = _nodes(data.node_tree)
        if not understood:
            warnings.append(f"The nodes of the light '{obj.name}' are not understood: only its plain light counts.")
        strength *= factor
        color = tuple(a * b for a, b in zip(color, node_color))
    if strength == 0 or not any(color):
        return None
    if data.type not in READERS:
        kinds = ", ".join(READERS).lower()
        left_out = f"The {data.type.lower()} light '{obj.name}' is left out"
        warnings.append(f"{left_out}: only lights of these kinds can be baked so far: {kinds}.")
        return None
    common = obj.name, strength, color, compat.light_casts_shadow(data)
    light = READERS[data.type](data, np.array(matrix, dtype=float), common)
    fault = light.fault()
    if fault:
        warnings.append(f"The light '{obj.name}' is left out: {fault}.")
        return None
    return light


def _nodes(tree) -> tuple[float, tuple[float, float, float], bool]:
    """Strength and colour that a light's nodes multiply it with, and whether they were understood."""
    plain = 1.0, (1.0, 1.0, 1.0), False
    output = tree.get_output_node("ALL")
    if output is None or not output.inputs["Surface"].is_linked:
        return 0.0, (0.0, 0.0, 0.0), True
    emission = output.inputs["Surface"].links[0].from_node
    if emission.bl_idname != "ShaderNodeEmission":
        return plain
    color, strength = emission.inputs["Color"], emission.inputs["Strength"]
    if color.is_linked or strength.is_linked:
        return plain
    return float(strength.default_value), tuple(color.default_value)[:3], True
