"""How enclosed and how lit receivers are, by rays and by boxes, and announced times of bounced light."""

import numpy as np
import pytest
from beamspread.core.bake.surroundings import (
    OPEN,
    Surroundings,
    bounced_seconds,
    bounced_seconds_of_cycles,
    corners_of,
    directions_of,
    enclosed_part,
    surroundings_of,
)
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight
from beamspread.core.scene.occluders import Mesh

UP = np.array([0.0, 0.0, 1.0])
LAMP = PointLight("Lamp", 100.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 5.0))
NODES, MAX_RAYS = 64**2, 12e6

# One ray in 128 or, of a few texels, noise of some percent.
NOISE = 0.03


def floor():
    """A square of 2 x 2 at the height 0."""
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    return Grid((-1.0, -1.0, 0.0), *axes, 0.25, 0.25, 8, 8, np.ones((8, 8), np.float32))


def plate(height, half):
    """A square at a height."""
    corners = np.array([(-half, -half, height), (half, -half, height), (half, half, height), (-half, half, height)])
    return Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))


def box_around(mesh):
    return mesh.vertices.min(axis=0)[None], mesh.vertices.max(axis=0)[None]


def test_the_part_that_a_plate_fills_is_its_form_factor():
    """The plate is a square of side 2 a at the height a; the eye lies below its middle."""
    roof = plate(1.0, 1.0)
    x = 1 / np.sqrt(2)
    exact = 4 / np.pi * x * np.arctan(x)
    assert enclosed_part(np.zeros((4, 3)) + corners_of(floor()), UP, *box_around(roof)) == pytest.approx(
        exact, abs=NOISE
    )


def test_rays_and_a_box_agree_on_a_plate():
    roof = plate(0.5, 4.0)
    by_box = enclosed_part(corners_of(floor()), UP, *box_around(roof))
    assert surroundings_of([floor()], Illumination([LAMP], roof)).enclosed == pytest.approx(by_box, abs=2 * NOISE)


def test_in_the_open_and_in_a_box():
    corners = corners_of(floor())
    none = np.zeros((0, 3))
    assert enclosed_part(corners, UP, none, none) == 0
    assert enclosed_part(corners, UP, np.array([[-9.0, -9, -1]]), np.array([[9.0, 9, 5]])) == 1
    assert enclosed_part(corners, UP, np.array([[-9.0, -9, -2]]), np.array([[9.0, 9, -1]])) == 0
    assert enclosed_part(corners, None, np.array([[-9.0, -9, -2]]), np.array([[9.0, 9, -1]])) > 0.3


def test_lamps_behind_a_plate_are_not_seen():
    assert surroundings_of([floor()], Illumination([LAMP])) == OPEN
    dark = surroundings_of([floor()], Illumination([LAMP], plate(4.0, 9.0)))
    assert dark.lit == 0
    assert dark.bounced == Surroundings(1.0, 0.0).bounced > Surroundings(0.5, 0.5).bounced
    sky = surroundings_of([floor()], Illumination([LAMP], plate(4.0, 9.0)), has_unknown_sky=True)
    assert sky.lit == pytest.approx(1 - sky.enclosed, abs=1e-6)


def test_directions_are_spread_as_even_light():
    """Means of the cosine: 2/3 above a plane, 0 all around."""
    assert np.linalg.norm(directions_of(UP), axis=1) == pytest.approx(1)
    assert (directions_of(UP) @ UP).mean() == pytest.approx(2 / 3, abs=NOISE)
    assert directions_of(None).mean(axis=0) == pytest.approx(0, abs=NOISE)


def seconds(triangles=1000, around=OPEN, is_bent=False, nodes=NODES, spread=0.0):
    return bounced_seconds(triangles, around, nodes, is_bent, 1, MAX_RAYS, spread)


def test_rooms_take_longer_up_to_the_largest_number_of_rays():
    room, dim = Surroundings(0.5, 1.0), Surroundings(1.0, 0.0)
    assert seconds() < seconds(around=room) < seconds(around=dim)
    assert seconds(around=dim, nodes=NODES / 4) < seconds(around=dim) == seconds(around=dim, nodes=4 * NODES)
    # 12 million rays in rooms of 5 thousand to 280 thousand triangles took 20 to 30 seconds of a core.
    assert 15 < seconds(5000, dim) < seconds(280_000, dim) < 35


def test_more_triangles_take_longer_and_bodies_less():
    assert seconds(100) < seconds(10**6)
    room = Surroundings(0.5, 0.5)
    assert seconds(around=room, is_bent=True) < seconds(around=room)


def test_light_that_few_directions_bring_takes_longer():
    """The light that rays found counts, however enclosed a surface is; a filter removes part of the noise in Cycles."""
    even, spotty = (Surroundings(0.5, 1.0, returned) for returned in ((0.9, 0.9), (0.9, 1.2)))
    dark = Surroundings(0.5, 0.0, (0.0, 0.0))
    assert seconds(around=dark) < seconds(around=even) < seconds(around=spotty)
    assert dark.bounced == 0
    bright, brighter = (Surroundings(1.0, 0.0, (0.5, square)) for square in (2.5, 11.0))
    assert seconds(around=bright) == seconds(around=brighter)  # paths are guided there
    assert even.bounced_in_cycles == pytest.approx(0.9)
    assert 0.9 < spotty.bounced_in_cycles < 1.2


def test_a_medium_that_spreads_light_over_nodes_needs_fewer_paths():
    room = Surroundings(0.5, 0.5)
    assert seconds(around=room, spread=4.0) < seconds(around=room, spread=1.0) < seconds(around=room)


def test_lamps_through_glass_take_cycles_long_where_its_paths_meet_them():
    """A sun shows as noise only once a path has met it."""
    times = [
        bounced_seconds_of_cycles(Surroundings(0.5, 0.5, (0.1, 0.1), *glass), NODES, False)
        for glass in ((0.0, 0.0), (100.0, 1e-8), (100.0, 2e-6), (100.0, 1e-3))
    ]
    plain, unseen, seldom, often = times
    assert unseen == pytest.approx(plain, rel=0.3)
    assert 2 * plain < seldom < 0.9 * often
    # 128 paths of each part; a core traces some 250,000 to 300,000 a second in the open.
    assert often == pytest.approx(bounced_seconds_of_cycles(Surroundings(0.5, 0.5, (2.0, 2.0)), NODES, False))
