"""Meshes, receivers and brute force that the tests of native/scene share."""

import numpy as np
from beamspread.core.native import native

SQUARE = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)


def rotation(seed):
    """A random rotation: rows are three axes."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def make_grid(width=8, height=None, size=(2.0, 2.0), axes=None, centre=(0, 0, 0)):
    """Arguments of a ReceiverGrid for a rectangle around `centre`; rows of `axes` are its x and y axis and normal."""
    height, axes = height or width, np.eye(3) if axes is None else axes
    return {
        "origin": np.asarray(centre) - axes[0] * size[0] / 2 - axes[1] * size[1] / 2,
        "x_axis": axes[0],
        "y_axis": axes[1],
        "normal": axes[2],
        "pitch_x": size[0] / width,
        "pitch_y": size[1] / height,
        "width": width,
        "height": height,
    }


def occluders(*meshes, **options):
    """Native occluders of meshes, each given as vertices and triangles."""
    return native.Occluders([native.OccluderMesh(*mesh) for mesh in meshes], **options)


def box(low, high):
    """Vertices and triangles of an axis-aligned box."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)
    return np.array(low) + corners * np.subtract(high, low), triangles


def net(columns, rows):
    """Triangles of a net of columns x rows quads, whose vertices stand row by row."""
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    a, b, c, d = corner, corner + 1, corner + columns + 2, corner + columns + 1
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)


def sphere(steps=12):
    """Vertices and triangles of a sphere of radius 1, and the triangles' UVs."""
    zenith, azimuth = np.meshgrid(np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, 2 * steps + 1))
    points = np.stack([np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)], -1)
    triangles = net(steps, 2 * steps)
    uvs = np.stack([azimuth, zenith], -1).reshape(-1, 2)[triangles] / np.pi
    return points.reshape(-1, 3), triangles, np.ascontiguousarray(uvs.reshape(-1, 6), np.float32)


def soup(corners):
    """Vertices and triangles of separate triangles (N, 3, 3)."""
    vertices = np.reshape(corners, (-1, 3))
    return vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)


def points_of(grid, samples):
    """World positions (H, W, samples^2, 3) of the points where light without a size is sampled."""
    j, i = np.divmod(np.arange(samples**2), samples)
    sub_x, sub_y = (i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples
    x = (np.arange(grid["width"])[None, :, None] + sub_x) * grid["pitch_x"]
    y = (np.arange(grid["height"])[:, None, None] + sub_y) * grid["pitch_y"]
    return grid["origin"] + x[..., None] * grid["x_axis"] + y[..., None] * grid["y_axis"]


def cast(origins, directions, distances, vertices, triangles):
    """Which triangles lie on each ray (triangles, ...), by Moeller and Trumbore; and how near to an edge of one the ray
    passes.
    """
    crossed, doubt = [], np.full(origins.shape[:-1], np.inf)
    for a, b, c in vertices.astype(float)[triangles]:
        p, q = np.cross(directions, c - a), np.cross(origins - a, b - a)
        det = p @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v, t = ((origins - a) * p).sum(-1) / det, (q * directions).sum(-1) / det, q @ (c - a) / det
        inside, ahead = np.minimum(np.minimum(u, v), 1 - u - v), np.minimum(t, distances - t)
        crossed.append((inside > 0) & (ahead > 0))
        doubt = np.fmin(doubt, np.abs(np.fmin(inside, ahead)))
    return np.reshape(crossed, (len(triangles), *doubt.shape)), doubt
