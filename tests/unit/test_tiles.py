"""UDIM tiles: the tile of each face, and the texture that holds the texels of several tiles."""

import numpy as np
import pytest
from beamspread.core.errors import ReceiverError
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.islands import check_map
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.scene.tiles import Tiling, corner_of, in_tiles

SQUARE = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)


def quads(uv_corners, step=1.0, size=1.0):
    """Unit squares beside each other in xy, `step` apart, with UVs of this size from these corners."""
    points = [np.column_stack([SQUARE + (step * number, 0), np.zeros(4)]) for number in range(len(uv_corners))]
    uvs = [np.array(corner) + SQUARE * size for corner in uv_corners]
    normals = np.tile([0.0, 0, 1], (len(uv_corners), 1))
    return Polygons(np.concatenate(points), np.concatenate(uvs), np.arange(0, 4 * len(points) + 1, 4), normals)


def test_faces_have_the_tile_of_their_uvs():
    polygons = in_tiles(quads([(0, 0), (1, 0), (9, 0), (0, 1), (3, 99)]), "Wall")
    assert polygons.tiles.tolist() == [1001, 1002, 1010, 1011, 1994]
    assert [corner_of(number) for number in polygons.tiles.tolist()] == [(0, 0), (1, 0), (9, 0), (0, 1), (3, 99)]
    np.testing.assert_allclose(polygons.uvs, np.tile(SQUARE, (5, 1)))
    check_map(polygons)  # one over another, but in tiles of their own


def test_rounding_at_borders_does_not_count():
    assert in_tiles(quads([(0.99995, 0)], size=1.0001), "Wall").tiles.tolist() == [1002]


@pytest.mark.parametrize("corner", [(-1, 0), (0, -0.6), (10, 0), (0, 100)])
def test_uvs_where_no_tile_can_be_are_named(corner):
    with pytest.raises(ReceiverError, match="'Wall' reaches where no UDIM tile can be, in 1 of 2 faces"):
        in_tiles(quads([(0, 0), corner]), "Wall")


def test_a_face_across_a_border_is_named():
    with pytest.raises(ReceiverError, match="'Wall' cross the border of the UDIM tile 1012: 1 of 2 faces"):
        in_tiles(quads([(0, 0), (1.1, 1)]), "Wall")


def test_overlaps_count_in_one_tile():
    with pytest.raises(ReceiverError, match="overlaps: 50%"):
        check_map(in_tiles(quads([(1, 0), (1, 0)]), "Wall"))


def test_tiles_lie_on_each_other_with_a_gap():
    tiling = Tiling(((1001, (4, 3)), (1002, (2, 5)), (1012, (3, 2))), gap=2)
    assert tiling.size == (4, 3 + 2 + 5 + 2 + 2)
    tiles = {number: np.full((height, width, 3), number, np.float32) for number, (width, height) in tiling.tiles}
    texture = tiling.joined(tiles)
    assert (texture > 0).all(axis=2).sum() == 4 * 3 + 2 * 5 + 3 * 2
    for number, part in tiling.split(texture).items():
        np.testing.assert_array_equal(part, tiles[number])


@pytest.mark.parametrize("step", [1.0, 1.5])
def test_a_plane_in_two_tiles_has_one_grid(step):
    """Squares that touch are one chart with an island in each tile; others are a chart each."""
    tiling = Tiling(((1001, (16, 16)), (1012, (16, 16))), gap=3)
    mesh = flatten(in_tiles(quads([(0, 0), (1, 1)], step), "Wall")).within(tiling)
    receiver = build_receiver(mesh, *tiling.size)
    assert len(receiver.charts) == (1 if step == 1 else 2)
    assert [part.mean() for part in tiling.split(receiver.coverage).values()] == pytest.approx([1, 1])
    assert receiver.coverage.sum() == pytest.approx(2 * 16 * 16)
    positions = [chart.grid.positions()[..., :2] for chart in receiver.charts]
    shown = tiling.split(receiver.to_texture(positions))
    for number, x in ((1001, 0.0), (1012, step)):
        centres = (np.arange(16) + 0.5) / 16
        np.testing.assert_allclose(shown[number][0, :, 0], x + centres, atol=1e-6)
        np.testing.assert_allclose(shown[number][:, 0, 1], centres, atol=1e-6)
    uvs = np.concatenate([chart.uvs(*tiling.size).reshape(-1, 2) for chart in receiver.charts])
    is_right = np.concatenate([at[..., 0].ravel() for at in positions]) > 1
    assert uvs[~is_right].max() < 1 < uvs[is_right].min()


def test_islands_outside_of_the_tiles_are_left_out():
    mesh = flatten(in_tiles(quads([(0, 0), (1, 0)]), "Wall"))
    assert [island.tile for island in mesh.within(Tiling(((1002, (8, 8)),))).islands] == [1002]
    assert mesh.within(Tiling(((1003, (8, 8)),))).parts == ()


@pytest.mark.parametrize(
    ("tiles", "faces", "part"), [(1, 10, "90%"), (1, 20, "over 95%"), (2, 20, "90%"), (2, 30, "over 93%")]
)
def test_many_faces_on_each_other_are_known_by_their_areas(tiles, faces, part):
    """Each face shows the whole image, as after UV > Reset."""
    polygons = in_tiles(quads([(number % tiles, 0) for number in range(faces)]), "Wall")
    with pytest.raises(ReceiverError, match=f"overlaps: {part}"):
        check_map(polygons)
