"""The bake of plain data: lights add up, colours and thickness act per channel, progress and cancel work."""

import math
import pickle
from dataclasses import replace

import beamspread
import numpy as np
import pytest
from beamspread.core.bake.bake_settings import COMBINED
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.layers import LAYERS, arrive, mean_direction
from beamspread.core.bake.spread_light import rays_per_texel
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.errors import MaterialError
from beamspread.core.native import native
from beamspread.core.scene.chart import Chart, ChartIsland
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, Light, PointLight, SpotLight, SunLight, WorldLight
from beamspread.core.scene.occluders import Mesh, Occluder
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import Receiver, build_receiver

from bakes import MATERIAL, SETTINGS, bake, bake_job, square

SUN = SunLight("Sun", 2.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))


def job(lights, occluders=None, surface=None, settings=SETTINGS, **frame):
    """A bake of a square with its frame changed."""
    return bake_job(lights, occluders, surface, settings, replace(square(), **frame))


def shifted(receiver, distance):
    """The same grid elsewhere."""
    return replace(receiver, origin=tuple(np.array(receiver.origin) + distance))


def light_beams(receiver, light, occluders=None, settings=SETTINGS):
    """Irradiance (H, W, 3) of a light without size, and the direction in which it travels."""
    irradiance, flow = arrive(receiver, Illumination([light], occluders), settings)
    return irradiance, mean_direction(flow)


def reflectance(angle, albedo=0.9, thickness=math.inf):
    medium = beamspread.Medium(g=0.0, ior=1.0, thickness=thickness)
    return beamspread.library(medium, quality="preview").reflectance(angle, albedo)


def test_interior_under_a_sun():
    luminance = bake(square(), Illumination([SUN]), MATERIAL, 0.0, SETTINGS)
    assert luminance.shape == (24, 24, 3)
    assert luminance.dtype == np.float32
    assert luminance[12, 12] == pytest.approx(reflectance(0) * 2 / math.pi, rel=2e-3)


def test_lights_add_up_and_colors_stay_apart():
    red = replace(SUN, color=(1.0, 0.0, 0.0))
    blue = replace(SUN, color=(0.0, 0.0, 1.0), direction=(math.sin(0.5), 0.0, -math.cos(0.5)))
    both = bake(square(), Illumination([red, blue]), MATERIAL, 0.0, SETTINGS)
    apart = sum(bake(square(), Illumination([light]), MATERIAL, 0.0, SETTINGS) for light in (red, blue))
    assert both == pytest.approx(apart)
    assert not both[..., 1].any()
    assert both[12, 12, 0] > both[12, 12, 2] > 0


def test_an_uneven_receiver_does_not_shadow_itself():
    """Corners off the plane, but still taken for flat; a low sun, and the mesh itself among the occluders."""
    bump = 3e-5
    corners = np.array([(-0.5, -0.5, bump), (0.5, -0.5, -bump), (0.5, 0.5, bump), (-0.5, 0.5, -bump)])
    uvs = corners[:, :2] + 0.5
    polygons = Polygons(corners, uvs, np.array([0, 4]), np.array([(0.0, 0.0, 1.0)]))
    target = build_receiver(flatten(polygons), 32, 32).charts[0].grid
    mesh = Mesh(corners, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))
    low_sun = replace(SUN, direction=(math.sin(1.5), 0.0, -math.cos(1.5)))
    irradiance, _ = light_beams(target, low_sun, mesh)
    assert irradiance == pytest.approx(np.full((32, 32, 3), 2 * math.cos(1.5)), rel=1e-3)


ROOF = Mesh(np.array([[-9, -9, 1], [9, -9, 1], [0, 18, 1]], float), np.array([[0, 1, 2]], np.uint32))


def test_receivers_near_each_other_share_the_shadows_of_their_scene():
    under_roof = Illumination([SUN], ROOF)
    near = under_roof.caster(square())
    assert near.triangle_count == 1
    assert under_roof.caster(shifted(square(), 3.0)) is near
    assert under_roof.caster(shifted(square(), 1e4)) is not near
    assert Illumination([SUN]).caster(square()) is None


