"""Sheets: meshes with a thickness. Faces are slabs of it, and both of their sides are at the positions of the mesh."""

from __future__ import annotations

import numpy as np

from ..messages import Message, note
from .polygons import Polygons, components

# Volume of a closed body, relative to the cube of its mesh's diagonal, from which it has an inside.
MIN_VOLUME = 1e-9


def bodies_of(polygons: Polygons) -> np.ndarray:
    """Number of the body of each face, int (N,): faces with common edges are one body."""
    first, second = polygons.shared_edges
    return components(polygons.count, polygons.face_of[first], polygons.face_of[second])


def closed_bodies(polygons: Polygons, body_of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """True for each body that is closed, and volumes of all bodies, cubic scene units; below 0 if faces look inward."""
    count = int(body_of.max(initial=-1)) + 1
    first, _ = polygons.shared_edges
    corners, is_edge = body_of[polygons.face_of], polygons.points != polygons.points[polygons.next_corners]
    # Two faces meet at each edge of a closed body.
    edges, pairs = np.bincount(corners[is_edge], minlength=count), np.bincount(corners[first], minlength=count)
    middle = polygons.corners.mean(axis=0)
    heights = np.einsum("ij,ij->i", polygons.corners[polygons.starts[:-1]] - middle, polygons.area_vectors)
    return edges == 2 * pairs, np.bincount(body_of, heights, minlength=count) / 3


def sheet_messages(polygons: Polygons, name: str) -> list[Message]:
    """The note about a sheet that is closed, the object `name`: its thickness does not make it solid."""
    is_closed, volumes = closed_bodies(polygons, bodies_of(polygons))
    volumes = volumes[is_closed & (np.abs(volumes) > MIN_VOLUME * polygons.diagonal**3)]
    if not len(volumes):
        return []
    inner = "whose back is the inside" if (volumes > 0).all() else "whose front is the inside: its normals point inward"
    text = f"'{name}' is closed, so its Thickness is that of a hollow wall, {inner}."
    return [note(name, text, "Turn Infinite Depth on for a solid body.")]
