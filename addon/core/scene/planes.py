"""Flat parts of a mesh: faces that touch and lie on one plane, so that the medium goes on from one to the next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ReceiverError
from .polygons import Polygons, components, largest

# Distance from a plane that counts as none, over the diagonal of all faces: a tenth of a texel at 1024.
FLATNESS_TOLERANCE = 1e-4

# Distance from a plane up to which faces are flattened onto it, over the same: half a texel at 1024.
FLATTENED = 5e-4

# Area of a face that counts as none, over the squared diagonal of all faces.
NO_AREA = 1e-10

# Area of a face that counts as none, over that of the largest face. More leaves out slivers, which show as black lines.
NO_AREA_BESIDE = 1e-12

# Cosine of the angle between neighbors below which a bend is an edge between planes: 30 degrees. Less joins more faces
# to bent surfaces.
SMOOTH_COSINE = 0.866

# Cosine of the angle between neighbors that count as coplanar before distances are checked: half a degree.
COPLANAR_COSINE = 0.99996

# Cosine of the angle to a plane within which its distance alone decides whether a face is flattened onto it.
FLATTENED_COSINE = 0.5

# Largest number of planes of a mesh that are looked for, the largest first.
MAX_PLANES = 4096

# Ratio of areas of a plane and of a bent neighbor, and fraction of all area, from which the plane is baked alone.
MIN_RATIO, MIN_PART = 4.0, 0.05


@dataclass(frozen=True, eq=False)
class Plane:
    """Faces on a plane.

    Attributes
    ----------
    faces : numbers of the faces, int (N,).
    centre : point on the plane.
    normal : outward unit normal.
    deviation : largest distance of a corner from the plane.
    """

    faces: np.ndarray
    centre: np.ndarray
    normal: np.ndarray
    deviation: float


def find_planes(polygons: Polygons, tolerance: float) -> tuple[list[Plane], np.ndarray]:
    """Planes of a mesh, the largest first, and the numbers of the faces that belong to none, which are bent.

    Faces that touch are flattened onto one plane if no corner is farther from it than the tolerance. Faces without area
    are left out.

    Raises
    ------
    ReceiverError
        No face has an area.
    """
    if polygons.areas.max() <= NO_AREA * polygons.diagonal**2:
        raise ReceiverError("The faces have no area.", "Check the object's scale.")
    return _Search(polygons, tolerance).run()


class _Search:
    def __init__(self, polygons: Polygons, tolerance: float) -> None:
        self.polygons, self.tolerance = polygons, tolerance
        self.normals = polygons.area_vectors / np.maximum(polygons.areas, 1e-300)[:, None]
        self.has_area = polygons.areas > NO_AREA_BESIDE * polygons.areas.max()
        first, second = polygons.shared_edges
        faces = polygons.face_of
        self.pairs = faces[first], faces[second]
        is_used = self.has_area[self.pairs[0]] & self.has_area[self.pairs[1]] & (self.pairs[0] != self.pairs[1])
        self.pairs = self.pairs[0][is_used], self.pairs[1][is_used]
        self.cosines = np.einsum("ij,ij->i", self.normals[self.pairs[0]], self.normals[self.pairs[1]])
        self.plane_of = np.full(polygons.count, -1)
        self.planes: list[Plane] = []

    def run(self) -> tuple[list[Plane], np.ndarray]:
        smooth = self._components(SMOOTH_COSINE)
        coplanar = self._components(COPLANAR_COSINE)
        for faces in self._by_area(smooth):
            plane = self._fit(faces)
            if plane is not None:
                self._add(plane)
            else:
                self._split(faces, coplanar[faces])
        bent = self.has_area & (self.plane_of < 0)
        return sorted(self.planes, key=self._area, reverse=True), np.flatnonzero(bent)

    def _components(self, cosine: float) -> np.ndarray:
        is_joined = self.cosines > cosine
        return components(self.polygons.count, self.pairs[0][is_joined], self.pairs[1][is_joined])

    def _by_area(self, labels: np.ndarray, faces: np.ndarray | None = None) -> list[np.ndarray]:
        """Faces with area of each label, those of the largest area first."""
        faces = np.flatnonzero(self.has_area) if faces is None else faces
        labels = np.unique(labels[faces] if len(labels) == self.polygons.count else labels, return_inverse=True)[1]
        areas = np.bincount(labels, self.polygons.areas[faces])
        order = np.argsort(labels, kind="stable")
        groups = np.split(faces[order], np.cumsum(np.bincount(labels))[:-1])
        return [groups[label] for label in np.argsort(-areas, kind="stable")]

    def _fit(self, faces: np.ndarray) -> Plane | None:
        """The plane of faces; None if they depart from it."""
        part = self.polygons.of_faces(faces)
        total = self.polygons.area_vectors[faces].sum(axis=0)
        length = np.linalg.norm(total)
        if length < 0.5 * self.polygons.areas[faces].sum():
            return None
        normal = total / length
        heights = part.corners @ normal
        height = 0.5 * (heights.min() + heights.max())
        deviation = float(np.abs(heights - height).max())
        if deviation > self.tolerance or (self.normals[faces] @ normal <= 0).any():
            return None
        centre = part.corners.mean(axis=0)
        return Plane(faces, centre + (height - centre @ normal) * normal, normal, deviation)

    def _add(self, plane: Plane) -> None:
        self.plane_of[plane.faces] = len(self.planes)
        self.planes.append(plane)

    def _area(self, plane: Plane) -> float:
        return float(self.polygons.areas[plane.faces].sum())

    def _split(self, faces: np.ndarray, coplanar: np.ndarray) -> None:
        """Find planes among faces that together are not flat: their largest flat parts, with near faces around."""
        parts = self._by_area(coplanar, faces)
        least = MIN_PART * float(self.polygons.areas.sum())
        kept: list[Plane] = []
        for part in parts[:MAX_PLANES]:
            if self.polygons.areas[part].sum() < least:
                break
            part = part[self.plane_of[part] < 0]
            plane = self._fit(part) if len(part) else None
            if plane is not None:
                plane = self._grown(plane, faces)
                self._add(plane)
                kept.append(plane)
        for plane in kept:
            if self._is_beside_bent(plane, faces, coplanar):
                self.plane_of[plane.faces] = -1
                self.planes.remove(plane)

    def _grown(self, plane: Plane, faces: np.ndarray) -> Plane:
        """The plane with the faces around it that lie within the tolerance."""
        part = self.polygons.of_faces(faces)
        distance = largest(np.abs((part.corners - plane.centre) @ plane.normal), part.starts)
        is_near = (distance <= self.tolerance) & (self.normals[faces] @ plane.normal > FLATTENED_COSINE)
        is_member = np.zeros(self.polygons.count, bool)
        is_member[faces[is_near & (self.plane_of[faces] < 0)]] = True
        is_member[plane.faces] = True
        is_joined = is_member[self.pairs[0]] & is_member[self.pairs[1]]
        labels = components(self.polygons.count, self.pairs[0][is_joined], self.pairs[1][is_joined])
        grown = np.flatnonzero(is_member & (labels == labels[plane.faces[0]]))
        heights = (self.polygons.of_faces(grown).corners - plane.centre) @ plane.normal
        return Plane(grown, plane.centre, plane.normal, float(np.abs(heights).max()))

    def _is_beside_bent(self, plane: Plane, faces: np.ndarray, coplanar: np.ndarray) -> bool:
        """True if a smooth edge joins the plane to bent faces that are about as large."""
        is_inside = np.zeros(self.polygons.count, bool)
        is_inside[plane.faces] = True
        first, second = is_inside[self.pairs[0]], is_inside[self.pairs[1]]
        across = (first != second) & (self.cosines > SMOOTH_COSINE)
        outside = np.where(first, self.pairs[1], self.pairs[0])[across]
        outside = outside[self.plane_of[outside] < 0]
        if not len(outside):
            return False
        label = np.zeros(self.polygons.count, int)
        label[faces] = np.unique(coplanar, return_inverse=True)[1]
        areas = np.bincount(label[faces], self.polygons.areas[faces])
        return self._area(plane) < MIN_RATIO * areas[label[outside]].max()
