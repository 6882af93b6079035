"""The lights of a scene and the meshes that block them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import copy

import numpy as np

from ..messages import Message, Messages, note
from .bent_grid import AnyGrid
from .lights import FieldLight, Light, SunLight, WorldLight
from .occluders import Mesh, Occluder, build

# Distance of the origins that shadows are traced relative to, texels; up to twice as far. Larger values let more
# receivers share a hierarchy, and round more: vertices by up to 2^-24 of it, and rays start 16 times 2^-23 of it off
# the plane, a 32nd of a texel.
TEXELS_BETWEEN_ORIGINS = 2**13


class Illumination:
    """Lights and occluders that all bakes of a scene share; owns the hierarchies for shadow rays.

    Attributes
    ----------
    lights : lights that can be baked.
    by_cycles : names of the lights that only Cycles can evaluate, each with the message for a bake without Cycles.
    receivers : names of the objects that each light of `by_cycles` is linked to, if it is not linked to all.
    untraceable : sentence that says why only Cycles can trace the light that bounces; "" if our own rays can.
    """

    def __init__(
        self,
        lights: Sequence[Light],
        occluders: Sequence[Occluder] | Mesh | None = None,
        messages: Iterable[Message] = (),
        max_crossings: int | None = None,
        by_cycles: Mapping[str, Message] | None = None,
        receivers: Mapping[str, Collection[str]] | None = None,
        untraceable: str = "",
    ) -> None:
        """`max_crossings`: number of see-through surfaces that light crosses before it ends at the next; None: any."""
        self.lights, suns = _divided(lights)
        self.by_cycles, self.receivers = dict(by_cycles or {}), dict(receivers or {})
        self.untraceable = untraceable
        self._messages = (*messages, *suns)
        self._occluders = (Occluder("", occluders),) if isinstance(occluders, Mesh) else tuple(occluders or ())
        self._max_crossings = max_crossings
        # Native occluders by origin and numbers of theirs; all have the same origin.
        self._casters: dict = {}

    def __getstate__(self) -> dict:
        """State without the hierarchies, which another process builds again."""
        return {**self.__dict__, "_casters": {}}

    def __copy__(self) -> Illumination:
        """A copy that shares the hierarchies."""
        same = object.__new__(type(self))
        same.__dict__.update(self.__dict__)
        return same

    def lighting(self, receiver: str) -> Illumination:
        """A copy with the lights that are linked to an object of that name; shares the hierarchies."""
        linked = copy(self)
        linked.lights = tuple(light for light in self.lights if light.receivers is None or receiver in light.receivers)
        beyond = {name for name, names in self.receivers.items() if receiver not in names}
        return linked.without(beyond & set(self.by_cycles))

    @property
    def bounce_problem(self) -> str:
        """Sentence that says why only Cycles can find bounced light; "" if our own rays can."""
        for name in self.by_cycles:
            return f"Only Cycles knows the light of '{name}'."
        return self.untraceable

    def without(self, names: Collection[str]) -> Illumination:
        """A copy without these lights of `by_cycles`, which Cycles takes over, and without their messages."""
        rest = copy(self)
        rest.by_cycles = {name: message for name, message in self.by_cycles.items() if name not in names}
        rest.lights = tuple(light for light in self.lights if light.name not in names)
        return rest

    @property
    def messages(self) -> tuple[Message, ...]:
        """Messages about light that is left out."""
        return tuple(Messages([*self._messages, *self.by_cycles.values()]))

    def with_messages(self, *messages: Message) -> Illumination:
        """A copy with more messages."""
        more = copy(self)
        more._messages = (*self._messages, *messages)
        return more

    def lit_by(self, lights: Sequence[Light]) -> Illumination:
        """A copy with more lights."""
        divided, suns = _divided(lights)
        more = self.with_messages(*suns)
        more.lights = (*self.lights, *divided)
        return more

    def native_lights(self, grid: AnyGrid) -> list[tuple]:
        """The lights that can reach a grid, as native code takes them: light, RGB strength, and `Occluders` or None."""
        return [self._native_light(light, grid) for light in self.lights if not light.is_behind(grid)]

    def reaches(self, grids: Sequence[AnyGrid]) -> bool:
        """True if one of the lights can reach one of the grids."""
        return any(not light.is_behind(grid) for light in self.lights for grid in grids)

    def stored_irradiance(self, grid: AnyGrid) -> float:
        """Mean irradiance of a grid by light that was computed elsewhere, W/m^2."""
        return sum(light.mean_irradiance(grid) for light in self.lights if isinstance(light, FieldLight))

    def arriving_lights(self, grids: Sequence[AnyGrid]) -> list[list[tuple | None]]:
        """All lights at each grid, as those of `native_lights`; None where they can't reach it."""
        # Grids of one origin follow each other, so that its occluders are built once.
        order = sorted(range(len(grids)), key=lambda number: self._origin(grids[number]))
        arriving: list[list[tuple | None]] = [[] for _ in grids]
        for number in order:
            grid = grids[number]
            arriving[number] = [
                None if light.is_behind(grid) else self._native_light(light, grid) for light in self.lights
            ]
        return arriving

    def _native_light(self, light: Light, grid: AnyGrid) -> tuple:
        return light.at(grid), light.rgb().tolist(), self.caster(grid, light) if light.cast_shadow else None

    def with_lights(self, lights: Sequence[Light]) -> Illumination:
        """A copy with these lights instead; shares the hierarchies."""
        relit = copy(self)
        relit.lights = tuple(lights)
        return relit

    def with_light_of(self, relit: Illumination) -> Illumination:
        """A copy of another illumination of the same occluders, with the hierarchies of this one."""
        same = copy(relit)
        same._occluders, same._casters = self._occluders, self._casters
        return same

    def shadow_key(self) -> tuple:
        """A key that is equal for the same meshes with the same placements."""
        return tuple(
            (
                (occluder.name, occluder.casts_shadows, occluder.is_seen),
                occluder.mesh.content,
                tuple(map(id, (*occluder.mesh.transmittances, *occluder.mesh.reflectors))),
                None if occluder.placements is None else occluder.placements.tobytes(),
            )
            for occluder in self._occluders
        )

    @property
    def triangle_count(self) -> int:
        """Number of triangles of all occluders that cast shadows, with those of each instance."""
        return sum(
            len(occluder.mesh.triangles) * (1 if occluder.placements is None else len(occluder.placements))
            for occluder in self._occluders
            if occluder.casts_shadows
        )

    @staticmethod
    def _origin(grid: AnyGrid) -> tuple[float, ...]:
        step = TEXELS_BETWEEN_ORIGINS * 2.0 ** math.ceil(math.log2(min(grid.pitch_x, grid.pitch_y)))
        return tuple(step * np.round(grid.centre / step))

    def caster(self, grid: AnyGrid, light: Light | None = None):
        """The native `Occluders` that may block the light, with its origin near the receiver; None without triangles.

        The origin follows from the receiver alone, so that a bake does not depend on earlier ones. Cached occluders
        serve all receivers with the same origin, and all lights with the same blockers.
        """
        blockers = light.blockers if light else None
        return self._built(grid, lambda item: item.casts_shadows and (blockers is None or item.name in blockers))

    def reflecting(self, grid: AnyGrid):
        """The same of the meshes that light bounces from."""
        return self._built(grid, lambda item: item.is_seen)

    def _built(self, grid: AnyGrid, is_chosen: Callable[[Occluder], bool]):
        origin = self._origin(grid)
        if any(cached_origin != origin for cached_origin, _ in list(self._casters)):
            self._casters.clear()  # first, because each may take gigabytes
        chosen = tuple(number for number, item in enumerate(self._occluders) if is_chosen(item))
        caster = self._casters.get((origin, chosen))
        if caster is None:
            occluders = [self._occluders[number] for number in chosen]
            caster = self._casters[origin, chosen] = build(occluders, origin, self._max_crossings)
        return caster


def _divided(lights: Iterable[Light]) -> tuple[tuple[Light, ...], list[Message]]:
    """The lights, with the suns of worlds apart, and notes that name these."""
    divided, notes = [], []
    for light in lights:
        parts = light.parts() if isinstance(light, WorldLight) else (light,)
        divided += parts
        for part in parts:
            if part is not light and isinstance(part, SunLight):
                degrees = math.degrees(part.angle)
                notes.append(note("", f"The sun in '{part.name}' is baked as a disk of {degrees:.2g}°."))
    return tuple(divided), notes
