"""Textures in which light scatters on faces that bend: tangent planes, and what they give where the truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.bent_textured import MOST_LIGHT, ratio_on_planes
from beamspread.core.bake.planes_image import closed
from beamspread.core.bake.spread_light import spread
from beamspread.core.bake.spreading import FINAL_EFFORT, QUICK_EFFORT, Reports, Spreading
from beamspread.core.bake.tangent_planes import Middle, Points, TangentPlane, middles_of, side_by_side
from beamspread.core.bake.textured_bake import with_factors
from beamspread.core.material import Material
from beamspread.core.progress import Progress
from beamspread.core.scene.bent_grid import BentGrid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import SunLight

from bakes import square
from bent_shapes import ball, flat, texels_of

G, SIZE, PITCH = 0.8, 40, 0.01
MATERIAL = Material(albedo=(0.5,) * 3, mean_free_path=(PITCH,) * 3, anisotropy=G)
SUN = SunLight("Sun", 1.0, (1.0, 1.0, 1.0), True, (0.6, 0.0, -0.8))
BELOW = replace(SUN, direction=(0.0, 0.6, 0.8))
STRIPES = np.where((np.arange(SIZE) // 4)[:, None] % 2, 0.97, 0.87)[..., None] * np.ones((SIZE, SIZE, 3))
PLANE = replace(square(SIZE, side=SIZE * PITCH), albedo=STRIPES.astype(np.float32))


def as_mesh(plane):
    """The texels of a plane as those of a mesh that bends."""
    names = "origin", "x_axis", "y_axis", "normal", "pitch_x", "pitch_y", "width", "height"
    texels = flat({name: getattr(plane, name) for name in names})
    return BentGrid(*vars(texels).values(), plane.coverage, albedo=plane.albedo)


def spreading(lights, thickness=np.inf, **options):
    sources = [library(Medium(G, 1.0, thickness), "preview")] * 3
    return Spreading(Illumination(lights), MATERIAL, sources, BakeSettings(), is_slab=np.isfinite(thickness), **options)


def distance(ours, truth):
    return np.abs(ours - truth).mean() / truth.mean()


@pytest.mark.parametrize("thickness", [np.inf, 4.0])
def test_a_flat_mesh_is_as_a_plane(thickness):
    """Both have 2 % of noise at most, root mean square; the solvers differ by .6 %. Slabs have light on both faces."""
    lights = [SUN] if np.isinf(thickness) else [SUN, BELOW]
    planes, meshes = (spread([grid], spreading(lights, thickness))[0] for grid in (PLANE, as_mesh(PLANE)))
    assert distance(meshes, planes) < 0.03
    assert meshes.sum() == pytest.approx(planes.sum(), rel=0.01)


def test_nearly_even_textures_are_as_bright_at_open_ends():
    """Light that passes the border of a mesh and comes back: the ratio is 1 everywhere, and was .89 at the end where
    paths of three texels met other planes. Bound: 1 %, since light comes from as far as 1.5 lengths that it spreads.
    """
    long = replace(MATERIAL, mean_free_path=(3 * PITCH,) * 3)
    nearly = 0.93 + 1e-4 * (np.arange(SIZE)[:, None] % 2) * np.ones((SIZE, SIZE, 3))
    of = replace(spreading([SUN]), material=long)
    grids, material = with_factors([as_mesh(replace(PLANE, albedo=nearly.astype(np.float32)))], long, of.sources)
    even = np.ones(grids[0].albedo.shape, np.float32)
    ratio = ratio_on_planes("reflected", grids[0], even, replace(of, material=material), Progress.of(None))
    assert ratio.reshape(SIZE, SIZE, 3).mean(axis=0) == pytest.approx(np.ones((SIZE, 3)), abs=0.01)


def ratios(grid, **options):
    of = spreading([SUN], **options)
    grids, material = with_factors([grid], of.material, of.sources)
    even = np.ones(grid.albedo.shape, np.float32)
    return ratio_on_planes("reflected", grids[0], even, replace(of, material=material), Progress.of(None))


def textured_ball(columns=64, rows=32, stripes=8):
    """A ball of radius 16 mean free paths by longitude and latitude, striped by longitude."""
    texels = texels_of(ball(radius=16 * PITCH), columns, rows)
    lit = np.where(np.arange(columns) * 2 * stripes // columns % 2, 0.97, 0.87)
    albedo = (np.ones((rows, 1, 1)) * lit[:, None] * np.ones(3)).astype(np.float32)
    return BentGrid(*vars(texels).values(), np.ones((rows, columns), np.float32), albedo=albedo)


def test_even_textures_are_the_convention():
    grid = textured_ball()
    np.testing.assert_array_equal(ratios(replace(grid, albedo=np.full_like(grid.albedo, 0.9))), 1)


def test_dark_stripes_are_brighter_than_the_convention_and_all_alike():
    """Straight below the sun's azimuth stripes repeat by the ball's symmetry: those of a class differ by noise."""
    down = replace(SUN, direction=(0.0, 0.0, -1.0))
    grid = textured_ball()
    of = spreading([down])
    grids, material = with_factors([grid], of.material, of.sources)
    even = np.ones(grid.albedo.shape, np.float32)
    ratio = ratio_on_planes("reflected", grids[0], even, replace(of, material=material), Progress.of(None))
    belt = ratio[20:26, :, 0].reshape(6, 8, 8)  # row, pair of stripes, column
    assert belt.std(axis=1).mean() < 0.04
    means = belt.mean(axis=(0, 1))
    np.testing.assert_allclose(means, means.reshape(2, 4)[:, ::-1].ravel(), atol=0.03)


def test_any_number_of_threads_gives_the_same_bits():
    grid = textured_ball()
    one, all_ = (ratios(grid, effort=replace(FINAL_EFFORT, max_walks=64)) for _ in range(2))
    np.testing.assert_array_equal(one, all_)


def test_few_paths_make_no_texel_brighter_than_the_brightest_color_everywhere():
    """Black stripes, and the shade of the ball's other side, where paths bring next to nothing: up to 13.7 of the
    convention's light below the surface without a bound, of 1.4 by many paths.
    """
    black = np.where(np.arange(64) // 4 % 2, 0.97, 1e-6)[:, None] * np.ones((32, 1, 3))
    grid = replace(textured_ball(), albedo=black.astype(np.float32))
    of = spreading([SUN])
    (known,), _ = with_factors([grid], of.material, of.sources)
    below = ratios(grid, effort=QUICK_EFFORT) * known.color_in
    assert below.max() <= 1.001 * MOST_LIGHT * known.color_in.max() ** 2


def test_a_quick_result_is_near_the_final_one():
    """With a hundred times fewer walks: 10 % of noise are wanted."""
    noises = []
    report = Reports(texture=noises.append)
    final, quick = (ratios(textured_ball(), effort=effort, reports=report) for effort in (FINAL_EFFORT, QUICK_EFFORT))
    lit = textured_ball().normals @ np.float32(SUN.direction) < -0.2
    assert distance(quick[lit], final[lit]) < 0.1
    assert 0 < noises[0] < noises[1] < 0.2


def points_of(grid):
    shown = grid.areas > 0
    return Points(grid.middles[shown], grid.normals[shown], grid.tangents[shown])


def test_cores_cover_all_points_and_planes_keep_areas():
    grid = textured_ball(256, 128)
    points = points_of(grid)
    middles = middles_of(points, 5 * PITCH)
    nearest = np.min([middle.distances(points) for middle in middles], axis=0)
    assert nearest.max() < 1.1  # half of the points were candidates
    middle = min(middles, key=lambda middle: abs(middle.normal[2]))
    plane = TangentPlane.of(middle, points, PITCH, 10 * PITCH)
    x, y = ((plane.places + plane.low) * PITCH).T
    # A cap within the chord c has the area pi c^2 on the ball; disks on the plane, too.
    for chord in (5 * PITCH, 10 * PITCH):
        within = np.hypot(x, y) < chord
        area = grid.areas[grid.areas > 0][plane.points[within]].sum()
        assert area == pytest.approx(np.pi * chord**2, rel=0.05)


def test_planes_lie_apart_in_one_image():
    points = points_of(textured_ball())
    planes, shape = side_by_side([TangentPlane.of(m, points, PITCH, 3 * PITCH) for m in middles_of(points, 8 * PITCH)])
    shown = np.zeros(shape, int)
    for plane in planes:
        shown[plane.part] += 1
        assert (plane.places >= np.array(plane.corner) + 0.5).all()
        assert (plane.places <= np.add(plane.corner, plane.size) - 0.5).all()
    assert len(planes) > 5
    assert shown.max() == 1
    assert shown.mean() > 0.6


def test_directions_turn_with_the_surface():
    """Along a great circle a direction keeps its angle to it, and the frame of the middle itself is the plane's."""
    angle = np.linspace(-1.2, 1.2, 9)
    normals = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1)
    along = np.stack([np.cos(angle), 0 * angle, -np.sin(angle)], -1)
    across = np.broadcast_to([0.0, 1.0, 0.0], normals.shape)
    middle = Middle(normals[4], normals[4], along[4], 1.0)
    np.testing.assert_allclose(middle.turns(Points(normals, normals, along)), 1, atol=1e-6)
    np.testing.assert_allclose(middle.turns(Points(normals, normals, across)), 1j, atol=1e-6)
    turned = middle.aligned(Points(normals, normals, along), np.full(9, 1j))
    np.testing.assert_allclose(turned.x_axis, (0, 1, 0), atol=1e-6)


def test_a_layer_below_counts_little():
    """Two sheets a few texels apart with the same normals: each plane shows its own."""
    upper = as_mesh(PLANE)
    lower = replace(upper, middles=upper.middles - [0, 0, 3 * PITCH])
    both = [np.concatenate(pair) for pair in zip(*(vars(points_of(grid)).values() for grid in (upper, lower)))]
    points = Points(*both)
    (middle,) = (m for m in middles_of(points.at(slice(0, SIZE * SIZE)), 20 * PITCH)[:1])
    plane = TangentPlane.of(middle, points, PITCH, 5 * PITCH)
    own = plane.points < SIZE * SIZE
    assert own.any()
    assert not own.all()
    assert plane.weights[own].min() == 1
    assert plane.weights[~own].max() < 0.01


def test_gaps_between_points_are_surface_and_wide_ones_are_not():
    known = np.zeros((12, 24), bool)
    known[2:10:2, 2:10:2] = True  # every second texel
    known[2:10, 16:22] = True
    surface = closed(known, 2)
    assert surface[2:9, 2:9].all()
    assert surface[2:10, 16:22].all()
    assert not surface[:, 11:15].any()
    assert not surface[:, 23].any()
