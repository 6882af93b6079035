"""The scene as targets of Live, as the viewport shows it; only changed data are read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import replace

import bpy
import numpy as np

from ...core.bake.spread import image_length, spread_over_edges
from ...core.bake.surface import Surface
from ...core.errors import ImageError, message_of
from ...core.live.live_target import LiveTarget
from ...core.live.renderer import for_live
from ...core.messages import Message, note
from ...core.scene.flat_mesh import flatten
from ...core.scene.illumination import Illumination
from ...core.scene.polygons import Polygons
from ...core.scene.receiver import Receiver, build_receiver, texture_size
from ...core.scene.texture import BaseColor, TextureUse
from ...core.target import Target
from .. import compat
from ..cycles.sky import SkyService
from ..images.files import check_image
from ..images.results import check_editable
from ..images.udim import is_tiled
from ..node.find import find_bakeable, find_node, find_node_in_groups, medium_of, node_of
from ..node.node import image_of_side
from ..read.base_color import read_texture
from ..read.geometry import mesh_key, read_polygons
from ..read.lights import read_illumination, with_lamps
from ..read.scene_cache import scene_cache
from ..read.scene_changes import SceneChanges
from ..read.visibility import SURFACE_TYPES, ObjectInstance, check_instance, find_instances, render_visible_names
from .preview import SINGLE

MAX_TARGETS = 16
"""Number of targets that follow, those nearest to the change; more follow with longer delays."""

MAX_TEXELS = 1024
"""Texels along the longer side at which textures are evaluated; more is finer and keeps the window waiting."""

Size = tuple[int, int] | int
"""Size of an image, or texels along its longer side."""

OUTPUT = "ShaderNodeOutputMaterial"

READ_BY_BAKES = {"LIGHT", *SURFACE_TYPES}
"""Types of objects that bakes read."""


class Reader:
    """Reads a scene again and again, from the cache where it has not changed.

    Attributes
    ----------
    targets : all targets that the viewport shows, those nearest to the last change first.
    errors : reason why a target can't follow.
    left_out : parts of the scene that bakes read and Live does not.
    """

    def __init__(self, sky: SkyService) -> None:
        self.targets: list[Target] = []
        self.errors: dict[Target, Message] = {}
        self.left_out: list[str] = []
        self._illumination: Illumination | None = None
        self._sky, self._sky_time = sky, -1
        self._lit: Illumination | None = None  # with the sky
        self._bounces = False  # True if bounced light is asked for
        self._lighting: dict[str, Illumination] = {}  # light on each object
        self._polygons: dict[Target, Polygons] = {}
        self._unreadable: dict[Target, Message] = {}  # errors of targets without polygons
        self._colors: dict[Target, tuple[Size, BaseColor]] = {}  # those of textures, with the size of their image
        self._live_targets: dict[Target, LiveTarget] = {}

    def read(
        self, depsgraph, changes: SceneChanges, sizes: Mapping[tuple, tuple[int, int]] | None = None
    ) -> list[LiveTarget]:
        """The targets to render, in this order; unchanged ones are the same objects as before.

        `sizes` has the size of images that nodes lack and several targets share, by `Target.image_key`.
        """
        bounces = depsgraph.scene.original.beamspread.use_indirect
        is_known = self._illumination is not None and bounces == self._bounces
        self._bounces = bounces
        if changes or not is_known:
            are_lamps_alone = is_known and changes.is_lamps_alone()
            self._read_light(depsgraph, changes.lamps if are_lamps_alone else None)
            if not are_lamps_alone or not self.targets:
                self._read_receivers(depsgraph)
            self._sort_by_distance(depsgraph.scene.original, changes)
        if changes or not is_known or self._sky_time != self._sky.time:
            self._light_sky(depsgraph)
            self._note_left_out(depsgraph)
        users = Counter(target.image_key for target in self.targets)
        shared = {key: size for key, size in (sizes or {}).items() if users[key] > 1}
        self.errors, self._colors, targets = dict(self._unreadable), {}, {}
        for target in self.targets[:MAX_TARGETS]:
            live_target = self._live_target(depsgraph, target, shared)
            if live_target is not None:
                targets[target] = live_target
        self._live_targets = targets
        return list(targets.values())

    def messages(self) -> list[Message]:
        """Messages about textures."""
        messages = [message for _, color in self._colors.values() for message in color.warnings]
        for target, (size, color) in self._colors.items():
            if color.unknown:
                shown = f"Live can't evaluate the Base Color of '{target.object_name}' and shows the node's own color"
                messages.append(note("", f"{shown}; bakes have Cycles evaluate it. {color.unknown}"))
            if color.texture is not None and (size if isinstance(size, int) else max(size)) > MAX_TEXELS:
                text = f"Live shows the texture of '{target.material_name}' with {MAX_TEXELS} texels along a side."
                messages.append(note("", text))
        return messages

    def _read_light(self, depsgraph, lamps: Collection[str] | None) -> None:
        """Read all light, or only these lamps if they alone have changed."""
        former = self._illumination
        light = None if lamps is None else with_lamps(depsgraph, former, lamps)
        if light is None:
            light = read_illumination(depsgraph, scene_cache, medium_of=medium_of if self._bounces else None)
            if former is not None and light.shadow_key() == former.shadow_key():
                light = former.with_light_of(light)
        self._illumination = light

    def _light_sky(self, depsgraph) -> None:
        """Add the light of a sky that Cycles renders, as far as it is there."""
        self._sky_time, light, world = self._sky.time, self._illumination, compat.world_of(depsgraph)
        if world is not None and world.name in light.by_cycles:
            sky = self._sky.light(world.original, depsgraph.scene.original)
            if sky is not None:
                light = light.without({world.name}).lit_by([sky])
        self._lit = light
        self._lighting.clear()

    def _read_receivers(self, depsgraph) -> None:
        layer = depsgraph.view_layer
        rendered = render_visible_names(layer)
        visible = [obj for obj in layer.objects if obj.visible_get(view_layer=layer) and obj.name in rendered]
        self.targets = find_bakeable(layer, visible)
        instances = find_instances(depsgraph, {target.object_name for target in self.targets})
        self._polygons, self._unreadable = {}, {}
        for target in self.targets:
            instance = instances.get(target.object_name)
            try:
                if instance is not None:
                    check_instance(target.object_name, instance, layer)
                    self._polygons[target] = _polygons(target, instance)
            except Exception as error:  # noqa: BLE001 - the other targets are still to be read
                self._unreadable[target] = message_of(error)

    def _sort_by_distance(self, scene, changes: SceneChanges) -> None:
        """Put the targets nearest to the changed objects first."""
        positions = [np.array(position) for position in changes.positions(scene)]
        corners = {target: polygons.corners for target, polygons in self._polygons.items() if len(polygons.corners)}
        centers = {target: points.mean(axis=0) for target, points in corners.items()}

        def distance(target: Target) -> float:
            if target not in centers:
                return np.inf
            return min(float(np.linalg.norm(centers[target] - position)) for position in positions)

        if positions:
            self.targets.sort(key=distance)

    def _note_left_out(self, depsgraph) -> None:
        names = [f"light of '{name}' that only Cycles can evaluate" for name in self._lit.by_cycles]
        if self._bounces and (problem := self._lit.bounce_problem):
            names.insert(0, f"bounced light, which only Cycles can find here ({problem.rstrip('.')})")
        names += _hidden(depsgraph.view_layer)
        if len(self.targets) > MAX_TARGETS:
            names.append(f"{len(self.targets) - MAX_TARGETS} objects farther away")
        self.left_out = names

    def _live_target(self, depsgraph, target: Target, sizes: Mapping[tuple, tuple[int, int]]) -> LiveTarget | None:
        """The former object unless something has changed, such as values of nodes and settings; None after errors."""
        material = bpy.data.materials.get(target.material_name)
        node = find_node(material)
        if target not in self._polygons or node is None:
            return None
        settings = depsgraph.scene.original.beamspread
        if target.object_name not in self._lighting:
            self._lighting[target.object_name] = self._lit.lighting(target.object_name)
        try:
            size = _image_size(material, image_of_side(node, target.side)) or sizes.get(target.image_key)
            side = self._side(target, node, settings)
            color = self._base_color(depsgraph, target, size or side)
            spread = spread_over_edges(node.surface())
        except Exception as error:  # noqa: BLE001 - the other targets are still to be read
            self.errors[target] = message_of(error)
            return None
        parts = {
            "polygons": self._polygons[target],
            "size": size,
            "resolution": side,
            "illumination": self._lighting[target.object_name],
            "surface": node.surface() if color is None else node.surface().colored(color),
            "texture": None if color is None else color.texture,
            "spread": spread,
            "settings": for_live(settings.for_bake()),
            "max_bounces": self._max_bounces(depsgraph, self._lighting[target.object_name]),
            "is_final": not self._sky.is_busy(),
        }
        former = self._live_targets.get(target)
        if former is not None and all(_is_same(getattr(former, name), value) for name, value in parts.items()):
            return former
        return LiveTarget(target, **parts)

    def _side(self, target: Target, node, settings) -> int:
        """Texels along the longer side of an image that the next bake would make."""
        if not settings.use_size:
            return settings.resolution
        surface = node.surface()
        surface.check()
        length = image_length([self._polygons[target]])
        return min(MAX_TEXELS, settings.side_for(length, surface, node.has_texture()))

    def _max_bounces(self, depsgraph, illumination: Illumination) -> tuple[int, int, int] | None:
        """Cycles' numbers of bounces; None where no light bounces, or only Cycles can find it."""
        is_left_out = not self._bounces or illumination.bounce_problem
        return None if is_left_out else compat.max_bounces(depsgraph.scene)

    def _base_color(self, depsgraph, target: Target, size: Size) -> BaseColor | None:
        """The texture that is linked to the target's node; None without a link."""
        material, polygons = bpy.data.materials[target.material_name], self._polygons[target]
        node, groups = find_node_in_groups(material)
        if not node.has_texture():
            return None

        def read() -> BaseColor:
            instance = find_instances(depsgraph, {target.object_name})[target.object_name]
            receiver = _receiver(polygons, size, node.surface())
            return read_texture(node.color_input(groups), node.texture_use(), instance, receiver)

        tree = scene_cache.texture(material, node.color_input(groups))
        use = node.texture_use()
        state = tree.text, polygons, size, use.is_albedo
        color = scene_cache.get(("texture", target), [material], read, tree.images, state)
        color = scene_cache.get(("used texture", target), [], lambda: _used(color, use), state=(color, use))
        self._colors[target] = size, color
        return color


