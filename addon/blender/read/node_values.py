"""Colours and numbers of a node tree by numpy: constants, images, and arithmetic on them, as Cycles evaluates them.

Values are arrays (1, 1, channels), or (H, W, channels) where they come from images; 1 channel of numbers, 3 of colours.
"""

from __future__ import annotations

import numpy as np

from .image_texture import NotUnderstoodError, Pixels, TexturePlace, alpha_of, color_of, place_of, resampled
from .node_links import End, Wanted, follow

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear Rec. 709, as Cycles turns colours into numbers

# Where nodes turn an image into another, not in proportion, Cycles does so after interpolating it: images whose longer
# side is below this are evaluated between their texels, too.
FINE_SIDE = 1024


class Values:
    """Evaluates nodes at each texel of their images, all of which must lie in the same place on the mesh."""

    def __init__(self, pixels: Pixels, size: tuple[int, int] = (1, 1), is_outside: bool = False) -> None:
        """`size` of the result; `is_outside`: beyond the border of clipped images instead, where these are 0."""
        self._pixels = pixels
        self._size = size
        self._is_outside = is_outside
        self.place: TexturePlace | None = None
        self.largest = (1, 1)  # of the images seen
        self.is_bent = False  # whether an image passes a function that is not linear

    def number(self, wanted: Wanted) -> np.ndarray:
        value = self._value(wanted)
        return value if value.shape[2] == 1 else value @ LUMINANCE[:, None]

    def color(self, wanted: Wanted) -> np.ndarray:
        value = self._value(wanted)
        return np.repeat(value, 3, axis=2) if value.shape[2] == 1 else value

    def _value(self, wanted: Wanted) -> np.ndarray:
        end = follow(wanted)
        if not end.socket.is_output:
            return _constant(end.socket.default_value)
        if end.node.mute:
            return _constant(0.0)
        evaluate = NODES.get(end.node.bl_idname)
        if evaluate is None:
            raise NotUnderstoodError(f"the node '{end.node.name}' is")
        return evaluate(self, end)

    def bent(self, *values: np.ndarray) -> None:
        self.is_bent |= any(value.shape[:2] != (1, 1) for value in values)

    def texture(self, end: End) -> np.ndarray:
        node = end.node
        stored = self._pixels(node.image)
        evaluate = color_of
        if end.socket.name == "Alpha":
            stored, evaluate = stored[..., 3:], alpha_of
        if stored.shape[:2] != (1, 1):
            place = place_of(end)
            if self.place not in (None, place):
                raise NotUnderstoodError(f"the node '{node.name}', which places its image otherwise than another, is")
            self.place = place
            self.largest = tuple(map(max, self.largest, stored.shape[:2]))
            stored = np.zeros_like(stored[:1, :1]) if self._is_outside else resampled(stored, place, self._size)
        return evaluate(node, stored)


def _constant(value) -> np.ndarray:
    numbers = np.atleast_1d(np.asarray(value, np.float32))
    return numbers[None, None, :3]


def _own_value(_values: Values, end: End) -> np.ndarray:
    return _constant(end.socket.default_value)


def _light_path(_values: Values, end: End) -> np.ndarray:
    """What shades is asked of shadow rays, whatever they left from."""
    if not end.socket.name.startswith("Is "):
        raise NotUnderstoodError(f"the output '{end.socket.name}' of the node '{end.node.name}' is")
    return _constant(float(end.socket.name == "Is Shadow Ray"))


def _invert(values: Values, end: End) -> np.ndarray:
    part, color = values.number(end.input(0)), values.color(end.input("Color"))
    return part * (1 - color) + (1 - part) * color


def _ramp(values: Values, end: End) -> np.ndarray:
    ramp, at = end.node.color_ramp, values.number(end.input(0))
    values.bent(at)
    table = np.array([ramp.evaluate(i / 255) for i in range(256)], np.float32)  # Cycles', too
    table = table[:, 3:] if end.socket.name == "Alpha" else table[:, :3]
    place = np.clip(at[..., 0], 0, 1) * 255
    cell = place.astype(int)
    low, high = table[cell], table[np.minimum(cell + 1, 255)]
    return low if ramp.interpolation == "CONSTANT" else low + (place - cell)[..., None] * (high - low)


