"""Forecast: the time that a bake will take, before there is a job."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from ..ldf.library import SIMULATING
from ..scene.bending import Bending
from ..scene.bent_grid import AnyGrid
from ..scene.lights import Light
from .bake_settings import BakeSettings
from .bounced import MAX_RAYS, NODES, BouncedLight, node_count, spread_in_nodes
from .estimate import (
    CYCLES_COLORS,
    CYCLES_LIGHT,
    OF_WORLD,
    cycles_color_seconds,
    cycles_light_seconds,
    simulation_seconds,
    textured_seconds,
    workloads_of,
)
from .pace import Estimate
from .spread_light import MIN_RAYS, has_back
from .steps import Solve, needs_medium, to_simulate
from .surface import Surface
from .surroundings import OPEN, Surroundings, bounced_seconds, bounced_seconds_of_cycles
from .textured_bake import why_multiplied


@dataclass(frozen=True)
class Finders:
    """Sources of a bake's light beside its lamps.

    Attributes
    ----------
    bounced : True if light may bounce.
    is_own : True if rays of our own find that; else Cycles does.
    world : True if Cycles renders the world.
    lamps : number of lamps whose light Cycles finds.
    colors : True if Cycles evaluates the base color.
    around : surroundings of the receiver, which decide how long bounced light takes.
    """

    bounced: bool = False
    is_own: bool = True
    world: bool = False
    lamps: int = 0
    colors: bool = False
    around: Surroundings = OPEN


@dataclass(frozen=True, eq=False)
class Forecast:
    """Facts about a bake to come.

    Attributes
    ----------
    name : of the object.
    grids : about those of the receiver, without their coverage.
    triangles : number of those that block light.
    unknown : fraction of all light, about, that is not among the lights, besides that which Cycles finds.
    is_bent : True if the receiver is a mesh that bends.
    pieces : into which its texels are divided, on average, if it bends and the grids don't tell; see `Workload`.
    bending : of the receiver, likewise.
    scatters : True if light scatters in a texture's albedos.
    planes : of the receiver, if the grids don't tell.
    glowing : number of meshes that glow, if the lights don't tell.
    """

    name: str
    grids: Sequence[AnyGrid]
    lights: Sequence[Light]
    triangles: int
    surface: Surface
    finders: Finders = Finders()
    unknown: float = 0.0
    is_bent: bool = False
    pieces: float = 0.0
    bending: Bending | None = None
    scatters: bool = False
    planes: int = 0
    glowing: int = 0

    def steps(self, settings: BakeSettings) -> list[Estimate]:
        """Estimates of the steps, without the simulation of media."""
        finders, threads, steps = self.finders, settings.threads, []
        bounced = finders.bounced and settings.indirect
        texels = sum(grid.texels for grid in self.grids)
        if finders.colors and needs_medium(settings):
            steps.append((CYCLES_COLORS, cycles_color_seconds(texels)))
        by_cycles = bounced and not finders.is_own
        sides = 1 + has_back(self.surface.thickness, settings)
        nodes = sides * (NODES**2 if self.is_bent else node_count(self.grids))
        if finders.world or finders.lamps or by_cycles:
            seconds = bounced_seconds_of_cycles(finders.around, nodes, self.is_bent) if by_cycles else 0.0
            lights = finders.world, finders.lamps, seconds
            steps.append((CYCLES_LIGHT, cycles_light_seconds(*lights, self.triangles)))
        if bounced and finders.is_own:
            facts = self.triangles, finders.around, nodes, self.is_bent, threads, MAX_RAYS
            seconds = bounced_seconds(*facts, spread_in_nodes(self.surface, settings, self.grids, self.is_bent))
            steps.append((BouncedLight.name, seconds))
        unknown = max(self.unknown, OF_WORLD * finders.world)
        shares = [finders.around.shares_on(side) for side in range(2)]
        light = {"lights": self.lights, "triangles": self.triangles, "bounced": bounced, "unknown": unknown}
        loads = workloads_of(self.grids, self.surface, settings, shares, has_all_sides=self.is_bent, **light)
        facts = {"pieces": self.pieces, "bending": self.bending, "planes": self.planes}
        known = {"is_bent": self.is_bent, **{name: value for name, value in facts.items() if value}}
        # Each light takes a few rays at least.
        loads = [replace(load, broad_traced=load.broad_traced + MIN_RAYS * self.glowing, **known) for load in loads]
        seconds = sum(load.seconds(settings) for load in loads)
        if self.scatters and not why_multiplied(settings):
            seconds += textured_seconds(texels, threads, self.is_bent)
        steps.append((Solve.kind_for(settings), seconds))
        return [Estimate(kind, self.name, seconds) for kind, seconds in steps]

    def simulations(self, settings: BakeSettings) -> dict:
        """Estimates of the simulations of media that are not known yet, by medium and quality."""
        return {
            (medium, settings.quality, self.is_bent): Estimate(
                SIMULATING[settings.quality], self.name, simulation_seconds([medium], settings, self.is_bent)
            )
            for medium in to_simulate(self.surface, settings, self.is_bent)
        }


def steps_of_bakes(bakes: Iterable[tuple[Forecast | None, BakeSettings]]) -> list[list[Estimate]]:
    """Estimates of the steps of each bake, one after the other: a medium is simulated once. No steps for None."""
    bakes_steps, simulated = [], set()
    for forecast, settings in bakes:
        media = {} if forecast is None else forecast.simulations(settings)
        steps = [] if forecast is None else forecast.steps(settings)
        bakes_steps.append(steps + [estimate for medium, estimate in media.items() if medium not in simulated])
        simulated |= media.keys()
    return bakes_steps


def seconds_of(estimates: Iterable[Estimate]) -> float:
    """Sum of estimates, at the pace of this session."""
    return sum(estimate.corrected() for estimate in estimates)
