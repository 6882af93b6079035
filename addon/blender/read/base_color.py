"""Base color that nodes give a receiver, at the sample positions of its grids."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.errors import MissingImageError, NotSupportedError
from ...core.messages import warning
from ...core.scene.receiver import Receiver
from ...core.scene.sampling import sample_positions
from ...core.scene.texture import BaseColor, TextureUse
from .image_nodes import Images
from .nodes import Evaluator, InputSocket, Links, Source, converted, shows_bake
from .shading import ON_NO_PATH, ShadingPoints
from .visibility import ObjectInstance

# Sample positions that are evaluated together; more take more memory.
MAX_POSITIONS = 1 << 20
# Most sample positions along each side of a texel, for images finer than the texture.
MAX_SIDE = 4


def read_texture(
    wanted: InputSocket,
    use: TextureUse,
    instance: ObjectInstance,
    receiver: Receiver,
    check: Callable[[], None] | None = None,
) -> BaseColor:
    """Base color of a texture on the texels of a receiver.

    Parameters
    ----------
    wanted : input that the texture is linked to.
    use : how the texture colors the surface.
    instance : mesh object, for its own coordinates.
    check : called now and then, raises an exception to cancel.
    """
    name = instance.obj.name
    if receiver.uv_map not in ("", _uv_map(instance.obj)):
        return BaseColor(unknown=f"The bake has a UV map of its own, '{receiver.uv_map}'.")
    try:
        colors = read_base_color(wanted, instance, receiver, check)
    except MissingImageError as error:
        text = f"The Base Color of '{name}' is left out: the node's own color is used. {error.text}"
        return BaseColor(warnings=(warning(name, text, error.remedy),))
    except NotSupportedError as error:
        return BaseColor(unknown=str(error))
    return BaseColor.of(colors, receiver, use, name)


class _OnChart(ShadingPoints):
    """Points of the UV map that is baked, which nodes may also ask for by its name."""

    def __init__(self, outputs, images, uv_map: str, links=None, check=None) -> None:
        super().__init__(outputs, images, links, check)
        self._uv_map = uv_map

    def own_value(self, source: Source) -> np.ndarray | None:
        node = source.node
        if node.bl_idname == "ShaderNodeUVMap" and node.uv_map == self._uv_map and not node.from_instancer:
            return self._outputs["ShaderNodeTexCoord", "UV"]
        return None if shows_bake(node) else super().own_value(source)


def read_base_color(
    wanted: InputSocket, instance: ObjectInstance, receiver: Receiver, check: Callable[[], None] | None = None
) -> list[np.ndarray]:
    """Linear color averaged over each texel, not below 0: float32 (grid height, grid width, 3) of each chart.

    Parameters
    ----------
    wanted, instance, check : as for `read_texture`.

    Raises
    ------
    NotSupportedError
        Names the first node that is not understood.
    """
    to_local, images, links = np.array(instance.matrix.inverted_safe(), dtype=float), Images(), Links()
    width, height, uv_map = receiver.width, receiver.height, _uv_map(instance.obj)
    sizes = [(width, height)] if receiver.tiling is None else receiver.tiling.sizes.values()
    side = _positions_along_texels(links, wanted, max(map(max, sizes)))
    colors = []
    for chart in receiver.charts:
        total = np.zeros((chart.grid.height, chart.grid.width, 3), np.float32)
        for at in sample_positions(side):
            uvs, positions = chart.uvs(width, height, at), chart.grid.positions(at)
            strip = max(1, MAX_POSITIONS // chart.grid.width)
            for first in range(0, chart.grid.height, strip):
                rows = slice(first, first + strip)
                outputs = _outputs(uvs[rows], positions[rows], to_local)
                total[rows] += _color(_OnChart(outputs, images, uv_map, links, check), wanted, uvs[rows].shape[:2])
        colors.append(np.maximum(total / side**2, 0))
    return colors


def _uv_map(obj) -> str:
    try:
        return next((layer.name for layer in obj.to_mesh().uv_layers if layer.active_render), "")
    finally:
        obj.to_mesh_clear()


def _color(evaluator: Evaluator, wanted: InputSocket, shape: tuple[int, int]) -> np.ndarray:
    color = converted(evaluator.value(wanted), wanted.socket.type, "RGBA")
    return np.broadcast_to(color, (shape[0] * shape[1], 3)).reshape(*shape, 3)


def _positions_along_texels(links: Links, wanted: InputSocket, texels: int) -> int:
    """Sample positions along a texel, so that no image of the tree that is spread over the texture loses texels."""
    tree = links.source(wanted).node.id_data
    sizes = [max(node.image.size) for node in tree.nodes if getattr(node, "image", None) is not None]
    return int(np.clip(np.ceil(max(sizes, default=1) / texels), 1, MAX_SIDE))


def _outputs(uvs: np.ndarray, positions: np.ndarray, to_local: np.ndarray) -> dict:
    flat = np.concatenate([uvs.reshape(-1, 2), np.zeros((uvs[..., 0].size, 1))], axis=1)
    world = positions.reshape(-1, 3)
    return {
        **ON_NO_PATH,
        ("ShaderNodeTexCoord", "UV"): flat,
        ("ShaderNodeTexCoord", "Object"): world @ to_local[:3, :3].T + to_local[:3, 3],
        ("ShaderNodeNewGeometry", "Position"): world,
    }
