"""Reads a Blender scene once, through its evaluated depsgraph, into the plain dataclasses of core."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from . import compat
from .core.errors import ReceiverError
from .core.job import Surface
from .core.material import Material
from .core.receiver import Polygons
from .core.scene import Light, Mesh, PointLight, SpotLight, SunLight

GEOMETRY_TYPES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


@dataclass(frozen=True, eq=False)
class SceneLight:
    """Lights and what they shine past; `warnings` name lights that are left out."""

    lights: tuple[Light, ...]
    occluders: Mesh
    warnings: tuple[str, ...]


def read_scene_light(depsgraph) -> SceneLight:
    """Lights and shadow casters of all objects and instances that render."""
    visible = render_visible_names(depsgraph.view_layer)
    lights, parts, warnings, cache = [], [], [], {}
    for instance in depsgraph.object_instances:
        if not _renders(instance, visible):
            continue
        obj = instance.object
        if obj.type == "LIGHT":
            light = _read_light(obj, instance.matrix_world, warnings)
            if light is not None:
                lights.append(light)
        elif obj.type in GEOMETRY_TYPES and getattr(obj, "visible_shadow", True):
            part = _world_triangles(obj, instance.matrix_world, cache)
            if part is not None:
                parts.append(part)
    return SceneLight(tuple(lights), Mesh.join(parts), tuple(dict.fromkeys(warnings)))


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


def _renders(instance, visible: set[str]) -> bool:
    obj = instance.object
    if instance.is_instance:
        parent = instance.parent
        return not obj.hide_render and parent is not None and parent.name in visible
    if obj.name not in visible:
        return False
    # An instancer that hides itself still shows its instances.
    return not obj.is_instancer or obj.show_instancer_for_render


def _read_light(obj, matrix, warnings: list[str]) -> Light | None:
    data = obj.data
    strength, color = compat.light_strength(data), compat.light_color(data)
    if data.use_nodes and data.node_tree is not None:
        factor, node_color, understood = _light_nodes(data.node_tree)
        if not understood:
            warnings.append(f"The nodes of the light '{obj.name}' are not understood: only its plain light counts.")
        strength *= factor
        color = tuple(a * b for a, b in zip(color, node_color))
    if strength == 0 or not any(color):
        return None
    axes = np.array(matrix, dtype=float)
    position = tuple(axes[:3, 3].tolist())
    shadow = compat.light_casts_shadow(data)
    if data.type == "SUN":
        travel = -axes[:3, 2] / np.linalg.norm(axes[:3, 2])
        return SunLight(obj.name, tuple(travel.tolist()), strength, color, shadow)
    if data.type == "POINT":
        return PointLight(obj.name, position, strength, color, shadow)
    if data.type == "SPOT":
        frame = tuple(tuple(row) for row in axes[:3, :3].T.tolist())
        cone = frame, data.spot_size, data.spot_blend, compat.spot_falloff()
        return SpotLight(obj.name, position, strength, color, shadow, *cone)
    warnings.append(f"The area light '{obj.name}' is left out: only sun, point and spot lights can be baked so far.")
    return None


def _light_nodes(tree) -> tuple[float, tuple[float, float, float], bool]:
    """Strength and colour that a light's nodes multiply it with, and whether they were understood."""
    plain = 1.0, (1.0, 1.0, 1.0), False
    output = tree.get_output_node("ALL")
    if output is None or not output.inputs["Surface"].is_linked:
        return 0.0, (0.0, 0.0, 0.0), True
    emission = output.inputs["Surface"].links[0].from_node
    if emission.bl_idname != "ShaderNodeEmission":
        return plain
    color, strength = emission.inputs["Color"], emission.inputs["Strength"]
    if color.is_linked or strength.is_linked:
        return plain
    return float(strength.default_value), tuple(color.default_value)[:3], True


def _world_triangles(obj, matrix, cache: dict) -> Mesh | None:
    """Triangles of an evaluated object in world space; `cache` shares the local ones among instances."""
    key = obj.data.as_pointer() if obj.data is not None else obj.as_pointer()
    if key not in cache:
        cache[key] = _local_triangles(obj)
    local = cache[key]
    if local is None:
        return None
    return Mesh(_transform(local.vertices, matrix), local.triangles)


def _local_triangles(obj) -> Mesh | None:
    mesh = obj.to_mesh()
    if mesh is None:
        return None
    try:
        mesh.calc_loop_triangles()
        if not mesh.loop_triangles:
            return None
        triangles = np.empty(len(mesh.loop_triangles) * 3, np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles)
        return Mesh(_vertices(mesh), triangles.astype(np.uint32).reshape(-1, 3))
    finally:
        obj.to_mesh_clear()


