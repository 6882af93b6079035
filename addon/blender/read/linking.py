"""Which objects a light shines on, and which cast its shadows (light linking, Blender 4.0 on)."""

from __future__ import annotations

from .instances import with_instanced


def links_of(obj, names: set[str]) -> dict[str, frozenset[str] | None]:
    """The fields `receivers` and `blockers` of an object's light; `names` are those of all objects of the scene."""
    linking = getattr(obj, "light_linking", None)
    if linking is None:
        return {}
    return {
        "receivers": _linked(linking.receiver_collection, names),
        "blockers": _linked(linking.blocker_collection, names),
    }


def _linked(collection, names: set[str]) -> frozenset[str] | None:
    """Names of the objects that a collection links; None: all.

    Measured in Blender 4.5: where it only excludes objects it links all others, what it has itself goes before what is
    in collections below, whose own states don't count, and an instancer stands for what it shows.
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
    return {one.name for one in with_instanced([obj])}
