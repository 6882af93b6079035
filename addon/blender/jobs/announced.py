"""How long bakes will take: facts about the scene that need no meshes, and the lines about them for panels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import bpy
import numpy as np

from ...core.bake.bake_settings import COMBINED, FINAL, PREVIEW, BakeSettings
from ...core.bake.estimate import OF_MESHES, OF_WORLD
from ...core.bake.forecast import Finders, Forecast, seconds_of
from ...core.bake.pace import Estimate
from ...core.bake.spread import Spread, diffuse_notes, extent
from ...core.bake.surroundings import Surroundings, enclosed_part
from ...core.errors import MaterialError
from ...core.scene.lights import Light, WorldLight
from ...core.scene.receiver import Grid
from ...core.target import FRONT, Target
from ...core.time_left import duration
from .. import compat
from ..node.draw import bent_materials
from ..node.find import BakeTarget, targets_of
from ..read.lamps import fault, is_portal, read_lamp
from ..read.node_kinds import NodeKinds, all_known, closures_of, kinds_of
from ..read.scene_cache import scene_cache
from ..read.visibility import SURFACE_TYPES, by_name, lights_surfaces, placed, render_visible_names
from .rays import CLEAR, Look, Tracer, places_for
from .state import Announced, state
from .target_shape import Shape, grid_of, grid_of_bent, shape_of

PLACEHOLDER_COLOR = (0.5, 0.5, 0.5)

# Most targets whose bakes are announced, since each takes time in scans.
MAX_TARGETS = 200

# Height above a receiver, relative to its size, from which on an object is above it.
LOW = 1e-4

# Number of lines about the spread of light in a panel.
MAX_LINES = 4

# Reflectance of materials whose color is not one value, and irradiance of emission of the same kind, W/m^2, about.
REFLECTANCE, GLOW = 0.5, 5.0
# Reflectance of surfaces without a material.
DEFAULT_REFLECTANCE = 0.8

# Largest numbers of triangles and of objects among which rays are traced. More keep the window waiting.
MAX_TRACED, MAX_TRACED_OBJECTS = 300_000, 500

# Largest number of glowing objects that estimates count: rays to more are shared.
MAX_GLOWING = 32

# Shortest simulation that a line names, seconds.
MIN_SIMULATION = 1.0


def announce(context, targets: list[Target]) -> dict[Target, Announced]:
    """Estimates for bakes of these targets; those about which too little is known are left out."""
    if len(targets) > MAX_TARGETS:
        return {}
    scene, view_layer, depsgraph = context.scene, context.view_layer, context.evaluated_depsgraph_get()
    scene_cache.enter(depsgraph)
    objects, settings = by_name(scene), scene.beamspread.for_bake()
    facts = _SceneFacts(scene, view_layer, depsgraph, len(targets))
    announced = {}
    bent_materials.clear()
    state.refused.clear()
    for target in targets:
        bakes = [item for item in targets_of(objects[target.object_name]) if item.name == target]
        shape = shape_of(bakes[0], depsgraph) if bakes and _is_valid(bakes[0]) else Shape()
        if shape.error is not None:
            state.refused[target] = shape.error
        bent_materials.update([target.material_name] if shape.is_bent else [])
        grid = grid_of(bakes[0], shape, _side(bakes[0], shape, scene)) if shape.length else None
        forecast = None if grid is None else facts.forecast(bakes[0], grid, shape)
        if forecast is not None:
            bake = _announced(target, forecast, settings)
            spread = Spread.of(shape.length, forecast.surface, (grid.width, grid.height))
            around = forecast.finders.around if forecast.finders.around.returned is not None else None
            announced[target] = replace(bake, spread=spread if settings.layer == COMBINED else None, around=around)
    return announced


def compare(target: Target, read: Sequence[Estimate]) -> None:
    """Note the estimates for a bake once its scene was read: they tell how far the facts without meshes are off."""
    for step in state.announced[target].steps if target in state.announced else ():
        plain = step.seconds / state.factors.get((target, step.kind), 1.0)
        seconds = next((item.seconds for item in read if item.kind == step.kind), 0.0)
        if plain and seconds:
            state.factors[target, step.kind] = seconds / plain


def _announced(target: Target, forecast: Forecast, settings: BakeSettings) -> Announced:
    steps, simulations = forecast.steps(settings), forecast.simulations(settings)
    steps = [replace(step, seconds=step.seconds * state.factors.get((target, step.kind), 1.0)) for step in steps]
    if simulations and settings.quality == FINAL and not bpy.app.background:
        quick = replace(settings, quality=PREVIEW, indirect=False)  # the preview of `steps_of`
        steps += forecast.steps(quick)
        simulations |= forecast.simulations(quick)
    return Announced(tuple(steps), simulations)


class _SceneFacts:
    """Facts about the light of a scene."""

    def __init__(self, scene, view_layer, depsgraph, targets: int) -> None:
        self.lights: list[Light] = []
        self.triangles, self.lamps_by_cycles, self.is_traceable = 0, 0, True
        self._boxes: list[tuple] = []
        visible = render_visible_names(view_layer)
        shown = (obj for obj in scene.objects if obj.name in visible)
        self._glowing = 0
        for obj, matrix, instancer in placed(depsgraph, shown):
            if obj.type == "LIGHT" and lights_surfaces(obj, instancer) and not is_portal(obj.data):
                self._add_lamp(obj, matrix)
            elif obj.type in SURFACE_TYPES and obj.data is not None:
                self._add_solid(obj, np.array(matrix))
        self._add_world(compat.original_world(view_layer, scene), view_layer)
        # Centers (N, 3) of the boxes around objects, and halves of their axes as columns (N, 3, 3).
        boxes = self._boxes or [(np.zeros(3), np.zeros((3, 3)))]
        self._centers, self._halves = map(np.array, zip(*boxes))
        self._tracer = Tracer(depsgraph, self.lights, _look_of, places_for(targets))

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
        self._glowing += any(kind.glows for kind in kinds)
        self.is_traceable &= all(kind.is_known for kind in kinds)

    def _add_world(self, world, view_layer) -> None:
        is_lit = world is not None and view_layer.use_sky and world.cycles_visibility.diffuse
        plain = is_lit and not compat.uses_nodes(world)
        kinds = NodeKinds() if not is_lit or plain else _kinds(world)
        self.world_by_cycles = not kinds.is_known
        color = tuple(world.color) if plain else kinds.color
        has_image = kinds.glows and kinds.is_known and color is None and not kinds.asks_path
        self.unknown = OF_WORLD if has_image else OF_MESHES * (self._glowing > 0)
        if color is not None and any(color):
            rows = tuple(map(tuple, np.eye(3).tolist()))
            self.lights.append(WorldLight("World", 1.0, color, True, np.ones((1, 1, 3), np.float32), rows))

    def _is_beside(self, obj) -> bool:
        """True if an object reaches beyond the box around this one."""
        corners = np.array(obj.bound_box) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3]
        low, high = corners.min(axis=0), corners.max(axis=0)
        halves, edge = np.abs(self._halves).sum(axis=2), LOW * np.ptp(corners, axis=0).max()
        return bool(((self._centers - halves < low - edge) | (self._centers + halves > high + edge)).any())

    def _around(self, target: BakeTarget, grid: Grid | None) -> Surroundings:
        """Surroundings of a target: by rays that Blender traces, or by boxes in large scenes."""
        if self.triangles <= MAX_TRACED and len(self._boxes) <= MAX_TRACED_OBJECTS:
            side = 1.0 if target.side == FRONT else -1.0
            has_unknown_sky = self.world_by_cycles or self.unknown == OF_WORLD
            sides = (side, -side) if target.node.surface().thickness > 0 else (side,)
            around = self._tracer.around(target.obj, sides, has_unknown_sky)
            shares = tuple(self._tracer.shares(target.obj, one, has_unknown_sky) for one in sides)
            return replace(around, shares=shares)
        obj = target.obj
        own = np.array(obj.bound_box) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3]
        normal = None if grid is None else np.array(grid.normal)
        halves = np.abs(self._halves).sum(axis=2)
        return Surroundings(enclosed_part(own, normal, self._centers - halves, self._centers + halves))

    def _extents(self, grid: Grid) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates (N, 3) of all boxes in a grid's frame, from its center."""
        axes = np.array((grid.x_axis, grid.y_axis, grid.normal))
        centers, halves = (self._centers - grid.centre) @ axes.T, np.abs(axes @ self._halves).sum(axis=2)
        return centers - halves, centers + halves

    def forecast(self, target: BakeTarget, grid: Grid, shape: Shape) -> Forecast | None:
        """The forecast for a target on about this grid; None if the scene has no light."""
        obj = target.obj
        if not (self.lights or self.unknown or self.world_by_cycles or self.lamps_by_cycles):
            return None
        surface = target.node.surface()
        if shape.is_bent:
            is_below = shape.is_hollow or self._is_beside(obj)
        else:
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
            around=self._around(target, None if shape.is_bent else grid) if is_below else Surroundings(),
        )
        surface = replace(surface, base_color=PLACEHOLDER_COLOR) if is_textured else surface
        scatters = is_textured and target.node.texture_use().is_scattered
        rest = finders, self.unknown, shape.is_bent, shape.pieces, shape.bending, scatters
        grids = [grid_of_bent(grid, shape) if shape.is_bent else grid]
        rest += 0 if shape.is_bent else shape.planes, min(self._glowing, MAX_GLOWING)
        return Forecast(obj.name, grids, self.lights, self.triangles, surface, *rest)


