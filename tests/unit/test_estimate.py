"""Estimates of the seconds that bakes take: what they grow with, and their correction by measured times."""

import math
from dataclasses import replace

import pytest
from beamspread import Medium
from beamspread.core.bake import steps
from beamspread.core.bake.estimate import (
    Workload,
    channels_of,
    parallel_seconds,
    share_of_rays,
    simulation_seconds,
    traced_rays,
)
from beamspread.core.bake.forecast import Finders, Forecast, seconds_of, steps_of_bakes
from beamspread.core.bake.pace import Estimate, Pace, pace
from beamspread.core.bake.spread_light import MIN_RAYS
from beamspread.core.bake.surface import Surface
from beamspread.core.ldf.library import angles_for
from beamspread.core.scene.bending import Bending
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight

from bakes import MATERIAL, SETTINGS, bake_job, square

WHITE, FRAME = (1.0, 1.0, 1.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SUN = SunLight("Sun", 2.0, WHITE, True, (0.0, 0.0, -1.0))
POINT = PointLight("Point", 2.0, WHITE, True, (0.0, 0.0, 1.0))
AREA = AreaLight("Area", 2.0, WHITE, True, (0.0, 0.0, 1.0), FRAME, 0.5, 0.5, False, 3.0)
FINAL = replace(SETTINGS, quality="final")


@pytest.fixture(autouse=True)
def no_pace():
    """No times of other tests count."""
    pace.forget()
    yield
    pace.forget()


def workload(lights, size=256, triangles=0, settings=SETTINGS, surface=None, bounced=False):
    rest = triangles, surface or Surface(MATERIAL), settings, bounced
    return Workload.of([square(size)], lights, *rest)


def seconds(lights, settings=SETTINGS, **options):
    return workload(lights, settings=settings, **options).seconds(settings)


def test_more_texels_take_longer():
    for lights in ([SUN], [POINT], [AREA]):
        assert seconds(lights, size=64) < seconds(lights, size=256) < seconds(lights, size=1024)
        # Four times the texels take at most about four times as long.
        assert seconds(lights, size=1024) < 4.1 * seconds(lights, size=512)


def test_more_lights_of_more_directions_take_longer():
    assert seconds([SUN]) < seconds([SUN, POINT]) < seconds([SUN, POINT, AREA])
    assert seconds([POINT]) < seconds([POINT] * 3)
    assert seconds([SUN]) < seconds([SUN], bounced=True)


def test_shadows_and_samples_take_longer():
    assert seconds([AREA]) < seconds([AREA], triangles=500) < seconds([AREA], triangles=10**6)
    assert seconds([AREA], triangles=500) < seconds([AREA], replace(SETTINGS, samples=8), triangles=500)


def test_lights_of_a_size_share_rays_by_their_brightness():
    bright = replace(AREA, strength=200.0)
    # Each has `MIN_RAYS` at least, and the other one all the rays of a light that is alone.
    alone, both = workload([AREA], size=16).broad_rays, workload([AREA, bright], size=16).broad_rays
    assert alone > 10 * MIN_RAYS
    assert both == pytest.approx(alone + MIN_RAYS, rel=0.01)


def test_lights_behind_the_receiver_take_no_time():
    assert workload([replace(POINT, position=(0.0, 0.0, -1.0))]).lamps == 0


def test_a_texel_traces_few_rays_where_all_or_nothing_is_blocked():
    """About as native/scene/first_pass.cpp gives them: few first ones, and up to all beside obstacles."""
    assert share_of_rays(None) == share_of_rays(0.0) == share_of_rays(1.0) == 0
    assert share_of_rays(0.5) == share_of_rays(0.9) == 1
    few, some = share_of_rays(0.02), share_of_rays(0.2)
    assert 1 / 8 < few < some < 1
    assert traced_rays(512, 0.0) == MIN_RAYS
    assert traced_rays(512, 1.0) == 512 + MIN_RAYS
    assert traced_rays(MIN_RAYS, 1.0) == MIN_RAYS


def test_rays_beside_obstacles_take_the_time():
    """Light that is blocked nowhere, or everywhere, is found by few rays."""
    fine = Surface(replace(MATERIAL, mean_free_path=(1e-6,) * 3))  # which blurs no noise
    open_load, blocked = (
        Workload.of([square(256)], [AREA], 500, fine, SETTINGS, shares={"Area": share}) for share in (0.0, 1.0)
    )
    assert blocked.broad_traced > 10 * open_load.broad_traced
    assert open_load.seconds(SETTINGS) < 0.5 * blocked.seconds(SETTINGS)
    unknown = workload([AREA], triangles=500, surface=fine)
    assert open_load.seconds(SETTINGS) < unknown.seconds(SETTINGS) < blocked.seconds(SETTINGS)


def test_a_surface_that_bends_has_no_lights_behind():
    """A plane stands for it until its mesh is read."""

    def seconds_under(height, is_bent):
        lamp = replace(AREA, position=(0.0, 0.0, height))
        return seconds_of(
            Forecast("Plane", [square(256)], [lamp], 0, Surface(MATERIAL), is_bent=is_bent).steps(SETTINGS)
        )

    assert seconds_under(-1.0, is_bent=True) == pytest.approx(seconds_under(1.0, is_bent=True))
    assert seconds_under(-1.0, is_bent=False) < 0.9 * seconds_under(1.0, is_bent=False)


def test_slow_solvers_take_longer():
    fft, adaptive, direct = (seconds([POINT], replace(SETTINGS, solver=name)) for name in ("fft", "adaptive", "direct"))
    assert fft < adaptive < direct


def test_each_medium_to_simulate_takes_its_time():
    first, second = Medium(0.3, 1.31), Medium(0.4, 1.31)
    assert simulation_seconds([], FINAL) == 0
    assert simulation_seconds([first], FINAL) < simulation_seconds([first, second], FINAL)
    assert simulation_seconds([first], SETTINGS) < 0.1 * simulation_seconds([first], FINAL)
    assert (
        0 < simulation_seconds([first], SETTINGS, is_bent=True) < 0.1 * simulation_seconds([first], FINAL, is_bent=True)
    )


def test_more_threads_are_faster():
    assert seconds([POINT], replace(SETTINGS, threads=8)) < seconds([POINT], replace(SETTINGS, threads=2))


def test_a_corrected_estimate_approaches_measured_times():
    pace = Pace()
    assert pace.corrected("Baking", "Plane", 2.0) == 2.0
    pace.note("Baking", "Plane", 2.0, 6.0)
    assert pace.corrected("Baking", "Plane", 2.0) == pytest.approx(6.0)
    assert pace.corrected("Simulating", "Plane", 2.0) == 2.0
    # Others come closer with each measurement.
    others = []
    for name in "abcd":
        others.append(pace.corrected("Baking", "Other", 1.0))
        pace.note("Baking", name, 1.0, 3.0)
    assert others == sorted(others)
    assert 1.7 < others[0] < others[-1] < 3.0
    pace.note("Baking", "Plane", 1e-3, 0.05)  # too short to tell
    assert pace.corrected("Baking", "Plane", 2.0) == pytest.approx(6.0)


def test_ratios_outlive_their_session():
    pace, later = Pace(), Pace()
    pace.note("Baking", "Plane", 2.0, 6.0)
    assert pace.ratios_of("Plane") == {"Baking": 3.0}
    assert pace.ratios_of("Other") == {}
    later.recall("Plane", {"Baking": 3.0})
    assert later.corrected("Baking", "Plane", 2.0) == pytest.approx(6.0)
    later.note("Baking", "Plane", 1.0, 2.0)
    later.recall("Plane", {"Baking": 3.0})  # what this session has measured counts
    assert later.corrected("Baking", "Plane", 1.0) == pytest.approx(2.0)


def test_another_scene_keeps_the_mean():
    pace = Pace()
    for name, ratio in (("First", 2.0), ("Second", 8.0)):
        pace.note("Baking", name, 1.0, ratio)
    pace.forget_subjects()
    assert pace.ratios_of("First") == {}
    assert pace.corrected("Baking", "First", 1.0) == pytest.approx(4.0**0.5)
    pace.note("Bounced", "First", 1.0, 60.0)  # a room, which the next scene need not be
    pace.forget_subjects()
    assert pace.corrected("Bounced", "First", 1.0) == pytest.approx(Pace.MACHINE**0.5)


def test_a_bake_teaches_the_next_one(monkeypatch):
    monkeypatch.setattr(Pace, "MIN_SECONDS", 0.0)
    job = bake_job([SUN], grid=square(512))
    announced = job.seconds()
    pace.note(steps.Solve.kind_for(SETTINGS), "Plane", 1.0, 5.0)
    assert job.seconds() == pytest.approx(5 * announced)
    job.run()
    assert pace.corrected(steps.Solve.kind_for(SETTINGS), "Plane", 1.0) != 5.0


def forecast(**options):
    return Forecast("Plane", [square(256)], [SUN], 0, Surface(MATERIAL), **options)


def test_a_forecast_is_that_of_the_job():
    job = bake_job([SUN], grid=square(256))
    assert seconds_of(forecast().steps(SETTINGS)) == pytest.approx(job.seconds())


def test_a_forecast_counts_who_finds_light():
    settings = replace(SETTINGS, indirect=True)
    ways = [Finders(), Finders(bounced=True), Finders(bounced=True, is_own=False), Finders(world=True, lamps=2)]
    kinds = [[step.kind for step in forecast(finders=way).steps(settings)][:-1] for way in ways]
    assert kinds == [[], ["Finding bounced light"], *[["Finding light with Cycles"]] * 2]
    assert len(forecast(finders=Finders(bounced=True)).steps(replace(settings, indirect=False))) == 1
    assert len(forecast(finders=Finders(colors=True)).steps(settings)) == 2


def test_a_medium_is_simulated_once(monkeypatch):
    monkeypatch.setattr(steps, "is_known", lambda *_: False)
    known = seconds_of(forecast().steps(FINAL))
    bakes = [(forecast(), FINAL), (forecast(), FINAL), (None, FINAL)]
    first, second, nothing = map(seconds_of, steps_of_bakes(bakes))
    assert first > 10 * second
    assert second == pytest.approx(known)
    assert nothing == 0


def test_estimates_have_a_subject():
    Estimate("Baking", "Plane", 1.0).compare(3.0)
    assert Estimate("Baking", "Plane", 2.0).corrected() == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("texels", "pieces", "channels", "bending", "path", "cpu"),
    [
        (169_900, 1.49, 3, Bending(), 0.47, 2.3),  # a UV sphere at 512 x 512
        (169_900, 1.49, 3, Bending(), 2.3, 2.3),
        (169_900, 1.49, 3, Bending(), 9.3, 2.6),
        (169_900, 1.49, 1, Bending(), 2.3, 1.4),
        (676_700, 1.44, 3, Bending(), 4.0, 5.0),
        (76_400, 1.02, 3, Bending(), 4.0, 1.5),  # an icosphere
        (64_000, 1.08, 3, Bending(2.1, 0.0), 4.0, 1.9),  # a torus
        (260_600, 1.02, 3, Bending(1.1, 0.0), 4.0, 2.8),  # hills
        (260_600, 1.02, 3, Bending(1.1, 0.0), 16.0, 3.8),
        (182_400, 1.67, 3, Bending(4.1, 0.0), 0.3, 2.0),  # a monkey
        (182_400, 1.67, 3, Bending(4.1, 0.0), 1.0, 3.2),
        (182_400, 1.67, 3, Bending(4.1, 0.0), 4.0, 7.5),
        (46_200, 1.69, 3, Bending(4.1, 19.3), 3.5, 3.7),  # the same of flat faces
        (19_500, 1.05, 3, Bending(1.0, 5.0), 10.0, 2.5),  # an icosphere of 80 flat faces
        (16_100, 1.17, 3, Bending(2.1, 10.7), 3.5, 2.4),  # a torus of 240 flat faces
    ],
)
def test_bodies_take_as_long_as_measured(texels, pieces, channels, bending, path, cpu):
    """CPU seconds of whole bakes in Blender 4.5 below a lamp, in a new session: marble's albedos, and paths scaled to
    texels.
    """
    facts = {"pieces": pieces, "channels": channels, "bending": bending, "path": path, "ior": 1.5}
    load = Workload(texels, is_bent=True, lamps=1, lit=0.5, **facts)
    assert cpu / 1.5 < load.seconds(replace(SETTINGS, threads=1)) < cpu * 1.5