def _over(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.divide(a, b, out=np.zeros(np.broadcast_shapes(a.shape, b.shape), np.float32), where=b != 0)


# How many inputs each operation has, and what it does with them.
MATH = {
    "ADD": (2, np.add),
    "SUBTRACT": (2, np.subtract),
    "MULTIPLY": (2, np.multiply),
    "DIVIDE": (2, _over),
    "MULTIPLY_ADD": (3, lambda a, b, c: a * b + c),
    "POWER": (2, lambda a, b: np.maximum(a, 0) ** b),
    "SQRT": (1, lambda a: np.sqrt(np.maximum(a, 0))),
    "ABSOLUTE": (1, np.abs),
    "MINIMUM": (2, np.minimum),
    "MAXIMUM": (2, np.maximum),
    "LESS_THAN": (2, lambda a, b: (a < b).astype(np.float32)),
    "GREATER_THAN": (2, lambda a, b: (a > b).astype(np.float32)),
    "ROUND": (1, lambda a: np.floor(a + 0.5)),
    "FLOOR": (1, np.floor),
    "CEIL": (1, np.ceil),
}
LINEAR_MATH = {"ADD", "SUBTRACT"}


def _math(values: Values, end: End) -> np.ndarray:
    node = end.node
    if node.operation not in MATH:
        raise NotUnderstoodError(f"the node '{node.name}' is")
    count, function = MATH[node.operation]
    inputs = [values.number(end.input(i)) for i in range(count)]
    if node.operation not in LINEAR_MATH or node.use_clamp:
        values.bent(*inputs)
    result = function(*inputs)
    return np.clip(result, 0, 1) if node.use_clamp else result


BLENDS = {
    "MIX": lambda _a, b: b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "SCREEN": lambda a, b: 1 - (1 - a) * (1 - b),
    "DIFFERENCE": lambda a, b: np.abs(a - b),
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
}


def _blend(values: Values, end: End, mode: str, inputs: list[np.ndarray], clamps: tuple[bool, bool]) -> np.ndarray:
    if mode not in BLENDS:
        raise NotUnderstoodError(f"the node '{end.node.name}' is")
    part, a, b = inputs
    values.bent(*inputs)
    part = np.clip(part, 0, 1) if clamps[0] else part
    result = (1 - part) * a + part * BLENDS[mode](a, b)
    return np.clip(result, 0, 1) if clamps[1] else result


def _mix_rgb(values: Values, end: End) -> np.ndarray:
    inputs = [values.number(end.input(0)), values.color(end.input(1)), values.color(end.input(2))]
    return _blend(values, end, end.node.blend_type, inputs, (True, end.node.use_clamp))


def _mix(values: Values, end: End) -> np.ndarray:
    node = end.node
    kinds = {"FLOAT": ("Float", values.number, "MIX"), "RGBA": ("Color", values.color, node.blend_type)}
    if node.data_type not in kinds:
        raise NotUnderstoodError(f"the node '{node.name}' is")
    kind, read, mode = kinds[node.data_type]
    by_name = {socket.identifier: Wanted(socket, end.groups) for socket in node.inputs}
    inputs = [values.number(by_name["Factor_Float"]), read(by_name[f"A_{kind}"]), read(by_name[f"B_{kind}"])]
    return _blend(values, end, mode, inputs, (node.clamp_factor, kind == "Color" and node.clamp_result))


def _map_range(values: Values, end: End) -> np.ndarray:
    node = end.node
    if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
        raise NotUnderstoodError(f"the node '{node.name}' is")
    at, low, high, to_low, to_high = (values.number(end.input(i)) for i in range(5))
    values.bent(at)
    result = to_low + _over(at - low, high - low) * (to_high - to_low)
    return np.clip(result, np.minimum(to_low, to_high), np.maximum(to_low, to_high)) if node.clamp else result


def _clamp(values: Values, end: End) -> np.ndarray:
    at, low, high = (values.number(end.input(i)) for i in range(3))
    values.bent(at)
    if end.node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(at, low), high)


def _separate(values: Values, end: End) -> np.ndarray:
    if getattr(end.node, "mode", "RGB") != "RGB":
        raise NotUnderstoodError(f"the node '{end.node.name}' is")
    channel = list(end.node.outputs).index(end.socket)
    return values.color(end.input(0))[..., channel : channel + 1]


def _combine(values: Values, end: End) -> np.ndarray:
    if getattr(end.node, "mode", "RGB") != "RGB":
        raise NotUnderstoodError(f"the node '{end.node.name}' is")
    channels = np.broadcast_arrays(*(values.number(end.input(i)) for i in range(3)))
    return np.concatenate(channels, axis=2)


def _gamma(values: Values, end: End) -> np.ndarray:
    color, power = values.color(end.input(0)), values.number(end.input(1))
    values.bent(color)
    return np.where(color > 0, np.maximum(color, 0) ** power, color)


NODES = {
    "ShaderNodeRGB": _own_value,
    "ShaderNodeValue": _own_value,
    "ShaderNodeTexImage": Values.texture,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeInvert": _invert,
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeMath": _math,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeMix": _mix,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeRGBToBW": lambda values, end: values.number(end.input(0)),
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateRGB": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineRGB": _combine,
    "ShaderNodeGamma": _gamma,
}