def test_the_shadows_of_a_scene_are_found_once_for_all_its_light_but_not_sent_elsewhere():
    scene = Illumination([SUN], ROOF)
    caster = scene.with_messages().caster(square())
    others = scene.lighting("Plane"), scene.with_lights([]), scene.lit_by([SUN]), scene.without({"World"})
    for other in (scene, *others, scene.with_light_of(Illumination([SUN], ROOF))):
        assert other.caster(square()) is caster
    elsewhere = pickle.loads(pickle.dumps(scene))
    assert elsewhere.caster(square()) is not caster
    assert elsewhere.caster(square()).triangle_count == 1


def test_lights_share_the_shadows_of_their_blockers():
    others = Mesh(ROOF.vertices + (0, 0, 1), np.concatenate([ROOF.triangles] * 2))
    scene = Illumination([SUN], [Occluder("Roof", ROOF), Occluder("Others", others)])

    def count(*names):
        return scene.caster(square(), linked(*names)).triangle_count

    def linked(*names):
        return replace(SUN, blockers=frozenset(names))

    assert scene.caster(square(), SUN).triangle_count == count("Roof", "Others") == 3
    assert (count("Roof"), count("Others", "Elsewhere")) == (1, 2)
    assert scene.caster(square(), linked("Elsewhere")) is None
    assert scene.caster(square(), linked("Roof")) is scene.caster(square(), linked("Roof", "Elsewhere"))
    assert scene.caster(square(), SUN) is scene.caster(square(), linked("Roof", "Others"))


def test_light_bounces_from_meshes_without_shadows_and_passes_unseen_ones():
    meshes = [Occluder("Flame", ROOF, casts_shadows=False), Occluder("Flag", ROOF, is_seen=False)]
    more = Mesh(ROOF.vertices, np.concatenate([ROOF.triangles] * 2))
    scene = Illumination([SUN], [*meshes, Occluder("Wall", more)])
    assert (scene.caster(square()).triangle_count, scene.reflecting(square()).triangle_count) == (3, 3)
    assert scene.triangle_count == 3
    shadowless, unseen = (Illumination([SUN], [mesh]) for mesh in meshes)
    assert shadowless.caster(square()) is None
    assert shadowless.reflecting(square()).triangle_count == 1
    assert unseen.reflecting(square()) is None
    assert unseen.caster(square()).triangle_count == 1
    plain = Illumination([SUN], more)
    assert plain.caster(square()) is plain.reflecting(square())
    assert (
        len({scene.shadow_key() for scene in (shadowless, unseen, Illumination([SUN], [Occluder("Flame", ROOF)]))}) == 3
    )


def test_placements_of_one_mesh_stand_in_one_caster():
    up, aside = np.eye(4)[:3], np.eye(4)[:3]
    up[2, 3], aside[0, 3] = 1, 30
    card = Mesh(ROOF.vertices - (0, 0, 1), ROOF.triangles)
    scene = Illumination([SUN], [Occluder("A", card, aside[None]), Occluder("B", card, np.stack([up, aside]))])
    assert scene.caster(square()).triangle_count == 3
    assert not bake(square(), scene, MATERIAL, 0.0, SETTINGS).any()


