"""Things that touch or cross the receiver leave neither gaps nor acne, here and 10 km from the world's origin."""

import math
from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.native import native
from beamspread.core.scene.grid import Grid
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight
from beamspread.core.scene.occluders import Mesh, Occluder

from helpers import gather_beams
from shapes import FACES, SQUARE, box, sphere

SIZE = 80  # texels of a floor of 2 m
TEXEL = 2 / SIZE
TURNS = {"upright": (0.0, 0.0), "turned": (0.7, 0.0), "tilted": (0.7, 0.5)}
FAR = 10_000 * np.array([0.6, -0.64, 0.48])


def frame(turn):
    """Rows: the floor's axes in the world."""
    about, tilt = TURNS[turn]
    spin = np.array([[math.cos(about), math.sin(about), 0], [-math.sin(about), math.cos(about), 0], [0, 0, 1]])
    lean = np.array([[1, 0, 0], [0, math.cos(tilt), math.sin(tilt)], [0, -math.sin(tilt), math.cos(tilt)]])
    return spin @ lean


def floor(axes, shift):
    corner = tuple(shift - axes[0] - axes[1])
    return Grid(corner, *map(tuple, axes), TEXEL, TEXEL, SIZE, SIZE, np.ones((SIZE, SIZE), np.float32))


GROUND = 3 * SQUARE, FACES


def light_past(*meshes, sun, turn, shift, is_instanced=False):
    """Irradiance by a sun or lamp over its unblocked one; meshes in the floor's frame, as are sun and lamp."""
    axes = frame(turn)
    grid = floor(axes, shift)
    placement = np.column_stack([axes.T, shift])[None]
    occluders = []
    for i, (vertices, triangles) in enumerate((*meshes, GROUND)):
        if is_instanced:
            # A second one stands where it shades nothing, below the floor.
            below = placement.copy()
            below[0, :, 3] -= 50 * axes[2]
            occluders.append(Occluder(str(i), Mesh(vertices, triangles), np.concatenate([placement, below])))
        else:
            occluders.append(Occluder(str(i), Mesh(vertices @ axes + shift, triangles)))
    common = "Light", 1.0, (1.0, 1.0, 1.0), True
    place = np.array(sun) @ axes
    light = SunLight(*common, tuple(place)) if sun[2] < 0 else PointLight(*common, tuple(place + shift))
    caster = Illumination([], occluders).caster(grid)
    if is_instanced:
        step = 2**13 * 2.0 ** math.ceil(math.log2(TEXEL))
        origin = step * np.round(grid.centre / step)
        caster = native.Occluders([one.mesh.native(one.placements) for one in occluders], origin, max_copied=0)
    shadowed, bare = (gather_beams(grid.native(), light.native(), occluders)[0] for occluders in (caster, None))
    return shadowed / bare


def middles():
    return np.meshgrid(*[(np.arange(SIZE) + 0.5) * TEXEL - 1] * 2)


SHIFTS = {"here": np.zeros(3), "far": FAR}
EVERYWHERE = pytest.mark.parametrize("shift", SHIFTS.values(), ids=SHIFTS.keys())
EVERY_TURN = pytest.mark.parametrize("turn", TURNS)


@EVERYWHERE
@EVERY_TURN
@pytest.mark.parametrize("bottom", [0.0, -0.2, 1e-9, -1e-9])
def test_a_box_on_the_floor(bottom, turn, shift):
    """The box stands on the floor, is sunk, or off by less than rounding: only its bottom and its shadow are dark.

    The box covers texels 30 to 49, and its shadow reaches .4 m further, 16 texels: 30 to 65.
    """
    lit = light_past(box((-0.25, -0.25, bottom), (0.25, 0.25, 0.4)), sun=(1, 0, -1), turn=turn, shift=shift)
    dark = np.zeros((SIZE, SIZE), bool)
    dark[30:50, 30:66] = True
    # Borders lie between texels: where rounding moves them by 2^-11 of a texel a ray or two may find the other side.
    border = dark ^ np.pad(dark, 1)[2:, 1:-1] | dark ^ np.pad(dark, 1)[:-2, 1:-1]
    border |= dark ^ np.pad(dark, 1)[1:-1, 2:] | dark ^ np.pad(dark, 1)[1:-1, :-2]
    assert not lit[dark & ~border].any()
    assert (lit[~dark & ~border] == 1).all()
    np.testing.assert_allclose(lit[border], ~dark[border], atol=0.26)


@EVERYWHERE
@EVERY_TURN
def test_a_wall_that_crosses_the_floor(turn, shift):
    """A wall without thickness along x = .0125 (the middle of a texel's column): no gap at its foot."""
    x = 0.5 * TEXEL
    wall = np.array([(x, -2, -0.5), (x, 2, -0.5), (x, 2, 0.5), (x, -2, 0.5)], float), FACES
    lit = light_past(wall, sun=(0.5, 0, -1), turn=turn, shift=shift)
    column = np.arange(SIZE)
    # Its shadow: x to x + .25, 10 texels.
    assert (lit[:, column < 40] == 1).all()
    np.testing.assert_allclose(lit[:, 40], 0.5, atol=0.26)
    assert not lit[:, (column > 40) & (column < 50)].any()
    np.testing.assert_allclose(lit[:, 50], 0.5, atol=0.26)
    assert (lit[:, column > 50] == 1).all()


