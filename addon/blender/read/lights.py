"""Illumination of a scene: its lamps, emissive meshes and world, and the occluders that cast shadows."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import bpy
import numpy as np

from ...core.errors import MissingImageError, NotSupportedError
from ...core.messages import Message, Messages, warning
from ...core.scene.illumination import Illumination
from ...core.scene.lights import Light
from .. import compat
from .emitters import VARYING, EmissiveMesh, radiance_of
from .geometry import GEOMETRY_TYPES, OccluderReader, lost_instance, lost_triangles, shapes_of
from .image_nodes import missing_images
from .lamps import fault, is_portal, read_lamp
from .nodes import InputSocket, Links, surface_of
from .reflection import MediumOf
from .scene_cache import SceneCache
from .transparency import transmittance_of
from .visibility import (
    casts_shadows,
    left_out,
    left_out_of_world,
    lights_surfaces,
    render_visible_names,
    renders,
    with_instanced,
)
from .world_light import read_world


def read_illumination(
    depsgraph,
    cache: SceneCache | None = None,
    check: Callable[[], None] | None = None,
    medium_of: MediumOf | None = None,
) -> Illumination:
    """Lights and occluders of all objects and instances that render.

    Parameters
    ----------
    cache : results of earlier reads, for a depsgraph of the viewport; None: everything is read.
    check : called while nodes are evaluated, and raises an exception to cancel that.
    medium_of : gives the medium of a material that is baked; None: reflections are not read.
    """
    cache = SceneCache() if cache is None else cache
    with cache.reading(depsgraph, check):
        return _read(depsgraph, cache, medium_of)


def _read(depsgraph, cache: SceneCache, medium_of: MediumOf | None) -> Illumination:
    visible = render_visible_names(depsgraph.view_layer)
    lights, occluders = (
        _Lights(depsgraph, cache),
        OccluderReader(cache, medium_of, compat.filtered_roughness(depsgraph.scene)),
    )
    for instance in depsgraph.object_instances:
        if not renders(instance, visible):
            continue
        obj, instancer = instance.object, instance.parent if instance.is_instance else None
        lights.warn_of_solid(left_out(obj))
        if lights_surfaces(obj, instancer):
            if obj.type == "LIGHT":
                lights.add_lamp(obj, instance.matrix_world)
            elif obj.type in GEOMETRY_TYPES:
                lights.add_mesh(instance)
        occluders.add(instance)
    world = compat.world_of(depsgraph)
    lights.add_world(depsgraph.view_layer, world)
    lights.warn_of_solid(left_out_of_world(world))
    reasons = [lights.untraceable, occluders.untraceable, "" if medium_of else UNREAD]
    return Illumination(
        lights.all(),
        occluders.occluders(),
        Messages([*lights.messages, *occluders.messages]),
        compat.transparent_bounces(depsgraph.scene),
        lights.by_cycles,
        lights.receivers,
        next(filter(None, reasons), ""),
    )


UNREAD = "Reflections were not read."


def with_lamps(depsgraph, illumination: Illumination, names: Collection[str]) -> Illumination | None:
    """The illumination with these lamps read again; None if the lamps alone can't tell all that has changed."""
    lights = list(illumination.lights)
    for name in names:
        indices = [index for index, light in enumerate(lights) if light.name == name]
        obj = depsgraph.view_layer.objects.get(name)
        if len(indices) != 1 or obj is None or name in illumination.by_cycles:
            return None
        evaluated = obj.evaluated_get(depsgraph)
        light, reason = read_lamp(evaluated, evaluated.matrix_world)
        if light is None or reason or fault(light):
            return None
        before = lights[indices[0]]
        lights[indices[0]] = replace(light, blockers=before.blockers, receivers=before.receivers)
    return illumination.with_lights(lights)


