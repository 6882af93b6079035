"""How each target becomes a job, or a sentence that says why it can't; shared by operator, engine and batch."""

from __future__ import annotations

import bpy

from ...core.bake.job import BakeJob
from ...core.bake.runner import Bake, Target
from ...core.bake.settings import BakeSettings
from ...core.errors import BakeError, sentence
from ...core.scene.illumination import Illumination
from ...core.scene.receiver import build_receiver, texture_size
from ...core.scene.uv_map import fit_uv_maps
from ..cycles.light import CyclesLight
from ..images.files import check_image
from ..node.find import find_place, materials_of
from ..read.geometry import read_polygons
from ..read.lights import read_illumination
from ..read.visible import as_rendered, render_visible_names
from .texture import with_texture


def prepare_scene(context, targets: list[Target], settings: BakeSettings, resolution: int | None = None) -> list[Bake]:
    """Read the scene as it would render at its current frame and make a job of every target.

    Parameters
    ----------
    resolution : texels along the longer side; None keeps the size of the node's image, or the scene's setting where
        there is none.
    """
    for target in targets:
        # Evaluated before the node's class was registered, it would still be of an unknown class.
        bpy.data.materials[target.material_name].node_tree.update_tag()
    with as_rendered(context.view_layer):
        visible = render_visible_names(context.view_layer)
        return prepare(context.evaluated_depsgraph_get(), targets, settings, resolution, visible=visible)


def prepare(
    depsgraph,
    targets: list[Target],
    settings: BakeSettings,
    resolution: int | None = None,
    size: tuple[int, int] | None = None,
    visible: set[str] | None = None,
) -> list[Bake]:
    """A bake for each target; `size` overrides all other sizes, `visible` names the objects that render, None: all."""
    try:
        illumination, by_cycles = read_illumination(depsgraph), CyclesLight(depsgraph)
    except Exception as error:  # noqa: BLE001 - each bake asked for needs an answer
        return [Bake(target, error=sentence(error)) for target in targets]
    bakes = []
    for target in targets:
        try:
            if visible is not None:
                check_visible(target.object_name, visible)
            job = _make_job(depsgraph, target, illumination, settings, resolution, size)
            bakes.append(Bake(target, by_cycles.complete(job)))
        except Exception as error:  # noqa: BLE001 - one object's failure must not keep the others from being baked
            bakes.append(Bake(target, error=sentence(error)))
    return bakes


def check_visible(object_name: str, visible: set[str]) -> None:
    """Raise BakeError if the object does not render: a bake of hours would show nothing."""
    if object_name not in visible:
        raise BakeError(
            f"The object '{object_name}' is hidden from render: turn on its camera icon, and its collections', "
            "in the Outliner."
        )


def _make_job(
    depsgraph, target: Target, illumination: Illumination, settings: BakeSettings, resolution, size
) -> BakeJob:
    obj = depsgraph.scene.objects[target.object_name].evaluated_get(depsgraph)
    node, groups = find_place(next(one for one in materials_of(obj) if one.name == target.material_name))
    surface = node.surface()
    surface.check()
    if size is None and node.image is not None:
        check_image(node.image.original)
        size = tuple(node.image.original.size) if resolution is None else None
    maps = fit_uv_maps(read_polygons(obj, target.material_name))
    size = size or texture_size(maps, resolution or depsgraph.scene.beamspread.resolution)
    job = BakeJob(obj.name, build_receiver(maps, *size), illumination.lighting(obj.name), surface, settings)
    return with_texture(job, node, groups, obj) if node.has_texture() else job
