"""Planes and islands: any set of flat faces with clean UVs becomes charts; bent faces are named."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.errors import ReceiverError
from beamspread.core.scene import islands
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.planes import find_planes
from beamspread.core.scene.polygons import Polygons, components
from beamspread.core.scene.receiver import build_receiver

from mesh_shapes import SQUARE, box, heights, mesh_of


def atlas(count, margin=0.02):
    """UVs of squares beside each other in rows of three."""
    places = [np.array([number % 3, number // 3]) / 3 for number in range(count)]
    return [place + margin + SQUARE * (1 / 3 - 2 * margin) for place in places]


def test_a_box_has_six_planes_and_each_face_its_texels():
    receiver = build_receiver(flatten(mesh_of(box(), atlas(6))), 96, 96)
    assert len(receiver.charts) == 6
    normals = sorted(tuple(np.round(chart.grid.normal, 9)) for chart in receiver.charts)
    assert normals == sorted(map(tuple, np.concatenate([np.eye(3), -np.eye(3)])))
    # Means of positions over the texels of a face are its center.
    texture = receiver.to_texture([np.float32(chart.grid.positions()) for chart in receiver.charts])
    for face, uvs in zip(box(), atlas(6)):
        column, row = (uvs.mean(axis=0) * 96).astype(int)
        assert texture[row, column] == pytest.approx(face.mean(axis=0), abs=0.03)


def test_faces_without_common_vertices_join_by_position():
    """A plane of four quads whose vertices are all split, as by custom normals."""
    faces, uvs = heights(lambda x, _y: 0 * x, 2)
    (part,) = flatten(mesh_of(faces, uvs)).parts
    assert len(part.plane.faces) == 4
    assert len(part.islands) == 1


def test_both_sides_of_a_plate_are_two_planes():
    mesh = flatten(mesh_of([*box((1, 1, 1e-3))], atlas(6)))
    assert len(mesh.parts) == 6
    assert [abs(part.plane.normal[2]) for part in mesh.parts[:2]] == [1, 1]
    assert mesh.parts[0].plane.normal[2] == -mesh.parts[1].plane.normal[2]


def test_coplanar_faces_of_both_orientations_are_two_planes():
    face = np.column_stack([SQUARE, np.zeros(4)])
    mesh = flatten(mesh_of([face, face[::-1]], [SQUARE * 0.4, SQUARE[::-1] * 0.4 + 0.5]))
    assert sorted(part.plane.normal[2] for part in mesh.parts) == [-1, 1]


def test_noise_within_the_medium_is_flattened_and_said():
    noise = 1e-3 * np.random.default_rng(1).uniform(-1, 1, (25, 25))
    mesh = flatten(mesh_of(*heights(lambda _x, _y: noise)), mean_free_path=1.1e-3, name="Scan")
    (part,) = mesh.parts
    assert len(part.plane.faces) == 24**2
    assert part.plane.deviation == pytest.approx(1e-3, rel=0.05)
    (message,) = mesh.messages
    deviation = part.plane.deviation
    assert message.text == (
        f"'Scan' is baked as flat faces; it departs from them by {deviation:.3g} units, {deviation / 1.1e-3:.2g} mean "
        "free paths."
    )
    assert build_receiver(mesh, 512, 512).messages("Scan") == []
    (message,) = build_receiver(mesh, 2048, 2048).messages("Scan")
    assert message.text == "The faces of 'Scan' depart from the planes that are baked by up to 2.0 texels."


def test_noise_of_a_fine_scan_bends_neighbors_by_more_than_bevels():
    """One millimetre over a square metre, vertices five millimetres apart, in marble: neighbors bend by 25 degrees."""
    noise = 1e-3 * np.random.default_rng(1).uniform(-1, 1, (201, 201))
    mesh = flatten(mesh_of(*heights(lambda _x, _y: noise, 200)), mean_free_path=4e-4, name="Scan")
    (part,) = mesh.parts
    assert len(part.plane.faces) == 200**2


def bevelled_box(bevel, side=1.0):
    """A strip of a box: top, bevel of two segments and a side."""
    profile = np.array([(0, side), (0.5, side)])
    turns = np.pi / 2 - np.array([1, 2, 3]) * np.pi / 6
    arc = np.column_stack([0.5 + bevel * np.cos(turns), side - bevel + bevel * np.sin(turns)])
    profile = np.concatenate([profile, arc, [(0.5 + bevel, 0)]])
    faces, uvs = [], []
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    for (x0, z0), (x1, z1), begin, end in zip(profile, profile[1:], along, along[1:]):
        faces.append(np.array([(x0, 0, z0), (x1, 0, z1), (x1, 1, z1), (x0, 1, z0)]))
        uvs.append(np.array([(begin, 0), (end, 0), (end, 1), (begin, 1)]) / along[-1])
    return mesh_of([face[::-1] for face in faces], [uv[::-1] for uv in uvs])


def test_small_bevels_go_to_their_planes():
    mesh = flatten(bevelled_box(1e-3), mean_free_path=2e-3, name="Box")
    assert len(mesh.parts) == 2
    assert sum(len(part.plane.faces) for part in mesh.parts) == 5
    assert "departs" in mesh.messages[0].text


def test_all_faces_of_a_mesh_that_bends_are_one_part():
    faces, uvs = heights(lambda x, _y: 0.2 * np.sin(6 * x))
    assert flatten(mesh_of(faces, uvs)).is_bent
    wall = np.array([(0, 0, 1), (0, 1, 1), (0, 1, 2), (0, 0, 2.0)])
    mesh = flatten(mesh_of([*faces, wall], [*(uv * 0.5 for uv in uvs), SQUARE * 0.4 + 0.55]), name="Both")
    (island,) = mesh.islands
    assert len(np.unique(island.polygons.numbers)) == 577
    assert not mesh.messages


def test_light_crosses_uv_cuts_of_a_plane():
    """Two halves of a plane lie apart in the image, one of them turned: they share a grid."""
    left = np.array([(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0.0)])
    right = left + (1, 0, 0)
    uvs = [SQUARE * (0.2, 0.4), np.array([(0.9, 0.5), (0.9, 0.7), (0.5, 0.7), (0.5, 0.5)])]
    receiver = build_receiver(flatten(mesh_of([left, right], uvs)), 100, 100)
    (chart,) = receiver.charts
    assert len(chart.islands) == 2
    assert (chart.grid.width, chart.grid.height) == (40, 40)
    assert chart.grid.coverage == pytest.approx(np.ones((40, 40)))
    # A linear function of the position comes to the texels that show it.
    values = np.float32(chart.grid.positions())
    texture = receiver.to_texture([values])
    assert texture[20, 10] == pytest.approx(left.mean(axis=0), abs=0.06)
    assert texture[60, 70] == pytest.approx(right.mean(axis=0), abs=0.06)
    np.testing.assert_allclose(chart.read(texture)[2:-2, 2:18], values[2:-2, 2:18], atol=0.06)


def test_islands_of_very_different_scales_are_baked_coarser_and_said():
    left = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)])
    right = np.array([(1, 0, 0), (1.02, 0, 0), (1.02, 1, 0), (1, 1, 0.0)])
    uvs = [SQUARE * 0.2, SQUARE * 0.4 + 0.5]
    receiver = build_receiver(flatten(mesh_of([left, right], uvs)), 200, 200)
    (chart,) = receiver.charts
    assert chart.grid.coverage.size < 4.2 * (40**2 + 80**2)
    # The right one has 80 texels over .02.
    assert chart.grid.pitch_x == pytest.approx(chart.coarser * 0.02 / 80)
    (message,) = receiver.messages("Boards")
    assert message.text.startswith("UV islands of 'Boards' differ in scale: the finest is baked 2")
    assert not build_receiver(flatten(mesh_of([left], uvs[:1])), 200, 200).messages("Board")


def test_a_trapezoid_on_a_square_is_cut_into_triangles():
    face = np.array([(0, 0, 0), (1, 0, 0), (0.8, 1, 0), (0.2, 1, 0.0)])
    receiver = build_receiver(flatten(mesh_of([face], [SQUARE])), 64, 64)
    (chart,) = receiver.charts
    assert len(chart.islands) == 2
    texture = receiver.to_texture([np.float32(chart.grid.positions())])
    # The diagonal from (0, 0) to (1, 1) of the square shows that of the trapezoid.
    assert texture[32, 32, :2] == pytest.approx((0.4, 0.5), abs=0.02)


def test_overlapping_islands_are_refused():
    with pytest.raises(ReceiverError, match="overlaps: 100%"):
        build_receiver(flatten(mesh_of(box(), [SQUARE] * 6)), 32, 32)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("twice", [False, True])
def test_slivers_across_the_whole_image_are_probed_in_some_rows(axis, twice):
    """A million edges from side to side pass through 2e9 texels; half of the image stays empty."""
    places = np.linspace(0, 0.5, 500_001)[: 250_000 if twice else None]
    left, right, tips = places[:-1], places[1:], 0.5 * (places[:-1] + places[1:])
    uvs = np.zeros((len(left), 3, 2))
    uvs[..., axis] = np.stack([left, right, tips], axis=1)
    uvs[:, 2, 1 - axis] = 1
    uvs = np.concatenate([uvs, uvs]) if twice else uvs
    corners = uvs.reshape(-1, 2)
    normals = np.tile((0.0, 0.0, 1.0), (len(uvs), 1))
    slivers = Polygons(np.pad(corners, ((0, 0), (0, 1))), corners, np.arange(0, len(corners) + 1, 3), normals)
    if not twice:
        islands.check_map(slivers)
        return
    with pytest.raises(ReceiverError, match=r"overlaps: 2[4-6]%"):  # a half, less where they cover half of a texel
        islands.check_map(slivers)


def test_faces_without_area_are_named_with_a_remedy_that_works():
    flat = [np.array([(x, 0, 0), (x + 1, 0, 0), (x + 0.5, 0, 0)], float) for x in range(3)]
    uvs = [SQUARE[:3] / 3 + (number / 3, 0) for number in range(3)]
    with pytest.raises(ReceiverError, match=r"corners of faces 0 to 2 lie on a line.*move the corners apart"):
        flatten(mesh_of(flat, uvs))
    apart = [face + np.outer(np.arange(3) == 2, (0, 1, 0)) for face in flat]
    assert len(flatten(mesh_of(apart, uvs)).parts) == 3


def test_faces_without_area_in_the_map_are_named():
    uvs = [np.full((4, 2), 0.9) if face in (2, 5) else square for face, square in enumerate(atlas(6))]
    with pytest.raises(ReceiverError, match="no area in 2 of 6 faces: faces 2 and 5"):
        islands.check_map(mesh_of(box(), uvs))


def test_a_plane_without_area_in_the_map_stays_black_and_is_named():
    mesh = flatten(mesh_of(box(), [*atlas(5), np.full((4, 2), 0.9)]), name="Box")
    assert len(mesh.parts) == 5
    (message,) = mesh.messages
    assert message.text == "Faces of 'Box' have no area in the UV map: 16.7% of its surface stay black."
    assert message.remedy == "Unwrap the mesh again: face 5."
    with pytest.raises(ReceiverError, match="no area"):
        flatten(mesh_of(box(), [np.full((4, 2), 0.9)] * 6))


def test_a_plane_with_too_many_islands_stays_black_and_is_named(monkeypatch):
    quads, uvs = heights(lambda x, _y: 0 * x, 2)
    places = [uv * 0.8 + number / 40 for number, uv in enumerate(uvs)]
    wall = np.array([(0, 0, 1), (0, 1, 1), (0, 1, 2), (0, 0, 2.0)])
    monkeypatch.setattr(islands, "MAX_ISLANDS", 3)
    mesh = flatten(mesh_of([*quads, wall], [*places, 0.95 + 0.04 * SQUARE]), name="Floor")
    (part,) = mesh.parts
    assert part.plane.faces.tolist() == [4]
    (message,) = mesh.messages
    assert message.text == "The UV map has 4 islands; 3 are allowed. Faces 0 to 3 of 'Floor' stay black."


def test_tiny_faces_without_area_in_the_map_are_left_out_and_said():
    sliver = np.array([(5, 0, 0), (5.03, 0, 0), (5.03, 1, 0), (5, 1, 0.0)])
    mesh = flatten(mesh_of([*box(), sliver], [*atlas(6), np.full((4, 2), 0.9)]), name="Box")
    assert len(mesh.parts) == 6
    assert mesh.messages[0].text == "Faces of 'Box' have no area in the UV map: 0.5% of its surface stay black."


def test_each_plane_is_baked_as_if_it_were_alone():
    """Light, shadows and texels of a chart follow from its own grid."""
    faces, uvs = box(), atlas(6)
    together = build_receiver(flatten(mesh_of(faces, uvs)), 60, 60)
    for face, uv in zip(faces, uvs):
        (alone,) = build_receiver(flatten(mesh_of([face], [uv])), 60, 60).charts
        (same,) = [c for c in together.charts if np.allclose(c.grid.normal, alone.grid.normal)]
        np.testing.assert_allclose(same.grid.positions(), alone.grid.positions(), atol=1e-9)
        np.testing.assert_array_equal(same.grid.coverage, alone.grid.coverage)


def test_components_are_those_of_a_search():
    rng = np.random.default_rng(2)
    first, second = rng.integers(0, 300, (2, 220))
    labels = components(300, first, second)
    neighbors = {number: {number} for number in range(300)}
    for _ in range(300):
        for a, b in zip(first.tolist(), second.tolist()):
            union = neighbors[a] | neighbors[b]
            for member in union:
                neighbors[member] = union
    for number in range(300):
        assert set(np.flatnonzero(labels == labels[number])) == neighbors[number]


def test_many_faces_fall_into_their_planes():
    faces = []
    for number in range(100):
        quads, _ = heights(lambda x, _y: 0 * x, 10)
        faces += [quad + (2 * (number % 10), 2 * (number // 10), 0.1 * number) for quad in quads]
    planes, bent = find_planes(mesh_of(faces), 1e-6)
    assert len(planes) == 100
    assert not len(bent)


def test_a_wall_on_a_floor_does_not_cut_it():
    """Three faces share an edge; the wall lies between both halves of the floor in the order of faces."""
    left = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)])
    wall = np.array([(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1.0)])
    planes, bent = find_planes(mesh_of([left, wall, left + (1, 0, 0)]), 1e-6)
    assert [plane.faces.tolist() for plane in planes] == [[0, 2], [1]]
    assert not len(bent)


def test_faces_on_each_other_are_one_plane():
    """The medium is there once, and each copy shows it."""
    face = np.column_stack([SQUARE, np.zeros(4)])
    uvs = [SQUARE * 0.4, SQUARE * 0.4 + 0.5]
    receiver = build_receiver(flatten(mesh_of([face, face], uvs)), 100, 100)
    (chart,) = receiver.charts
    assert chart.grid.coverage == pytest.approx(np.ones((40, 40)))
    texture = receiver.to_texture([np.float32(chart.grid.positions())])
    np.testing.assert_allclose(texture[:40, :40], texture[50:90, 50:90], atol=1e-6)


def test_large_faces_of_a_large_mesh_are_planes():
    """Bevels join a desk's panels smoothly; each is a small part of a house."""
    desk = bevelled_box(0.2)
    house = [20 * face + (100, 0, 0) for face in box()]
    planes, bent = find_planes(mesh_of([*desk.split(desk.corners), *house]), 1e-6)
    is_flat = ~np.isin(np.arange(desk.count), bent)
    assert is_flat[[0, -1]].all()
    assert sum(len(plane.faces) for plane in planes) >= 8