def _kinds(owner) -> NodeKinds:
    return scene_cache.get(("kinds", owner), [owner, owner.node_tree], lambda: kinds_of(owner))


def _look_of(obj) -> Look:
    """The look of an evaluated object to rays: the mean over its material slots."""
    materials = [slot.material.original for slot in obj.material_slots if slot.material is not None]
    looks = [
        scene_cache.get(("look", item), [item, item.node_tree], lambda item=item: _look(item)) for item in materials
    ]
    return Look(*np.mean(looks, axis=0).tolist()) if looks else Look(DEFAULT_REFLECTANCE)


def _look(material) -> Look:
    if not compat.uses_nodes(material):
        return Look(float(np.clip(material.diffuse_color[:3], 0.0, 1.0).mean()))
    kinds = _kinds(material)
    glow = 0.0 if not kinds.glows else GLOW if kinds.color is None else np.pi * float(np.mean(kinds.color))
    closures = closures_of(material)
    sockets = [node.inputs.get("Base Color") or node.inputs.get("Color") for node in closures]
    plain = [float(np.mean(item.default_value[:3])) for item in sockets if item is not None and not item.is_linked]
    is_plain = plain and len(plain) == len(sockets)
    clear = float(np.mean([*map(_is_glass, closures)])) if closures else 0.0
    return Look((float(np.mean(plain)) if is_plain else REFLECTANCE) * (kinds.color is None), glow, clear)


