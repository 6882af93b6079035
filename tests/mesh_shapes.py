"""Meshes for tests, as polygons."""

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