def test_a_strip_of_many_panels_with_bevels_has_planes():
    """Forty panels in a zigzag of 28 degrees, rounded at each edge by a strip of a twentieth."""
    turn, points = np.radians(14), [np.zeros(2)]
    for number in range(40):
        angle = turn * (-1) ** number
        for length, direction in ((1.0, angle), (0.05, 0.0)):
            points.append(points[-1] + length * np.array([np.cos(direction), np.sin(direction)]))
    faces = [
        np.array([(*a[:1], 0, a[1]), (*b[:1], 0, b[1]), (b[0], 1, b[1]), (a[0], 1, a[1])])
        for a, b in zip(points, points[1:])
    ]
    planes, bent = find_planes(mesh_of(faces), 1e-6)
    assert len(planes) == 40
    assert len(bent) == 40


@pytest.mark.parametrize("count", [24, 32, 64])
def test_a_cylinder_is_bent(count):
    turns = 2 * np.pi * np.arange(count + 1) / count
    circle = np.stack([np.cos(turns), np.sin(turns)], 1)
    sides = [np.array([(*a, 0), (*b, 0), (*b, 2), (*a, 2)]) for a, b in zip(circle, circle[1:])]
    caps = [np.column_stack([circle[:-1], np.full(count, 2.0)]), np.column_stack([circle[:-1][::-1], np.zeros(count)])]
    planes, bent = find_planes(mesh_of([*sides, *caps]), 1e-6)
    assert sorted(plane.faces.tolist() for plane in planes) == [[count], [count + 1]]
    assert len(bent) == count


