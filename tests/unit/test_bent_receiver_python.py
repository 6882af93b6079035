"""Receivers of meshes that bend: one chart, whose texels are the texture's."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.errors import ReceiverError
from beamspread.core.native import native
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver, outline, texture_size
from beamspread.core.scene.stretch import lengths_of_faces, pieces_of_faces
from beamspread.core.scene.tiles import Tiling
from beamspread.core.scene.unwrap import unwrap

from mesh_shapes import heights, mesh_of
from mesh_shapes import smooth_ball as ball

FRAME = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def joined(*parts):
    """One mesh of several, whose maps lie side by side."""
    uvs = [(part.uvs + (number, 0)) / (len(parts), 1) for number, part in enumerate(parts)]
    sizes = np.concatenate([part.sizes for part in parts])
    return Polygons(
        np.concatenate([part.corners for part in parts]),
        np.concatenate(uvs),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([part.normals for part in parts]),
        corner_normals=np.concatenate([part.corner_normals for part in parts]),
    )


def grid_of(polygons, width=96, height=48):
    mesh = flatten(polygons, name="Ball")
    receiver = build_receiver(mesh, width, height, "Ball")
    (chart,) = receiver.charts
    return chart.grid, receiver, mesh


def test_a_ball_is_one_chart_of_the_texels_of_its_texture():
    grid, receiver, mesh = grid_of(ball())
    assert not mesh.messages
    assert receiver.is_bent
    assert grid.area == pytest.approx(ball().areas.sum(), rel=1e-5)
    # Facets of 7.5 degrees are up to .0043 within the ball.
    shown = grid.areas > 0
    np.testing.assert_allclose(np.linalg.norm(grid.positions()[shown], axis=-1), 1, atol=5e-3)
    np.testing.assert_allclose(np.einsum("nc,nc->n", grid.positions()[shown], grid.normals[shown]), 1, atol=5e-3)
    assert grid.texels == np.count_nonzero(shown)
    assert grid.texels * grid.pitch_x * grid.pitch_y == pytest.approx(grid.area)
    assert grid.centre == pytest.approx(np.zeros(3), abs=1e-2)
    values = np.float32(grid.positions())
    texture = receiver.to_texture([values])
    np.testing.assert_array_equal(texture[receiver.inside()], values[grid.coverage > 0])
    u, v = np.moveaxis(receiver.charts[0].uvs(96, 48), -1, 0)
    assert u[0] == pytest.approx((np.arange(96) + 0.5) / 96)
    assert v[:, 0] == pytest.approx((np.arange(48) + 0.5) / 48)
    across = grid.positions((1, 0.5)) - grid.positions((0, 0.5))
    np.testing.assert_allclose(across, grid.steps_x, atol=1e-6)


def test_labels_are_the_pieces_of_the_map():
    polygons = ball()
    polygons = replace(polygons, uvs=unwrap(polygons))
    _, receiver, mesh = grid_of(polygons, 128, 128)
    (island,) = mesh.islands
    labels = receiver.labels()
    assert len(np.unique(labels)) == len(np.unique(island.pieces)) + 1 > 4
    assert ((labels >= 0) == receiver.inside()).all()


def test_tiles_lie_in_one_grid():
    polygons = ball()
    tiles = np.where(np.arange(polygons.count) % 48 < 24, 1001, 1012)  # halves by longitude
    uvs = polygons.uvs * (2, 1) - np.stack([(tiles == 1012)[polygons.face_of], np.zeros(len(polygons.uvs))], 1)
    mesh = flatten(replace(polygons, uvs=uvs, tiles=tiles), name="Ball")
    mesh = replace(mesh, tiling=Tiling(((1001, (40, 30)), (1012, (60, 50))), 4))
    receiver = build_receiver(mesh, *mesh.tiling.size, "Ball")
    (chart,) = receiver.charts
    assert chart.grid.area == pytest.approx(polygons.areas.sum(), rel=1e-5)
    assert (receiver.width, receiver.height) == (60, 84)
    assert not receiver.coverage[30:34].any()
    uvs = chart.uvs(*mesh.tiling.size)
    assert uvs[0, 0] == pytest.approx((0.5 / 40, 0.5 / 30))
    assert uvs[34, 0] == pytest.approx((1 + 0.5 / 60, 1 + 0.5 / 50))
    only = mesh.within(Tiling(((1012, (60, 50)),), 0))
    assert build_receiver(only, 60, 50).charts[0].grid.area == pytest.approx(polygons.areas.sum() / 2, rel=1e-5)


def test_closed_bodies_look_outward_and_hollows_into_themselves():
    inside_out = replace(ball(), normals=-ball().normals, corner_normals=-ball().corner_normals)
    grid, _, mesh = grid_of(inside_out)
    (message,) = mesh.messages
    assert message.text == "The normals of 'Ball' point inward; it is baked as if they pointed outward."
    shown = grid.areas > 0
    assert np.einsum("nc,nc->n", grid.positions()[shown], grid.normals[shown]).min() > 0.9
    hollow = replace(ball(radius=0.5), normals=-ball().normals, corner_normals=-ball().corner_normals)
    grid, _, mesh = grid_of(joined(ball(), hollow), 192, 48)
    assert not mesh.messages
    shown = (grid.areas > 0) & (np.arange(192) >= 96)
    assert np.einsum("nc,nc->n", grid.positions()[shown], grid.normals[shown]).max() < -0.4


@pytest.mark.parametrize("is_hollow", [False, True])
def test_faces_of_other_materials_tell_which_side_of_a_body_is_outside(is_hollow):
    """Half of a ball, whose normals point inward: it is turned where the other half closes the ball, and stays where
    the ball is the hollow of a larger one.
    """
    whole = replace(ball(), normals=-ball().normals, corner_normals=-ball().corner_normals)
    half = np.flatnonzero(whole.corners[whole.starts[:-1], 2] > 0)
    part = replace(whole.of_faces(half), whole=joined(whole, ball(radius=2.0)) if is_hollow else whole)
    mesh = flatten(part, name="Ball")
    said = [message.text for message in mesh.messages if "inward" in message.text]
    assert len(said) == (not is_hollow)
    (island,) = mesh.parts[0].islands
    outward = np.einsum("nc,nc->n", island.polygons.corners[::3], island.polygons.normals)
    assert (outward < 0).all() if is_hollow else (outward > 0).all()
    assert island.polygons.whole is None


def test_doubled_faces_and_faces_that_look_to_the_other_side_are_named():
    said = [str(message) for message in grid_of(joined(ball(), ball()))[2].messages]
    assert any(text.startswith("Faces of 'Ball' lie on each other, 100% of its surface") for text in said)
    assert not any("opposite sides" in text for text in said)  # nothing would mend that
    polygons = ball()
    normals = np.where((np.arange(polygons.count) % 2 == 0)[:, None], -polygons.normals, polygons.normals)
    (text,) = [str(message) for message in grid_of(replace(polygons, normals=normals))[2].messages]
    assert text.startswith("Faces of 'Ball' that touch look to opposite sides, at ")
    assert " edges: light can't be right there. Recalculate the normals (Edit Mode: Shift N)" in text


def test_faces_without_an_area_in_the_map_are_named_and_overlaps_refused():
    polygons = ball()
    uvs = polygons.uvs.copy()
    uvs[: polygons.starts[480]] = 0.5
    (message,) = grid_of(replace(polygons, uvs=uvs))[2].messages
    assert message.text.startswith("Faces of 'Ball' have no area in the UV map: ")
    with pytest.raises(ReceiverError, match="The UV map overlaps"):
        grid_of(replace(joined(ball(), ball(at=(3, 0, 0))), uvs=np.concatenate([polygons.uvs, polygons.uvs])))


def test_an_open_bowl_bends_and_is_not_turned():
    faces, uvs = heights(lambda x, y: x**2 + y**2, 16)
    grid, _, mesh = grid_of(mesh_of(faces, uvs), 64, 64)
    assert not mesh.messages
    assert grid.normals[grid.areas > 0][:, 2].min() > 0


def test_an_outline_has_about_the_texels_and_the_area():
    mesh = flatten(ball(), name="Ball")
    grid = build_receiver(mesh, 1024, 512).charts[0].grid
    about = outline(mesh, mesh.parts[0], 1024, 512)
    assert about.areas.size < 64**2
    assert about.texels == pytest.approx(grid.texels, rel=0.05)
    assert about.area == pytest.approx(grid.area, rel=1e-5)


def test_new_images_have_nearly_square_texels():
    """Circles of latitude have a root mean square length of 2 pi / sqrt(2), longitudes that of pi."""
    assert texture_size(flatten(ball()), 512) == (512, pytest.approx(512 / np.sqrt(2), rel=0.03))


def test_lights_that_reach_no_texel_are_behind():
    faces, uvs = heights(lambda x, y: 0.3 * (x**2 + y**2), 16)
    grid, *_ = grid_of(mesh_of(faces, uvs), 64, 64)
    shared = {"name": "Lamp", "strength": 1.0, "color": (1.0, 1.0, 1.0), "cast_shadow": True}
    assert SunLight(**shared, direction=(0, 0, 1.0)).is_behind(grid)
    assert not SunLight(**shared, direction=(1.0, 0, 0)).is_behind(grid)
    assert PointLight(**shared, position=(0.5, 0.5, -2)).is_behind(grid)
    assert not PointLight(**shared, position=(0.5, 0.5, 2)).is_behind(grid)
    lamp = {"frame": FRAME, "size_x": 0.1, "size_y": 0.1, "is_round": False, "spread": np.pi}
    assert AreaLight(**shared, position=(0.5, 0.5, -2), **lamp).is_behind(grid)
    assert not AreaLight(**shared, position=(0.5, 0.5, 2), **lamp).is_behind(grid)
    assert not any(
        SunLight(**shared, direction=tuple(direction)).is_behind(grid_of(ball())[0])
        for direction in np.concatenate([np.eye(3), -np.eye(3)])
    )


def test_some_texels_stand_for_all():
    grid, *_ = grid_of(ball())
    few = grid.coarse(16)
    assert few.texels == 256
    assert few.mean(np.ones((few.height, few.width, 3))) == pytest.approx(1)
    shown = few.areas > 0
    np.testing.assert_allclose(np.linalg.norm(few.middles[shown], axis=-1), 1, atol=5e-3)


@pytest.mark.parametrize("angle", [0.01, 0.5, 2.0])
def test_a_flat_sun_lights_texels_as_planes_of_their_normals(angle):
    """Blender 3.4 has flat suns. A table tells their irradiance where the horizon cuts the disk."""
    grid, *_ = grid_of(replace(ball(), corner_normals=None), 24, 12)
    sun = native.SunLight((0.3, 0.4, -0.8), angle, "flat")
    white = [1.0, 1.0, 1.0]
    irradiance, _ = native.bake_arrival(grid.surface(), [(sun, white, None)], samples=1, rays=16)
    for row, column in np.argwhere(grid.areas > 0).tolist():
        normal, tangent = grid.normals[row, column].astype(float), grid.tangents[row, column].astype(float)
        normal /= np.linalg.norm(normal)
        tangent -= normal * (tangent @ normal)
        tangent /= np.linalg.norm(tangent)
        plane = native.ReceiverGrid((0, 0, 0), tangent, np.cross(normal, tangent), normal, 1.0, 1.0, 1, 1)
        expected, _ = native.bake_arrival(native.Surface(plane), [(sun, white, None)], samples=1, rays=16)
        assert irradiance[row, column, 0] == pytest.approx(expected[0, 0, 0], abs=1e-4)


def test_the_sides_of_an_image_by_faces_are_those_by_triangles():
    """Within 1 %: quads stand for both of their triangles."""
    _, _, mesh = grid_of(ball())
    (island,) = mesh.islands
    assert lengths_of_faces(ball()) == pytest.approx(island.lengths, rel=0.01)
    (chart,) = build_receiver(mesh, *texture_size(mesh, 512)).charts  # where the border of the island cuts few texels
    assert pieces_of_faces(ball()) == pytest.approx(chart.grid.pieces, rel=0.1)


def test_light_that_few_texels_face_is_not_behind_the_mesh():
    """A flat square with one texel that is tilted: some texels alone don't tell."""
    grid, _, _ = grid_of(ball())
    tilted = np.zeros_like(grid.areas, bool)
    row, column = np.argwhere(grid.areas > 0)[3]
    tilted[row, column] = True
    up, aside = np.float32((0, 0, 1)), np.float32((0.8, 0, 0.6))
    middles = np.zeros_like(grid.middles)
    normals = np.where(tilted[..., None], aside, up) * (grid.areas > 0)[..., None]
    square = replace(grid, middles=middles, normals=np.float32(normals))
    assert square.faces((1.0, 0.0, -0.5))
    assert square.faces((0.0, 0.0, 0.1))
    assert square.faces((0.0, 0.0, -0.1), 0.2)
    assert not square.faces((-1.0, 0.0, -0.5))
    assert not square.faces((0.0, 0.0, -0.1), 0.05)
    assert square.meets((-0.8, 0.0, 0.6))
    assert not square.meets((0.8, 0.0, 0.6))
    assert square.meets((0.8, 0.0, 0.6), 0.61)
    assert not PointLight("Lamp", 1.0, (1, 1, 1), True, (1.0, 0.0, -0.5)).is_behind(square)
    assert SunLight("Sun", 1.0, (1, 1, 1), True, (0.8, 0.0, 0.6)).is_behind(square)
