"""Shapes of targets, for announced times: the faces as they are before anything is evaluated for a bake."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from mathutils import Vector

from ...core.bake.spread import image_length, spread_over_edges
from ...core.errors import BakeError
from ...core.scene.bending import BALL, Bending, bending_of
from ...core.scene.bent_grid import HOLLOW_SIDE, see_each_other
from ...core.scene.flat_mesh import bends, check_faces
from ...core.scene.polygons import Polygons
from ...core.scene.receiver import Grid
from ...core.scene.stretch import lengths_of_faces, pieces_of_faces
from ...core.target import FRONT
from ..images.facts import is_sequence
from ..node.find import BakeTarget, uses_tiles
from ..read.geometry import mesh_key, read_polygons
from ..read.scene_cache import scene_cache

MAX_FACES = 100_000
"""Number of faces of a mesh up to which their areas are read. More slow the scans of a scene down."""

PLANE_DIGITS = 3
"""Digits of normals, and of distances relative to the surface, by which planes are told apart."""


@dataclass(frozen=True)
class Shape:
    """Facts about the faces of a target.

    Attributes
    ----------
    length : of an image's side on the surface, scene units; 0 for a surface without area, or if it is not known.
    is_bent : True if the surface bends.
    sides : of an image on a surface that bends, scene units; only their ratio counts.
    filled : part of the image that shows the faces.
    pieces : into which a texel is divided where the surface bends, on average.
    is_hollow : True if parts of a surface that bends see each other.
    bending : of a surface that bends.
    planes : on which the faces of a surface lie that does not bend, about.
    error : reason why the target can't be baked, if that is known.
    """

    length: float = 0.0
    is_bent: bool = False
    sides: tuple[float, float] = (1.0, 1.0)
    filled: float = 1.0
    pieces: float = 1.0
    is_hollow: bool = False
    bending: Bending = BALL
    planes: int = 1
    error: BakeError | None = None


def shape_of(target: BakeTarget, depsgraph) -> Shape:
    """The shape of a target. Where a mesh is large, its length is that of the box around it, and it counts as bent."""
    obj, matrix = target.obj, target.obj.matrix_world
    if len(getattr(obj.data, "polygons", ())) > MAX_FACES:  # curves and text have none themselves
        return Shape(max(obj.dimensions), True)
    evaluated, node = obj.evaluated_get(depsgraph), target.node
    is_tiled = uses_tiles(node, target.side)
    surface = node.surface()
    try:
        surface.check()
    except BakeError:
        return Shape()  # `problems` says why
    path, spread = min(surface.material.mean_free_path), spread_over_edges(surface)

    def read() -> Shape:
        try:
            polygons = read_polygons(evaluated, target.material.name, None, node.uv_map, is_tiled)
            check_faces(polygons, obj.name)
            length = image_length([polygons])
            if not 0 < length < math.inf:
                return Shape()
            is_bent = bends(polygons, path, spread)
            filled = float(polygons.areas.sum()) / length**2
            if not is_bent:
                return Shape(length, filled=filled, planes=_planes(polygons))
            facts = (
                lengths_of_faces(polygons),
                filled,
                pieces_of_faces(polygons),
                _is_hollow(polygons),
                bending_of(polygons),
            )
            return Shape(length, is_bent, *facts)
        except BakeError as error:
            return Shape(error=error)

    state = mesh_key(evaluated), node.uv_map, is_tiled, path, spread, *(tuple(row) for row in matrix)
    return scene_cache.get(("shape of image", obj, target.material.name), [obj], read, state=state)


def _planes(polygons: Polygons) -> int:
    """Number of planes on which faces lie, by their normals and distances from the origin."""
    firsts = polygons.corners[polygons.starts[:-1]]
    distances = np.einsum("nc,nc->n", firsts, polygons.normals) / (float(np.ptp(polygons.corners)) or 1.0)
    return len(np.unique(np.round(np.column_stack([polygons.normals, distances]), PLANE_DIGITS), axis=0))


def _is_hollow(polygons: Polygons) -> bool:
    """True if parts of a surface see each other, by the middles of some faces."""
    count = min(polygons.count, HOLLOW_SIDE**2)
    faces = np.linspace(0, polygons.count - 1, count).astype(int)
    middles = np.array([polygons.corners[polygons.starts[face] : polygons.starts[face + 1]].mean(0) for face in faces])
    return see_each_other(middles, polygons.normals[faces], float(np.ptp(polygons.corners, axis=0).max()))


def grid_of(target: BakeTarget, shape: Shape, resolution: int) -> Grid | None:
    """About the grid of a target: as if the texture covered the object's largest two sides, in a plane."""
    obj, image = target.obj, target.image
    if is_sequence(image):
        return None
    matrix, faces = obj.matrix_world, getattr(obj.data, "polygons", ())
    # Modifiers may make the faces of a mesh that has none, and curves and text mostly lie in their plane z = 0.
    face_normal, middle = (faces[0].normal, faces[0].center) if len(faces) else (Vector((0, 0, 1)), _middle(obj))
    normal = matrix.to_3x3().inverted_safe().transposed() @ face_normal
    x_axis = matrix.to_3x3().col[0] if abs(face_normal.x) < 0.9 else matrix.to_3x3().col[1]
    if not normal.length or not x_axis.length:
        return None
    normal.normalize()
    x_axis = (x_axis - x_axis.dot(normal) * normal).normalized()
    y_axis = normal.cross(x_axis)
    corners = np.array(obj.bound_box) @ np.array(matrix)[:3, :3].T + np.array(matrix)[:3, 3]
    along = corners @ np.array([x_axis, y_axis]).T
    sides = np.ptp(along, axis=0)
    if not sides.all():
        return None
    lengths = np.array(shape.sides) if shape.is_bent else sides
    size = np.maximum(np.rint(resolution * lengths / lengths.max()), 1) if image is None else np.array(image.size)
    if not size.all():
        return None
    if (size[0] < size[1]) != (sides[0] < sides[1]):
        size = size[::-1]
    columns, rows = map(int, size)
    low, height = along.min(axis=0), (matrix @ middle).dot(normal)
    origin = low[0] * np.array(x_axis) + low[1] * np.array(y_axis) + height * np.array(normal)
    whole = np.broadcast_to(np.float32(1), (rows, columns))
    axes = tuple(x_axis), tuple(y_axis), tuple(normal)
    grid = Grid(tuple(origin.tolist()), *axes, *map(float, sides / [columns, rows]), columns, rows, whole)
    return grid if target.side == FRONT else grid.flipped()


def _middle(obj) -> Vector:
    """Middle of the box around an object, in its own coordinates."""
    return (Vector(obj.bound_box[0]) + Vector(obj.bound_box[6])) / 2


def grid_of_bent(grid: Grid, shape: Shape) -> Grid:
    """The grid with as many texels as show a surface that bends, and with their pitch."""
    side = math.sqrt(grid.texels)
    count, pitch = max(round(side * math.sqrt(shape.filled)), 1), shape.length / side
    corner = grid.centre - 0.5 * count * pitch * (np.array(grid.x_axis) + np.array(grid.y_axis))
    whole = np.broadcast_to(np.float32(1), (count, count))
    size = {"pitch_x": pitch, "pitch_y": pitch, "width": count, "height": count, "coverage": whole}
    return replace(grid, origin=tuple(corner.tolist()), **size)