def test_a_few_flat_faces_do_not_make_a_ball_flat():
    turns, rows = np.meshgrid(2 * np.pi * np.arange(65) / 64, np.pi * np.arange(1, 32) / 32)
    ball = np.stack([np.sin(rows) * np.cos(turns), np.sin(rows) * np.sin(turns), -np.cos(rows)], -1)
    quads = [ball[:-1, :-1], ball[:-1, 1:], ball[1:, 1:], ball[1:, :-1]]
    faces = list(np.stack(quads, axis=2).reshape(-1, 4, 3))
    chip = np.array([(3, 0, 0), (3.2, 0, 0), (3.2, 0.2, 0), (3, 0.2, 0.0)])
    assert flatten(mesh_of([*faces, chip], [SQUARE * 1e-3] * (len(faces) + 1))).is_bent


def test_warped_faces_are_baked_as_triangles():
    warped = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0.2), (0, 1, 0.0)])
    assert len(flatten(mesh_of([warped], [SQUARE])).parts) == 2
    faces, uvs = [*box()[:5], warped + (3, 0, 0)], atlas(6)
    mesh = flatten(replace(mesh_of(faces, uvs), tiles=np.array([1001] * 5 + [1012])), name="Box")
    assert [part.islands[0].tile for part in mesh.parts].count(1012) == 2
    mesh = flatten(mesh_of(faces, uvs), name="Box")
    assert len(mesh.parts) == 7
    assert not mesh.messages
    receiver = build_receiver(mesh, 96, 96)
    texture = receiver.to_texture([np.float32(chart.grid.positions()) for chart in receiver.charts])
    column, row = ([0.75, 0.25] @ uvs[5][[1, 3]] * 96).astype(int)
    assert texture[row, column] == pytest.approx(0.75 * warped[1] + 0.25 * warped[3] + (3, 0, 0), abs=0.06)


