"""The bake of plain data: lights add up, colours and thickness act per channel, progress and cancel work."""

import math
from dataclasses import replace

import beamspread
import numpy as np
import pytest
from beamspread.core.bake import BakeSettings, bake, light_beams
from beamspread.core.errors import MaterialError
from beamspread.core.job import BakeJob, Surface
from beamspread.core.material import Material
from beamspread.core.receiver import Polygons, Receiver, build_receiver, fit_uv_map
from beamspread.core.scene import Grid, Mesh, PointLight, SpotLight, SunLight

SETTINGS = BakeSettings(quality="preview", samples=2, margin=0)
MATERIAL = Material(albedo=(0.9, 0.9, 0.9), mean_free_path=(0.01, 0.01, 0.01), anisotropy=0.0)
SUN = SunLight("Sun", (0.0, 0.0, -1.0), 2.0, (1.0, 1.0, 1.0))


def grid(size=24, side=1.0):
    """A square in the xy plane, centred on the origin."""
    return Grid(
        origin=(-side / 2, -side / 2, 0.0),
        x_axis=(1.0, 0.0, 0.0),
        y_axis=(0.0, 1.0, 0.0),
        normal=(0.0, 0.0, 1.0),
        pitch_x=side / size,
        pitch_y=side / size,
        width=size,
        height=size,
        coverage=np.ones((size, size), np.float32),
    )


def shifted(receiver, distance):
    """The same grid elsewhere."""
    return replace(receiver, origin=tuple(np.array(receiver.origin) + distance))


def reflectance(angle, albedo=0.9, thickness=math.inf):
    medium = beamspread.Medium(g=0.0, ior=1.0, thickness=thickness)
    return beamspread.library(medium, quality="preview").reflectance(angle, albedo)


def test_interior_under_a_sun():
    luminance = bake(grid(), [SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS)
    assert luminance.shape == (24, 24, 3)
    assert luminance.dtype == np.float32
    assert luminance[12, 12] == pytest.approx(reflectance(0) * 2 / math.pi, rel=2e-3)


def test_lights_add_up_and_colours_stay_apart():
    red = replace(SUN, color=(1.0, 0.0, 0.0))
    blue = replace(SUN, color=(0.0, 0.0, 1.0), direction=(math.sin(0.5), 0.0, -math.cos(0.5)))
    both = bake(grid(), [red, blue], Mesh.empty(), MATERIAL, 0.0, SETTINGS)
    apart = sum(bake(grid(), [light], Mesh.empty(), MATERIAL, 0.0, SETTINGS) for light in (red, blue))
    assert both == pytest.approx(apart)
    assert not both[..., 1].any()
    assert both[12, 12, 0] > both[12, 12, 2] > 0


def test_an_uneven_receiver_does_not_shadow_itself():
    """Corners off the plane, but still taken for flat; a low sun, and the mesh itself among the occluders."""
    bump = 3e-5
    corners = np.array([(-0.5, -0.5, bump), (0.5, -0.5, -bump), (0.5, 0.5, bump), (-0.5, 0.5, -bump)])
    uvs = corners[:, :2] + 0.5
    polygons = Polygons(corners, uvs, np.array([0, 4]), np.array([(0.0, 0.0, 1.0)]))
    receiver = build_receiver(polygons, fit_uv_map(polygons), 32, 32)
    mesh = Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))
    low_sun = replace(SUN, direction=(math.sin(1.5), 0.0, -math.cos(1.5)))
    irradiance, _ = light_beams(receiver.grid, low_sun, mesh.ray_caster(receiver.grid), SETTINGS)
    assert irradiance == pytest.approx(np.full((32, 32, 3), 2 * math.cos(1.5)), rel=1e-3)


def test_objects_under_the_same_light_share_its_shadows():
    roof = Mesh(np.array([[-9, -9, 1], [9, -9, 1], [0, 18, 1]], float), np.array([[0, 1, 2]], np.uint32))
    near = roof.ray_caster(grid())
    assert near.triangle_count == 1
    assert roof.ray_caster(shifted(grid(), 3.0)) is near
    assert roof.ray_caster(shifted(grid(), 1e4)) is not near
    assert Mesh.empty().ray_caster(grid()) is None


