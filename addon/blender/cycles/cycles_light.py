"""Light by Cycles: bounced light, and lights whose nodes only Cycles can evaluate."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...core.bake.bounced import (
    BY_OWN_RAYS,
    MAX_SAMPLES,
    NEGLIGIBLE,
    NODES,
    NOISE,
    NOISY,
    NOTHING_BOUNCES,
    BouncedLight,
    bent_nodes_of,
    charts_of,
    mean_over,
    node_count,
)
from ...core.bake.estimate import cycles_light_seconds
from ...core.bake.job import BakeJob, Step
from ...core.bake.mean_light import mean_irradiance, mean_open_irradiance
from ...core.bake.smoothing import SPLINE_VARIANCE, smoothing_variance
from ...core.bake.surroundings import bounced_seconds_of_cycles, corners_of, enclosed_part
from ...core.errors import MissingImageError
from ...core.messages import Message, note, warning
from ...core.progress import Callback, Progress
from ...core.scene.bent_grid import AnyGrid, BentGrid
from ...core.scene.lights import STRATA, BentField, Field, FieldLight, Light, WorldLight
from .. import compat
from ..read.image_nodes import missing_images
from ..read.nodes import Links, surface_of
from ..read.visibility import SOLID_TYPES, render_visible_names, renders
from . import kept_world
from .process import run, start
from .scene_copy import CopyForCycles, SceneCopy

# Nodes along the longest side for direct light of lamps whose nodes only Cycles can evaluate.
DIRECT_NODES = 256

# Places in each node of a mesh that bends where light arrives. More show better how it changes in a node.
STARTS = 8

# Samples of each texel of the world's panorama, and of texels in tiles around a sun; more reduce noise.
WORLD_SAMPLES, SUN_SAMPLES = 2, 256

REQUEST = {
    "strata": STRATA.tolist(),
    "light": "INDIRECT",
    "with_world": True,
    "only": [],
    "by_lamps": False,
    "totals_by_lamps": False,
    "reflectances": {},
    "textures": {},
    "tolerance": NOISE,
    "variance": SPLINE_VARIANCE,
    "direct": 0.0,
    "open": 0.0,
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
        self._max_bounces = compat.max_bounces(depsgraph.scene)
        self._copy = copy
        self._lacks_world_images = world is not None and bool(_missing_images_of(world))
        materials = (data for data in depsgraph.ids if isinstance(data, bpy.types.Material))
        self._missing = [message for material in materials for message in _warnings_of(material)]

    def complete(self, job: BakeJob) -> BakeJob:
        """The job, with a step that adds the light that it lacks."""
        illumination, scene = job.illumination, bpy.data.scenes[self._names[0]]
        world = self._world if self._world in illumination.by_cycles else ""
        bounced = job.settings.indirect and bool(illumination.lights or illumination.by_cycles)
        bounced = bounced and self.is_below_something(job.lit_grids)
        objects = [name for name in illumination.by_cycles if name != world and name in scene.objects]
        if job.receiver.is_bent:
            objects = [name for name in objects if name not in self._lamps]  # fields of lamps lie on planes
        if bounced:
            illumination = illumination.with_messages(*self._missing)
            # The world may be one that Cycles renders: our own rays need it as a panorama.
            why_not_own = illumination.without({world}).bounce_problem
            if not why_not_own:
                job = replace(job, steps=(BouncedLight(self._max_bounces), *job.steps))
                illumination, bounced = illumination.with_messages(BY_OWN_RAYS), False
        key = self._key_of(world)
        kept = kept_world.kept(key, world)
        if kept is not None:
            illumination = illumination.without({world}).lit_by([kept]).with_messages(note("", _finder_note([world])))
            world = ""
        job = replace(job, illumination=illumination)
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
        names = [name for name in [world, *objects] if name]
        texts = [_finder_note(names)] if names else []
        if bounced:
            texts.append(f"Cycles finds the bounced light, since Beamspread's own rays can't. {why_not_own}")
        illumination = illumination.with_messages(*(note("", text) for text in texts))
        lamps = {name: self._lamps.get(name) for name in objects}
        step = LightByCycles(self._copy, world, lamps, bounced, has_world, key)
        return replace(job, illumination=illumination, steps=(step, *job.steps))

    def _key_of(self, world: str) -> str:
        """Key of the light of a world for later bakes; "" without a world, and in the thread of a render."""
        if not world or threading.current_thread() is not threading.main_thread():
            return ""
        return kept_world.key_of(bpy.data.worlds[world], bpy.data.scenes[self._names[0]])

    def copy(self) -> CopyForCycles | None:
        """Copy of the scene; None if there is none and this is not the main thread."""
        if self._copy is None and threading.current_thread() is threading.main_thread():
            scene = bpy.data.scenes[self._names[0]]
            self._copy = CopyForCycles(scene, scene.view_layers[self._names[1]])
        return self._copy

    def enclosed_part(self, grid: AnyGrid) -> float:
        """Part of what a grid sees that objects fill, as the boxes around them."""
        boxes = self._corners.reshape(-1, 8, 3)
        normal = None if isinstance(grid, BentGrid) else np.array(grid.normal)
        return enclosed_part(corners_of(grid), normal, boxes.min(axis=1), boxes.max(axis=1))

    def is_below_something(self, grids: Iterable[AnyGrid]) -> bool:
        """True if light may bounce to the receiver: something that renders, or a part of itself, is above it."""
        for grid in grids:
            if isinstance(grid, BentGrid):
                # The receiver's own corners lie beyond the middles of its texels.
                low, high = grid.corners()[[0, -1]] + (1e-5 * grid.size + grid.reach) * np.array([[-1], [1]])
                if ((self._corners < low) | (self._corners > high)).any() or grid.is_hollow():
                    return True
                continue
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
    world_key : key of the world for later bakes, or "".
    """

    copy: CopyForCycles
    world: str
    lamps: dict[str, tuple | None]
    bounced: bool
    has_world: bool
    world_key: str = ""

    name = "Finding light with Cycles"
    finds_light = True

    def stage(self, _job: BakeJob) -> str:
        bounced = ["bounced light"] * self.bounced
        return f"{self.name}: {', '.join([*filter(None, [self.world]), *bounced, *self.lamps])}"

    @property
    def finds_world(self) -> bool:
        return bool(self.world)

    def seconds(self, job: BakeJob) -> float:
        renders_world = bool(self.world) and self.copy.panorama is None
        bounced = 0.0
        if self.bounced:
            around = job.surroundings
            bounced = bounced_seconds_of_cycles(around, node_count(job.lit_grids), job.receiver.is_bent)
        return cycles_light_seconds(renders_world, len(self.lamps), bounced, job.illumination.triangle_count)

    def run(self, job: BakeJob, progress: Progress) -> BakeJob:
        renders_world = bool(self.world) and self.copy.panorama is None
        lamps = [[name] for name, lamp in self.lamps.items() if lamp is not None]
        meshes = [name for name, lamp in self.lamps.items() if lamp is None]
        groups = [*lamps, *([meshes] if meshes else [])]
        first, *rest, last = progress.split([1.0 * renders_world, *(1.0 for _ in groups), 2.0 * self.bounced])
        if renders_world:
            radiance = world_panorama(self.copy.scene, progress=first)
            self.copy.panorama = WorldLight(self.world, *WHITE, True, radiance, UPRIGHT)
            kept_world.keep(self.world_key, self.copy.panorama)
        if self.world:
            job = replace(job, illumination=job.illumination.lit_by([self.copy.panorama]))
        for names, part in zip(groups, rest):
            job = self._with_direct(job, names, part)
        return self._with_bounced(job, last) if self.bounced else job

    def _with_direct(self, job: BakeJob, names: list[str], progress: Progress) -> BakeJob:
        """The job with the light of one lamp, or of all meshes together."""
        lamp, doing = self.lamps[names[0]], f"Finding the light of {_listed(names)}"
        options = {"light": "DIRECT", "only": names, "totals_by_lamps": lamp is None}
        if lamp is not None:
            options |= {"nodes": DIRECT_NODES, "by_lamps": True, "strata": [[0.0, 1.0, 0.0, 1.0]]}
        job, fields, _ = self._with_fields(job, progress, doing, **options)
        light = FieldLight(", ".join(names), *WHITE, False, fields, **(lamp or {}))
        return replace(job, illumination=job.illumination.lit_by([light]))

    def _with_bounced(self, job: BakeJob, progress: Progress) -> BakeJob:
        job, fields, fraction = self._with_fields(job, progress, "Finding indirect light")
        illumination = job.illumination
        if fraction >= NEGLIGIBLE:
            illumination = illumination.lit_by([FieldLight("Bounced light", *WHITE, False, fields)])
        elif fraction > 0:
            illumination = illumination.with_messages(NOTHING_BOUNCES)
        return replace(job, illumination=illumination)

    def _with_fields(
        self, job: BakeJob, progress: Progress, doing: str, nodes: int = 0, **options
    ) -> tuple[BakeJob, tuple[Field | BentField, ...], float]:
        """Bounced light, or light as the options ask for: the job with messages, the light, its fraction of all.

        The fraction is that of the irradiance without obstacles on both sides; infinite if there is no other light.
        """
        receiver, lights, grids = job.receiver, job.illumination.lights, job.lit_grids
        without_obstacles = mean_over(grids, lambda grid: _open_irradiance_of_both_sides(grid, lights))
        nodes = nodes or NODES
        bent = bent_nodes_of(grids, nodes) if receiver.is_bent else []
        charts = [_chart_of(of_chart) for of_chart in bent] or charts_of(grids, nodes)
        request = REQUEST | {
            "charts": charts,
            "with_world": self.has_world,
            "reflectances": self.copy.reflectances,
            "textures": self.copy.textures,
            "tolerance": NOISE,
            "direct": mean_over(grids, lambda grid: mean_irradiance(grid, job.illumination)),
            "open": without_obstacles,
            "variance": smoothing_variance(receiver, job.surface, job.settings, nodes),
            "most_samples": MAX_SAMPLES,
        }
        arrays = run(self.copy.scene, "fields", request | options, progress, doing)
        radiances = [arrays[f"radiance_{n}"] for n in range(len(charts))]
        if bent:
            fields = tuple(
                BentField(of_grid.positions, of_grid.normals, of_grid.spacing, radiance[:, :, 0], grid.is_back)
                for grid, of_grid, radiance in zip(grids, bent, radiances)
            )
        else:
            fields = tuple(Field(grid.origin, grid.normal, radiance) for grid, radiance in zip(grids, radiances))
        noise, irradiance = float(arrays["noise"]), float(arrays["irradiance"])
        fraction = irradiance / without_obstacles if without_obstacles > 0 else math.inf * (irradiance > 0)
        if fraction >= NEGLIGIBLE and noise > NOISY * NOISE:
            text = f"{doing} on '{job.name}' left {100 * noise:.1f} % of noise, relative to all light there."
            job = replace(job, illumination=job.illumination.with_messages(note(job.name, text)))
        return job, fields, fraction


