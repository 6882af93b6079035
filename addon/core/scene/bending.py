"""How much a mesh bends: the solver computes more pairs where surfaces turn within the reach of their light."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .polygons import Polygons

OF_BALL = 4 * np.pi**0.5
"""Length of edges times the turn of faces there, over the root of the surface's area, for a ball of many faces."""

SMALL_TURN = 0.1
"""Sine of a turn of shading up to which an edge is no crease. Larger: shorter estimates for many flat faces."""


@dataclass(frozen=True)
class Bending:
    """Measures of a surface that bends, whatever its size and number of faces.

    Attributes
    ----------
    turning : integral of its mean curvature's magnitude over the root of its area, relative to a ball's: about 1 for
        compact bodies, and more for bodies with thin or rough parts.
    creases : length of edges times the sine of the turn of shading normals there, as far as it is beyond `SMALL_TURN`,
        over the root of the area: 4.4 for a cube, 0 where shading is smooth.
    """

    turning: float = 1.0
    creases: float = 0.0


BALL = Bending()
"""Bending of a smooth ball."""


def bending_of(polygons: Polygons) -> Bending:
    """The bending of faces; turns of shading of more than 90 degrees count as such."""
    first, second = polygons.shared_edges
    area = float(polygons.areas.sum())
    if not len(first) or not 0 < area < np.inf:
        return Bending(0.0)
    sides = polygons.corners[polygons.next_corners[first]] - polygons.corners[first]
    lengths = np.linalg.norm(sides, axis=1) / np.sqrt(area)
    faces = [polygons.normals[polygons.face_of[corners]] for corners in (first, second)]
    if polygons.corner_normals is None:
        shading = faces
    else:
        is_same_way = polygons.points[first] == polygons.points[second]
        beside = np.where(is_same_way, second, polygons.next_corners[second])
        shading = [polygons.corner_normals[corners] for corners in (first, beside)]
    turns = np.arccos(np.clip(np.einsum("nc,nc->n", *faces), -1, 1))
    cosines = np.clip(np.einsum("nc,nc->n", *shading), 0, 1)
    creases = np.maximum(np.sqrt(1 - cosines**2) - SMALL_TURN, 0)
    return Bending(float((lengths * turns).sum() / OF_BALL), float((lengths * creases).sum()))
