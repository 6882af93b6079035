"""Slabs have two faces: light on the one behind is transmitted to the one that is baked."""

import math
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import IRRADIANCE
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.live.live_target import LiveTarget
from beamspread.core.live.renderer import for_live
from beamspread.core.material import Material
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, SunLight
from beamspread.core.scene.occluders import Mesh, Occluder
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.target import BACK, FRONT, Target

from bakes import SETTINGS, bake_job, square
from helpers import travel
from mesh_shapes import box, heights, mesh_of, smooth_ball

ALBEDO, PATH, PATHS = 0.9, 0.02, 2.0
MEDIUM = Medium(0.0, 1.0, PATHS)
MATERIAL = Material(albedo=(ALBEDO,) * 3, mean_free_path=(PATH,) * 3, anisotropy=0.0)
SLAB = Surface(MATERIAL, PATHS * PATH)
ABOVE = travel(30, 20)
BELOW = ABOVE * (1, 1, -1)
WHITE = (1.0, 1.0, 1.0)
# Error of the solver (`TOLERANCE`), and rounding of the library's totals.
SOLVED = 6e-3


def sun(direction, name="Sun"):
    return SunLight(name, 2.0, WHITE, True, tuple(map(float, direction)))


def lamp(*position):
    return PointLight("Lamp", 30.0, (1.0, 0.7, 0.4), True, position)


def baked(*lights, side=FRONT, **options):
    job = bake_job(lights, surface=SLAB, **options)
    return replace(job, receiver=job.receiver.seen_from(side)).run().texture


@pytest.fixture(scope="module")
def ldf():
    return library(MEDIUM, "preview")


def mesh_job(polygons, lights, side=FRONT, surface=SLAB, size=(64, 32), name="Sheet"):
    """The bake of a sheet that shadows itself."""
    mesh = flatten(polygons, min(surface.material.mean_free_path), name, is_sheet=True)
    receiver = build_receiver(mesh, *size, name).seen_from(side)
    triangles = Mesh(polygons.corners, _triangles(polygons))
    return BakeJob(name, receiver, Illumination(lights, [Occluder(name, triangles)]), surface, SETTINGS, BAKE_STEPS)


def _triangles(polygons):
    fans = [
        (start, start + k, start + k + 1)
        for start, size in zip(polygons.starts[:-1], polygons.sizes)
        for k in range(1, size - 1)
    ]
    return np.array(fans, np.uint32)


def test_light_from_behind_is_transmitted(ldf):
    irradiance = 2 * math.cos(math.radians(30))
    middle = (slice(8, 16), slice(8, 16))  # 17 mean free paths from the edges
    behind, before = baked(sun(BELOW))[middle], baked(sun(ABOVE))[middle]
    np.testing.assert_allclose(behind, ldf.transmittance(30, ALBEDO) * irradiance / math.pi, rtol=SOLVED)
    np.testing.assert_allclose(before, ldf.reflectance(30, ALBEDO) * irradiance / math.pi, rtol=SOLVED)
    assert not np.allclose(behind, before, rtol=0.1)


def test_light_of_both_faces_adds_up():
    above, below = lamp(0.2, 0.1, 0.3), lamp(-0.3, 0.2, -0.1)
    np.testing.assert_allclose(baked(above, below), baked(above) + baked(below), rtol=1e-6)


def test_a_slab_seen_from_behind_is_a_slab():
    """The same scene, mirrored at the slab: other signs of heights, the same numbers."""
    for height in (0.3, -0.15):
        front = baked(lamp(0.2, 0.1, height))
        back = baked(lamp(0.2, 0.1, -height), side=BACK)
        np.testing.assert_allclose(back, front, rtol=1e-5)


