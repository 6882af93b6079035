"""Meshes that bend, and their texels as a native grid: for tests of native/scene and native/bake."""

from dataclasses import dataclass

import numpy as np
from beamspread.core.native import native


@dataclass
class Mesh:
    """Vertices, triangles counterclockwise from outside, UVs (M, 3, 2) and normals (M, 3, 3) of their corners."""

    vertices: np.ndarray
    triangles: np.ndarray
    uvs: np.ndarray
    normals: np.ndarray

    def occluders(self, *others):
        """Native occluders: the mesh as object 1, and other meshes as vertices and triangles."""
        meshes = [native.OccluderMesh(self.vertices, self.triangles, owners=[1])]
        return native.Occluders(meshes + [native.OccluderMesh(*mesh) for mesh in others])


@dataclass
class Texels:
    """Arrays of `ReceiverGrid.bent`."""

    positions: np.ndarray
    steps_x: np.ndarray
    steps_y: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray
    areas: np.ndarray

    def native(self, owner=1):
        return native.ReceiverGrid.bent(**vars(self), owner=owner)

    @property
    def inside(self):
        return self.normals.any(axis=-1)


def unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-30)


def texels_of(mesh, width, height=None):
    """The texels whose middles lie in a triangle of the UV map."""
    height = height or width
    shape = (height, width)
    out = Texels(np.zeros((*shape, 3)), *[np.zeros((*shape, 3), np.float32) for _ in range(4)], np.zeros(shape, "f4"))
    for triangle, uvs, normals in zip(mesh.triangles, mesh.uvs * (width, height), mesh.normals):
        corners = mesh.vertices[triangle]
        sides = np.stack([uvs[1] - uvs[0], uvs[2] - uvs[0]], 1)
        if abs(np.linalg.det(sides)) < 1e-9 or np.linalg.norm(np.cross(*(corners[1:] - corners[0]))) < 1e-15:
            continue
        to_weights = np.linalg.inv(sides)
        low, high = np.floor(uvs.min(0)).astype(int), np.ceil(uvs.max(0)).astype(int)
        y, x = np.mgrid[max(low[1], 0) : min(high[1], height), max(low[0], 0) : min(high[0], width)]
        b, c = np.moveaxis((np.stack([x, y], -1) + 0.5 - uvs[0]) @ to_weights.T, -1, 0)
        inside = (b >= 0) & (c >= 0) & (b + c < 1)
        y, x, weights = y[inside], x[inside], np.stack([1 - b - c, b, c], -1)[inside]
        steps_x, steps_y = ((corners[1:] - corners[0]).T @ to_weights).T
        normal = unit(weights @ normals)
        out.positions[y, x], out.normals[y, x] = weights @ corners, normal
        out.steps_x[y, x], out.steps_y[y, x] = steps_x, steps_y
        out.tangents[y, x] = unit(steps_x - normal * (normal @ steps_x)[:, None])
        out.areas[y, x] = np.linalg.norm(np.cross(steps_x, steps_y))
    return out


def cut_texels(mesh, width, height=None):
    """The texels that a mesh covers at least in part, and their coverage."""
    uvs = np.ascontiguousarray((mesh.uvs * (width, height or width)).reshape(-1, 2))
    corners = np.ascontiguousarray(mesh.vertices[mesh.triangles].reshape(-1, 3))
    normals = np.ascontiguousarray(mesh.normals.reshape(-1, 3), np.float32)
    shown = native.bent_texels(uvs, corners, normals, width, height or width)
    names = ("positions", "steps_x", "steps_y", "normals", "tangents", "areas")
    return Texels(*[shown[name] for name in names]), np.minimum(shown["covered"], 1)


def ball(columns=32, rows=16, radius=1.0, inward=False, zenith=np.pi, smooth=True):
    """A ball by longitude and latitude, or its cap up to a zenith angle; `inward`: the inside is lit."""
    turn, fall = np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1)
    u, v = np.meshgrid(turn, 1 - fall)
    azimuth, angle = 2 * np.pi * u, zenith * (1 - v)
    points = radius * np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], -1)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    a, b, c, d = corner, corner + columns + 1, corner + columns + 2, corner + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    points, uv = points.reshape(-1, 3), np.stack([u, v], -1).reshape(-1, 2)
    size = np.linalg.norm(np.cross(*np.moveaxis(points[triangles][:, 1:] - points[triangles][:, :1], 1, 0)), axis=1)
    triangles = triangles[size > 1e-9]
    return from_points(points, triangles, uv[triangles], inward, smooth)