def _chart_of(nodes) -> dict:
    """The nodes of a mesh that bends, for the child process; they are rows of up to `NODES` columns."""
    positions, normals = nodes.starts(STARTS)
    return {
        "positions": positions.tolist(),
        "normals": normals.tolist(),
        "spacing": nodes.spacing,
        "nodes": [NODES, -(-len(positions) // NODES)],
    }


def _finder_note(names: Sequence[str]) -> str:
    return "Cycles finds the light of {}.".format(", ".join(f"'{name}'" for name in names))


def _listed(names: Sequence[str]) -> str:
    """The first names, and the number of others."""
    shown = ", ".join(f"'{name}'" for name in names[:3])
    return shown if len(names) <= 3 else f"{shown} and {len(names) - 3} more"


def _open_irradiance_of_both_sides(grid: AnyGrid, lights: Sequence[Light]) -> float:
    """Mean irradiance without obstacles, W/m^2: light from behind may come back as well."""
    return mean_open_irradiance(grid, lights) + mean_open_irradiance(grid.flipped(), lights)


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
    copy: SceneCopy,
    width: int = 4096,
    height: int = 2048,
    samples: int = WORLD_SAMPLES,
    fine_samples: int = SUN_SAMPLES,
    progress: Callback | None = None,
) -> np.ndarray:
    """Radiance of the world by direction, for light on a diffuse surface.

    Returns
    -------
    float32 (height, width, 3), W/(m^2 sr), row 0 at the bottom, or of fewer texels where nothing is lost: the image of
    an equirectangular Environment Texture node that shows the same world. The direction of the point (u, v), each 0..1,
    has the azimuth 2 pi (0.5 - u) around +Z from +X, and the elevation pi (v - 0.5).

    Raises
    ------
    BakeError
        Cycles failed.
    Cancelled
        `progress` returned False.
    """
    request = {"width": width, "height": height, "samples": samples, "fine_samples": fine_samples}
    return run(copy, "world", request, progress, "Rendering the world")["radiance"]