@pytest.mark.parametrize("distance", [1e4, 1e6])
def test_shadows_do_not_drift_far_from_the_world_origin(distance):
    """Rays are traced relative to an origin within 2^13 texels, in single precision: known to 2^-11 of a texel.

    So shadows stay where they are but for single rays, of 16 per texel, that pass an edge within rounding: with 400
    texels along edges and rays a 16th of a texel apart some 400 * 16 / 2^11 = 3 for each rounding that moves them.
    """
    card = np.array([(-0.31, -0.17, 0.23), (0.23, -0.29, 0.11), (0.07, 0.37, 0.31)])
    lamp = PointLight("Lamp", 1.0, (1.0, 1.0, 1.0), True, (0.13, 0.21, 0.83))
    offset = np.array([0.6, -0.64, 0.48]) * distance

    def beams(offset):
        mesh = Mesh(card + offset, np.array([(0, 1, 2)], np.uint32))
        there = replace(lamp, position=tuple(np.array(lamp.position) + offset))
        receiver = shifted(square(256), offset)
        return light_beams(receiver, there, mesh, replace(SETTINGS, samples=4))

    (here, direction), (there, direction_there) = beams(np.zeros(3)), beams(offset)
    dark = (here[..., 0] == 0).sum()
    assert 5000 < dark < 20000
    flips = np.abs(there - here)[..., 0] > 1e-6 * here.max()
    assert flips.sum() < 40
    assert np.abs(there - here).sum() < 1e-4 * here.sum()
    assert direction_there[~flips] == pytest.approx(direction[~flips], abs=1e-6)


@pytest.mark.parametrize("distance", [1e3, 1e6])
def test_distant_objects_do_not_change_shadows_nearby(distance):
    """The start of rays depends on nearby triangles, not on the largest coordinate of the scene."""
    card = np.array([(-0.31, -0.17, 0.0), (0.23, -0.29, 0.0), (0.07, 0.37, 0.031)])
    far = np.array([(0, 0, -10), (1, 0, -10), (0, 1, -10)]) + (distance, 0, 0)
    sun = replace(SUN, direction=(0.3, 0.2, -1.0))
    alone = Mesh(card, np.array([(0, 1, 2)], np.uint32))
    both = [Occluder("", mesh) for mesh in (alone, Mesh(far, np.array([(0, 1, 2)], np.uint32)))]
    near, wide = (light_beams(square(256), sun, mesh)[0] for mesh in (alone, both))
    assert (near == 0).any()
    assert np.array_equal(near, wide)


def turned_grid(turn):
    """A grid around the origin in a random plane, with its axes as rows."""
    axes, _ = np.linalg.qr(np.random.default_rng(turn).normal(size=(3, 3)))
    x_axis, y_axis, normal = (tuple(axis) for axis in axes)
    origin = tuple(-0.5 * (axes[0] + axes[1]))
    return replace(square(), origin=origin, x_axis=x_axis, y_axis=y_axis, normal=normal), axes


@pytest.mark.parametrize("height", [0.0, 1e-30, 1e-17, 1e-16, 1e-12])
def test_a_lamp_in_the_plane_adds_nothing(height):
    lamp = PointLight("Lamp", 100.0, (1.0, 1.0, 1.0), True, (0.013, 0.21, height))
    sun = bake(square(), Illumination([SUN]), MATERIAL, 0.0, SETTINGS)
    assert np.array_equal(bake(square(), Illumination([lamp, SUN]), MATERIAL, 0.0, SETTINGS), sun)


@pytest.mark.parametrize("kind", ["point", "sun"])
def test_light_along_a_turned_plane_adds_nothing(kind):
    """By rounding it comes from above or from below."""
    for turn in range(60):
        receiver, axes = turned_grid(turn)
        within = np.array([0.013, 0.21, 0.0]) @ axes
        if kind == "point":
            light = PointLight("Lamp", 100.0, (1.0, 1.0, 1.0), True, tuple(within))
        else:
            light = replace(SUN, direction=tuple(within / np.linalg.norm(within)))
        irradiance, direction = light_beams(receiver, light)
        assert not irradiance.any()
        assert not direction.any()
        sun = replace(SUN, direction=tuple(-axes[2]))
        alone, both = (
            bake(receiver, Illumination(lights), MATERIAL, 0.0, SETTINGS) for lights in ([sun], [light, sun])
        )
        assert np.array_equal(alone, both)


def test_no_light():
    assert not bake(square(), Illumination([]), MATERIAL, 0.0, SETTINGS).any()


