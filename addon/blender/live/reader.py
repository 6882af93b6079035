"""The scene as targets of Live, as the viewport shows it; only changed data are read again."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import bpy
import numpy as np

from ...core.errors import text_of
from ...core.live.live_target import LiveTarget
from ...core.live.renderer import for_live
from ...core.messages import Message
from ...core.scene.illumination import Illumination
from ...core.target import Target
from ..images.files import check_image
from ..images.results import check_editable
from ..node.find import find_bakeable, find_node
from ..read.geometry import read_polygons
from ..read.lights import read_illumination, with_lamps
from ..read.scene_cache import SceneCache
from ..read.visibility import SURFACE_TYPES, ObjectInstance, check_instance, find_instances, render_visible_names
from .preview import SINGLE
from .scene_changes import SceneChanges
from .texture_cache import TextureCache

MAX_TARGETS = 16
"""Number of targets that follow, those nearest to the change; more follow with longer delays."""

INDIRECT = "indirect light"

OUTPUT = "ShaderNodeOutputMaterial"

READ_BY_BAKES = {"LIGHT", *SURFACE_TYPES}
"""Types of objects that bakes read."""


class Reader:
    """Reads a scene again and again, and keeps the data that have not changed.

    Attributes
    ----------
    targets : all targets that the viewport shows, those nearest to the last change first.
    errors : reason why a target can't follow.
    left_out : parts of the scene that bakes read and Live does not.
    """

    def __init__(self) -> None:
        self.targets: list[Target] = []
        self.errors: dict[Target, str] = {}
        self.left_out: list[str] = []
        self._cache = SceneCache()
        self._illumination: Illumination | None = None
        self._lighting: dict[str, Illumination] = {}  # light on each object
        self._polygons: dict[Target, object] = {}
        self._unreadable: dict[Target, str] = {}  # errors of targets without polygons
        self._live_targets: dict[Target, LiveTarget] = {}
        self._textures = TextureCache()

    def read(
        self, depsgraph, changes: SceneChanges, sizes: Mapping[str, tuple[int, int]] | None = None
    ) -> list[LiveTarget]:
        """The targets to render, in this order; unchanged ones are the same objects as before.

        `sizes` has the image size of materials that several targets share and whose node has no image.
        """
        scene = depsgraph.scene.original
        if changes.images or changes.other or changes.materials:
            self._textures.forget(None if changes.images or changes.other else changes.materials)
        if changes or self._illumination is None:
            self._read_light(depsgraph, changes)
            if self._illumination is None or not changes.is_lamps_alone() or not self.targets:
                self._read_receivers(depsgraph, changes)
            self._sort_by_distance(scene, changes)
            self._note_left_out(depsgraph)
        users = Counter(target.material_name for target in self.targets)
        shared = {name: size for name, size in (sizes or {}).items() if users[name] > 1}
        targets, self.errors = {}, dict(self._unreadable)
        for target in self.targets[:MAX_TARGETS]:
            live_target = self._live_target(depsgraph, target, shared)
            if live_target is not None:
                targets[target] = live_target
        self._live_targets = targets
        return list(targets.values())

    def messages(self) -> list[Message]:
        """Messages about textures."""
        return self._textures.messages()

    def _read_light(self, depsgraph, changes: SceneChanges) -> None:
        light = self._illumination
        if light is not None and changes.is_lamps_alone():
            light = with_lamps(depsgraph, light, changes.lamps)
        else:
            light = None
        if light is None:
            if changes.images:
                self._cache.forget_images()
            self._cache.forget_materials([name for name in changes.materials if not shows_medium_alone(name)])
            if changes.world:
                self._cache.world = None
            self._cache.forget(changes.shaped)
            light = read_illumination(depsgraph, self._cache)
            if self._illumination is not None and light.shadow_key() == self._illumination.shadow_key():
                light = self._illumination.with_light_of(light)
        self._illumination = light
        self._lighting.clear()

    def _read_receivers(self, depsgraph, changes: SceneChanges) -> None:
        layer = depsgraph.view_layer
        rendered = render_visible_names(layer)
        visible = [obj for obj in layer.objects if obj.visible_get(view_layer=layer) and obj.name in rendered]
        self.targets = find_bakeable(layer, visible)
        self._unreadable = {target: why for target, why in self._unreadable.items() if target in self.targets}
        changed, due = changes.moved | changes.shaped, []
        for target in self.targets:
            obj = layer.objects.get(target.object_name)  # None if it is an instance, which other objects move, too
            is_known = target in self._polygons and obj is not None and not changes.other
            if not is_known or obj.name in changed or obj.data.name in changed:
                due.append(target)
        instances = find_instances(depsgraph, {target.object_name for target in due})
        for target in due:
            self._read_polygons(target, instances.get(target.object_name), layer)
        self._polygons = {target: self._polygons[target] for target in self.targets if target in self._polygons}

    def _read_polygons(self, target: Target, instance: ObjectInstance | None, view_layer) -> None:
        self._unreadable.pop(target, None)
        former = self._polygons.pop(target, None)
        if instance is None:
            return
        try:
            check_instance(target.object_name, instance, view_layer)
            polygons = read_polygons(instance.obj, target.material_name, instance.matrix)
        except Exception as error:  # noqa: BLE001 - the other targets are still to be read
            self._unreadable[target] = text_of(error)
            return
        self._polygons[target] = former if former is not None and _are_equal(former, polygons) else polygons

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
        names = [f"light of '{name}' that only Cycles can evaluate" for name in self._illumination.by_cycles]
        if depsgraph.scene.beamspread.use_indirect:
            names.insert(0, INDIRECT)
        names += _hidden(depsgraph.view_layer)
        if len(self.targets) > MAX_TARGETS:
            names.append(f"{len(self.targets) - MAX_TARGETS} objects farther away")
        self.left_out = names

    def _live_target(self, depsgraph, target: Target, sizes: Mapping[str, tuple[int, int]]) -> LiveTarget | None:
        """The former object unless something has changed, such as values of nodes and settings; None after errors."""
        material = bpy.data.materials.get(target.material_name)
        node = find_node(material)
        if target not in self._polygons or node is None:
            return None
        settings = depsgraph.scene.original.beamspread
        if target.object_name not in self._lighting:
            self._lighting[target.object_name] = self._illumination.lighting(target.object_name)
        try:
            size = _image_size(material, node.image) or sizes.get(target.material_name)
            color = self._textures.read(depsgraph, target, self._polygons[target], size or settings.resolution)
        except Exception as error:  # noqa: BLE001 - the other targets are still to be read
            self.errors[target] = text_of(error)
            return None
        parts = {
            "polygons": self._polygons[target],
            "size": size,
            "resolution": settings.resolution,
            "illumination": self._lighting[target.object_name],
            "surface": node.surface() if color is None else node.surface().colored(color),
            "texture": None if color is None else color.texture,
            "settings": for_live(settings.for_bake()),
        }
        former = self._live_targets.get(target)
        if former is not None and all(_is_same(getattr(former, name), value) for name, value in parts.items()):
            return former
        return LiveTarget(target, **parts)


def _image_size(material, image) -> tuple[int, int] | None:
    """Size of a node's image; None without pixels. BakeError if the node can't show a preview in place of the image."""
    check_editable(material)
    if image is None:
        return None
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


def _are_equal(first, second) -> bool:
    """True if polygons have equal arrays."""
    arrays = ((getattr(first, name), getattr(second, name)) for name in ("corners", "uvs", "starts", "normals"))
    return all((a is None) == (b is None) and (a is None or np.array_equal(a, b)) for a, b in arrays)