def test_noise_may_have_outliers():
    """Gaussian noise of a millimetre over a square metre: the largest is four times the deviation."""
    noise = 1e-3 * np.random.default_rng(1).normal(size=(101, 101))
    mesh = flatten(mesh_of(*heights(lambda _x, _y: noise, 100)), mean_free_path=4e-4, name="Scan")
    (part,) = mesh.parts
    assert len(part.plane.faces) == 100**2
    assert part.plane.deviation == pytest.approx(4e-3, rel=0.1)


def test_a_small_bent_part_is_no_noise():
    """A thin half pipe stands on a large plate. Its height is the largest that noise may have."""
    turns = np.linspace(0, np.pi, 13)
    arc = 4e-3 * np.stack([np.cos(turns), np.sin(turns)], 1) + (0, 0.01)
    pipe = [
        np.array([(a[0], 0, a[1]), (a[0], 1, a[1]), (b[0], 1, b[1]), (b[0], 0, b[1])]) for a, b in zip(arc, arc[1:])
    ]
    plate = np.array([(-1, -1, 0), (1, -1, 0), (1, 2, 0), (-1, 2, 0.0)])
    planes, _ = find_planes(mesh_of([*pipe, plate]), 1e-3 * 3.6 / 5)
    assert all(plane.deviation <= 1e-3 for plane in planes)