@pytest.mark.parametrize("kind", ["point", "spot"])
def test_lamp_above_the_centre(kind):
    """P / (4 pi r^2) below the lamp; a cone wider than the plane changes nothing there."""
    place = ("Lamp", 100.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 2.0))
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    lamp = PointLight(*place) if kind == "point" else SpotLight(*place, axes, math.radians(120), 0.0)
    luminance = bake(square(), Illumination([lamp]), MATERIAL, 0.0, SETTINGS)
    irradiance = 100 / (4 * math.pi * 2**2)
    assert luminance[12, 12] == pytest.approx(reflectance(0) * irradiance / math.pi, rel=0.01)
    assert luminance[12, 4] == pytest.approx(luminance[12, 19], rel=0.01)


def test_occluder_and_lamps_without_shadow():
    assert not bake(square(), Illumination([SUN], ROOF), MATERIAL, 0.0, SETTINGS).any()
    free = bake(square(), Illumination([replace(SUN, cast_shadow=False)], ROOF), MATERIAL, 0.0, SETTINGS)
    assert free == pytest.approx(bake(square(), Illumination([SUN]), MATERIAL, 0.0, SETTINGS))


def test_thickness_counts_in_mean_free_paths_of_each_channel():
    material = replace(MATERIAL, mean_free_path=(0.01, 0.02, 0.04))
    luminance = bake(square(), Illumination([SUN]), material, 0.04, SETTINGS)
    expected = [reflectance(0, thickness=depth) * 2 / math.pi for depth in (4, 2, 1)]
    assert luminance[12, 12] == pytest.approx(expected, rel=0.01)


def test_properties_are_checked_before_anything_runs():
    with pytest.raises(MaterialError, match="albedo"):
        bake(square(), Illumination([SUN]), replace(MATERIAL, albedo=(1.0, 0.5, 0.5)), 0.0, SETTINGS)
    with pytest.raises(MaterialError, match="thickness"):
        bake(square(), Illumination([SUN]), MATERIAL, -1.0, SETTINGS)


def test_progress_rises_to_one_and_can_stop_at_any_time():
    seen = []
    sun = bake(square(), Illumination([SUN, SUN]), MATERIAL, 0.0, SETTINGS, lambda done: seen.append(done) or True)
    assert (np.diff(seen) > -1e-9).all()
    assert 0 <= seen[0] <= seen[-1] <= 1
    for moment in (0.0, 0.6, 0.95):
        with pytest.raises(beamspread.Cancelled):
            bake(square(), Illumination([SUN, SUN]), MATERIAL, 0.0, SETTINGS, lambda done, m=moment: done < m)
    assert np.array_equal(bake(square(), Illumination([SUN, SUN]), MATERIAL, 0.0, SETTINGS), sun)


def test_most_of_the_progress_is_that_of_rays_where_a_light_has_a_size():
    """1000 rays from each texel count .4 units each; the survey, the choice of terms and the solver count eight.

    The rays take a second, and each 50 ms have a report.
    """
    area = AreaLight("Area", 10.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 0.5), np.eye(3), 0.3, 0.3, False, np.pi)
    seen, settings = [], replace(SETTINGS, samples=4)
    bake(square(512, 8.0), Illumination([area]), MATERIAL, 0.0, settings, lambda done: seen.append(done) or True)
    assert (np.diff(seen) > -1e-9).all()
    assert len([fraction for fraction in seen if 0.1 < fraction < 0.9]) >= 3


def test_job_works_out_the_albedo_of_a_base_color():
    surface = Surface(replace(MATERIAL, albedo=(2.0, 2.0, 2.0)), base_color=(0.5, 0.3, 0.1))
    albedo = surface.resolve("preview").albedo
    library = beamspread.library(beamspread.Medium(g=0.0, ior=1.0), quality="preview")
    assert [library.diffuse_reflectance(value) for value in albedo] == pytest.approx([0.5, 0.3, 0.1], abs=1e-6)
    texture = job([SUN], surface=surface).run().texture
    expected = [reflectance(0, value) * 2 / math.pi for value in albedo]
    assert texture[12, 12] == pytest.approx(expected, rel=5e-3)


