"""Tiles of meshes that bend where few rays to a lamp without a size tell how the others go."""

import numpy as np
import pytest
from beamspread.core.native import native

from bent_shapes import ball, flat, texels_of
from helpers import gather_beams
from shapes import box, make_grid, occluders, soup

SIDE = 160
TEXEL = 2 / SIDE
LIGHTS = {"sun": native.SunLight((0.3, 0.2, -1)), "point": native.PointLight((0.3, 0.2, 1.5))}


def both(light, casters, grid, **options):
    """Irradiance where all rays are traced, and where tiles that are even are found first."""
    return [gather_beams(grid, light, casters, find_shadows=find, **options)[0] for find in (False, True)]


@pytest.mark.parametrize("name", LIGHTS)
def test_shadows_wider_than_a_texel_are_as_if_traced(name):
    """Bit by bit, for any number of threads: boxes far apart, which leave some tiles open, and shade others wholly."""
    grid = flat(make_grid(SIDE)).native()
    casters = occluders(box((-0.9, -0.9, 0.2), (-0.2, -0.1, 0.3)), box((0.5, 0.5, 0.2), (0.52, 0.53, 0.21)))
    traced, found = both(LIGHTS[name], casters, grid)
    assert (traced == 0).sum() > 3000
    assert (traced > 0).sum() > 3000
    np.testing.assert_array_equal(found, traced)
    for threads in (1, 3):
        np.testing.assert_array_equal(gather_beams(grid, LIGHTS[name], casters, threads=threads)[0], found)


@pytest.mark.parametrize(
    ("kind", "width"), [("dots", 0.1), ("dots", 0.5), ("wires", 0.02), ("wires", 0.1), ("wires", 0.5)]
)
def test_obstacles_finer_than_a_texel_are_lost_for_a_thousandth_of_the_light_at_most(kind, width):
    """Obstacles in random places, as many as one to 10 x 10 texels, and wires through all the grid."""
    rng = np.random.default_rng(3)
    count = 256 if kind == "dots" else 12
    middle = np.concatenate([rng.uniform(-1, 1, (count, 2)), np.full((count, 1), 0.05)], 1)
    turn = rng.uniform(0, 2 * np.pi, count)
    along = np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    across = np.stack([-along[:, 1], along[:, 0], 0 * turn], 1) * width * TEXEL
    along = along * (width * TEXEL if kind == "dots" else 3.0)
    corners = [middle + x * along + y * across for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))]
    faces = [np.stack([corners[0], corners[k], corners[k + 1]], 1).reshape(-1, 3) for k in (1, 2)]
    casters = occluders(soup(np.concatenate(faces)))
    traced, found = both(LIGHTS["sun"], casters, flat(make_grid(SIDE)).native())
    assert traced.min() < traced.max()
    assert abs(found.mean() / traced.mean() - 1) < 1e-3


@pytest.mark.parametrize("name", LIGHTS)
def test_a_ball_is_lit_as_if_traced(name):
    """Only texels of the terminator, of which a part faces the light, may differ, by little."""
    body = ball(64, 32)
    texels = texels_of(body, 256)
    traced, found = both(LIGHTS[name], body.occluders(box((0.2, 0.2, 1.1), (0.4, 0.4, 1.2))), texels.native())
    assert (found == traced).mean() > 0.95
    np.testing.assert_allclose(found, traced, atol=0.02 * traced.max())
    assert abs(found.mean() / traced.mean() - 1) < 1e-5


def test_hollows_are_even_where_ends_of_texels_lie_behind_the_next_face():
    """A coarse ball lit from its middle: nothing is shaded, though many texels reach through its edges."""
    room = ball(12, 8, inward=True)
    texels = texels_of(room, 192)
    traced, found = both(native.PointLight((0, 0, 0)), room.occluders(), texels.native())
    np.testing.assert_array_equal(found, traced)
    inside = np.linalg.norm(texels.normals, axis=-1) > 0
    assert (found[inside] > 0).all()