@pytest.mark.parametrize("distance", [1e4, 1e6])
def test_shadows_do_not_drift_far_from_the_world_origin(distance):
    """Rays are traced relative to an origin within 2^13 texels, in single precision: known to 2^-11 of a texel.

    So shadows stay where they are but for single rays, of 16 per texel, that pass an edge within rounding: with 400
    texels along edges and rays a 16th of a texel apart some 400 * 16 / 2^11 = 3 for each rounding that moves them.
    """
    card = np.array([(-0.31, -0.17, 0.23), (0.23, -0.29, 0.11), (0.07, 0.37, 0.31)])
    lamp = PointLight("Lamp", (0.13, 0.21, 0.83), 1.0, (1.0, 1.0, 1.0))
    offset = np.array([0.6, -0.64, 0.48]) * distance

    def beams(offset):
        mesh = Mesh(card + offset, np.array([(0, 1, 2)], np.uint32))
        there = replace(lamp, position=tuple(np.array(lamp.position) + offset))
        receiver = shifted(grid(256), offset)
        return light_beams(receiver, there, mesh.ray_caster(receiver), replace(SETTINGS, samples=4))

    (here, direction), (there, direction_there) = beams(np.zeros(3)), beams(offset)
    dark = (here[..., 0] == 0).sum()
    assert 5000 < dark < 20000
    flips = np.abs(there - here)[..., 0] > 1e-6 * here.max()
    assert flips.sum() < 40
    assert np.abs(there - here).sum() < 1e-4 * here.sum()
    assert direction_there[~flips] == pytest.approx(direction[~flips], abs=1e-6)


@pytest.mark.parametrize("distance", [1e3, 1e6])
def test_what_is_far_away_does_not_change_shadows_nearby(distance):
    """Where rays start depends on what they might meet there, not on the largest coordinate of the scene."""
    card = np.array([(-0.31, -0.17, 0.0), (0.23, -0.29, 0.0), (0.07, 0.37, 0.031)])
    far = np.array([(0, 0, -10), (1, 0, -10), (0, 1, -10)]) + (distance, 0, 0)
    sun = replace(SUN, direction=(0.3, 0.2, -1.0))
    alone = Mesh(card, np.array([(0, 1, 2)], np.uint32))
    both = Mesh.join([alone, Mesh(far, np.array([(0, 1, 2)], np.uint32))])
    near, wide = (light_beams(grid(256), sun, mesh.ray_caster(grid(256)), SETTINGS)[0] for mesh in (alone, both))
    assert (near == 0).any()
    assert np.array_equal(near, wide)


def turned_grid(turn):
    """A grid around the origin in a random plane, with its axes as rows."""
    axes, _ = np.linalg.qr(np.random.default_rng(turn).normal(size=(3, 3)))
    x_axis, y_axis, normal = (tuple(axis) for axis in axes)
    origin = tuple(-0.5 * (axes[0] + axes[1]))
    return replace(grid(), origin=origin, x_axis=x_axis, y_axis=y_axis, normal=normal), axes