def test_a_bake_uses_the_anisotropy_of_each_channel():
    material = replace(MATERIAL, anisotropy=0.5, anisotropy_rgb=(0.0, 0.7, 0.0))
    luminance = bake(square(), Illumination([SUN]), material, 0.0, SETTINGS)
    forward = beamspread.library(beamspread.Medium(g=0.7, ior=1.0), quality="preview").reflectance(0, 0.9)
    expected = [value * 2 / math.pi for value in (reflectance(0), forward, reflectance(0))]
    assert luminance[12, 12] == pytest.approx(expected, rel=0.01)


def test_base_color_is_met_with_an_anisotropy_per_channel():
    material = replace(MATERIAL, anisotropy_rgb=(0.0, 0.7, 0.0))
    albedo = Surface(material, base_color=(0.3, 0.3, 0.3)).resolve("preview").albedo
    assert albedo[0] == albedo[2] < albedo[1]
    library = beamspread.library(beamspread.Medium(g=0.7, ior=1.0), quality="preview")
    assert library.diffuse_reflectance(albedo[1]) == pytest.approx(0.3, abs=1e-9)


LAMP = PointLight("Lamp", 10.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 2.0))
DOWN = {"normal": (0.0, 0.0, -1.0), "x_axis": (-1.0, 0.0, 0.0), "origin": (0.5, -0.5, 0.0)}
BEHIND = "All lights are behind 'Plane'"


def test_a_plane_lit_from_the_back_alone_says_so_before_it_is_baked():
    assert job([SUN, LAMP]).messages() == []
    for lights in ([SUN], [LAMP], [SUN, LAMP]):
        (warning,) = job(lights, **DOWN).messages()
        assert warning.text.startswith(BEHIND)
        assert "Flip" in warning.remedy
    in_front = replace(LAMP, position=(0.0, 0.0, -2.0))
    assert job([SUN, in_front], **DOWN).messages() == []
    (none_at_all,) = job([]).messages()
    assert "The scene has no light that can be baked" in none_at_all.text


@pytest.mark.parametrize(
    ("light", "words"),
    [
        (replace(SUN, strength=math.nan), "The power of 'Sun' is nan."),
        (replace(SUN, strength=math.inf), "The power of 'Sun' is inf."),
        (replace(LAMP, strength=-5.0), "The power of 'Lamp' is -5, and a bake cannot remove light."),
        (replace(LAMP, color=(1.0, -0.5, 0.0)), "The color of 'Lamp' is 1, -0.5, 0."),
        (replace(LAMP, color=(1.0, math.nan, 0.0)), "The color of 'Lamp' is 1, nan, 0."),
        (replace(SUN, direction=(math.nan,) * 3), "The position or direction of 'Sun' is not a number."),
        (replace(LAMP, position=(0.0, 0.0, math.inf)), "The position or direction of 'Lamp' is not a number."),
        (SUN, ""),
        (LAMP, ""),
    ],
)
def test_reasons_why_a_light_is_not_baked(light, words):
    assert light.fault() == words


def test_a_new_kind_of_light_and_a_new_layer_need_nothing_but_themselves(monkeypatch):
    """Even light from above, and a layer that shows the irradiance of all lights."""

    class Sky(Light):
        def at(self, target):
            return native.FieldLight(
                np.ones((1, 1, 1, 3), np.float32), np.ones(1, np.float32), np.float32([[0, 0, -1]])
            )

        def is_behind(self, target):
            return False

    def irradiance(targets, illumination, _material, _thickness, settings, *_progress_and_reports):
        return [arrive(target, illumination, settings)[0] for target in targets]

    monkeypatch.setitem(LAYERS, "Own", irradiance)
    sky = Sky("Sky", 3.0, (1.0, 0.5, 0.0), True)
    own, combined = (job([sky], settings=replace(SETTINGS, layer=layer)).run().texture for layer in ("Own", COMBINED))
    assert own[12, 12] == pytest.approx([3, 1.5, 0])
    assert combined[12, 12] == pytest.approx(reflectance(0) / math.pi * np.array([3, 1.5, 0]), rel=2e-3)


