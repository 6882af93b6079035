"""Flat parts of a mesh: faces that touch and lie on one plane, so that the medium goes on from one to the next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ReceiverError
from .polygons import Polygons, components, largest

# Distance from a plane that counts as none, over the diagonal of all faces: a tenth of a texel at 1024.
FLATNESS_TOLERANCE = 1e-4

# Distance from a plane up to which faces are flattened onto it, over the same: a texel at 1024. More flattens rougher
# scans.
FLATTENED = 1e-3

# Noise whose root mean square is within the distance above is flattened, too. Its largest distance from the plane,
# and the least size of a part that is noisy rather than bent, over the distance above. More flattens more
# outliers; fewer parts.
OUTLIERS, MIN_NOISY = 5.0, 50.0

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

# Largest number of planes of a part that bends smoothly, the largest first.
MAX_PLANES = 4096

# Fraction of the area of a part that bends smoothly from which a flat piece is a plane; the same for pieces that are
# larger than each neighbor by the ratio; and the ratio of areas to a bent neighbor below which none is. Larger: more
# is bent.
MIN_PART, MIN_APART, MIN_RATIO = 0.05, 0.01, 4.0


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

    Faces that touch are flattened onto one plane if no corner is farther from it than the tolerance, or if the root
    mean square of noise is within. Faces without area are left out.

    Raises
    ------
    ReceiverError
        No face has an area.
    """
    if polygons.areas.max() <= NO_AREA * polygons.diagonal**2:
        listed = polygons.listed(np.ones(polygons.count, bool))
        text = f"The corners of {listed} lie on a line: no face has an area."
        raise ReceiverError(text, "Check the object's scale and modifiers, or move the corners apart.")
    return _Search(polygons, tolerance).run()


class _Search:
    """Splits a mesh into parts that bend smoothly, which share no plane."""

    def __init__(self, polygons: Polygons, tolerance: float) -> None:
        self.polygons, self.tolerance = polygons, tolerance
        self.normals = polygons.area_vectors / np.maximum(polygons.areas, 1e-300)[:, None]
        self.has_area = polygons.areas > NO_AREA_BESIDE * polygons.areas.max()
        first, second = polygons.shared_edges
        faces = polygons.face_of
        pairs = np.stack([faces[first], faces[second]])
        self.pairs = pairs[:, self.has_area[pairs].all(axis=0) & (pairs[0] != pairs[1])]
        self.cosines = np.einsum("ij,ij->i", self.normals[self.pairs[0]], self.normals[self.pairs[1]])

    def run(self) -> tuple[list[Plane], np.ndarray]:
        planes: list[Plane] = []
        is_bent = self.has_area.copy()
        for cosine in (FLATTENED_COSINE, SMOOTH_COSINE):
            # Noise bends by more than bevels: parts that are flat as a whole come first.
            for part in self._parts(cosine, is_bent):
                plane = part.fit(np.arange(len(part.faces)))
                fitted = [plane] if plane is not None else part.planes() if cosine == SMOOTH_COSINE else []
                planes += [replace(plane, faces=part.faces[plane.faces]) for plane in fitted]
            for plane in planes:
                is_bent[plane.faces] = False
        areas = self.polygons.areas
        return sorted(planes, key=lambda plane: -areas[plane.faces].sum()), np.flatnonzero(is_bent)

    def _parts(self, cosine: float, is_left: np.ndarray) -> Iterator[_Part]:
        """Parts of the faces that are left, whose neighbors look the same way up to an angle of this cosine."""
        is_used = is_left[self.pairs].all(axis=0)
        pairs, cosines = self.pairs[:, is_used], self.cosines[is_used]
        labels = components(self.polygons.count, *pairs[:, cosines > cosine])
        is_inner = labels[pairs[0]] == labels[pairs[1]]
        pairs, cosines = pairs[:, is_inner], cosines[is_inner]
        faces, order = np.flatnonzero(is_left), np.argsort(labels[pairs[0]], kind="stable")
        faces = faces[np.argsort(labels[faces], kind="stable")]
        starts = np.flatnonzero(np.diff(labels[faces], prepend=-1))
        ends = np.append(starts[1:], len(faces))
        label_of_pair = labels[pairs[0, order]]
        first, last = (np.searchsorted(label_of_pair, labels[faces[starts]], side) for side in ("left", "right"))
        place = np.empty(self.polygons.count, int)
        for begin, end, low, high in zip(starts, ends, first, last):
            chosen, inner = faces[begin:end], order[low:high]
            place[chosen] = np.arange(end - begin)
            polygons = self.polygons.of_faces(chosen)
            yield _Part(chosen, polygons, self.normals[chosen], place[pairs[:, inner]], cosines[inner], self.tolerance)