SKY_AND_LAMP = {"broad_rays": 32, "broad_traced": 15, "narrow_rays": 64, "narrow_traced": 11}


@pytest.mark.parametrize(
    ("texels", "pieces", "turning", "path", "ior", "light", "cpu"),
    [
        (260_600, 1.02, 1.1, 1.0, 1.0, {"lamps": 1}, 4.4),  # hills
        (260_600, 1.02, 1.1, 4.0, 1.0, {"lamps": 1}, 5.2),
        (260_600, 1.02, 1.1, 16.0, 1.0, {"lamps": 1}, 8.2),
        (181_300, 1.55, 3.3, 1.0, 1.0, {"lamps": 1}, 7.0),  # a smooth monkey
        (181_300, 1.55, 3.3, 4.0, 1.0, {"lamps": 1}, 22.4),
        (181_300, 1.55, 3.3, 4.0, 1.0, {"broad_rays": 8, "broad_traced": 8}, 29.3),
        (181_300, 1.55, 3.3, 4.0, 1.5, {"broad_rays": 8, "broad_traced": 8}, 13.5),
        (169_900, 1.49, 1.0, 4.0, 1.5, {"broad_rays": 8, "broad_traced": 8}, 3.3),  # a UV sphere
        (160_400, 1.23, 3.3, 1.1, 1.5, {**SKY_AND_LAMP, "bounced": True}, 10.0),  # another smooth monkey
    ],
)
def test_bodies_under_skies_and_of_index_1_take_as_long_as_measured(texels, pieces, turning, path, ior, light, cpu):
    """CPU seconds as above, of light of one direction or of an even sky, or of both, of a size, and bounces."""
    facts = {"lit": 0.5 if "lamps" in light else 1.0, "bending": Bending(turning, 0.0), "path": path, "ior": ior}
    load = Workload(texels, is_bent=True, pieces=pieces, triangles=15_000, **facts, **light)
    assert cpu / 1.6 < load.seconds(replace(SETTINGS, threads=1)) < cpu * 1.6


