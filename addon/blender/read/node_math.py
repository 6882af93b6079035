"""Nodes that depend on their inputs alone, by Cycles' formulas.

Each function takes a `Node` (nodes.py) and returns its value, or None for a mode that it does not know.
"""

from __future__ import annotations

import numpy as np

# Weights by which Cycles turns colors into numbers (Rec. 709).
LUMINANCE = np.array((0.2126729, 0.7151522, 0.0721750))


def _safe(function):
    """The function with 0 in place of infinity and NaN, as Cycles' nodes have it."""

    def safe(*values):
        with np.errstate(all="ignore"):
            result = function(*values)
        return np.where(np.isfinite(result), result, 0.0)

    return safe


MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": _safe(np.divide),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": _safe(np.power),
    "LOGARITHM": _safe(lambda a, b: np.log(a) / np.log(b)),
    "SQRT": _safe(np.sqrt),
    "INVERSE_SQRT": _safe(lambda a: a**-0.5),
    "ABSOLUTE": np.abs,
    "EXPONENT": np.exp,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "LESS_THAN": np.less,
    "GREATER_THAN": np.greater,
    "SIGN": np.sign,
    "COMPARE": lambda a, b, c: np.abs(a - b) <= np.maximum(c, 1e-5),
    "ROUND": lambda a: np.floor(a + 0.5),
    "FLOOR": np.floor,
    "CEIL": np.ceil,
    "TRUNC": np.trunc,
    "FRACT": lambda a: a - np.floor(a),
    "MODULO": _safe(np.fmod),
    "SINE": np.sin,
    "COSINE": np.cos,
    "TANGENT": np.tan,
    "ARCSINE": lambda a: np.arcsin(np.clip(a, -1, 1)),
    "ARCCOSINE": lambda a: np.arccos(np.clip(a, -1, 1)),
    "ARCTANGENT": np.arctan,
    "ARCTAN2": np.arctan2,
    "RADIANS": np.radians,
    "DEGREES": np.degrees,
}

VECTOR_MATH = {name: MATH[name] for name in ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD")} | {
    name: MATH[name] for name in ("ABSOLUTE", "MINIMUM", "MAXIMUM", "FLOOR", "CEIL", "SINE", "COSINE", "TANGENT")
}

# (factor, first color, second color) -> color
BLENDS = {
    "MIX": lambda t, a, b: a + t * (b - a),
    "ADD": lambda t, a, b: a + t * b,
    "SUBTRACT": lambda t, a, b: a - t * b,
    "MULTIPLY": lambda t, a, b: a * (1 - t + t * b),
    "SCREEN": lambda t, a, b: 1 - (1 - t + t * (1 - b)) * (1 - a),
    "DIVIDE": lambda t, a, b: np.where(b == 0, a, (1 - t) * a + t * a / np.where(b == 0, 1, b)),
    "DIFFERENCE": lambda t, a, b: a + t * (np.abs(a - b) - a),
    "DARKEN": lambda t, a, b: a + t * (np.minimum(a, b) - a),
    "LIGHTEN": lambda t, a, b: a + t * (np.maximum(a, b) - a),
}


def _number(node):
    """Value and RGB nodes, which keep their value in their output."""
    return np.atleast_1d(np.asarray(node.output.default_value, float))[:3]


def _math(node):
    function = MATH.get(node.node.operation)
    if function is None:
        return None
    arguments = [node[i] for i in range(len(node.node.inputs)) if node.node.inputs[i].enabled]
    return _clamped(function(*arguments), node.node.use_clamp)


def _clamped(value, clamp=True):
    return np.clip(value, 0, 1) if clamp else value


def _vector_math(node):
    operation = node.node.operation
    arguments = [node[i] for i in range(len(node.node.inputs)) if node.node.inputs[i].enabled]
    if operation in VECTOR_MATH:
        return VECTOR_MATH[operation](*arguments)
    first = arguments[0]
    if operation == "SCALE":
        return first * arguments[1]
    if operation == "DOT_PRODUCT":
        return (first * arguments[1]).sum(axis=-1, keepdims=True)
    if operation == "LENGTH":
        return np.linalg.norm(first, axis=-1, keepdims=True)
    if operation == "NORMALIZE":
        return _safe(np.divide)(first, np.linalg.norm(first, axis=-1, keepdims=True))
    return None


def _mix(node):
    """The Mix node of Blender 3.4 on."""
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.node.data_type)
    if kind is None:
        return None
    is_vector_factor = kind == "Vector" and node.node.factor_mode == "NON_UNIFORM"
    factor = _clamped(node["Factor_Vector" if is_vector_factor else "Factor_Float"], node.node.clamp_factor)
    mixed = _blend(node, node.node.blend_type if kind == "Color" else "MIX", factor, f"A_{kind}", f"B_{kind}")
    return mixed if mixed is None else _clamped(mixed, kind == "Color" and node.node.clamp_result)


def _mix_rgb(node):
    """The Mix node of files before Blender 3.4."""
    mixed = _blend(node, node.node.blend_type, _clamped(node[0]), 1, 2)
    return mixed if mixed is None else _clamped(mixed, node.node.use_clamp)


def _blend(node, kind: str, factor, first, second):
    if kind == "MIX" and not (factor.any() and (factor != 1).any()):
        return node[second if factor.any() else first]  # the unused input need not be understood
    return BLENDS[kind](factor, node[first], node[second]) if kind in BLENDS else None


