"""Objects that stand in a scene because another one, an instancer, shows the collection that has them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def collection_of(obj):
    """The collection that an object shows at its place, or None."""
    return obj.instance_collection if obj.instance_type == "COLLECTION" else None


def instanced_collections(objects: Iterable) -> list:
    """Collections that objects show, and those that the objects in these show in turn; each once."""
    found, waiting = {}, list(objects)
    for obj in waiting:
        collection = collection_of(obj)
        if collection is not None and collection not in found:
            found[collection] = None
            waiting.extend(collection.all_objects)
    return list(found)


def with_instanced(objects: Iterable) -> list:
    """The objects, and after them those of the collections that they show; each once."""
    objects = list(objects)
    inner = (obj for collection in instanced_collections(objects) for obj in collection.all_objects)
    return list(dict.fromkeys([*objects, *inner]))


def by_name(scene) -> dict:
    """The objects that a scene has and shows, those of its own before others of the same name."""
    return {obj.name: obj for obj in reversed(with_instanced(scene.objects))}


def rendered_in(collection) -> list:
    """What a render shows of a collection where that is instanced, but for what its objects show in turn."""
    found = {}
    if not collection.hide_render:
        found = dict.fromkeys(obj for obj in collection.objects if not obj.hide_render)
        for child in collection.children:
            found |= dict.fromkeys(rendered_in(child))
    return list(found)


def count_places(objects: Iterable, known: dict | None = None) -> Counter:
    """By name, in how many places a render of the objects shows others through collections."""
    known, total = {} if known is None else known, Counter()
    for collection, times in Counter(filter(None, map(collection_of, objects))).items():
        if collection not in known:
            inside = rendered_in(collection)
            known[collection] = count_places(inside, known) + Counter(obj.name for obj in inside)
        for name, count in known[collection].items():
            total[name] += times * count
    return total
