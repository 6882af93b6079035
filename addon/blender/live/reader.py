"""The scene as subjects of pictures, as the viewport has it; only what has changed is read again."""

from __future__ import annotations

import bpy
import numpy as np

from ...core.errors import text_of
from ...core.live.picture import for_live
from ...core.live.subject import Subject
from ...core.scene.illumination import Illumination
from ...core.target import Target
from ..images.files import check_image
from ..node.find import find_bakeable, find_node
from ..read.geometry import read_polygons
from ..read.lights import read_illumination, with_lamps
from ..read.scene_cache import SceneCache
from ..read.visibility import ObjectInstance, check_instance, find_instances, render_visible_names
from .marks import Marks
from .textures import Textures

# Objects that follow, those nearest to what changed: more would wait for each other.
MOST_SUBJECTS = 16

INDIRECT = "indirect light"

OUTPUT = "ShaderNodeOutputMaterial"

SEEN_BY_BAKES = {"LIGHT", "MESH", "CURVE", "SURFACE", "FONT", "META"}


class Reader:
    """Keeps what it has read.

    Attributes
    ----------
    errors : by target, why it can't follow.
    left_out : what pictures lack beside what bakes have.
    """

    def __init__(self) -> None:
        self.errors: dict[Target, str] = {}
        self.left_out: list[str] = []
        self._kept = SceneCache()
        self._illumination: Illumination | None = None
        self._lit: dict[str, Illumination] = {}  # by object: what shines on it
        self._polygons: dict[Target, object] = {}
        self._targets: list[Target] = []
        self._subjects: dict[Target, Subject] = {}
        self._textures = Textures()

    def read(self, depsgraph, marks: Marks) -> list[Subject]:
        """What to paint, in this order; the same objects as before where nothing has changed."""
        scene = depsgraph.scene.original
        if marks.images or marks.other or marks.materials:
            self._textures.forget(None if marks.images or marks.other else marks.materials)
        if marks or self._illumination is None:
            self._read_light(depsgraph, marks)
            if self._illumination is None or not marks.is_lamps_alone() or not self._targets:
                self._read_receivers(depsgraph, marks)
            self._put_in_order(scene, marks)
            self._say_what_is_left_out(depsgraph)
        subjects = {}
        for target in self._targets[:MOST_SUBJECTS]:
            subject = self._subject(depsgraph, target)
            if subject is not None:
                subjects[target] = subject
        self._subjects = subjects
        return list(subjects.values())

    def sentences(self) -> list[str]:
        """What there is to say of textures."""
        return self._textures.sentences()

    def _read_light(self, depsgraph, marks: Marks) -> None:
        light = self._illumination
        if light is not None and marks.is_lamps_alone():
            light = with_lamps(depsgraph, light, marks.lamps)
        else:
            light = None
        if light is None:
            if marks.images:
                self._kept.forget_images()
            self._kept.forget_materials([name for name in marks.materials if not shows_medium_alone(name)])
            if marks.world:
                self._kept.world = None
            self._kept.forget(marks.shaped)
            light = read_illumination(depsgraph, self._kept)
            if self._illumination is not None and light.shadow_key() == self._illumination.shadow_key():
                light = self._illumination.with_light_of(light)
        self._illumination = light
        self._lit.clear()

    def _read_receivers(self, depsgraph, marks: Marks) -> None:
        layer = depsgraph.view_layer
        renders = render_visible_names(layer)
        visible = [obj for obj in layer.objects if obj.visible_get(view_layer=layer) and obj.name in renders]
        self._targets = find_bakeable(layer, visible)
        self.errors = {target: why for target, why in self.errors.items() if target in self._targets}
        changed, due = marks.moved | marks.shaped, []
        for target in self._targets:
            obj = layer.objects.get(target.object_name)  # None where it is an instance, which others move, too
            is_known = target in self._polygons and obj is not None and not marks.other
            if not is_known or obj.name in changed or obj.data.name in changed:
                due.append(target)
        placed = find_instances(depsgraph, {target.object_name for target in due})
        for target in due:
            self._read_polygons(target, placed.get(target.object_name), layer)
        self._polygons = {target: self._polygons[target] for target in self._targets if target in self._polygons}

    def _read_polygons(self, target: Target, placed: ObjectInstance | None, view_layer) -> None:
        self.errors.pop(target, None)
        before = self._polygons.pop(target, None)
        if placed is None:
            return
        try:
            check_instance(target.object_name, placed, view_layer)
            polygons = read_polygons(placed.obj, target.material_name, placed.matrix)
        except Exception as error:  # noqa: BLE001 - the others are still to be read
            self.errors[target] = text_of(error)
            return
        self._polygons[target] = before if before is not None and _are_equal(before, polygons) else polygons

    def _put_in_order(self, scene, marks: Marks) -> None:
        """Those nearest to what has changed first."""
        places = [np.array(place) for place in marks.places(scene)]
        known = {target: polygons.corners for target, polygons in self._polygons.items() if len(polygons.corners)}
        middles = {target: corners.mean(axis=0) for target, corners in known.items()}
        if places:
            self._targets.sort(
                key=lambda target: min(
                    (float(np.linalg.norm(middles[target] - place)) for place in places if target in middles),
                    default=np.inf,
                )
            )

    def _say_what_is_left_out(self, depsgraph) -> None:
        names = [f"what only Cycles knows of '{name}'" for name in self._illumination.by_cycles]
        if depsgraph.scene.beamspread.use_indirect:
            names.insert(0, INDIRECT)
        names += _hidden(depsgraph.view_layer)
        if len(self._targets) > MOST_SUBJECTS:
            names.append(f"{len(self._targets) - MOST_SUBJECTS} objects farther away")
        self.left_out = names

    def _subject(self, depsgraph, target: Target) -> Subject | None:
        """The one of before unless something that handlers don't tell of has changed: values of nodes and settings."""
        if target not in self._polygons:
            return None
        node = find_node(bpy.data.materials.get(target.material_name))
        if node is None:
            return None
        size = None
        if node.image is not None:
            try:
                check_image(node.image)
            except ValueError as error:
                self.errors[target] = text_of(error)
                return None
            size = tuple(node.image.size)
        if target.object_name not in self._lit:
            self._lit[target.object_name] = self._illumination.lighting(target.object_name)
        settings = depsgraph.scene.original.beamspread
        try:
            texture = self._textures.read(depsgraph, target, self._polygons[target], size or settings.resolution)
        except Exception as error:  # noqa: BLE001 - the others are still to be read
            self.errors[target] = text_of(error)
            return None
        parts = {
            "polygons": self._polygons[target],
            "size": size,
            "resolution": settings.resolution,
            "illumination": self._lit[target.object_name],
            "surface": node.surface() if texture is None else texture.base_color.on(node.surface()),
            "texture": None if texture is None else texture.texture,
            "settings": for_live(settings.for_bake()),
        }
        before = self._subjects.get(target)
        if before is not None and all(_is_same(getattr(before, name), value) for name, value in parts.items()):
            return before
        return Subject(target, **parts)


def _hidden(view_layer) -> list[str]:
    """What a bake would see and the viewport does not."""
    rendered = render_visible_names(view_layer)
    objects = (obj for obj in view_layer.objects if obj.type in SEEN_BY_BAKES and obj.name in rendered)
    names = [f"'{obj.name}'" for obj in objects if not obj.visible_get(view_layer=view_layer)]
    return [f"what the viewport hides: {', '.join(names)}"] if names else []


def shows_medium_alone(material_name: str) -> bool:
    """Whether a Beamspread node is all that a material shows: others see nothing of it but its shape."""
    node = find_node(bpy.data.materials.get(material_name))
    return node is not None and any(link.to_node.bl_idname == OUTPUT for link in node.outputs["BSDF"].links)


def _is_same(one, other) -> bool:
    return one is other or (not isinstance(one, Illumination) and type(one) is type(other) and one == other)


def _are_equal(one, other) -> bool:
    arrays = ((getattr(one, name), getattr(other, name)) for name in ("corners", "uvs", "starts", "normals"))
    return all((a is None) == (b is None) and (a is None or np.array_equal(a, b)) for a, b in arrays)