class _Lights:
    """Collects the lights of a scene, and warnings about those that are left out."""

    def __init__(self, depsgraph, cache: SceneCache) -> None:
        self._cache = cache
        self._names = {data.name for data in depsgraph.ids if isinstance(data, bpy.types.Object)}
        self._lights: list[Light] = []
        # By object name and mesh: geometry nodes may give an object several meshes.
        self._emissive: dict[tuple[str, int], EmissiveMesh | None] = {}
        self._links: dict[str, dict] = {}
        self.messages: list[Message] = []
        self.by_cycles: dict[str, Message] = {}  # see Illumination
        self.receivers: dict[str, frozenset[str]] = {}
        self.untraceable = ""  # see Illumination

    def all(self) -> list[Light]:
        emissive = ((name, mesh) for (name, _), mesh in self._emissive.items() if mesh is not None)
        meshes = [mesh.light((name, 1.0, (1.0, 1.0, 1.0), True)) for name, mesh in emissive]
        for light in filter(None, meshes):
            self._add(light, self._links[light.name])
        return self._lights

    def warn(self, message: Message | None) -> None:
        """Add a message about an object or world, if there is one, whose light is left out in part."""
        if message is not None:
            self.messages.append(message)

    def warn_of_solid(self, message: Message | None) -> None:
        """The same, of an object that reflects light in ways of its own."""
        if message is not None:
            self.warn(message)
            self.untraceable = self.untraceable or f"They can't trace '{message.subject}'."

    def add_lamp(self, obj, matrix) -> None:
        if is_portal(obj.data):
            return
        light, reason = read_lamp(obj, matrix)
        links = links_of(obj, self._names)
        if reason:
            text = f"The light '{obj.name}' is baked without its nodes."
            self._warn_of(obj.name, text, reason, missing_images(Links(), surface_of(obj.data.node_tree)), links)
        if light is not None:
            self._add(light, links)

    def add_mesh(self, instance) -> None:
        """Add an instance of a mesh; all instances of a mesh become one light."""
        obj = instance.object
        key = obj.name, obj.data.as_pointer()
        if key not in self._emissive:
            self._emissive[key] = mesh = self._emissive_mesh(instance, key)
            if mesh is not None:
                self._links[obj.name] = links_of(obj, self._names)
            if mesh is not None and mesh.reason:
                text = f"The emission of '{obj.name}' is left out."
                self._warn_of(obj.name, text, mesh.reason, mesh.missing, self._links[obj.name])
        mesh = self._emissive[key]
        if mesh is None:
            return
        if not self._blocks_light(instance):
            mesh.show_backs()
        if mesh.lost:
            self.warn(lost_triangles(obj.name, mesh.lost))
        if not mesh.add_instance(instance.matrix_world):
            self.warn(lost_instance(obj.name))

    def _blocks_light(self, instance) -> bool:
        """True if an instance of an emissive mesh blocks all light, its own too."""
        obj, parent = instance.object, instance.parent if instance.is_instance else None
        blockers = self._links[obj.name].get("blockers")
        if not casts_shadows(obj, parent) or (blockers is not None and obj.name not in blockers):
            return False
        materials = (slot.material for slot in obj.material_slots)
        return all(transmittance_of(material, self._cache).transmittance.is_black for material in materials)

    def _emissive_mesh(self, instance, key: tuple) -> EmissiveMesh | None:
        """The mesh without its instances; None if all of its materials are dark."""
        obj, cache = instance.object, self._cache
        radiance = [(slot.material, radiance_of(slot.material, cache)) for slot in obj.material_slots]
        if all(light is None for _, light in radiance):
            return None
        state = tuple(light.tobytes() if isinstance(light, np.ndarray) else light for _, light in radiance)
        varying = [material for material, light in radiance if light is VARYING]
        blocks = {*shapes_of(instance), *(material.original for material in varying)}
        images = tuple(dict.fromkeys(image for material in varying for image in cache.tree(material).images))
        names = tuple(material and material.name_full for material, _ in radiance)
        mesh = cache.get(("emission", *key, *names), blocks, lambda: EmissiveMesh(obj, cache), images, state)
        return mesh.without_instances()

    def add_world(self, view_layer, world) -> None:
        light, reason = (None, None) if world is None else self._read_world(view_layer, world)
        if reason:
            text = f"The world '{world.name}' is left out."
            self._warn_of(world.name, text, reason, missing_images(Links(), surface_of(world.node_tree)), {})
        if light is not None:
            self._add(light, {})

    def _read_world(self, view_layer, world) -> tuple[Light | None, NotSupportedError | None]:
        cache, block = self._cache, world.original
        key, images = ("world", block, view_layer.use_sky), cache.tree(world).images

        def keep(color: InputSocket, read: Callable[[], Light | None]) -> Light | None:
            tree = cache.texture(block, color)
            return cache.get(("panorama", block), [], read, tree.images, tree.text)

        return cache.get(key, [block], lambda: read_world(view_layer, world, cache.images, cache.check, keep), images)

    def _warn_of(
        self, name: str, text: str, reason: NotSupportedError, missing: list[MissingImageError], links: dict
    ) -> None:
        """Add a warning, and leave the light to Cycles if Cycles can evaluate its nodes."""
        message = warning(name, f"{text} {reason.text}", reason.remedy)
        if isinstance(reason, MissingImageError):
            self.warn(message)
            return
        self.by_cycles[name] = message
        for error in missing:
            self.warn(warning(name, f"{error.text} Cycles shows it in magenta, as light of '{name}'.", error.remedy))
        if links.get("receivers") is not None:
            self.receivers[name] = links["receivers"]
        self._note_links(name, links)

    def _add(self, light: Light, links: dict) -> None:
        if why := fault(light):
            self.warn(warning(light.name, f"The light '{light.name}' is left out. {why}"))
        else:
            self._lights.append(replace(light, **links))
            self._note_links(light.name, links)

    def _note_links(self, name: str, links: dict) -> None:
        if any(names is not None for names in links.values()):
            self.untraceable = self.untraceable or f"The light of '{name}' is linked to some objects only."


def links_of(obj, names: set[str]) -> dict[str, frozenset[str] | None]:
    """The fields `receivers` and `blockers` of an object's light (light linking, Blender 4.0 on).

    Parameters
    ----------
    names : of all objects of the scene.
    """
    linking = compat.light_linking(obj)
    if linking is None:
        return {}
    return {
        "receivers": _linked(linking.receiver_collection, names),
        "blockers": _linked(linking.blocker_collection, names),
    }


def _linked(collection, names: set[str]) -> frozenset[str] | None:
    """Names of the objects that a collection links; None: all.

    Measured in Blender 4.5: a collection that only excludes objects links all others. Its own objects win over those
    of collections in it, whose own states don't count. An instancer stands for the objects that it instances.
    """
    states = {}
    if collection is not None:
        for link, child in zip(collection.collection_children, collection.children):
            states |= {name: link.light_linking.link_state for obj in child.all_objects for name in _shown_by(obj)}
        for link, obj in zip(collection.collection_objects, collection.objects):
            states |= dict.fromkeys(_shown_by(obj), link.light_linking.link_state)
    if not states:
        return None
    included = {name for name, state in states.items() if state == "INCLUDE"}
    return frozenset(included or names - set(states))


def _shown_by(obj) -> set[str]:
    return {inner.name for inner in with_instanced([obj])}
