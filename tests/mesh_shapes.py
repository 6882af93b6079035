"""Meshes for tests, as polygons."""

from dataclasses import replace

import numpy as np
from beamspread.core.scene.polygons import Polygons

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)


def mesh_of(faces, uvs=None):
    """Polygons of faces (n, 3) and their UVs (n, 2); normals by the order of corners."""
    corners = np.concatenate(faces)
    starts = np.concatenate([[0], np.cumsum([len(face) for face in faces])])
    normals = np.array([np.cross(face[1] - face[0], face[2] - face[0]) for face in faces])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return Polygons(corners, None if uvs is None else np.concatenate(uvs), starts, normals)


def box(size=(1.0, 1.0, 1.0)):
    """Six faces of a box around the origin, normals outward."""
    faces = []
    for axis in range(3):
        for sign in (-1, 1):
            u, v = ((axis + 1) % 3, (axis + 2) % 3)[:: int(sign)]
            face = np.zeros((4, 3))
            face[:, u], face[:, v], face[:, axis] = SQUARE[:, 0] - 0.5, SQUARE[:, 1] - 0.5, 0.5 * sign
            faces.append(face * size)
    return faces


def heights(function, count=24):
    """Quads over the unit square whose corners have the height that a function gives."""
    line = np.linspace(0, 1, count + 1)
    x, y = np.meshgrid(line, line)
    points = np.stack([x, y, function(x, y)], -1)
    quads = [points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]]
    faces = np.stack(quads, axis=2).reshape(-1, 4, 3)
    return list(faces), list(faces[:, :, :2])


def smooth_ball(columns=48, rows=24, at=(0.0, 0.0, 0.0), radius=1.0):
    """Faces of a ball of quadrilaterals, and of triangles at the poles, with smooth normals and longitudes as UVs."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    azimuth, polar = 2 * np.pi * u, np.pi * (1 - v)
    points = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    points[0], points[-1] = (0, 0, -1), (0, 0, 1)

    def corners(values):
        faces = []
        for row in range(rows):
            for column in range(columns):
                around = [(row, column), (row, column + 1), (row + 1, column + 1), (row + 1, column)]
                around = around[1:] if row == 0 else around[:3] if row == rows - 1 else around
                faces.append(values[tuple(np.transpose(around))])
        return faces

    faces, uvs = corners(points), corners(np.stack([u, v], -1))
    polygons = mesh_of(faces, uvs)
    normals = polygons.corners / np.linalg.norm(polygons.corners, axis=1)[:, None]
    return replace(polygons, corners=radius * polygons.corners + at, corner_normals=normals.astype(np.float32))