@dataclass(frozen=True, eq=False)
class _Part:
    """Faces that bend smoothly.

    Attributes
    ----------
    faces : their numbers in the mesh; all other numbers are within the part.
    polygons, normals : the same faces.
    pairs : neighbors, int (2, P).
    cosines : of the angles between neighbors, (P,).
    """

    faces: np.ndarray
    polygons: Polygons
    normals: np.ndarray
    pairs: np.ndarray
    cosines: np.ndarray
    tolerance: float

    def fit(self, faces: np.ndarray) -> Plane | None:
        """The plane of faces; None if they depart from it."""
        part = self.polygons.of_faces(faces)
        total = part.area_vectors.sum(axis=0)
        length = np.linalg.norm(total)
        if length < 0.5 * part.areas.sum():
            return None
        normal = total / length
        heights = part.corners @ normal
        height = 0.5 * (heights.min() + heights.max())
        deviation = float(np.abs(heights - height).max())
        is_noise = (
            deviation <= OUTLIERS * self.tolerance
            and heights.std() <= self.tolerance
            and np.sqrt(length) >= MIN_NOISY * self.tolerance
        )
        if not (deviation <= self.tolerance or is_noise) or (self.normals[faces] @ normal <= 0).any():
            return None
        centre = part.corners.mean(axis=0)
        return Plane(faces, centre + (height - centre @ normal) * normal, normal, deviation)

    def planes(self) -> list[Plane]:
        """Planes among faces that together are not flat: their largest flat pieces, with near faces around."""
        areas = self.polygons.areas
        is_joined = self.cosines > COPLANAR_COSINE
        pieces = components(len(self.faces), *self.pairs[:, is_joined])
        sizes = np.bincount(pieces, areas)
        is_apart = sizes >= np.maximum(MIN_RATIO * self._largest_beside(pieces, sizes), MIN_APART * areas.sum())
        is_large = is_apart | (sizes >= MIN_PART * areas.sum())
        is_free, planes = np.ones(len(self.faces), bool), []
        for piece in np.argsort(-sizes, kind="stable")[:MAX_PLANES]:
            members = np.flatnonzero((pieces == piece) & is_free) if is_large[piece] else ()
            plane = self.fit(members) if len(members) else None
            if plane is not None:
                planes.append(self._grown(plane, is_free))
                is_free[planes[-1].faces] = False
        return [plane for plane in planes if not self._is_beside_bent(plane, is_free, pieces, sizes)]

    def _largest_beside(self, pieces: np.ndarray, sizes: np.ndarray) -> np.ndarray:
        """Area of the largest piece beside each piece; infinite without any."""
        largest_beside = np.zeros(len(sizes))
        first, second = pieces[self.pairs]
        is_across = first != second
        for piece, beside in ((first, second), (second, first)):
            np.maximum.at(largest_beside, piece[is_across], sizes[beside[is_across]])
        return np.where(largest_beside > 0, largest_beside, np.inf)

    def _grown(self, plane: Plane, is_free: np.ndarray) -> Plane:
        """The plane with the free faces around it that lie within the tolerance."""
        distance = largest(np.abs((self.polygons.corners - plane.centre) @ plane.normal), self.polygons.starts)
        is_member = (distance <= self.tolerance) & (self.normals @ plane.normal > FLATTENED_COSINE) & is_free
        is_member[plane.faces] = True
        is_joined = is_member[self.pairs].all(axis=0)
        labels = components(len(self.faces), *self.pairs[:, is_joined])
        grown = np.flatnonzero(is_member & (labels == labels[plane.faces[0]]))
        heights = (self.polygons.of_faces(grown).corners - plane.centre) @ plane.normal
        return Plane(grown, plane.centre, plane.normal, float(np.abs(heights).max()))

    def _is_beside_bent(self, plane: Plane, is_free: np.ndarray, pieces: np.ndarray, sizes: np.ndarray) -> bool:
        """True if a smooth edge joins the plane to bent faces, those without a plane, that are about as large."""
        is_inside = np.zeros(len(self.faces), bool)
        is_inside[plane.faces] = True
        first, second = is_inside[self.pairs]
        is_across = (first != second) & (self.cosines > SMOOTH_COSINE)
        outside = np.where(first, self.pairs[1], self.pairs[0])[is_across]
        outside = outside[is_free[outside]]
        area = self.polygons.areas[plane.faces].sum()
        return len(outside) > 0 and area < MIN_RATIO * sizes[pieces[outside]].max()