def test_slabs_that_bend_take_longer_the_farther_their_light_spreads():
    """All of their texels are solved."""
    shade = Workload(170_000, is_bent=True, path=2.3, ior=1.5, thickness=2.0)
    assert shade.seconds(SETTINGS) > 2 * replace(shade, path=0.23).seconds(SETTINGS)
    assert shade.seconds(SETTINGS) > 2 * replace(shade, thickness=math.inf).seconds(SETTINGS)


def test_channels_of_one_medium_share_their_light_under_one_color():
    red = replace(SUN, color=(1.0, 0.5, 0.5))
    gray = Surface(replace(MATERIAL, mean_free_path=(1e-3,) * 3, albedo=(0.9,) * 3))
    assert channels_of(gray, [SUN, POINT]) == channels_of(gray, [red]) == 1
    assert channels_of(gray, [SUN, red]) == 3
    assert channels_of(Surface(replace(gray.material, albedo=(0.9, 0.9, 0.5))), [SUN]) == 2


def test_simulations_of_slabs_take_as_long_as_measured():
    """CPU seconds for each angle at g .8 and ior 1.4, by `simulate` with the photons of final quality."""
    one_thread = replace(FINAL, threads=1)
    for thickness, seconds in ((1.0, 0.86), (5.0, 0.86), (20.0, 1.87), (math.inf, 5.95)):
        medium = Medium(0.8, 1.4, thickness)
        estimate = simulation_seconds([medium], one_thread) / len(angles_for(medium))
        assert seconds / 1.7 < estimate < seconds * 1.7


def test_light_in_a_texture_takes_its_time_only_where_it_scatters():
    plain, scattering = (seconds_of(forecast(scatters=is_so).steps(SETTINGS)) for is_so in (False, True))
    # 6 to 17 microseconds of a thread for each texel, amid CPU seconds of bakes of veins (1.5) and checkers (20).
    texels = 256**2
    assert 6e-6 * texels < (scattering - plain) * parallel_speed() < 17e-6 * texels
    own = replace(SETTINGS, distributions="angular")
    assert seconds_of(forecast(scatters=True).steps(own)) == seconds_of(forecast().steps(own))


def parallel_speed():
    """Speed of all threads that the settings ask for, relative to one."""
    return 1 / parallel_seconds(1.0, SETTINGS.threads)
