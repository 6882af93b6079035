"""Fingerprints: digests of everything that bakes read, by names for artists.

They are made from the scene as the window has it, so that they cost little, by the readers of bakes and Live and with
their cache. Materials count by the light that they emit and let through, or by the values of their nodes where
evaluating these takes long or only Cycles can.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import bpy

from ....core.target import Target
from ... import compat
from ...node.find import find_node, find_node_in_groups
from ...node.node import image_of_side
from ...read.digests import digest
from ...read.scene_cache import scene_cache
from ...read.visibility import by_name
from .object_digests import ObjectDigests, surface_values, texture_tree


class Parts(dict[str, str]):
    """Digests of the parts of a scene that a bake reads, by names for artists.

    Attributes
    ----------
    objects : names of the other objects by their digests, which follow the digest of all in `OTHERS`.
    """

    objects: Mapping[str, str] = {}


IMAGE, QUALITY, SETTINGS, OTHERS = "size of the image", "quality", "settings", "other objects"

MAX_OBJECTS = 300
"""Number of other objects up to which each has a digest of its own; more make images larger by 9 bytes each."""

EACH = "each:"
"""Word before the digests of single objects; records of earlier versions lack both."""

MAX_NAMED = 3
"""Number of changed objects that are named."""

# Cycles' settings for bounced light.
BOUNCES = (
    *("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "volume_bounces"),
    *("transparent_max_bounces", "caustics_reflective", "caustics_refractive", "blur_glossy"),
)


def fingerprints(context, targets: Iterable[Target], is_for_bake: bool = False) -> dict[Target, Parts]:
    """Digests of each target of the context's scene; targets that are gone are left out.

    `is_for_bake`: a bake follows, which shows hidden objects for a moment, so that no earlier digest of them stays.
    """
    scene, view_layer, depsgraph = context.scene, context.view_layer, context.evaluated_depsgraph_get()
    scene_cache.enter(depsgraph)
    scene_cache.check_images()
    objects, known, parts = ObjectDigests(depsgraph, is_for_bake), by_name(scene), {}
    nodes = filter(None, map(find_node, bpy.data.materials))
    results = {image.name_full for node in nodes for image in (node.image, node.image_back) if image is not None}
    world = _world(compat.original_world(view_layer, scene), view_layer, objects.images)
    for target in targets:
        obj, material = known.get(target.object_name), bpy.data.materials.get(target.material_name)
        place = None if obj is None else find_node_in_groups(material)
        if place is None:
            continue
        texture, solids = texture_tree(material, *place), objects.solids(material.name_full)
        solids.pop(obj.name, None)
        others = {_text(other, 8): name for name, other in solids.items()}
        values = {
            "object": _text(objects.shape_of(obj.name)),
            "other materials of the object": objects.other_materials(obj.name, material.name_full),
            OTHERS: " ".join([_text(solids.total()), *_each_of(others)]),
            "lights": _text(objects.lamps),
            "world": world,
            "textures": _digest_of({*objects.images, *texture.images} - results),
            "material": digest(
                surface_values(*place, target.side), texture.text, place[0].uv_map, objects.look_of(material)
            ),
            SETTINGS: settings_part(scene),
            QUALITY: _quality(scene),
            IMAGE: image_part(image_of_side(place[0], target.side)),
        }
        parts[target] = Parts(values)
        parts[target].objects = others
    return parts


def changed_objects(before: str, now: Parts) -> str:
    """Words for the other objects that differ between a part `OTHERS` of a bake and present ones."""
    _, *count, known = before.partition(f" {EACH}")
    if not any(count) or len(now.objects) > MAX_OBJECTS:
        return OTHERS
    changed = sorted(name for number, name in now.objects.items() if number not in known.split(" "))
    if not changed:
        return "removed or hidden objects"
    rest = len(changed) - MAX_NAMED
    more = f" and {rest} more object{'s' if rest > 1 else ''}" if rest > 0 else ""
    return ", ".join(f"'{name}'" for name in changed[:MAX_NAMED]) + more


def _each_of(others: Iterable[str]) -> list[str]:
    """The digest of each of the other objects, unless there are too many."""
    numbers = sorted(others)
    return [EACH, *numbers] if len(numbers) <= MAX_OBJECTS else []


def _text(total: int, digits: int = 16) -> str:
    return f"{total % 16**digits:x}"


def _digest_of(images: Iterable[str]) -> str:
    """Digest of the pixels of textures."""
    return digest(sorted((name, scene_cache.image_digest(name)) for name in images))


def _world(world, view_layer, images: dict) -> str:
    if world is None or not view_layer.use_sky:
        return ""
    tree = scene_cache.tree(world)
    images |= dict.fromkeys(tree.images)
    return digest(tuple(world.color), compat.uses_nodes(world) and tree.text, world.cycles_visibility.diffuse)


def image_part(image) -> str:
    """Digest of the size of the node's image; "" for None."""
    return digest(tuple(image.size)) if image is not None else ""


def settings_part(scene, solver: str | None = None, indirect: bool | None = None) -> str:
    """Digest of the bake settings; arguments override the scene's."""
    settings = scene.beamspread
    use_indirect = settings.use_indirect if indirect is None else indirect
    bounces = (
        [getattr(scene.cycles, name, None) for name in BOUNCES] if use_indirect and hasattr(scene, "cycles") else []
    )
    values = [solver or settings.solver, settings.distributions, settings.samples, settings.margin, use_indirect]
    if settings.margin_type != "EXTEND":
        values.append(settings.margin_type)
    return digest(values, compat.transparent_bounces(scene), *bounces)


def _quality(scene) -> str:
    """Quality of the distributions, or the folder of samples; no digest, since a quick preview replaces it."""
    settings = scene.beamspread
    return settings.quality if settings.distributions == "LIBRARY" else bpy.path.abspath(settings.sample_folder)