def _is_glass(node) -> bool:
    """True if a closure lets most light through."""
    share = node.inputs.get("Transmission Weight") or node.inputs.get("Transmission")
    is_clear = share is not None and (share.is_linked or share.default_value > CLEAR)
    return is_clear or node.bl_idname in ("ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction")


def _is_valid(target: BakeTarget) -> bool:
    """True if a medium can have the values of the node."""
    try:
        target.node.surface().check()
    except MaterialError:
        return False
    return True


def _side(target: BakeTarget, shape: Shape, scene) -> int:
    """Texels along the longer side of a new image for a target, about."""
    node = target.node
    return scene.beamspread.side_for(shape.length, node.surface(), node.has_texture(), shape.is_bent)


def line_of(announced: dict[Target, Announced], targets: Iterable[Target]) -> str:
    """How long bakes of the targets take, such as "About 4 s"; "" if that is not known of one of them."""
    chosen = [announced.get(target) for target in targets]
    if not chosen or None in chosen:
        return ""
    return f"About {duration(_total(chosen))}"


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
    return f"Includes {duration(seconds)} to simulate {first}{f' and {len(rest)} more' if rest else ''}, only once"


def spread_lines(announced: dict[Target, Announced], targets: Iterable[Target]) -> list[str]:
    """How far light spreads in the images of targets, in texels; bakes in which it spreads less than a texel apart.

    All materials of an object, and both sides of a sheet, have one line.
    """
    shown: list[Spread] = []
    diffuse: dict[str, list[Spread]] = {}
    for target in targets:
        spread = announced[target].spread if target in announced else None
        if spread is not None:
            (diffuse.setdefault(target.object_name, []) if spread.is_diffuse else shown).append(spread)
    lines = [f"The light spreads over {_extent(shown)}"] if shown else []
    lines += [str(message) for name, spreads in diffuse.items() for message in diffuse_notes(name, spreads)]
    return lines[:MAX_LINES]


def _extent(spreads: list[Spread]) -> str:
    """Least to most texels over which light spreads. Numbers beyond the size of an image would tell nothing."""
    inside = [spread for spread in spreads if not spread.is_wide]
    if not inside:
        return "the whole surface"
    if len(inside) < len(spreads):
        return f"{extent([min(inside, key=lambda spread: spread.texels)])} and more"
    return extent(inside)


def _total(chosen: list[Announced]) -> float:
    simulations: dict[object, Estimate] = {}
    for bake in chosen:
        simulations |= bake.simulations
    return sum(seconds_of(bake.steps) for bake in chosen) + seconds_of(simulations.values())
