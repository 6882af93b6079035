"""The lights of a scene and what throws their shadows."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from copy import copy

import numpy as np

from ..messages import Message, Messages
from .grid import Grid
from .lights import Light
from .occluders import Mesh, Occluder, build

# Shadows are traced in single precision relative to an origin, on a lattice this many texels wide or up to twice that:
# vertices near a receiver are off by at most 2^-24 of it, and rays start 16 times 2^-23 of it off the plane, which is a
# 32nd of a texel. Wider, more receivers share a hierarchy.
TEXELS_BETWEEN_ORIGINS = 2**13


class Illumination:
    """Lights and what they shine past, shared by all bakes of a scene; owns the hierarchies that rays are cast in.

    Attributes
    ----------
    lights : those that can be baked.
    by_cycles : names of the lights that only Cycles can evaluate, each with the message for a bake without Cycles.
    receivers : of these lights the names of the objects that they are linked to, of those that are not linked to all.
    """

    def __init__(
        self,
        lights: Sequence[Light],
        occluders: Sequence[Occluder] | Mesh | None = None,
        messages: Iterable[Message] = (),
        max_crossings: int | None = None,
        by_cycles: Mapping[str, Message] | None = None,
        receivers: Mapping[str, Collection[str]] | None = None,
    ) -> None:
        """`max_crossings`: light that crossed so many see-through surfaces ends at the next; None: it never does."""
        self.lights = tuple(lights)
        self.by_cycles, self.receivers = dict(by_cycles or {}), dict(receivers or {})
        self._messages = tuple(messages)
        self._occluders = (Occluder("", occluders),) if isinstance(occluders, Mesh) else tuple(occluders or ())
        self._max_crossings = max_crossings
        # By origin and names of the blockers, all of the same origin.
        self._casters: dict = {}

    def lighting(self, receiver: str) -> Illumination:
        """The same without the lights that are not linked to an object of that name; shares the hierarchies."""
        linked = copy(self)
        linked.lights = tuple(one for one in self.lights if one.receivers is None or receiver in one.receivers)
        beyond = {name for name, names in self.receivers.items() if receiver not in names}
        return linked.found(beyond & set(self.by_cycles))

    def found(self, names: Collection[str]) -> Illumination:
        """The same without these lights of `by_cycles`, which Cycles takes over, and without their messages."""
        rest = copy(self)
        rest.by_cycles = {name: message for name, message in self.by_cycles.items() if name not in names}
        rest.lights = tuple(light for light in self.lights if light.name not in names)
        return rest

    @property
    def messages(self) -> tuple[Message, ...]:
        """Messages about light that is left out."""
        return tuple(Messages([*self._messages, *self.by_cycles.values()]))

    def with_messages(self, *messages: Message) -> Illumination:
        """The same with more messages."""
        more = copy(self)
        more._messages = (*self._messages, *messages)
        return more

    def lit_by(self, lights: Sequence[Light]) -> Illumination:
        """The same with more lights."""
        more = copy(self)
        more.lights = (*self.lights, *lights)
        return more

    def native_lights(self, grid: Grid) -> list[tuple]:
        """The lights that can reach a grid, as native code takes them: light, RGB strength, and `Occluders` or None."""
        return [
            (light.at(grid), light.rgb().tolist(), self.caster(grid, light) if light.cast_shadow else None)
            for light in self.lights
            if not light.is_behind(grid)
        ]

    def with_lights(self, lights: Sequence[Light]) -> Illumination:
        """The same with these lights instead; shares the hierarchies."""
        other = copy(self)
        other.lights = tuple(lights)
        return other

    def with_light_of(self, other: Illumination) -> Illumination:
        """The other, which has equal things in the way, with the hierarchies of this one."""
        same = copy(other)
        same._occluders, same._casters = self._occluders, self._casters
        return same

    def shadow_key(self) -> tuple:
        """Equal for those with the same meshes in the same places."""
        return tuple(
            (
                one.name,
                one.mesh.content,
                tuple(map(id, one.mesh.transmittances)),
                None if one.placements is None else one.placements.tobytes(),
            )
            for one in self._occluders
        )

    @property
    def triangle_count(self) -> int:
        """Of all that can stand in the light's way, those of instances each counted."""
        placed = [(one.mesh, 1 if one.placements is None else len(one.placements)) for one in self._occluders]
        return sum(count * len(mesh.triangles) for mesh, count in placed)

    def caster(self, grid: Grid, light: Light | None = None):
        """The native `Occluders` that may block the light, with its origin near the receiver; None without triangles.

        A light's `blockers` are the names of the objects that block it, or None: all do. The origin follows from the
        receiver alone, so that a bake does not depend on those before it. Those last made serve all receivers with the
        same origin, and all lights with the same blockers.
        """
        step = TEXELS_BETWEEN_ORIGINS * 2.0 ** math.ceil(math.log2(min(grid.pitch_x, grid.pitch_y)))
        origin = tuple(step * np.round(grid.centre / step))
        if any(known != origin for known, _ in self._casters):
            self._casters.clear()  # before others are made: each may take gigabytes
        blockers = light.blockers if light else None
        names = {occluder.name for occluder in self._occluders}
        chosen = None if blockers is None or names <= blockers else frozenset(names & blockers)
        if (origin, chosen) not in self._casters:
            occluders = [one for one in self._occluders if chosen is None or one.name in chosen]
            self._casters[origin, chosen] = build(occluders, origin, self._max_crossings)
        return self._casters[origin, chosen]
