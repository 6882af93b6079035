"""The light of a scene: its lamps, its glowing meshes and its world, and what casts shadows."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import bpy

from ...core.scene.illumination import Illumination
from ...core.scene.lights import Light
from .. import compat
from .emitters import Glow
from .geometry import GEOMETRY_TYPES
from .kept import Kept
from .lamps import fault, is_portal, read_lamp
from .left_out import left_out, left_out_of_world
from .linking import links_of
from .occluders import OccluderReader
from .visible import render_visible_names, renders
from .world import read_world


def read_illumination(depsgraph, kept: Kept | None = None) -> Illumination:
    """Lights and shadow casters of all objects and instances that render; nothing that is `kept` is read again."""
    kept = kept or Kept()
    visible = render_visible_names(depsgraph.view_layer)
    lights, occluders = _Lights(depsgraph, kept), OccluderReader(kept)
    for instance in depsgraph.object_instances:
        if not renders(instance, visible):
            continue
        obj = instance.object
        lights.say(left_out(obj))
        asks_instancer = instance.is_instance and (obj.type != "LIGHT" or compat.instancer_hides_lamps())
        lights_surfaces = obj.visible_diffuse and (not asks_instancer or instance.parent.visible_diffuse)
        if obj.type == "LIGHT" and lights_surfaces:
            lights.add_lamp(obj, instance.matrix_world)
        elif obj.type in GEOMETRY_TYPES and lights_surfaces:
            lights.add_mesh(instance)
        occluders.add(instance)
    world = compat.world_of(depsgraph)
    lights.add_world(depsgraph.view_layer, world)
    lights.say(left_out_of_world(world))
    return Illumination(
        lights.all(),
        occluders.occluders(),
        (*lights.warnings, *dict.fromkeys(occluders.warnings)),
        compat.transparent_bounces(depsgraph.scene),
        lights.by_cycles,
        lights.receivers,
    )


def with_lamps(depsgraph, illumination: Illumination, names: Collection[str]) -> Illumination | None:
    """The same with these lamps read again; None where more has changed than a look at each can tell."""
    lights = list(illumination.lights)
    for name in names:
        places = [place for place, light in enumerate(lights) if light.name == name]
        obj = depsgraph.view_layer.objects.get(name)
        if len(places) != 1 or obj is None or name in illumination.by_cycles:
            return None
        evaluated = obj.evaluated_get(depsgraph)
        light, reason = read_lamp(evaluated, evaluated.matrix_world)
        if light is None or reason or fault(light):
            return None
        old = lights[places[0]]
        lights[places[0]] = replace(light, blockers=old.blockers, receivers=old.receivers)
    return illumination.with_lights(lights)


class _Lights:
    """What was read so far, and what there is to say about it."""

    def __init__(self, depsgraph, kept: Kept) -> None:
        self._kept = kept
        self._names = {one.name for one in depsgraph.ids if isinstance(one, bpy.types.Object)}
        self._lights: list[Light] = []
        self._glows: dict[tuple[str, int], Glow] = {}  # by name and mesh: geometry nodes may give an object several
        self._links: dict[str, dict] = {}
        self.warnings: dict[str, None] = {}  # in order, each once
        self.by_cycles: dict[str, str] = {}  # see Illumination
        self.receivers: dict[str, frozenset[str]] = {}

    def all(self) -> list[Light]:
        glowing = [glow.light((name, 1.0, (1.0, 1.0, 1.0), True)) for (name, _), glow in self._glows.items()]
        for light in filter(None, glowing):
            self._add(light, self._links[light.name])
        return self._lights

    def say(self, sentence: str) -> None:
        if sentence:
            self.warnings[sentence] = None

    def add_lamp(self, obj, matrix) -> None:
        if is_portal(obj.data):
            return
        light, reason = read_lamp(obj, matrix)
        links = links_of(obj, self._names)
        if reason:
            why = f"The light '{obj.name}' counts as if it had no nodes: {reason} not understood."
            self._leave_to_cycles(obj.name, why, links)
        if light is not None:
            self._add(light, links)

    def add_mesh(self, instance) -> None:
        """Instances of a mesh become one light."""
        obj = instance.object
        key = obj.name, obj.data.as_pointer()
        if key not in self._glows:
            if key not in self._kept.glows:
                self._kept.glows[key] = Glow(obj, self._kept.emission)
                self._kept.note(self._kept.glows, key, instance)
            self._glows[key] = glow = self._kept.glows[key].unplaced()
            self._links[obj.name] = links_of(obj, self._names)
            if glow.reason:
                why = f"What glows of '{obj.name}' is left out: {glow.reason} not understood."
                self._leave_to_cycles(obj.name, why, self._links[obj.name])
        self._glows[key].place(instance.matrix_world)

    def add_world(self, view_layer, world) -> None:
        known = world and (world.name, view_layer.use_sky)
        if self._kept.world is None or self._kept.world[0] != known:
            self._kept.world = known, read_world(view_layer, world, self._kept.emission.images)
        light, reason = self._kept.world[1]
        if reason:
            self.by_cycles[world.name] = f"The world '{world.name}' is left out: {reason} not understood."
        if light is not None:
            self._add(light, {})

    def _leave_to_cycles(self, name: str, why: str, links: dict) -> None:
        self.by_cycles[name] = why
        if links.get("receivers") is not None:
            self.receivers[name] = links["receivers"]

    def _add(self, light: Light, links: dict) -> None:
        if why := fault(light):
            self.say(f"The light '{light.name}' is left out: {why}.")
        else:
            self._lights.append(replace(light, **links))
