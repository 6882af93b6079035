"""UV maps of our own: inside the image, without overlaps, at one density, isometric on flat parts."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.native import native
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.unwrap import SPACE, unwrap, unwrap_together

from mesh_shapes import SQUARE, box, heights, mesh_of


def coverage_sum(polygons, uvs, side=512):
    """Sum of the parts of texels inside each face, (side, side)."""
    total = np.zeros((side, side))
    for face in polygons.split(uvs * side):
        total += native.coverage(np.ascontiguousarray(face), np.array([len(face)], np.uint32), side, side)
    return total


def areas_of(polygons, uvs):
    flat = np.column_stack([uvs, np.zeros(len(uvs))])
    return replace(polygons, corners=flat, normals=np.zeros(polygons.normals.shape)).areas


SHAPES = {
    "box": box(),
    "plate": box((3.0, 1.0, 0.01)),
    "many boxes": [
        face + (2 * i, 3 * j, 0) for i in range(5) for j in range(4) for face in box((1, 1 + i, 0.3 * j + 0.1))
    ],
    "triangle": [np.array([(0, 0, 0), (1, 0, 0), (0.2, 0.7, 0.5)])],
    "double corners": [np.array([(0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 0.0)])],
    "letter": [np.array([(0, 0, 0), (3, 0, 0), (3, 1, 0), (1, 1, 0), (1, 4, 0), (0, 4, 0.0)])],
}


@pytest.mark.parametrize("faces", SHAPES.values(), ids=SHAPES)
def test_flat_parts_keep_their_shape_at_one_density(faces):
    polygons = mesh_of(faces)
    uvs = unwrap(polygons)
    assert uvs.min() >= 0
    assert uvs.max() <= 1
    # A texel in a border that two islands share would be wrong; the space between them is 8 texels at 1024.
    assert coverage_sum(polygons, uvs).max() <= 1 + 1e-6
    density = areas_of(polygons, uvs) / polygons.areas
    np.testing.assert_allclose(density, density[0], rtol=1e-9)
    mesh = flatten(replace(polygons, uvs=uvs))
    assert all(len(part.islands) == 1 and part.islands[0].is_orthogonal() for part in mesh.parts)
    build_receiver(mesh, 128, 128)


ON_EACH_OTHER = {
    "the same twice": [*box(), *box()],
    # Two faces that share an edge with a third one.
    "in part": [
        np.array([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0.0)]),
        np.array([(2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0.0)]),
        np.array([(2, 0, 0), (4, 0.5, 0), (2, 1, 0.0)]),
    ],
}


@pytest.mark.parametrize("faces", ON_EACH_OTHER.values(), ids=ON_EACH_OTHER)
def test_faces_on_each_other_have_places_of_their_own(faces):
    polygons = mesh_of(faces)
    uvs = unwrap(polygons)
    assert coverage_sum(polygons, uvs).max() <= 1 + 1e-6
    density = areas_of(polygons, uvs) / polygons.areas
    np.testing.assert_allclose(density, density[0], rtol=1e-9)
    build_receiver(flatten(replace(polygons, uvs=uvs)), 128, 128)


def test_faces_that_show_no_light_take_no_room():
    """Slivers of a bevel, a face of one point, and one with a corner that is not a number."""
    flat = [np.tile(face[:1], (4, 1)) for face in box()] + [box()[0][[0, 1, 1, 0]]]
    triangle = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0.0)])
    polygons = mesh_of([*flat, *box(), triangle, triangle])
    polygons.corners[-1, 0], polygons.corners[-4, 0] = np.nan, np.inf
    uvs = polygons.split(unwrap(polygons))
    assert not np.concatenate([*uvs[:7], *uvs[13:]]).any()
    np.testing.assert_array_equal(np.concatenate(uvs[7:13]), unwrap(mesh_of(box())))
    assert not unwrap(polygons.of_faces(np.array([13, 14]))).any()


def test_islands_keep_a_distance():
    polygons = mesh_of(box())
    uvs = unwrap(polygons)
    boxes = [(face.min(axis=0), face.max(axis=0)) for face in polygons.split(uvs)]
    for number, (low, high) in enumerate(boxes):
        assert low.min() >= SPACE * 0.999
        assert high.max() <= 1 - SPACE * 0.999
        for other_low, other_high in boxes[:number]:
            assert np.maximum(other_low - high, low - other_high).max() >= 2 * SPACE * 0.999


def test_the_image_is_used():
    """Six squares fill a square of three by three at best in 6/9; rows of many boxes more."""
    assert areas_of(mesh_of(box()), unwrap(mesh_of(box()))).sum() > 0.6
    many = mesh_of(SHAPES["many boxes"])
    assert areas_of(many, unwrap(many)).sum() > 0.65


def test_bent_parts_are_projected_without_overlaps():
    faces, _ = heights(lambda x, y: 0.3 * np.sin(7 * x) * np.cos(5 * y))
    polygons = mesh_of(faces)
    uvs = unwrap(polygons)
    assert coverage_sum(polygons, uvs).max() <= 1.01
    # Faces look at most 60 degrees away from the direction of their projection.
    density = areas_of(polygons, uvs) / polygons.areas
    assert density.min() > 0.4 * density.max()


def test_a_mesh_of_one_plane_fills_its_longer_side():
    uvs = unwrap(mesh_of([np.column_stack([SQUARE * (4, 1), np.zeros(4)])]))
    assert np.ptp(uvs, axis=0) == pytest.approx((1 - 2 * SPACE, (1 - 2 * SPACE) / 4), rel=0.01)


def test_meshes_lie_side_by_side_at_one_density():
    meshes = [mesh_of(box()), mesh_of(box((3.0, 0.2, 0.1))), mesh_of(SHAPES["letter"])]
    uvs = unwrap_together(meshes)
    total = sum(coverage_sum(polygons, at) for polygons, at in zip(meshes, uvs))
    assert total.max() <= 1 + 1e-6
    density = np.concatenate([areas_of(polygons, at) / polygons.areas for polygons, at in zip(meshes, uvs)])
    np.testing.assert_allclose(density, density[0], rtol=1e-9)
    assert min(at.min() for at in uvs) >= 0
    assert max(at.max() for at in uvs) <= 1