def ico_ball(subdivisions, smooth=True):
    """A ball of nearly equal triangles, each an island of half a square."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    corners = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 "
    corners += "2 4 11 6 2 10 8 6 7 9 8 1"
    triangles = np.array(corners.split(), int).reshape(-1, 3)
    faces = unit(np.array(points, float))[triangles]
    for _ in range(subdivisions):
        a, b, c = np.moveaxis(faces, 1, 0)
        ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = np.concatenate([np.stack(part, 1) for part in parts])
    count = len(faces)
    side = int(np.ceil(np.sqrt(count)))
    cell = np.stack([np.arange(count) % side, np.arange(count) // side], -1)[:, None]
    uvs = (cell + np.array([(0.02, 0.02), (0.98, 0.02), (0.02, 0.98)])) / side
    return from_points(faces.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3), uvs, False, smooth)


def cube(half=1.0):
    """A cube of six islands, three by two."""
    corners = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], float) * half
    turns = [np.eye(3), ((1, 0, 0), (0, -1, 0), (0, 0, -1)), ((0, 0, 1), (1, 0, 0), (0, 1, 0))]
    turns += [
        ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
        ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
        ((0, 1, 0), (0, 0, -1), (-1, 0, 0)),
    ]
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
    points = np.concatenate([corners @ np.array(turn, float).T for turn in turns])
    triangles = np.concatenate([np.array([(0, 1, 2), (0, 2, 3)]) + 4 * i for i in range(6)])
    uv = np.concatenate([(square * 0.9 + 0.05 + (i % 3, i // 3)) / (3, 2) for i in range(6)])
    return from_points(points, triangles, uv[triangles], False, False)


def from_points(points, triangles, uvs, inward, smooth):
    sign = -1.0 if inward else 1.0
    corners = points[triangles]
    flat = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[:, None].repeat(3, 1)
    normals = sign * (unit(corners) if smooth else flat)
    return Mesh(np.ascontiguousarray(points, float), np.ascontiguousarray(triangles, np.uint32), uvs, normals)


def flat(grid):
    """Texels like those of a plane: `grid` has the arguments of `ReceiverGrid`."""
    size = (grid["height"], grid["width"])
    x_axis, y_axis = (np.array(grid[name], float) for name in ("x_axis", "y_axis"))
    columns, rows = np.arange(grid["width"]) + 0.5, np.arange(grid["height"])[:, None] + 0.5
    positions = np.array(grid["origin"]) + (columns * grid["pitch_x"])[None, :, None] * x_axis
    positions = positions + (rows * grid["pitch_y"])[..., None] * y_axis
    every = [grid["pitch_x"] * x_axis, grid["pitch_y"] * y_axis, grid["normal"], x_axis]
    vectors = [np.broadcast_to(np.float32(vector), (*size, 3)).copy() for vector in every]
    return Texels(positions, *vectors, np.full(size, grid["pitch_x"] * grid["pitch_y"], np.float32))


def hills(side, height=0.1, turns=1.0):
    """Texels of a square of side 2 with hills in rows and columns; flat without a height."""
    line = (np.arange(side) + 0.5) / side * 2 - 1
    x, y = np.meshgrid(line, line)
    wave, one, none = 6 * turns, np.ones_like(x), np.zeros_like(x)
    positions = np.stack([x, y, height * (np.sin(wave * x) + np.cos(wave * y))], -1)
    return from_steps(
        positions,
        np.stack([one, none, wave * height * np.cos(wave * x)], -1) * 2 / side,
        np.stack([none, one, -wave * height * np.sin(wave * y)], -1) * 2 / side,
    )


def from_steps(positions, steps_x, steps_y):
    """Texels whose normals and areas follow from their steps."""
    normals = np.cross(steps_x, steps_y)
    values = steps_x, steps_y, unit(normals), unit(steps_x), np.linalg.norm(normals, axis=-1)
    return Texels(positions, *[np.ascontiguousarray(value, np.float32) for value in values])