def _polygons(target: Target, instance: ObjectInstance) -> Polygons:
    obj, matrix = instance.obj, instance.matrix
    uv_map = getattr(node_of(target), "uv_map", "")
    state = mesh_key(obj), *(tuple(row) for row in matrix), uv_map
    key = "polygons", obj.original, target.material_name

    def read() -> Polygons:
        return read_polygons(obj, target.material_name, matrix, uv_map)

    return scene_cache.get(key, [obj.original], read, state=state)


def _used(color: BaseColor, use: TextureUse) -> BaseColor:
    if color.texture is None or color.texture.use == use:
        return color
    return replace(color, texture=replace(color.texture, use=use))


def _receiver(polygons: Polygons, size: Size, surface: Surface) -> Receiver:
    path, spread, is_sheet = min(surface.material.mean_free_path), spread_over_edges(surface), surface.thickness > 0
    mesh = flatten(polygons, path, spread=spread, is_sheet=is_sheet)
    width, height = texture_size(mesh, size) if isinstance(size, int) else size
    shrink = min(1.0, MAX_TEXELS / max(width, height))
    return build_receiver(mesh, max(1, round(width * shrink)), max(1, round(height * shrink)))


def _image_size(material, image) -> tuple[int, int] | None:
    """Size of a node's image; None without pixels. BakeError if the node can't show a preview in place of the image."""
    check_editable(material)
    if image is None:
        return None
    if is_tiled(image):
        raise ImageError(f"The image '{image.name}' has UDIM tiles, in which Live has no previews: they show a bake.")
    if image.source not in SINGLE:
        check_image(image)
    return None if 0 in image.size else tuple(image.size)


def _hidden(view_layer) -> list[str]:
    """Objects that a bake reads and the viewport hides, in words."""
    rendered = render_visible_names(view_layer)
    objects = (obj for obj in view_layer.objects if obj.type in READ_BY_BAKES and obj.name in rendered)
    names = [f"'{obj.name}'" for obj in objects if not obj.visible_get(view_layer=view_layer)]
    return [f"objects that the viewport hides: {', '.join(names)}"] if names else []


def shows_medium_alone(material_name: str) -> bool:
    """True if the material's output is a Beamspread node, so that its shading affects no other object."""
    node = find_node(bpy.data.materials.get(material_name))
    return node is not None and any(link.to_node.bl_idname == OUTPUT for link in node.outputs["BSDF"].links)


def _is_same(first, second) -> bool:
    """True if two parts of targets are equal; light is only equal to itself."""
    return first is second or (not isinstance(first, Illumination) and type(first) is type(second) and first == second)
