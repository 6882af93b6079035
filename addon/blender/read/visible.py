"""What a render of a view layer shows, as against the viewport."""

from __future__ import annotations

from contextlib import contextmanager

from .instances import instanced_collections


def render_visible_names(view_layer) -> set[str]:
    """Names of the objects that a render of the view layer shows (the depsgraph of the viewport shows others)."""
    names: set[str] = set()

    def visit(layer_collection) -> None:
        if layer_collection.exclude or layer_collection.collection.hide_render:
            return
        names.update(obj.name for obj in layer_collection.collection.objects if not obj.hide_render)
        for child in layer_collection.children:
            visit(child)

    visit(view_layer.layer_collection)
    return names


def renders(instance, visible: set[str]) -> bool:
    obj = instance.object
    if instance.is_instance:
        parent = instance.parent
        return not obj.hide_render and parent is not None and parent.name in visible
    if obj.name not in visible:
        return False
    # An instancer that hides itself still shows its instances.
    return not obj.is_instancer or obj.show_instancer_for_render


@contextmanager
def as_rendered(view_layer):
    """Make the viewport's depsgraph hold what a render would, for the time of a `with` block.

    Blender offers scripts no depsgraph in render mode outside a render engine, and its viewport's leaves out objects
    and modifiers that are hidden there but render.
    """
    restore = []

    def set_value(owner, name, value) -> None:
        if getattr(owner, name) != value:
            restore.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    def visit(layer_collection) -> None:
        if layer_collection.exclude:
            return
        set_value(layer_collection, "hide_viewport", False)
        if layer_collection.collection.library is None:
            set_value(layer_collection.collection, "hide_viewport", False)
        for child in layer_collection.children:
            visit(child)

    def show_modifiers(obj) -> None:
        for modifier in obj.modifiers:
            set_value(modifier, "show_viewport", modifier.show_render)
            if modifier.type == "SUBSURF":
                set_value(modifier, "levels", modifier.render_levels)

    def learn_of_parts() -> None:
        for collection in collections:
            collection.update_tag()  # of what it shows where one within is hidden, or no longer

    objects = list(view_layer.objects)
    # Lists, since what is hidden or not makes collections look for their objects anew.
    collections = instanced_collections(view_layer.id_data.objects)
    parts = [part for collection in collections for part in (collection, *collection.children_recursive)]
    instanced = [obj for collection in collections for obj in collection.all_objects]
    hidden = [obj for obj in objects if obj.hide_get(view_layer=view_layer)]
    try:
        visit(view_layer.layer_collection)
        for obj in objects:
            if obj.library is not None or obj.hide_render:
                continue
            set_value(obj, "hide_viewport", False)
            obj.hide_set(False, view_layer=view_layer)
            show_modifiers(obj)
        for part in parts:
            if part.library is None:
                set_value(part, "hide_viewport", part.hide_render)
        learn_of_parts()
        for obj in instanced:
            if obj.library is None:
                set_value(obj, "hide_viewport", obj.hide_render)
                show_modifiers(obj)
        view_layer.update()
        yield
    finally:
        for owner, name, value in reversed(restore):
            setattr(owner, name, value)
        for obj in hidden:
            obj.hide_set(True, view_layer=view_layer)
        learn_of_parts()
        view_layer.update()