@EVERYWHERE
@EVERY_TURN
@pytest.mark.parametrize("is_instanced", [False, True])
@pytest.mark.parametrize("sun", [(0, 0, -1), (0.1, 0.2, 3.0)], ids=["sun", "lamp"])
def test_a_sphere_half_sunk(sun, is_instanced, turn, shift):
    """Light from above leaves a disk dark, of the radius of the sphere and no larger than a lamp makes it."""
    vertices, triangles, _ = sphere(48)
    lit = light_past((0.5 * vertices, triangles), sun=sun, turn=turn, shift=shift, is_instanced=is_instanced)
    x, y = middles()
    distance = np.hypot(x, y)
    # The polygon's corners and a texel's own; a lamp 3 m up sees .5 / sqrt(1 - (.5 / 3)^2) - .5 beyond.
    edge = 0.5 * math.cos(math.pi / 48) - 0.75 * TEXEL
    assert not lit[distance < edge].any()
    assert (lit[distance > 0.5 / math.sqrt(1 - (0.5 / 3) ** 2) + 0.06] == 1).all()


@EVERYWHERE
@EVERY_TURN
@pytest.mark.parametrize("angle", [0.0, 60.0, 85.0, 89.5])
@pytest.mark.parametrize("is_instanced", [False, True])
def test_a_bare_floor_has_no_acne(angle, is_instanced, turn, shift):
    """The floor itself is among the occluders, as two instances of a mesh below the size that is shared, too."""
    sun = math.sin(math.radians(angle)), 0.0, -math.cos(math.radians(angle))
    assert (light_past(sun=sun, turn=turn, shift=shift, is_instanced=is_instanced) == 1).all()


def openness(grid, *occluders):
    """Part of an even sky's light that reaches each texel, and the same of a sun that falls in at 30 degrees."""
    caster = Illumination([], occluders).caster(grid)
    sky = native.EnvironmentLight(np.ones((2, 4, 3), np.float32), np.eye(3))
    travel = np.array(grid.normal) * -math.cos(0.5) + np.array(grid.x_axis) * math.sin(0.5)
    parts = []
    for light in (sky, native.SunLight(travel)):
        lit, bare = (native.gather_rays(grid.native(), light, blockers, rays=16)[0] for blockers in (caster, None))
        parts.append(lit[..., 0] / bare[..., 0])
    return parts


def underside(axes, shift):
    """The lit side of a box's bottom, 0.5 m wide, which is the receiver."""
    corner = tuple(shift - 0.25 * axes[0] + 0.25 * axes[1])
    frame = map(tuple, (axes[0], -axes[1], -axes[2]))
    return Grid(corner, *frame, 0.5 / 20, 0.5 / 20, 20, 20, np.ones((20, 20), np.float32), owner="Box")


def object_at(name, axes, shift, vertices, triangles, is_mirrored=False):
    """An occluder in the floor's frame; a mirrored one is the same shape by a mirrored mesh and placement."""
    mirror = np.diag([-1.0, 1, 1]) if is_mirrored else np.eye(3)
    placement = np.column_stack([axes.T @ mirror, shift])[None]
    return Occluder(name, Mesh(vertices @ mirror, triangles[:, ::-1] if is_mirrored else triangles), placement)


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-6, 1e-5, 1e-4])
def test_the_underside_of_a_box_on_a_floor_is_dark(gap, is_mirrored):
    """Rays start 2e-6 m off the box and would miss a floor that is nearer."""
    axes, shift = np.eye(3), np.array([0, 0, gap])
    standing = object_at("Box", axes, shift, *box((-0.25, -0.25, 0), (0.25, 0.25, 0.4)), is_mirrored)
    ground = object_at("Floor", axes, np.zeros(3), *GROUND, is_mirrored)
    grid = underside(axes, shift)
    for lit in openness(grid, standing):
        assert (lit == 1).all()
    for lit in openness(grid, standing, ground):
        assert not lit.any()


@pytest.mark.parametrize("turn", TURNS)
def test_a_tilted_box_that_touches_its_floor_is_dark_below(turn):
    axes = frame(turn)
    standing = object_at("Box", axes, np.zeros(3), *box((-0.25, -0.25, 0), (0.25, 0.25, 0.4)))
    for lit in openness(underside(axes, np.zeros(3)), standing, object_at("Floor", axes, np.zeros(3), *GROUND)):
        assert not lit.any()


@pytest.mark.parametrize("height", [-1e-6, -1e-7, 0.0, 1e-7, 1e-6, 1e-5])
def test_paper_shades_the_floor_that_it_lies_on(height):
    """Below the plane, and in it, it shades nothing: a decal is lit on its floor, and either may be the receiver.

    The paper has borders within texels.
    """
    grid = replace(floor(np.eye(3), np.zeros(3)), owner="Floor")
    ground = object_at("Floor", np.eye(3), np.zeros(3), *GROUND)
    paper = object_at("Paper", np.eye(3), np.array([0, 0, height]), 0.51 * SQUARE, FACES)
    covered = np.clip((0.51 - (np.abs(np.arange(SIZE) + 0.5 - SIZE / 2) - 0.5) * TEXEL) / TEXEL, 0, 1)
    expected = 1 - covered[:, None] * covered * (height > 0)
    for lit in openness(grid, ground, paper):
        np.testing.assert_allclose(lit, expected, atol=0.13)
        assert lit.mean() == pytest.approx(expected.mean(), abs=2e-3)


def test_a_surface_of_two_sheets_is_lit_on_both():
    """Flat text has each face twice, one for each side, in the same place."""
    grid = replace(floor(np.eye(3), np.zeros(3)), owner="Text")
    sheets = Mesh(SQUARE, np.concatenate([FACES, FACES[:, ::-1]]))
    for lit in openness(grid, Occluder("Text", sheets)):
        assert (lit == 1).all()
