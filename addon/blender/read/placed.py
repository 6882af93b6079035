"""Where a depsgraph has the objects that are baked: themselves, or the one instance of a collection that shows them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...core.errors import BakeError
from .instances import with_instanced
from .visible import render_visible_names, renders


@dataclass(frozen=True)
class Placed:
    """An evaluated object in the world.

    Attributes
    ----------
    times : in how many places it stands; `matrix` is that of the first.
    is_instance : whether it stands there through others alone.
    """

    obj: object
    matrix: object
    times: int = 1
    is_instance: bool = False


def find_placed(depsgraph, names: set[str], visible: set[str] | None = None) -> dict[str, Placed]:
    """By name, objects of the view layer as they stand in it, and of others the instances that render.

    `visible` names those of the view layer that count, None: all do.
    """
    own = {
        obj.name: obj.evaluated_get(depsgraph)
        for obj in depsgraph.view_layer.objects
        if obj.name in names and (visible is None or obj.name in visible)
    }
    found = {name: Placed(obj, obj.matrix_world) for name, obj in own.items()}
    if len(found) == len(names):
        return found
    visible = render_visible_names(depsgraph.view_layer) if visible is None else visible
    for instance in depsgraph.object_instances:
        name = instance.object.name
        if name not in names or name in own or not instance.is_instance or not renders(instance, visible):
            continue
        obj = instance.object.original.evaluated_get(depsgraph)
        # Geometry nodes may give an object instances of other meshes, under its own name.
        if instance.object.data == obj.data:
            first = found.get(name) or Placed(obj, instance.matrix_world.copy(), 0, is_instance=True)
            found[name] = replace(first, times=first.times + 1)
    return found


def check_placed(name: str, placed: Placed | None, view_layer) -> None:
    """Raise BakeError unless an object stands in one place."""
    if placed is None:
        raise BakeError(why_hidden(name, view_layer))
    if placed.times > 1:
        raise BakeError(
            f"The object '{name}' stands in {placed.times} places as an instance, and has one image, which can't show "
            "the light of all: make them real (Object > Apply > Make Instances Real) and give each a material of its "
            "own (Object > Relations > Make Single User > Materials), or hide all but one from render."
        )


def why_hidden(name: str, view_layer) -> str:
    """A sentence about an object that does not render: a bake of hours would show nothing."""
    others = [] if name in view_layer.objects else with_instanced(view_layer.objects)
    names = " and ".join(f"'{obj.name}'" for obj in others if _shows(obj, name))
    icons = "its camera icon, and its collections'" + (f", and those of {names}, which shows it" if names else "")
    return f"The object '{name}' is hidden from render: turn on {icons}, in the Outliner."


def _shows(obj, name: str) -> bool:
    return any(one.name == name for one in with_instanced([obj]) if one != obj)