def _vertices(mesh) -> np.ndarray:
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    return vertices.reshape(-1, 3)


def _transform(points: np.ndarray, matrix) -> np.ndarray:
    world = np.array(matrix, dtype=float)
    return points.astype(float) @ world[:3, :3].T + world[:3, 3]


def read_polygons(obj, material_name: str) -> Polygons:
    """The faces of an evaluated mesh object that carry the material, in world space.

    Raises
    ------
    ReceiverError
        A scale of zero.
    """
    mesh = obj.to_mesh()
    try:
        totals, starts, slots = (np.empty(len(mesh.polygons), np.int32) for _ in range(3))
        mesh.polygons.foreach_get("loop_total", totals)
        mesh.polygons.foreach_get("loop_start", starts)
        mesh.polygons.foreach_get("material_index", slots)
        normals = np.empty(len(mesh.polygons) * 3, np.float32)
        mesh.polygons.foreach_get("normal", normals)
        corners = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        uvs, vertices = _active_uvs(mesh), _vertices(mesh)
    finally:
        obj.to_mesh_clear()
    chosen = np.flatnonzero(_has_material(obj, slots, material_name))
    sizes = totals[chosen]
    new_starts = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    loops = np.repeat(starts[chosen] - new_starts[:-1], sizes) + np.arange(new_starts[-1])
    world = np.array(obj.matrix_world, dtype=float)[:3, :3]
    if abs(np.linalg.det(world)) < 1e-30:
        world = _flat_scale(world)
    # Normals transform with the inverse transpose, which also keeps them outward under mirroring.
    world_normals = normals.reshape(-1, 3)[chosen] @ np.linalg.inv(world)
    lengths = np.linalg.norm(world_normals, axis=1, keepdims=True)
    return Polygons(
        corners=_transform(vertices[corners[loops]], obj.matrix_world),
        uvs=None if uvs is None else uvs[loops].astype(float),
        starts=new_starts,
        normals=world_normals / np.where(lengths > 0, lengths, 1),
    )


def _flat_scale(world: np.ndarray) -> np.ndarray:
    """A plane may well have scale 0 along its normal: give that axis a length, which its normal alone needs."""
    scales = np.linalg.norm(world, axis=0)
    if (scales == 0).sum() != 1:
        raise ReceiverError("The object's scale is zero along more than one axis: reset it (Alt+S).")
    flat = int(np.argmin(scales))
    world = world.copy()
    world[:, flat] = np.cross(world[:, (flat + 1) % 3], world[:, (flat + 2) % 3])
    return world


def _active_uvs(mesh) -> np.ndarray | None:
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer is None:
        return None
    uvs = np.empty(len(mesh.loops) * 2, np.float32)
    layer.data.foreach_get("uv", uvs)
    return uvs.reshape(-1, 2)


def _has_material(obj, slots: np.ndarray, material_name: str) -> np.ndarray:
    """Which faces carry the material; Blender gives faces with a slot too high the last one."""
    names = [slot.material.name if slot.material else None for slot in obj.material_slots]
    matches = np.array([name == material_name for name in names] or [False])
    return matches[np.clip(slots, 0, len(matches) - 1)]


def read_surface(node) -> Surface:
    """A Beamspread node's values; lengths stay in scene units, as the geometry's."""
    material = Material(
        albedo=tuple(map(_decimal, node.albedo)),
        mean_free_path=tuple(map(_decimal, node.mean_free_path)),
        anisotropy=_decimal(node.anisotropy),
        ior=_decimal(node.ior),
    )
    base_color = tuple(map(_decimal, node.base_color)) if node.color_mode == "BASE_COLOR" else None
    return Surface(material, _decimal(node.thickness), base_color)


def _decimal(value: float) -> float:
    """The number typed, from Blender's 32-bit float: 0.8, not 0.800000012, which would be another medium."""
    return float(f"{value:.7g}")


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

    objects = list(view_layer.objects)
    hidden = [obj for obj in objects if obj.hide_get(view_layer=view_layer)]
    try:
        visit(view_layer.layer_collection)
        for obj in objects:
            if obj.library is not None or obj.hide_render:
                continue
            set_value(obj, "hide_viewport", False)
            obj.hide_set(False, view_layer=view_layer)
            for modifier in obj.modifiers:
                set_value(modifier, "show_viewport", modifier.show_render)
                if modifier.type == "SUBSURF":
                    set_value(modifier, "levels", modifier.render_levels)
        view_layer.update()
        yield
    finally:
        for owner, name, value in reversed(restore):
            setattr(owner, name, value)
        for obj in hidden:
            obj.hide_set(True, view_layer=view_layer)
        view_layer.update()
