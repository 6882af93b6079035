"""How long bakes will take: facts about the scene that need no meshes, and the lines about them for panels."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...core.bake.bake_settings import COMBINED, FINAL, PREVIEW, BakeSettings
from ...core.bake.estimate import OF_MESHES, OF_WORLD
from ...core.bake.forecast import Finders, Forecast, seconds_of
from ...core.bake.pace import Estimate
from ...core.bake.spread import Spread, image_length, spread_over_edges
from ...core.errors import BakeError, MaterialError, ReceiverError
from ...core.scene.flat_mesh import NO_FACES, bends
from ...core.scene.lights import Light, WorldLight
from ...core.scene.receiver import Grid
from ...core.target import FRONT, Target
from ...core.time_left import duration
from .. import compat
from ..images.facts import is_sequence
from ..node.draw import bent_materials
from ..node.find import BakeTarget, targets_of, uses_tiles
from ..read.geometry import mesh_key, read_polygons
from ..read.lamps import fault, is_portal, read_lamp
from ..read.lights import lights_surfaces
from ..read.node_kinds import NodeKinds, all_known, kinds_of
from ..read.scene_cache import scene_cache
from ..read.visibility import SURFACE_TYPES, by_name, placed, render_visible_names
from .state import Announced, state

PLACEHOLDER_COLOR = (0.5, 0.5, 0.5)

# Most targets whose bakes are announced, since each takes time in scans.
MAX_TARGETS = 200

# Height above a receiver, relative to its size, from which on an object is above it.
LOW = 1e-4

# Fraction of a receiver that an object has to reach over for it to be enclosed.
ENCLOSED = 0.9

# Number of faces of a mesh up to which their areas are read. More slow the scans of a scene down.
MAX_FACES = 100_000

# Number of lines about the spread of light in a panel.
MAX_LINES = 4

# Shortest simulation that a line names, seconds.
MIN_SIMULATION = 1.0


NO_SHAPE = 0.0, False, None
"""Shape of a target about which nothing is known."""


def announce(context, targets: list[Target]) -> dict[Target, Announced]:
    """Estimates for bakes of these targets; those about which too little is known are left out."""
    if len(targets) > MAX_TARGETS:
        return {}
    scene, view_layer, depsgraph = context.scene, context.view_layer, context.evaluated_depsgraph_get()
    scene_cache.enter(depsgraph)
    objects, settings = by_name(scene), scene.beamspread.for_bake()
    facts = _SceneFacts(scene, view_layer, depsgraph)
    announced = {}
    bent_materials.clear()
    state.refused.clear()
    for target in targets:
        bakes = [item for item in targets_of(objects[target.object_name]) if item.name == target]
        length, is_bent, error = _shape(bakes[0], depsgraph) if bakes and _is_valid(bakes[0]) else NO_SHAPE
        if error is not None:
            state.refused[target] = error
        bent_materials.update([target.material_name] if is_bent else [])
        forecast = facts.forecast(bakes[0], _side(bakes[0], length, scene), is_bent) if length else None
        if forecast is not None:
            bake = _announced(target, forecast, settings, facts.encloses(forecast.grids[0]))
            (grid,) = forecast.grids
            spread = Spread.of(length, forecast.surface, (grid.width, grid.height))
            announced[target] = replace(bake, spread=spread if settings.layer == COMBINED else None)
    return announced


def compare(target: Target, read: Sequence[Estimate]) -> None:
    """Note the estimates for a bake once its scene was read: they tell how far the facts without meshes are off."""
    for step in state.announced[target].steps if target in state.announced else ():
        plain = step.seconds / state.factors.get((target, step.kind), 1.0)
        seconds = next((item.seconds for item in read if item.kind == step.kind), 0.0)
        if plain and seconds:
            state.factors[target, step.kind] = seconds / plain


def _announced(target: Target, forecast: Forecast, settings: BakeSettings, is_enclosed: bool) -> Announced:
    steps, simulations = forecast.steps(settings), forecast.simulations(settings)
    steps = [replace(step, seconds=step.seconds * state.factors.get((target, step.kind), 1.0)) for step in steps]
    if simulations and settings.quality == FINAL and not bpy.app.background:
        quick = replace(settings, quality=PREVIEW, indirect=False)  # the preview of `steps_of`
        steps += forecast.steps(quick)
        simulations |= forecast.simulations(quick)
    return Announced(tuple(steps), simulations, is_enclosed)


class _SceneFacts:
    """Facts about the light of a scene."""

    def __init__(self, scene, view_layer, depsgraph) -> None:
        self.lights: list[Light] = []
        self.triangles, self.lamps_by_cycles, self.is_traceable = 0, 0, True
        self._boxes: list[tuple] = []
        visible = render_visible_names(view_layer)
        shown = (obj for obj in scene.objects if obj.name in visible)
        self._glowing = False
        for obj, matrix, instancer in placed(depsgraph, shown):
            if obj.type == "LIGHT" and lights_surfaces(obj, instancer) and not is_portal(obj.data):
                self._add_lamp(obj, matrix)
            elif obj.type in SURFACE_TYPES and obj.data is not None:
                self._add_solid(obj, np.array(matrix))
        self._add_world(compat.original_world(view_layer, scene), view_layer)
        # Centers (N, 3) of the boxes around objects, and halves of their axes as columns (N, 3, 3).
        boxes = self._boxes or [(np.zeros(3), np.zeros((3, 3)))]
        self._centers, self._halves = map(np.array, zip(*boxes))

    def _add_lamp(self, obj, matrix) -> None:
        light, reason = read_lamp(obj, matrix)
        if reason is not None:
            self.lamps_by_cycles += 1
        elif light is not None and not fault(light):
            self.lights.append(light)

    def _add_solid(self, obj, matrix: np.ndarray) -> None:
        if obj.visible_shadow:
            self.triangles += 2 * len(getattr(obj.data, "polygons", ()))
        low, high = np.array(obj.bound_box[0]), np.array(obj.bound_box[6])
        self._boxes.append((matrix[:3, :3] @ (low + high) / 2 + matrix[:3, 3], matrix[:3, :3] * (high - low) / 2))
        kinds = [_kinds(slot.material.original) for slot in obj.material_slots if slot.material is not None]
        self._glowing |= any(kind.glows for kind in kinds)
        self.is_traceable &= all(kind.is_known for kind in kinds)

    def _add_world(self, world, view_layer) -> None:
        is_lit = world is not None and view_layer.use_sky and world.cycles_visibility.diffuse
        plain = is_lit and not compat.uses_nodes(world)
        kinds = NodeKinds() if not is_lit or plain else _kinds(world)
        self.world_by_cycles = not kinds.is_known
        color = tuple(world.color) if plain else kinds.color
        has_image = kinds.glows and kinds.is_known and color is None and not kinds.asks_path
        self.unknown = OF_WORLD if has_image else OF_MESHES * self._glowing
        if color is not None and any(color):
            rows = tuple(map(tuple, np.eye(3).tolist()))
            self.lights.append(WorldLight("World", 1.0, color, True, np.ones((1, 1, 3), np.float32), rows))

    def encloses(self, grid: Grid) -> bool:
        """True if the box around an object reaches over nearly all of a grid, as a room's does."""
        low, high = self._extents(grid)
        size = np.array((grid.width * grid.pitch_x, grid.height * grid.pitch_y))
        shared = np.minimum(high[:, :2], size / 2) - np.maximum(low[:, :2], -size / 2)
        covered = np.prod(np.maximum(shared, 0) / size, axis=1)
        return bool((covered[high[:, 2] > LOW * size.max()] > ENCLOSED).any())

    def _extents(self, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates (N, 3) of all boxes in a grid's frame, from its center."""
        axes = np.array((grid.x_axis, grid.y_axis, grid.normal))
        centers, halves = (self._centers - grid.centre) @ axes.T, np.abs(axes @ self._halves).sum(axis=2)
        return centers - halves, centers + halves

    def forecast(self, target: BakeTarget, resolution: int, is_bent: bool) -> Forecast | None:
        """The forecast for a target; None if it has no faces or no size."""
        grid, obj = _grid(target, resolution), target.obj
        if grid is None or not (self.lights or self.unknown or self.world_by_cycles or self.lamps_by_cycles):
            return None
        surface = target.node.surface()
        low, high = self._extents(grid)
        reach = max(high[:, 2].max(), -low[:, 2].min() * (surface.thickness > 0))
        is_below = reach > LOW * max(obj.dimensions)
        is_textured = target.node.has_texture()
        finders = Finders(
            bounced=is_below,
            is_own=self.is_traceable and not self.lamps_by_cycles,
            world=self.world_by_cycles,
            lamps=self.lamps_by_cycles,
            colors=is_textured and not all_known(target.node.color_input(target.groups)),
        )
        surface = replace(surface, base_color=PLACEHOLDER_COLOR) if is_textured else surface
        return Forecast(obj.name, [grid], self.lights, self.triangles, surface, finders, self.unknown, is_bent)


def _kinds(owner) -> NodeKinds:
    return scene_cache.get(("kinds", owner), [owner, owner.node_tree], lambda: kinds_of(owner))


def _is_valid(target: BakeTarget) -> bool:
    """True if a medium can have the values of the node."""
    try:
        target.node.surface().check()
    except MaterialError:
        return False
    return True


def _side(target: BakeTarget, length: float, scene) -> int:
    """Texels along the longer side of a new image for a target, about."""
    return scene.beamspread.side_for(length, target.node.surface(), target.node.has_texture())


def _shape(target: BakeTarget, depsgraph) -> tuple[float, bool, BakeError | None]:
    """Length of an image's side on the surface, scene units, 0 for a surface without area; True if the surface bends;
    the reason why it can't be baked, if that is known.

    Where a mesh is large, the length is that of the box around its object, and it counts as bent.
    """
    obj, matrix = target.obj, target.obj.matrix_world
    if len(obj.data.polygons) > MAX_FACES:
        return max(obj.dimensions), True, None
    evaluated, node = obj.evaluated_get(depsgraph), target.node
    is_tiled = uses_tiles(node, target.side)

    surface = node.surface()
    try:
        surface.check()
    except BakeError:
        return NO_SHAPE  # `problems` says why
    path, spread = min(surface.material.mean_free_path), spread_over_edges(surface)

    def read() -> tuple[float, bool, BakeError | None]:
        try:
            polygons = read_polygons(evaluated, target.material.name, None, node.uv_map, is_tiled)
            if not polygons.count:
                raise ReceiverError(*NO_FACES)
            length = image_length([polygons])
            is_bent = 0 < length < math.inf and bends(polygons, path, spread)
        except BakeError as error:
            return 0.0, False, error
        return (length, is_bent, None) if math.isfinite(length) else NO_SHAPE

    state = mesh_key(evaluated), node.uv_map, is_tiled, path, spread, *(tuple(row) for row in matrix)
    return scene_cache.get(("shape of image", obj, target.material.name), [obj], read, state=state)


def _grid(target: BakeTarget, resolution: int) -> Grid | None:
    """About the grid of a target: as if the texture covered the object's largest two sides."""
    obj, image = target.obj, target.image
    if not len(obj.data.polygons) or is_sequence(image):
        return None
    matrix, face = obj.matrix_world, obj.data.polygons[0]
    normal = matrix.to_3x3().inverted_safe().transposed() @ face.normal
    x_axis = matrix.to_3x3().col[0] if abs(face.normal.x) < 0.9 else matrix.to_3x3().col[1]
    if not normal.length or not x_axis.length:
        return None
    normal.normalize()
    x_axis = (x_axis - x_axis.dot(normal) * normal).normalized()
    y_axis = normal.cross(x_axis)
    corners = np.array(obj.bound_box) @ np.array(matrix)[:3, :3].T + np.array(matrix)[:3, 3]
    along = corners @ np.array([x_axis, y_axis]).T
    sides = np.ptp(along, axis=0)
    if not sides.all():
        return None
    size = np.maximum(np.rint(resolution * sides / sides.max()), 1) if image is None else np.array(image.size)
    if not size.all():
        return None
    if (size[0] < size[1]) != (sides[0] < sides[1]):
        size = size[::-1]
    columns, rows = map(int, size)
    low, height = along.min(axis=0), (matrix @ face.center).dot(normal)
    origin = low[0] * np.array(x_axis) + low[1] * np.array(y_axis) + height * np.array(normal)
    whole = np.broadcast_to(np.float32(1), (rows, columns))
    axes = tuple(x_axis), tuple(y_axis), tuple(normal)
    grid = Grid(tuple(origin.tolist()), *axes, *map(float, sides / [columns, rows]), columns, rows, whole)
    return grid if target.side == FRONT else grid.flipped()


def line_of(announced: dict[Target, Announced], targets: Iterable[Target]) -> str:
    """How long bakes of the targets take, such as "About 4 s"; "" if that is not known of one of them."""
    chosen = [announced.get(target) for target in targets]
    if not chosen or None in chosen:
        return ""
    about = "At least" if any(bake.is_rough() for bake in chosen) else "About"
    return f"{about} {duration(_total(chosen))}"


def seconds_of_frames(announced: dict[Target, Announced], targets: Iterable[Target], count: int) -> float | None:
    """Seconds of bakes of the targets at so many frames; None if that is not known of one of them."""
    chosen = [announced.get(target) for target in targets]
    if not chosen or None in chosen:
        return None
    return _total(chosen) + (count - 1) * sum(seconds_of(bake.steps) for bake in chosen)


def simulation_line(announced: dict[Target, Announced], targets: Iterable[Target]) -> str:
    """Part of that time in which materials are simulated, and their names; "" if there is none."""
    simulations, names = {}, {}
    for target in targets:
        simulated = announced[target].simulations if target in announced else {}
        names |= dict.fromkeys([f"'{target.material_name}'"] if simulated else [])
        simulations |= simulated
    seconds = seconds_of(simulations.values())
    if seconds < MIN_SIMULATION:
        return ""
    first, *rest = names
    return f"Of which {duration(seconds)} simulate {first}{f' and {len(rest)} more' if rest else ''} (once)"


def spread_lines(announced: dict[Target, Announced], targets: Iterable[Target]) -> list[str]:
    """How far light spreads in the images of targets, in texels; bakes in which it spreads less than a texel apart."""
    spreads = {target: announced[target].spread for target in targets if target in announced}
    shown = [spread.texels for spread in spreads.values() if spread is not None and not spread.is_diffuse]
    # Two digits, without exponent.
    least, most = (f"{float(f'{texels:.2g}'):,.10g}" for texels in (min(shown, default=0.0), max(shown, default=0.0)))
    lines = [f"The light spreads over {least if least == most else f'{least} to {most}'} texels"] if shown else []
    diffuse = {target: spread for target, spread in spreads.items() if spread is not None and spread.is_diffuse}
    lines += [str(message) for target, spread in diffuse.items() for message in spread.messages(target.object_name)]
    return lines[:MAX_LINES]


def _total(chosen: list[Announced]) -> float:
    simulations: dict[object, Estimate] = {}
    for bake in chosen:
        simulations |= bake.simulations
    return sum(seconds_of(bake.steps) for bake in chosen) + seconds_of(simulations.values())
