"""The colour that nodes give a receiver, at the places of its grids."""

from __future__ import annotations

import numpy as np

from ...core.scene.receiver import Receiver
from .image_texture import MISSING, NotUnderstoodError, Pixels
from .node_links import End, Wanted, follow
from .node_values import converted
from .places import ON_NO_PATH, Places
from .textures import Images
from .visibility import ObjectInstance

# Places evaluated at a time, and the most of them along each side of a texel, for images finer than the texture.
PLACES_AT_ONCE, MOST_PLACES = 1 << 20, 4


class _OnChart(Places):
    """Knows the UV map that is baked by its name, too."""

    def __init__(self, outputs, images, uv_map: str) -> None:
        super().__init__(outputs, images)
        self._uv_map = uv_map

    def own_value(self, end: End) -> np.ndarray | None:
        if end.node.bl_idname == "ShaderNodeUVMap" and end.node.uv_map == self._uv_map and not end.node.from_instancer:
            return self._outputs["ShaderNodeTexCoord", "UV"]
        return super().own_value(end)


def read_base_color(wanted: Wanted, placed: ObjectInstance, receiver: Receiver) -> list[np.ndarray]:
    """Float32 (grid height, grid width, 3) of each chart, not below 0: the linear colour, averaged over each texel.

    Parameters
    ----------
    wanted : the input that the colour is linked to.
    placed : mesh object, for coordinates of its own.

    Raises
    ------
    NotUnderstoodError
        Names the first node in the way.
    """
    to_local, images = np.array(placed.matrix.inverted_safe(), dtype=float), Images()
    width, height, uv_map = receiver.width, receiver.height, _uv_map(placed.obj)
    count = _places_along_texels(wanted, max(width, height))
    middles = (np.arange(count) + 0.5) / count
    colors = []
    for chart in receiver.charts:
        total = np.zeros((chart.grid.height, chart.grid.width, 3), np.float32)
        for at in ((across, up) for across in middles for up in middles):
            uvs, positions = chart.uvs(width, height, at), chart.grid.positions(at)
            strip = max(1, PLACES_AT_ONCE // chart.grid.width)
            for first in range(0, chart.grid.height, strip):
                rows = slice(first, first + strip)
                evaluator = _OnChart(_outputs(uvs[rows], positions[rows], to_local), images, uv_map)
                total[rows] += _color(evaluator, wanted, uvs[rows].shape[:2])
        colors.append(np.maximum(total / count**2, 0))
    return colors


def is_understood(wanted: Wanted, obj) -> bool:
    """Whether `read_base_color` can do so, without a look at pixels."""
    nowhere = _outputs(np.zeros((1, 1, 2)), np.zeros((1, 1, 3)), np.eye(4))
    try:
        _OnChart(nowhere, Images(_Unread()), _uv_map(obj)).value(wanted)
    except NotUnderstoodError:
        return False
    return True


class _Unread(Pixels):
    @staticmethod
    def _read(_image) -> np.ndarray:
        return MISSING[None, None]


def _uv_map(obj) -> str:
    return next((layer.name for layer in obj.data.uv_layers if layer.active_render), "")


def _color(evaluator: Places, wanted: Wanted, shape: tuple[int, int]) -> np.ndarray:
    color = converted(evaluator.value(wanted), wanted.socket.type, "RGBA")
    return np.broadcast_to(color, (shape[0] * shape[1], 3)).reshape(*shape, 3)


def _places_along_texels(wanted: Wanted, texels: int) -> int:
    """So many that none of the tree's images, if it is spread over the texture, loses texels of its own."""
    tree = follow(wanted).node.id_data
    sizes = [max(node.image.size) for node in tree.nodes if getattr(node, "image", None) is not None]
    return int(np.clip(np.ceil(max(sizes, default=1) / texels), 1, MOST_PLACES))


def _outputs(uvs: np.ndarray, positions: np.ndarray, to_local: np.ndarray) -> dict:
    flat = np.concatenate([uvs.reshape(-1, 2), np.zeros((uvs[..., 0].size, 1))], axis=1)
    world = positions.reshape(-1, 3)
    return {
        **ON_NO_PATH,
        ("ShaderNodeTexCoord", "UV"): flat,
        ("ShaderNodeTexCoord", "Object"): world @ to_local[:3, :3].T + to_local[:3, 3],
        ("ShaderNodeNewGeometry", "Position"): world,
    }