def _map_range(node):
    if node.node.data_type != "FLOAT" or node.node.interpolation_type != "LINEAR":
        return None
    value, from_min, from_max, to_min, to_max = (node[i] for i in range(5))
    result = to_min + MATH["DIVIDE"](value - from_min, from_max - from_min) * (to_max - to_min)
    return np.clip(result, np.minimum(to_min, to_max), np.maximum(to_min, to_max)) if node.node.clamp else result


def _clamp(node):
    low, high = node[1], node[2]
    if node.node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(node[0], low), high)


def _color_ramp(node):
    """Color Ramp, by a table of 256 entries as in Cycles."""
    ramp, steps = node.node.color_ramp, np.linspace(0, 1, 256)
    table = np.array([ramp.evaluate(step) for step in steps])
    table = table[:, 3:] if node.output.name == "Alpha" else table[:, :3]
    factor = _clamped(node[0])
    if ramp.interpolation == "CONSTANT":
        return table[(factor[..., 0] * 255).astype(int)]
    return np.concatenate([np.interp(factor, steps, column) for column in table.T], axis=-1)


def _combine(node):
    if getattr(node.node, "mode", "RGB") != "RGB":
        return None
    return np.concatenate(np.broadcast_arrays(*(node[i] for i in range(3))), axis=-1)


def _separate(node):
    if getattr(node.node, "mode", "RGB") != "RGB":
        return None
    channel = list(node.node.outputs).index(node.output)
    return node[0][..., channel : channel + 1]


def _gamma(node):
    color = node[0]
    return np.where(color > 0, np.power(np.maximum(color, 0), node[1]), color)


def _bright_contrast(node):
    contrast = node[2]
    return np.maximum((1 + contrast) * node[0] + node[1] - 0.5 * contrast, 0)


def _invert(node):
    factor, color = node[0], node[1]
    return factor * (1 - color) + (1 - factor) * color


def _hue_saturation(node):
    """Hue turned, saturation and value scaled, in Smith's hexagonal HSV (1978)."""
    hue, saturation, strength, factor, color = (node[i] for i in range(5))
    peak, low = color.max(axis=-1, keepdims=True), color.min(axis=-1, keepdims=True)
    chroma = np.where(peak > low, peak - low, 1)
    red, green, blue = (color[..., i : i + 1] for i in range(3))
    sector = np.where(
        red == peak,
        (green - blue) / chroma,
        np.where(green == peak, 2 + (blue - red) / chroma, 4 + (red - green) / chroma),
    )
    angle = np.mod(sector / 6 + hue + 0.5, 1) * 6
    purity = np.clip(saturation * _safe(np.divide)(peak - low, peak), 0, 1)
    pure = np.clip(np.abs(np.mod(angle + np.array((0, 4, 2)), 6) - 3) - 1, 0, 1)
    turned = peak * strength * (1 + purity * (pure - 1))
    return np.maximum(color + factor * (turned - color), 0)


def _mapping(node):
    """Mapping: scales, rotates and moves points; Texture does the inverse."""
    kind, vector = node.node.vector_type, node["Vector"]
    angles, scale = node["Rotation"], node["Scale"]
    if angles.ndim > 1:  # differs from point to point
        return None
    rotation = rotation_matrix(angles)
    if kind == "TEXTURE":
        return _safe(np.divide)((vector - node["Location"]) @ rotation, scale)
    if kind == "NORMAL":
        turned = _safe(np.divide)(vector, scale) @ rotation.T
        return _safe(np.divide)(turned, np.linalg.norm(turned, axis=-1, keepdims=True))
    turned = (vector * scale) @ rotation.T
    return turned + node["Location"] if kind == "POINT" else turned


def rotation_matrix(angles) -> np.ndarray:
    """3 x 3 matrix of Blender's Euler angles in radians, about x first."""
    (cos_x, cos_y, cos_z), (sin_x, sin_y, sin_z) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1, 0, 0], [0, cos_x, -sin_x], [0, sin_x, cos_x]])
    about_y = np.array([[cos_y, 0, sin_y], [0, 1, 0], [-sin_y, 0, cos_y]])
    about_z = np.array([[cos_z, -sin_z, 0], [sin_z, cos_z, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


# Blackbody: polynomials of 1000 K / temperature for linear red, green and blue at a luminance of 1, lowest power first.
# Fitted to Cycles; agrees with Blender 3.4 and 4.5 to 0.3 % of the strongest channel.
BLACKBODY = np.array(
    [
        (0.63575, 1.63766, 8.10316, -10.26485, 5.87697, -1.38757),
        (0.95478, 0.88502, -5.48236, 6.76964, -4.15069, 1.06245),
        (2.43557, -12.0266, 20.99363, -13.1999, 0.0, 0.0),
    ]
)
# Temperatures, kelvin, beyond which Cycles' blackbody keeps its color.
MIN_KELVIN, MAX_KELVIN = 800.0, 12000.0


def blackbody(kelvin: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3) of a temperature (..., 1)."""
    powers = (1000.0 / np.clip(kelvin, MIN_KELVIN, MAX_KELVIN)) ** np.arange(BLACKBODY.shape[1])
    return np.maximum(powers @ BLACKBODY.T, 0.0)


FUNCTIONS = {
    "ShaderNodeValue": _number,
    "ShaderNodeRGB": _number,
    "ShaderNodeBlackbody": lambda node: blackbody(node[0]),
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeValToRGB": _color_ramp,
    "ShaderNodeRGBToBW": lambda node: node[0] @ LUMINANCE[:, None],
    "ShaderNodeCombineRGB": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeSeparateRGB": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeBrightContrast": _bright_contrast,
    "ShaderNodeInvert": _invert,
    "ShaderNodeHueSaturation": _hue_saturation,
    "ShaderNodeMapping": _mapping,
}
