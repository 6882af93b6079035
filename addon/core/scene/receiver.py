"""Receivers: the texels of a texture that one bake fills, and the grids on which their light is solved.

Rows of all arrays run up: row 0 is the bottom (v = 0), as Blender stores images.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ReceiverError
from ..messages import Message, note
from ..native import native
from ..target import FRONT
from .bent_chart import bent_chart
from .bent_grid import AnyGrid, BentGrid
from .bent_part import BentPart
from .chart import EDGE_TOLERANCE, Chart, ChartIsland, in_chart
from .flat_mesh import FlatMesh, FlatPart
from .grid import Grid
from .islands import UNWRAP_APART, Island
from .seams import Seams
from .tiles import Place, Tiling

# Largest number of texels of a grid over those of its islands; more keep islands of different density sharper.
MAX_FINER = 4.0

# Factor of a grid's texels over the finest of its islands above which a bake says so.
MAX_COARSER = 1.1

# Coverage by several charts, and fraction of the texels, above which the UV map overlaps. `check_map` accepts none that
# comes near it.
MAX_COVERAGE, MAX_OVERLAP = 1.5, 0.03

# Texels along the longer side of the texture in which a mesh that bends is outlined. More: slower, finer.
OUTLINE_SIDE = 64


@dataclass(frozen=True, eq=False)
class Receiver:
    """The texels of a texture that one bake fills.

    Attributes
    ----------
    coverage : float32 (height, width), largest fraction of each texel inside an island.
    charts : flat parts, the largest first, or one for all faces of a mesh that bends.
    uv_map : name of the UV map; "" is the one that renders.
    tiling : UDIM tiles of which the texture consists; None for one image.
    seams : edges of the islands; None if margins need none.
    """

    coverage: np.ndarray
    charts: tuple[Chart, ...]
    uv_map: str = ""
    tiling: Tiling | None = None
    seams: Seams | None = None

    @property
    def height(self) -> int:
        return self.coverage.shape[0]

    @property
    def width(self) -> int:
        return self.coverage.shape[1]

    @property
    def is_bent(self) -> bool:
        """True if it has one chart, of faces that bend."""
        return any(isinstance(chart.grid, BentGrid) for chart in self.charts)

    def seen_from(self, side: str) -> Receiver:
        """The receiver of the mesh's front, or of its back: the same texels show the other face."""
        if side == FRONT:
            return self
        return replace(self, charts=tuple(replace(chart, grid=chart.grid.flipped()) for chart in self.charts))

    def inside(self) -> np.ndarray:
        """Bool (height, width): texels that belong to a chart."""
        return in_chart(self.coverage)

    def labels(self) -> np.ndarray | None:
        """Int32 (height, width): number of the island that covers most of each texel, -1 where none; None with one."""
        islands = [island for chart in self.charts for island in chart.islands]
        if len(islands) < 2 and islands[0].pieces is None:
            return None
        labels = np.full(self.coverage.shape, -1, np.int32)
        for number, island in enumerate(islands):
            is_most = in_chart(island.coverage) & (island.coverage >= island.part_of(self.coverage))
            island.part_of(labels)[is_most] = number if island.pieces is None else island.pieces[is_most]
        return labels

    def messages(self, name: str) -> list[Message]:
        """Messages about the texels of the object `name`."""
        coarser = max(chart.coarser for chart in self.charts)
        texels = max(chart.grid.clearance / min(chart.grid.pitch_x, chart.grid.pitch_y) for chart in self.charts)
        messages = []
        if coarser > MAX_COARSER:
            text = (
                f"UV islands of '{name}' differ in scale: the finest is baked {coarser:.1f} times coarser than its "
                "texels."
            )
            messages.append(note(name, text, "Unwrap the mesh at one density."))
        if texels > 1:
            text = f"The faces of '{name}' depart from the planes that are baked by up to {texels:.1f} texels."
            messages.append(note(name, text, "Their shadows may be off by as much."))
        return messages

    def to_texture(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Texture, float32 (height, width, C), with the charts' grid values (grid height, grid width, C); 0 outside.

        A texel that several islands share has the value of the one that covers most of it.
        """
        texture = np.zeros((self.height, self.width, values[0].shape[2]), np.float32)
        for chart, on_grid in zip(self.charts, values):
            for island in chart.islands:
                is_most = in_chart(island.coverage) & (island.coverage >= island.part_of(self.coverage))
                island.part_of(texture)[is_most] = island.sampled(on_grid, is_most)
        return texture


def texture_size(mesh: FlatMesh, resolution: int, beside: Iterable[FlatMesh] = ()) -> tuple[int, int]:
    """Width and height of a texture with `resolution` texels along the longer side; texels are nearly square.

    Meshes `beside` it have their places in the same texture.
    """
    lengths = np.max([island.lengths for one in (mesh, *beside) for island in one.islands], axis=0).tolist()
    return tuple(max(1, round(resolution * length / max(lengths))) for length in lengths)


def build_receiver(mesh: FlatMesh, width: int, height: int, owner: str = "") -> Receiver:
    """Make the charts of a mesh of the object `owner` for a texture of `width` x `height` texels.

    Raises
    ------
    ReceiverError
        The mesh covers no texel, or texels several times.
    """
    if mesh.is_bent:
        return _bent_receiver(mesh, width, height, owner)
    charts = []
    for part in mesh.parts:
        places = [mesh.place(island, width, height) for island in part.islands]
        charts.append(_chart(part, places, owner))
    islands = [island for chart in charts for island in chart.islands]
    if len(islands) == 1 and islands[0].coverage.shape == (height, width):
        coverage = islands[0].coverage
    else:
        coverage, total = np.zeros((2, height, width), np.float32)
        for island in islands:
            part, sums = island.part_of(coverage), island.part_of(total)
            np.maximum(part, island.coverage, out=part)
            sums += island.coverage
        _check_overlap(total)
    if not in_chart(coverage).any():
        raise ReceiverError("The UV map covers no texel of the image.", "Enlarge it, or the image.")
    return Receiver(coverage, tuple(charts), mesh.uv_map, mesh.tiling)


def _check_overlap(total: np.ndarray) -> None:
    """Raise ReceiverError for texels whose total coverage is that of several faces."""
    overlap = (total > MAX_COVERAGE).sum() / max(in_chart(total).sum(), 1)
    if overlap > MAX_OVERLAP:
        text = f"The UV map overlaps: {overlap:.0%} of its texels show several faces."
        raise ReceiverError(text, UNWRAP_APART)


def _bent_receiver(mesh: FlatMesh, width: int, height: int, owner: str) -> Receiver:
    """The receiver of a mesh that bends, with one chart of the texels around all its islands."""
    (part,) = mesh.parts
    places = {island.tile: mesh.place(island, width, height) for island in part.islands}
    chart, covered = bent_chart(part, places, owner, mesh.tiling is not None)
    _check_overlap(covered)
    coverage = np.zeros((height, width), np.float32)
    chart.islands[0].part_of(coverage)[...] = chart.grid.coverage
    if not in_chart(coverage).any():
        raise ReceiverError("The UV map covers no texel of the image.", "Enlarge it, or the image.")
    return Receiver(coverage, (chart,), mesh.uv_map, mesh.tiling)


def outline(mesh: FlatMesh, part: FlatPart | BentPart, width: int, height: int) -> AnyGrid:
    """About the grid of a part of a mesh, in a texture of that size; a rectangle if the part is flat; quickly made."""
    if isinstance(part, BentPart):
        finer = max(max(width, height) / OUTLINE_SIDE, 1.0)
        places = {island.tile: mesh.place(island, width, height) for island in part.islands}
        coarse = {tile: Place(*(np.array(place[:4]) / finer).tolist()) for tile, place in places.items()}
        return replace(bent_chart(part, coarse)[0].grid, finer=finer)
    island = part.islands[0]
    frame, pitch = _frame(island), _pitch(island, mesh.place(island, width, height))
    points = np.concatenate([island.polygons.corners @ frame.T / pitch for island in part.islands])
    corner, size = points.min(axis=0), np.ptp(points, axis=0)
    columns, rows = np.maximum(np.rint(size), 1).astype(int).tolist()
    origin = (corner * pitch) @ frame + (part.plane.centre @ part.plane.normal) * part.plane.normal
    return _grid(origin, frame, part, pitch, np.broadcast_to(np.float32(1), (rows, columns)), "")


def _chart(part: FlatPart, places: Sequence[Place], owner: str) -> Chart:
    first, *rest = part.islands
    if not rest and first.is_orthogonal():
        return _chart_of_texels(part, places[0], owner)
    return _chart_of_grid(part, places, owner)


def _frame(island: Island) -> np.ndarray:
    """Unit vectors along the columns and across them, (2, 3)."""
    x_axis = island.p_u / np.linalg.norm(island.p_u)
    across = island.p_v - (island.p_v @ x_axis) * x_axis
    return np.stack([x_axis, across / np.linalg.norm(across)])


def _pitch(island: Island, place: Place) -> np.ndarray:
    """Size of the island's texels along the columns and across them, scene units."""
    frame = _frame(island)
    return np.array([np.linalg.norm(island.p_u) / place.width, island.p_v @ frame[1] / place.height])


def _chart_of_texels(part: FlatPart, place: Place, owner: str) -> Chart:
    (island,) = part.islands
    texels = _in_texture(island, place)
    columns, rows = texels.offset[0] - place.column, texels.offset[1] - place.row
    origin = island.p_0 + columns / place.width * island.p_u + rows / place.height * island.p_v
    grid = _grid(origin, _frame(island), part, _pitch(island, place), texels.coverage, owner)
    return Chart(grid, (texels,))


def _chart_of_grid(part: FlatPart, places: Sequence[Place], owner: str) -> Chart:
    """A chart with a rectangle around all islands, whose rows are parallel to those of the largest island."""
    frame, coarser = _frame(part.islands[0]), 1.0
    texels = [_in_texture(island, place) for island, place in zip(part.islands, places)]
    if len(texels) == 1:
        pitch = _pitch(part.islands[0], places[0])
    else:
        pitch = np.repeat(min(_pitch(island, place).min() for island, place in zip(part.islands, places)), 2)
        area = sum(float(island.polygons.areas.sum()) for island in part.islands)
        wanted = MAX_FINER * max(sum(float(island.coverage.sum()) for island in texels), 1.0)
        coarser = max(1.0, float(np.sqrt(area / wanted) / pitch[0]))
        pitch *= coarser
    points = [island.polygons.corners @ frame.T / pitch for island in part.islands]
    everywhere = np.concatenate(points)
    corner = everywhere.min(axis=0)
    columns, rows = np.maximum(np.ceil(everywhere.max(axis=0) - corner - EDGE_TOLERANCE), 1).astype(int).tolist()
    faces = [face - corner for island, at in zip(part.islands, points) for face in island.polygons.split(at)]
    origin = (corner * pitch) @ frame + (part.plane.centre @ part.plane.normal) * part.plane.normal
    grid = _grid(origin, frame, part, pitch, _coverage(faces, columns, rows), owner)
    islands = []
    for island, place, shown in zip(part.islands, places, texels):
        slopes = np.stack([(frame @ island.p_u) / pitch / place.width, (frame @ island.p_v) / pitch / place.height])
        first = frame @ island.p_0 / pitch - corner - np.array([place.column, place.row]) @ slopes
        islands.append(replace(shown, texel_to_grid=np.column_stack([*slopes, first])))
    return Chart(grid, tuple(islands), _labels(part, points, corner, (rows, columns)), coarser)


def _labels(
    part: FlatPart, points: Sequence[np.ndarray], corner: np.ndarray, shape: tuple[int, int]
) -> np.ndarray | None:
    """The island that covers most of each texel of a grid; the largest one where none does."""
    if len(points) == 1:
        return None
    labels, most = np.zeros(shape, np.int32), np.zeros(shape, np.float32)
    for label, (island, at) in enumerate(zip(part.islands, points)):
        first = np.clip(np.floor((at - corner).min(axis=0)), 0, [shape[1] - 1, shape[0] - 1]).astype(int)
        last = np.clip(np.ceil((at - corner).max(axis=0)), first + 1, shape[::-1]).astype(int)
        faces = [face - corner - first for face in island.polygons.split(at)]
        coverage = _coverage(faces, *(last - first).tolist())
        within = slice(first[1], last[1]), slice(first[0], last[0])
        is_most = coverage > most[within]
        labels[within][is_most], most[within][is_most] = label, coverage[is_most]
    return labels


def _in_texture(island: Island, place: Place) -> ChartIsland:
    texels, width, height = island.polygons.uvs * [place.width, place.height], place.width, place.height
    first = np.clip(np.floor(texels.min(axis=0) + EDGE_TOLERANCE), 0, [width - 1, height - 1]).astype(int)
    last = np.clip(np.ceil(texels.max(axis=0) - EDGE_TOLERANCE), first + 1, [width, height]).astype(int)
    faces = island.polygons.split(texels - first)
    offset = place.column + int(first[0]), place.row + int(first[1])
    return ChartIsland(_coverage(faces, *(last - first).tolist()), offset, places=(place,) if island.tile else ())


def _grid(
    origin: np.ndarray, frame: np.ndarray, part: FlatPart, pitch: np.ndarray, coverage: np.ndarray, owner: str
) -> Grid:
    origin, x_axis, y_axis, normal = (tuple(vector.tolist()) for vector in (origin, *frame, part.plane.normal))
    pitches, (height, width) = map(float, pitch), coverage.shape
    rest = {"clearance": part.plane.deviation, "owner": owner}
    return Grid(origin, x_axis, y_axis, normal, *pitches, width, height, coverage, **rest)


def _coverage(faces: list[np.ndarray], width: int, height: int) -> np.ndarray:
    """Fraction of each texel inside the faces; `faces` have (x, y) in texels."""
    corners = np.ascontiguousarray(np.concatenate(faces), np.float64)
    counts = np.array([len(face) for face in faces], np.uint32)
    return native.coverage(corners, counts, width, height)