@pytest.mark.parametrize("height", [0.0, 1e-30, 1e-17, 1e-16, 1e-12])
def test_a_lamp_in_the_plane_adds_nothing(height):
    lamp = PointLight("Lamp", (0.013, 0.21, height), 100.0, (1.0, 1.0, 1.0))
    sun = bake(grid(), [SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS)
    assert np.array_equal(bake(grid(), [lamp, SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS), sun)


@pytest.mark.parametrize("kind", ["point", "sun"])
def test_light_along_a_turned_plane_adds_nothing(kind):
    """By rounding it comes from above or from below."""
    for turn in range(60):
        receiver, axes = turned_grid(turn)
        within = np.array([0.013, 0.21, 0.0]) @ axes
        if kind == "point":
            light = PointLight("Lamp", tuple(within), 100.0, (1.0, 1.0, 1.0))
        else:
            light = replace(SUN, direction=tuple(within / np.linalg.norm(within)))
        irradiance, direction = light_beams(receiver, light, None, SETTINGS)
        assert not irradiance.any()
        assert (direction == (0, 0, -1)).all()
        sun = replace(SUN, direction=tuple(-axes[2]))
        alone, both = (
            bake(receiver, lights, Mesh.empty(), MATERIAL, 0.0, SETTINGS) for lights in ([sun], [light, sun])
        )
        assert np.array_equal(alone, both)


def test_no_light():
    assert not bake(grid(), [], Mesh.empty(), MATERIAL, 0.0, SETTINGS).any()


@pytest.mark.parametrize("kind", ["point", "spot"])
def test_lamp_above_the_centre(kind):
    """P / (4 pi r^2) below the lamp; a cone wider than the plane changes nothing there."""
    place = ("Lamp", (0.0, 0.0, 2.0), 100.0, (1.0, 1.0, 1.0), True)
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    lamp = PointLight(*place) if kind == "point" else SpotLight(*place, axes, math.radians(120), 0.0)
    luminance = bake(grid(), [lamp], Mesh.empty(), MATERIAL, 0.0, SETTINGS)
    irradiance = 100 / (4 * math.pi * 2**2)
    assert luminance[12, 12] == pytest.approx(reflectance(0) * irradiance / math.pi, rel=0.01)
    assert luminance[12, 4] == pytest.approx(luminance[12, 19], rel=0.01)


def test_occluder_and_lamps_without_shadow():
    roof = Mesh(np.array([[-9, -9, 1], [9, -9, 1], [0, 18, 1]], float), np.array([[0, 1, 2]], np.uint32))
    assert not bake(grid(), [SUN], roof, MATERIAL, 0.0, SETTINGS).any()
    free = bake(grid(), [replace(SUN, cast_shadow=False)], roof, MATERIAL, 0.0, SETTINGS)
    assert free == pytest.approx(bake(grid(), [SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS))


def test_thickness_counts_in_mean_free_paths_of_each_channel():
    material = replace(MATERIAL, mean_free_path=(0.01, 0.02, 0.04))
    luminance = bake(grid(), [SUN], Mesh.empty(), material, 0.04, SETTINGS)
    expected = [reflectance(0, thickness=depth) * 2 / math.pi for depth in (4, 2, 1)]
    assert luminance[12, 12] == pytest.approx(expected, rel=0.01)


def test_properties_are_checked_before_anything_runs():
    with pytest.raises(MaterialError, match="albedo"):
        bake(grid(), [SUN], Mesh.empty(), replace(MATERIAL, albedo=(1.0, 0.5, 0.5)), 0.0, SETTINGS)
    with pytest.raises(MaterialError, match="thickness"):
        bake(grid(), [SUN], Mesh.empty(), MATERIAL, -1.0, SETTINGS)


def test_progress_rises_to_one_and_can_stop_at_any_time():
    seen = []
    sun = bake(grid(), [SUN, SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS, lambda done: seen.append(done) or True)
    assert (np.diff(seen) > -1e-9).all()
    assert 0 <= seen[0] <= seen[-1] <= 1
    for moment in (0.0, 0.6, 0.95):
        with pytest.raises(beamspread.Cancelled):
            bake(grid(), [SUN, SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS, lambda done, m=moment: done < m)
    assert np.array_equal(bake(grid(), [SUN, SUN], Mesh.empty(), MATERIAL, 0.0, SETTINGS), sun)


def test_job_works_out_the_albedo_of_a_base_colour():
    surface = Surface(replace(MATERIAL, albedo=(2.0, 2.0, 2.0)), base_color=(0.5, 0.3, 0.1))
    albedo = surface.resolve("preview").albedo
    library = beamspread.library(beamspread.Medium(g=0.0, ior=1.0), quality="preview")
    assert [library.diffuse_reflectance(value) for value in albedo] == pytest.approx([0.5, 0.3, 0.1], abs=1e-6)
    receiver = Receiver(grid(), 24, 24, grid().coverage)
    texture = BakeJob(receiver, [SUN], Mesh.empty(), surface, SETTINGS).run()
    expected = [reflectance(0, value) * 2 / math.pi for value in albedo]
    assert texture[12, 12] == pytest.approx(expected, rel=5e-3)


def test_a_bake_uses_the_anisotropy_of_each_channel():
    material = replace(MATERIAL, anisotropy=0.5, anisotropy_rgb=(0.0, 0.7, 0.0))
    luminance = bake(grid(), [SUN], Mesh.empty(), material, 0.0, SETTINGS)
    forward = beamspread.library(beamspread.Medium(g=0.7, ior=1.0), quality="preview").reflectance(0, 0.9)
    expected = [value * 2 / math.pi for value in (reflectance(0), forward, reflectance(0))]
    assert luminance[12, 12] == pytest.approx(expected, rel=0.01)


def test_base_color_is_met_with_an_anisotropy_per_channel():
    material = replace(MATERIAL, anisotropy_rgb=(0.0, 0.7, 0.0))
    albedo = Surface(material, base_color=(0.3, 0.3, 0.3)).resolve("preview").albedo
    assert albedo[0] == albedo[2] < albedo[1]
    library = beamspread.library(beamspread.Medium(g=0.7, ior=1.0), quality="preview")
    assert library.diffuse_reflectance(albedo[1]) == pytest.approx(0.3, abs=1e-9)


def test_albedo_from_color_is_public():
    medium = beamspread.Medium(g=0.0, ior=1.0)
    assert 0 < beamspread.albedo_from_color((0.2, 0.3, 0.4), medium, quality="preview")[0] < 1