def test_charts_are_baked_apart_on_planes_of_their_own():
    """The left half lies under the sun; the right half is turned by 60 degrees and takes half as much."""
    turned = {"normal": (math.sin(math.pi / 3), 0.0, 0.5), "x_axis": (0.5, 0.0, -math.sin(math.pi / 3))}
    coverage = np.zeros((24, 60), np.float32)
    planes = [square(), replace(square(), **turned, coverage=square().coverage * np.float32(0.5))]
    charts = tuple(Chart(plane, (ChartIsland(plane.coverage, (36 * place, 0)),)) for place, plane in enumerate(planes))
    for chart in charts:
        chart.islands[0].part_of(coverage)[:] = chart.islands[0].coverage
    whole = BakeJob("Plane", Receiver(coverage, charts), Illumination([SUN]), Surface(MATERIAL), SETTINGS, BAKE_STEPS)
    texture = whole.run().texture
    for chart, plane in zip(charts, planes):
        alone = bake(plane, Illumination([SUN]), MATERIAL, 0.0, SETTINGS)
        assert np.array_equal(chart.islands[0].part_of(texture), alone)
    assert not texture[:, 24:36].any()
    assert texture[12, 48] == pytest.approx(0.25 * reflectance(60) * 2 / math.pi, rel=2e-3)


def test_albedo_from_color_is_public():
    medium = beamspread.Medium(g=0.0, ior=1.0)
    assert 0 < beamspread.albedo_from_color((0.2, 0.3, 0.4), medium, quality="preview")[0] < 1


@pytest.mark.parametrize("path", [0.01, 0.5], ids=["coarse", "fine"])
def test_every_value_of_the_samples_slider_works(path):
    """Rays to lights of a size follow from the samples, and a surface whose texels are coarse asks for the most."""
    area = AreaLight("Area", 10.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, 0.5), np.eye(3), 0.3, 0.3, False, np.pi)
    lamp = PointLight("Lamp", 10.0, (1.0, 1.0, 1.0), True, (0.1, 0.0, 0.5))
    material, grid = replace(MATERIAL, mean_free_path=(path,) * 3), square(3)
    counts = [rays_per_texel(grid, material, replace(SETTINGS, samples=samples)) for samples in range(1, 65)]
    assert counts == sorted(counts)
    results = []
    for samples in (1, 2, 4, 8, 9, 16, 33, 64):
        changed = replace(SETTINGS, samples=samples)
        results.append(bake(grid, Illumination([area, lamp]), material, 0.0, changed))
        arrive(grid, Illumination([area, lamp]), changed)
    np.testing.assert_allclose(results, [results[-1]] * len(results), rtol=0.1)


def test_more_samples_mean_less_noise_where_nothing_blocks():
    """A world of bright and dark stripes; paths of half a texel average little. 64 rays in place of 16 have half of the
    noise, if it falls as the square root of the rays; a fifth more is allowed, as 256 texels tell the noise to 5 %.
    """
    radiance = np.ones((8, 16, 3), np.float32)
    radiance[:, ::2] = 0
    world = WorldLight("World", 1.0, (1.0, 1.0, 1.0), True, radiance, ((1, 0, 0), (0, 1, 0), (0, 0, 1)))
    grid = square(24)
    material = replace(MATERIAL, mean_free_path=(0.5 * grid.pitch_x,) * 3)
    noise = []
    for samples in (4, 8):
        luminance = bake(grid, Illumination([world]), material, 0.0, replace(SETTINGS, samples=samples))[4:-4, 4:-4]
        noise.append(np.std(luminance / luminance.mean(axis=(0, 1))))
    assert noise[1] < 0.6 * noise[0]
