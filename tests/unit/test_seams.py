"""Margins of adjacent faces: texels around an island have the light beyond its edges."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.bake.bake_settings import ADJACENT_FACES, COMBINED, IRRADIANCE, BakeSettings
from beamspread.core.bake.finish import finished_texture, with_seams
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.tiles import Tiling, in_tiles
from beamspread.core.scene.unwrap import unwrap

from bakes import MATERIAL
from mesh_shapes import SQUARE, box, mesh_of

SIDE, MARGIN = 256, 6
# Light that changes linearly in space: bilinear samples of it are exact.
SLOPES = np.array([(0.3, -0.2, 0.5), (0.1, 0.6, -0.3), (-0.4, 0.2, 0.2)])
SETTINGS = BakeSettings(margin=MARGIN, margin_type=ADJACENT_FACES, layer=IRRADIANCE)


def light(positions):
    return np.float32(2 + positions @ SLOPES)


def finished(polygons, settings=SETTINGS):
    mesh = flatten(polygons)
    receiver = build_receiver(mesh, SIDE, SIDE)
    prepared = with_seams(receiver, mesh, settings)
    values = [light(chart.grid.positions()) for chart in receiver.charts]
    return mesh, receiver, finished_texture(prepared, values, MATERIAL, settings)


def position_of(island):
    """World positions (SIDE, SIDE, 3) of all texels on the plane of an island, and rings from it along each axis."""
    y, x = (np.mgrid[:SIDE, :SIDE] + 0.5) / SIDE
    return island.p_0 + x[..., None] * island.p_u + y[..., None] * island.p_v


def beside(receiver, island, polygons):
    """Texels straight beside the edges of a rectangular island, within 5 texels, without the last at their ends."""
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    low, high = polygons.uvs.min(axis=0) * SIDE, polygons.uvs.max(axis=0) * SIDE
    across, along = (
        np.maximum(line[0] - at, at - line[1]) for line, at in (((low[0], high[0]), x), ((low[1], high[1]), y))
    )
    outside = ~receiver.inside()
    return outside & (((across < -1) & (along < 5)) | ((along < -1) & (across < 5)))


def test_beyond_the_edges_of_a_box_there_is_the_next_face():
    """A texel at a distance outside a face has the light of the face around the edge, at the same distance inside."""
    polygons = mesh_of(box((1.0, 0.8, 0.6)))
    # Islands farther from each other than their margins.
    polygons = replace(polygons, uvs=spread_out(unwrap(polygons), polygons))
    mesh, receiver, texture = finished(polygons)
    half = np.array([0.5, 0.4, 0.3])
    for part in mesh.parts:
        (island,) = part.islands
        normal, chosen = part.plane.normal, beside(receiver, island, island.polygons)
        assert chosen.sum() > 100
        flat = position_of(island)[chosen]
        edge = np.clip(flat, -half, half)
        distance = np.linalg.norm(flat - edge, axis=1, keepdims=True)
        # Grids end at the edges of planes: positions in their last half texels repeat the centers.
        is_sure = distance[:, 0] > np.linalg.norm(island.p_u) / SIDE
        np.testing.assert_allclose(texture[chosen][is_sure], light(edge - distance * normal)[is_sure], atol=1e-3)
        assert np.abs(light(edge - distance * normal) - light(edge)).max() > 0.01


def spread_out(uvs, polygons):
    """UVs of faces that are smaller around their centres."""
    result = uvs.copy()
    for first, last in zip(polygons.starts[:-1], polygons.starts[1:]):
        centre = uvs[first:last].mean(axis=0)
        result[first:last] = centre + 0.75 * (uvs[first:last] - centre)
    return result


def test_a_cut_in_a_plane_is_crossed():
    """Two squares of one plane, apart, turned and mirrored in the map: light goes on beyond their common edge."""
    corners = [np.column_stack([SQUARE + (shift, 0), np.zeros(4)]) for shift in (0, 1)]
    uvs = [SQUARE * 0.4 + 0.05, (SQUARE * 0.4)[:, ::-1] + 0.55]
    mesh, receiver, texture = finished(mesh_of(corners, uvs))
    (part,) = mesh.parts
    assert len(part.islands) == 2
    for island in part.islands:
        at = position_of(island)
        beyond = beside(receiver, island, island.polygons) & (at[..., 0] > 0.02) & (at[..., 0] < 1.98)
        beyond &= (at[..., 1] > 0.02) & (at[..., 1] < 0.98)
        assert beyond.sum() > 3 * 90
        np.testing.assert_allclose(texture[beyond], light(at[beyond]), atol=1e-3)


def test_edges_without_another_face_extend_the_island():
    square = mesh_of([np.column_stack([SQUARE, np.zeros(4)])], [SQUARE * 0.5 + 0.25])
    _, _, texture = finished(square)
    np.testing.assert_array_equal(texture, finished(square, replace(SETTINGS, margin_type="EXTEND"))[2])


def test_texels_inside_are_those_of_the_other_type():
    polygons = mesh_of(box())
    polygons = replace(polygons, uvs=unwrap(polygons))
    for layer in (COMBINED, IRRADIANCE):
        settings = replace(SETTINGS, layer=layer)
        _, receiver, texture = finished(polygons, settings)
        extended = finished(polygons, replace(settings, margin_type="EXTEND"))[2]
        np.testing.assert_array_equal(texture[receiver.inside()], extended[receiver.inside()])
        assert (texture != extended).any()


@pytest.mark.parametrize("margin", [0, 1])
def test_a_margin_of_no_texels_has_no_seams(margin):
    polygons = mesh_of(box())
    polygons = replace(polygons, uvs=unwrap(polygons))
    _, receiver, texture = finished(polygons, replace(SETTINGS, margin=margin))
    assert texture[~receiver.inside()].any() == (margin > 0)


def test_seams_cross_udim_tiles():
    """Two squares of one plane in two tiles of different size."""
    corners = [np.column_stack([SQUARE + (shift, 0), np.zeros(4)]) for shift in (0, 1)]
    polygons = in_tiles(mesh_of(corners, [SQUARE * 0.8 + 0.1, SQUARE * 0.8 + (1.1, 0.1)]), "Plane")
    tiling = Tiling(((1001, (64, 64)), (1002, (96, 96))), gap=8)
    mesh = replace(flatten(polygons), tiling=tiling)
    receiver = build_receiver(mesh, *tiling.size)
    values = [light(chart.grid.positions()) for chart in receiver.charts]
    texture = finished_texture(with_seams(receiver, mesh, SETTINGS), values, MATERIAL, SETTINGS)
    for number, left, columns in ((1001, 0, np.arange(58, 62)), (1002, 1, np.arange(5, 9))):
        tile = tiling.split(texture)[number]
        side = len(tile)
        x = left + ((columns + 0.5) / side - 0.1) / 0.8
        at = np.stack([x, np.full(4, ((side // 2 + 0.5) / side - 0.1) / 0.8), np.zeros(4)], axis=1)
        np.testing.assert_allclose(tile[side // 2, columns], light(at), atol=1e-5)