def test_planes_that_exchange_light_over_edges_are_one_part():
    """Within .004 of its 12 edges lie 1.6 % of a cube's area, within .02 8 %; a limit of 5 % is between them."""
    cube = mesh_of(box(), atlas(6))
    assert len(flatten(cube, spread=0.004).parts) == 6
    assert flatten(cube, spread=0.02).is_bent
    floor = mesh_of([box()[0]], [SQUARE])
    assert not flatten(floor, spread=10.0).is_bent  # no plane meets another


def test_chosen_faces_have_the_areas_of_a_mesh_of_their_own():
    faces = [face * (1, 2, 3) for face in box()]
    mesh, chosen = mesh_of(faces, atlas(6)), [4, 1]
    expected = mesh.of_faces(np.array(chosen)).areas
    assert mesh.areas.max() == 6  # computed before faces are chosen
    np.testing.assert_array_equal(mesh.of_faces(np.array(chosen)).areas, expected)
    np.testing.assert_array_equal(mesh.of_faces(np.array(chosen)).area_vectors, mesh.area_vectors[chosen])
    everything = mesh.of_faces(np.arange(mesh.count))
    assert everything.areas is mesh.areas
    assert mesh.numbers is None
    np.testing.assert_array_equal(everything.numbers, np.arange(mesh.count))
    numbered = mesh.of_faces(np.array(chosen))
    np.testing.assert_array_equal(numbered.of_faces(np.arange(len(chosen))).numbers, chosen)
