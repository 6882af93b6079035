"""Light by Cycles: bounced light, and lights whose nodes only Cycles can evaluate."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.bake.job import BakeJob, Step
from ...core.bake.layers import mean_open_irradiance
from ...core.errors import MissingImageError
from ...core.messages import Message, warning
from ...core.progress import Callback, Progress
from ...core.scene.lights import STRATA, Field, FieldLight, Light, WorldLight
from ...core.scene.receiver import Receiver
from .. import compat
from ..read.image_nodes import missing_images
from ..read.nodes import Links, surface_of
from ..read.visibility import SOLID_TYPES, render_visible_names, renders
from .process import run, start
from .scene_copy import CopyForCycles, SceneCopy

# Nodes along the longest side of a receiver; more resolve bounced light more finely and take longer.
NODES = 64
# Most squares of that side that the nodes of all charts fill.
MAX_SQUARES = 2.0

# Allowed noise of bounced light at a node, relative to all irradiance; interpolation about halves it.
NOISE_OF_ALL = 0.01
# Limits of that noise, relative to the bounced irradiance.
MIN_NOISE, MAX_NOISE = 0.03, 0.1
# Most samples of each direction at a node.
MAX_SAMPLES = 128

# Fraction of the unoccluded direct light below which bounced light is ignored. Leaks into a closed box are 1.3e-7.
NEGLIGIBLE = 1e-6
NOTHING_BOUNCES = warning(
    "", "Indirect light is left out: it is less than a millionth of what the lights send without obstacles."
)

# Nodes along the longest side, and noise, of direct light whose nodes only Cycles can evaluate.
DIRECT_NODES, DIRECT_NOISE = 256, 0.02

# Height above the receiver at which light is gathered, in nodes; objects below it cast no shadow.
LIFT = 1e-3

# Samples of each texel of the world's panorama, and of texels in tiles around a sun; more reduce noise.
WORLD_SAMPLES, SUN_SAMPLES = 2, 256

REQUEST = {
    "strata": STRATA.tolist(),
    "light": "INDIRECT",
    "with_world": True,
    "only": [],
    "by_lamps": False,
    "reflectances": {},
    "textures": {},
    "noise": (MIN_NOISE, MAX_NOISE),
    "noise_of_all": NOISE_OF_ALL,
    "direct": 0.0,
    "negligible": NEGLIGIBLE,
    "most_samples": MAX_SAMPLES,
}
"""Input of the task `fields` (child_fields.py) without the charts."""

WHITE = 1.0, (1.0, 1.0, 1.0)
UPRIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class CyclesLight:
    """Completes the jobs of one scene, which share a copy of it.

    Make it, and call `complete`, in the main thread, unless a copy that was made there is given.
    """

    def __init__(self, depsgraph, copy: CopyForCycles | None = None) -> None:
        # Names, since undo between two jobs replaces data-blocks.
        self._names = depsgraph.scene.name, depsgraph.view_layer.name
        world = compat.world_of(depsgraph)
        self._world = world.name if world else ""
        self._corners = _corners_of_solids(depsgraph)
        self._lamps = {
            obj.name: _position_of(obj) for obj in bpy.data.scenes[self._names[0]].objects if obj.type == "LIGHT"
        }
        self._copy = copy
        self._lacks_world_images = world is not None and bool(_missing_images_of(world))
        materials = (data for data in depsgraph.ids if isinstance(data, bpy.types.Material))
        self._missing = [message for material in materials for message in _warnings_of(material)]

    def complete(self, job: BakeJob) -> BakeJob:
        """The job, with a step that adds the light that it lacks."""
        illumination, scene = job.illumination, bpy.data.scenes[self._names[0]]
        world = self._world if self._world in illumination.by_cycles else ""
        bounced = job.settings.indirect and bool(illumination.lights or illumination.by_cycles)
        bounced = bounced and self._is_below_something(job.receiver)
        objects = [name for name in illumination.by_cycles if name != world and name in scene.objects]
        if not (world or bounced or objects):
            return job
        # A world without its images is left out; Cycles would show it in magenta.
        is_lit = bool(world) or any(light.name == self._world for light in illumination.lights)
        has_world = is_lit or not self._lacks_world_images
        if self.copy() is None:
            text = "Blender's own Bake could not ask Cycles for light that only Cycles can evaluate."
            missing = warning("", text, "Use Bake Beamspread.")
            return replace(job, illumination=illumination.with_messages(missing))
        start(self._copy.scene)
        illumination = illumination.without({world, *objects} - {""}).with_messages(*self._copy.scene.warnings)
        illumination = illumination.with_messages(*self._missing) if bounced else illumination
        step = LightByCycles(self._copy, world, {name: self._lamps.get(name) for name in objects}, bounced, has_world)
        return replace(job, illumination=illumination, steps=(step, *job.steps))

    def copy(self) -> CopyForCycles | None:
        """Copy of the scene; None if there is none and this is not the main thread."""
        if self._copy is None and threading.current_thread() is threading.main_thread():
            scene = bpy.data.scenes[self._names[0]]
            self._copy = CopyForCycles(scene, scene.view_layers[self._names[1]])
        return self._copy

    def _is_below_something(self, receiver: Receiver) -> bool:
        for grid in (chart.grid for chart in receiver.charts):
            heights = (self._corners - grid.origin) @ np.array(grid.normal)
            # The receiver's own corners lie in the plane up to rounding.
            size = max(grid.width * grid.pitch_x, grid.height * grid.pitch_y)
            if heights.max(initial=0) > grid.clearance + 1e-5 * size + 1e-6 * np.abs(grid.origin).max():
                return True
        return False


@dataclass(frozen=True, eq=False)
class LightByCycles(Step):
    """Adds the light that only Cycles can evaluate.

    Attributes
    ----------
    world : name of the world, "" if our own readers have read it.
    lamps : position or direction of each lamp, as an argument of `FieldLight`; None for an object of another kind.
    bounced : True if bounced light is added.
    has_world : False if bounced light is that of a scene without its world.
    """

    copy: CopyForCycles
    world: str
    lamps: dict[str, tuple | None]
    bounced: bool
    has_world: bool

    name = "Finding light with Cycles"
    finds_light = True

    def stage(self, _job: BakeJob) -> str:
        bounced = ["bounced light"] * self.bounced
        return f"{self.name}: {', '.join([*filter(None, [self.world]), *bounced, *self.lamps])}"

    def weight(self, _job: BakeJob) -> float:
        return 2.0

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        renders_world = bool(self.world) and self.copy.panorama is None
        first, second, *rest = progress.split([1.0 * renders_world, 2.0 * self.bounced, *(1.0 for _ in self.lamps)])
        illumination, receiver = job.illumination, job.receiver
        if renders_world:
            radiance = world_panorama(self.copy.scene, progress=first)
            self.copy.panorama = WorldLight(self.world, *WHITE, True, radiance, UPRIGHT)
        if self.world:
            illumination = illumination.lit_by([self.copy.panorama])
        if self.bounced:
            direct = _irradiance_in_the_open(receiver, illumination.lights)
            fields, irradiance = self._fields(receiver, second, "Finding indirect light", direct=direct)
            if irradiance >= NEGLIGIBLE * direct:
                illumination = illumination.lit_by([FieldLight("Bounced light", *WHITE, False, fields)])
            elif irradiance > 0:
                illumination = illumination.with_messages(NOTHING_BOUNCES)
        lights = [self._direct(receiver, name, part) for name, part in zip(self.lamps, rest)]
        return replace(job, illumination=illumination.lit_by(lights))

    def _direct(self, receiver: Receiver, name: str, progress: Progress) -> Light:
        """Light of one object on the receiver."""
        lamp = self.lamps[name]
        doing = f"Finding the light of '{name}'"
        options = {"light": "DIRECT", "only": [name], "noise": (DIRECT_NOISE, DIRECT_NOISE)}
        if lamp is None:
            return FieldLight(name, *WHITE, False, self._fields(receiver, progress, doing, **options)[0])
        whole = {"by_lamps": True, "strata": [[0.0, 1.0, 0.0, 1.0]], "charts": charts_of(receiver, DIRECT_NODES)}
        fields, _ = self._fields(receiver, progress, doing, **options, **whole)
        return FieldLight(name, *WHITE, False, fields, **lamp)

    def _fields(self, receiver: Receiver, progress: Progress, doing: str, **options) -> tuple[tuple[Field, ...], float]:
        """Bounced light, or light as the options ask for, and an estimate of its mean irradiance, W/m^2."""
        request = REQUEST | {
            "charts": charts_of(receiver, NODES),
            "with_world": self.has_world,
            "reflectances": self.copy.reflectances,
            "textures": self.copy.textures,
            "noise": (MIN_NOISE, MAX_NOISE),
            "most_samples": MAX_SAMPLES,
        }
        arrays = run(self.copy.scene, "fields", request | options, progress, doing)
        grids = (chart.grid for chart in receiver.charts)
        fields = tuple(Field(grid.origin, grid.normal, arrays[f"radiance_{n}"]) for n, grid in enumerate(grids))
        return fields, float(arrays["irradiance"])


def _irradiance_in_the_open(receiver: Receiver, lights: Sequence[Light]) -> float:
    """Mean irradiance, W/m^2, of the lights without occluders."""
    grids = [chart.grid for chart in receiver.charts]
    means = [mean_open_irradiance(grid, lights) for grid in grids]
    areas = [grid.width * grid.pitch_x * grid.height * grid.pitch_y for grid in grids]
    return float(np.average(means, weights=areas))


def charts_of(receiver: Receiver, nodes: int) -> list[dict]:
    """Charts as child_fields.py takes them: rectangles of nodes slightly above the receiver."""
    sizes = [(c.grid.width * c.grid.pitch_x, c.grid.height * c.grid.pitch_y) for c in receiver.charts]
    cell = max(*map(max, sizes), math.sqrt(sum(x * y for x, y in sizes) / MAX_SQUARES)) / nodes
    charts = []
    for grid, size in zip((chart.grid for chart in receiver.charts), sizes):
        lift = grid.clearance + LIFT * cell + 1e-6 * float(np.abs(grid.origin).max())
        charts.append(
            {
                "corner": (np.array(grid.origin) + lift * np.array(grid.normal)).tolist(),
                "x_axis": list(map(float, grid.x_axis)),
                "y_axis": list(map(float, grid.y_axis)),
                "normal": list(map(float, grid.normal)),
                "size": size,
                "nodes": [max(1, round(length / cell)) for length in size],
            }
        )
    return charts


def _corners_of_solids(depsgraph) -> np.ndarray:
    """World positions (N, 3) of the corners of the bounding boxes of all objects that render."""
    visible = render_visible_names(depsgraph.view_layer)
    corners = [np.zeros((0, 3))]
    for instance in depsgraph.object_instances:
        if instance.object.type in SOLID_TYPES and renders(instance, visible):
            world = np.array(instance.matrix_world, dtype=float)
            corners.append(np.array(instance.object.bound_box) @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(corners)


def _missing_images_of(owner) -> list[MissingImageError]:
    surface = surface_of(owner.node_tree) if compat.uses_nodes(owner) else None
    return [] if surface is None else missing_images(Links(), surface)


def _warnings_of(material) -> list[Message]:
    text = f"Light that bounces from the material '{material.name}' is magenta, as Cycles shows it."
    return [warning(material.name, f"{error.text} {text}", error.remedy) for error in _missing_images_of(material)]


def _position_of(lamp) -> dict:
    """Position of a lamp, or direction of a sun, as an argument of `FieldLight`."""
    if lamp.data.type != "SUN":
        return {"position": tuple(lamp.matrix_world.translation)}
    return {"direction": tuple(-lamp.matrix_world.col[2].to_3d().normalized())}


def world_panorama(
    copy: SceneCopy, width: int = 4096, height: int = 2048, progress: Callback | None = None
) -> np.ndarray:
    """Radiance of the world by direction, for light on a diffuse surface.

    Returns
    -------
    float32 (height, width, 3), W/(m^2 sr), row 0 at the bottom: the image of an equirectangular Environment Texture
    node that shows the same world. The direction of the point (u, v), each 0..1, has the azimuth 2 pi (0.5 - u) around
    +Z from +X, and the elevation pi (v - 0.5).

    Raises
    ------
    BakeError
        Cycles failed.
    Cancelled
        `progress` returned False.
    """
    request = {"width": width, "height": height, "samples": WORLD_SAMPLES, "fine_samples": SUN_SAMPLES}
    return run(copy, "world", request, progress, "Rendering the world")["radiance"]