@pytest.mark.parametrize("axes", [((1, 0, 0), (0, 1, 0)), ((-1, 0, 0), (0, 1, 0)), ((0, 1, 0), (1, 0, 0))])
def test_transmitted_light_moves_on_along_its_beam(axes, ldf):
    """One lit texel: what leaves the other face lies ahead of it in the world, however the texture lies.

    The centroid is that of the library's own image; single texels of a third of a mean free path move it by less than
    a tenth of one.
    """
    size, pitch = 96, PATH / 3
    x_axis, y_axis = np.array(axes, float)
    corner = tuple((-(x_axis + y_axis) * pitch * size / 2).tolist())
    lit = np.zeros((size, size, 3), np.float32)
    lit[size // 2, size // 2] = 1
    grid = replace(
        square(size, side=pitch * size), origin=corner, x_axis=tuple(x_axis), y_axis=tuple(y_axis), color_in=lit
    )
    travels = np.array((math.sin(math.radians(60)), 0.0, math.cos(math.radians(60))))
    light = baked(sun(travels), grid=grid)[..., 0].astype(float)
    center = np.einsum("hw,hwc->c", light, grid.positions() - grid.positions()[size // 2, size // 2]) / light.sum()
    image = ldf.image(60, ALBEDO, size + 1, pitch / PATH, side="transmitted").astype(float)
    ahead = (image.sum(0) * (np.arange(size + 1) - size / 2)).sum() * pitch / image.sum()
    assert ahead > PATH
    np.testing.assert_allclose(center, (ahead, 0, 0), atol=0.1 * PATH)


def test_a_sheet_that_curls_is_flat_where_it_is_large():
    """A radius of 2 m is 400 mean free paths; where the sheet lies level, the sun's light is that of the plane."""
    surface = Surface(replace(MATERIAL, mean_free_path=(0.005,) * 3), 0.01)
    curl = mesh_of(*heights(lambda x, y: 0.25 * (x - 0.5) ** 2))
    for direction in ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)):
        job = mesh_job(curl, [sun(direction)], surface=surface, size=(48, 48))
        assert job.receiver.is_bent
        flat = bake_job([sun(direction)], surface=surface, grid=square(48)).run().texture
        # 1 %: rays of disks in place of squares; faces tilt by 1.2 degrees.
        np.testing.assert_allclose(job.run().texture[22:26, 22:26], flat[22:26, 22:26], rtol=0.02)


def test_a_shade_with_a_bulb_shines_evenly(ldf):
    """The sheet neither shadows its own back, nor keeps a lamp inside from it: T(0) E / pi on all of a sphere.

    Facets of 7.5 degrees lie up to .5 % nearer to the lamp, and tilt by 4 degrees.
    """
    irradiance = 30.0 * np.array((1.0, 0.7, 0.4)) / (4 * math.pi)
    job = mesh_job(smooth_ball(), [lamp(0.0, 0.0, 0.0)])
    shade = job.run()
    inside = shade.receiver.inside()
    wanted = ldf.transmittance(0, ALBEDO) * irradiance / math.pi
    np.testing.assert_allclose(shade.texture[inside].mean(axis=0), wanted, rtol=3e-3)  # .14 % measured
    # Texels at the poles are long and cut: 3.5 % at most, 2.4 % in one of a hundred, .6 % in one of ten.
    off = np.abs(shade.texture[inside][:, 0] / wanted[0] - 1)
    assert np.quantile(off, 0.9) < 0.01
    assert off.max() < 0.05
    lit = mesh_job(smooth_ball(), [lamp(0.0, 0.0, 0.0)], side=BACK).run().texture[inside].mean(axis=0)
    np.testing.assert_allclose(lit, ldf.reflectance(0, ALBEDO) * irradiance / math.pi, rtol=0.015)  # 1 % measured
    dark = mesh_job(smooth_ball(), [lamp(0.0, 0.0, 0.0)], surface=Surface(MATERIAL)).run()
    assert not dark.texture.any()


def test_a_closed_sheet_is_said_to_be_hollow_and_keeps_its_normals():
    inward = replace(smooth_ball(), normals=-smooth_ball().normals, corner_normals=-smooth_ball().corner_normals)
    for polygons, words in ((smooth_ball(), "back is the inside"), (inward, "front is the inside")):
        mesh = flatten(polygons, PATH, "Shade", is_sheet=True)
        (message,) = mesh.messages
        assert words in message.text
        assert "Infinite Depth" in message.remedy
        grid = build_receiver(mesh, 32, 16).charts[0].grid
        assert np.sign(grid.height_of((0.0, 0.0, 0.0))) == (1 if polygons is inward else -1)
    solid = flatten(inward, PATH, "Ball")
    assert "point inward" in solid.messages[0].text
    uvs = [np.array([(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]) + (0.15 * n, 0) for n in range(6)]
    (flat_note,) = flatten(mesh_of(box(), uvs), PATH, "Box", is_sheet=True).messages
    assert "hollow" in flat_note.text
    curl = mesh_of(*heights(lambda x, y: 0.25 * (x - 0.5) ** 2))
    assert flatten(curl, 0.1 * PATH, "Page", is_sheet=True).messages == ()


def test_messages_tell_what_counts():
    def texts(*lights, **changes):
        job = bake_job(lights, surface=SLAB, settings=replace(SETTINGS, **changes))
        return [message.text for message in job.messages()]

    above, below = lamp(0, 0, 1.0), replace(lamp(0, 0, -1.0), name="Low lamp")
    assert texts(above, below) == texts(below) == []
    (left_out,) = texts(above, below, distributions="angular")
    assert (
        left_out == "Light that reaches the back of 'Plane' is left out, since LDF samples know one side: 'Low lamp'."
    )
    (dark,) = texts(below, layer=IRRADIANCE)
    assert dark == "All lights are behind 'Plane', so it is black."


def test_irradiance_is_that_of_the_baked_face():
    above, below = (
        bake_job([light], settings=replace(SETTINGS, layer=IRRADIANCE), surface=SLAB)
        for light in (sun(ABOVE), sun(BELOW))
    )
    for job, side in ((above, FRONT), (below, BACK)):
        receiver = job.receiver.seen_from(side)
        irradiance = replace(job, receiver=receiver).run().texture
        np.testing.assert_allclose(irradiance, 2 * math.cos(math.radians(30)), rtol=1e-5)
    assert not replace(above, receiver=above.receiver.seen_from(BACK)).run().texture.any()


def test_estimates_count_both_faces():
    def seconds(*lights, surface=SLAB):
        return bake_job(lights, surface=surface, grid=square(512)).seconds()

    above, below = lamp(0, 0, 1.0), lamp(0, 0, -1.0)
    assert seconds(below) == pytest.approx(seconds(above))
    assert seconds(above, below) == pytest.approx(2 * seconds(above), rel=0.1)
    assert seconds(above, below, surface=Surface(MATERIAL)) < 1.1 * seconds(above, surface=Surface(MATERIAL))


@pytest.mark.parametrize("side", [FRONT, BACK])
def test_live_shows_both_faces(side, renderer, ldf):
    """Exact renderings are bakes; quick ones are within 6 %, as on half-spaces."""
    corners = np.array([(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)])
    polygons = mesh_of([corners], [corners[:, :2] + 0.5])
    lights, size = [lamp(0.2, 0.1, 0.4), lamp(-0.1, 0.1, -0.4)], (64, 64)
    target = LiveTarget(Target("Plane", "M", side), polygons, size, 64, Illumination(lights), SLAB, for_live(SETTINGS))
    assert renderer.missing(target) == []
    exact, quick = renderer.exact(target).texture, renderer.quick(target, 64).texture
    wanted = baked(*lights, side=side, grid=square(64))
    np.testing.assert_allclose(exact, wanted, rtol=SOLVED)
    assert np.abs(quick - wanted).max() < 0.06 * wanted.max()
