"""What there is to bake in a scene, and how each object becomes a job; shared by operator, engine and batch."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import bpy

from . import extract, nodes, targets
from .core.bake import BakeSettings
from .core.errors import BakeError
from .core.job import BakeJob
from .core.receiver import build_receiver, fit_uv_map, texture_size


@dataclass(frozen=True)
class Target:
    """One material of one object, by name: data in Blender may move while a bake runs."""

    object_name: str
    material_name: str

    def __str__(self) -> str:
        return f"{self.object_name} / {self.material_name}"


@dataclass(frozen=True, eq=False)
class Prepared:
    """A target with either its job or the sentence that says why there is none."""

    target: Target
    job: BakeJob | None
    error: str = ""


def sentence(error: Exception) -> str:
    """What to tell the artist about an exception."""
    if type(error).__name__ == "Cancelled":
        return "The bake was cancelled."
    if isinstance(error, MemoryError):
        return "There is not enough memory: lower the resolution."
    if not isinstance(error, (ValueError, OSError)):
        # Nothing that an artist does should lead here: keep what a bug report needs.
        import logging

        logging.getLogger(__name__).error("unexpected error", exc_info=error)
    return str(error) or type(error).__name__


def materials_of(obj) -> list:
    """The object's materials that have a Beamspread node, each once."""
    if obj.type != "MESH":
        return []
    materials = (slot.material for slot in obj.material_slots)
    return list(dict.fromkeys(material for material in materials if nodes.find_node(material) is not None))


def find_targets(objects: Iterable) -> list[Target]:
    """Everything to bake among the objects, in their order."""
    return [Target(obj.name, material.name) for obj in objects for material in materials_of(obj)]


def core_settings(settings, solver: str | None = None) -> BakeSettings:
    """The scene's settings as core's."""
    return BakeSettings(
        solver=solver or settings.solver,
        samples=settings.samples,
        margin=settings.margin,
        quality=settings.quality,
        distributions=settings.distributions.lower(),
        sample_folder=bpy.path.abspath(settings.sample_folder),
    )


def prepare(context, wanted: list[Target], settings: BakeSettings, resolution: int | None = None) -> list[Prepared]:
    """Read the scene at its current frame and make a job of every target.

    Parameters
    ----------
    resolution : texels along the longer side; None keeps the size of the node's image, or the scene's setting where
        there is none.
    """
    for target in wanted:
        # Evaluated before the node's class was registered, it would still be of an unknown class.
        bpy.data.materials[target.material_name].node_tree.update_tag()
    with extract.as_rendered(context.view_layer):
        depsgraph = context.evaluated_depsgraph_get()
        try:
            light = extract.read_scene_light(depsgraph)
        except Exception as error:  # noqa: BLE001 - each bake asked for needs an answer
            return [Prepared(target, None, sentence(error)) for target in wanted]
        visible = extract.render_visible_names(context.view_layer)
        return [_prepare_one(context.scene, depsgraph, light, visible, one, settings, resolution) for one in wanted]


def _prepare_one(scene, depsgraph, light, visible, target: Target, settings, resolution) -> Prepared:
    try:
        check_visible(target.object_name, visible)
        obj = scene.objects[target.object_name].evaluated_get(depsgraph)
        job = make_job(obj, target.material_name, light, settings, resolution, scene.beamspread.resolution)
    except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
        return Prepared(target, None, sentence(error))
    return Prepared(target, job)


def check_visible(object_name: str, visible: set[str]) -> None:
    """Raise BakeError if the object does not render: a bake of hours would show nothing."""
    if object_name not in visible:
        raise BakeError(
            f"The object '{object_name}' is hidden from render: turn on its camera icon, and its collections', "
            "in the Outliner."
        )


def make_job(
    obj,
    material_name: str,
    light: extract.SceneLight,
    settings: BakeSettings,
    resolution: int | None,
    default_resolution: int,
    size: tuple[int, int] | None = None,
) -> BakeJob:
    """The job of one material of an evaluated object; `size` overrides all other sizes.

    Raises
    ------
    BakeError
        Anything that keeps it from being baked, in one sentence.
    """
    material = next(material for material in materials_of(obj) if material.name == material_name)
    node = nodes.find_node(material)
    surface = extract.read_surface(node)
    surface.check()
    if size is None and node.image is not None:
        targets.check_image(node.image.original)
        if resolution is None:
            size = tuple(node.image.original.size)
    polygons = extract.read_polygons(obj, material_name)
    uv_map = fit_uv_map(polygons)
    width, height = size or texture_size(uv_map, resolution or default_resolution)
    receiver = build_receiver(polygons, uv_map, width, height)
    warnings = light.warnings if light.lights else (*light.warnings, "No light of the scene can be baked: it is black.")
    return BakeJob(receiver, light.lights, light.occluders, surface, settings, warnings)
