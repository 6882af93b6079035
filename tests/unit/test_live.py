"""Pictures that follow a scene: how far they are off, what is kept, and when they come."""

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.surface import Surface
from beamspread.core.live import media
from beamspread.core.live.pace import BUDGET_SECONDS, FIRST_SIDE, SIDES, Pace
from beamspread.core.live.painter import Painter
from beamspread.core.live.picture import FramedReceiver, Studio, for_live
from beamspread.core.live.subject import Subject
from beamspread.core.material import Material
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight
from beamspread.core.scene.receiver import Receiver, build_receiver
from beamspread.core.scene.texture import Texture
from beamspread.core.scene.uv_map import Polygons, fit_uv_maps
from beamspread.core.target import Target

CORNERS = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
FLOOR = Polygons(CORNERS, CORNERS[:, :2] / 2 + 0.5, np.array([0, 4]), np.array([(0.0, 0, 1)]))
WHITE, AXES = (1.0, 1.0, 1.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LAMP = PointLight("Lamp", 10.0, (1.0, 0.5, 0.2), True, (0.3, 0.2, 0.3))
SUN = SunLight("Sun", 3.0, WHITE, True, (0.6, 0.0, -0.8))
AREA = AreaLight("Area", 10.0, WHITE, True, (0.0, 0.0, 0.4), AXES, 0.4, 0.4, False, math.pi)


@pytest.fixture(autouse=True)
def libraries_at_hand():
    library(Medium(0.8, 1.4), "preview")


def subject(*lights, size=256, **material):
    values = {"albedo": (0.99, 0.9, 0.6), "mean_free_path": (0.02,) * 3, "anisotropy": 0.8, "ior": 1.4} | material
    rest = Illumination(lights), Surface(Material(**values)), for_live(BakeSettings(margin=4))
    return Subject(Target("Floor"), FLOOR, (size, size), size, *rest)


def off(picture, truth):
    """The sum of errors over the sum, and the worst texel over the brightest, in the worst channel."""
    error = np.abs(picture.texture - truth.texture)
    total = error.sum((0, 1)) / truth.texture.sum((0, 1))
    return total.max(), (error / truth.texture.max((0, 1))).max()


@pytest.mark.parametrize(
    ("lights", "total", "worst"),
    [
        ([LAMP], 0.002, 0.01),
        ([SUN], 0.002, 0.01),
        ([LAMP, SUN], 0.002, 0.01),
        ([AREA], 0.01, 0.1),  # of few rays
    ],
    ids=["lamp", "sun", "both", "area"],
)
def test_quick_pictures_are_nearly_bakes(lights, total, worst):
    studio, wanted = Studio(media.Media()), subject(*lights)
    errors = off(studio.quick(wanted, 256), studio.exact(wanted))
    assert errors[0] < total
    assert errors[1] < worst


def test_a_field_is_kept_for_other_light_and_forgets_the_light_before():
    studio = Studio(media.Media())
    studio.quick(subject(LAMP), 128)
    after = studio.quick(subject(LAMP, SUN), 128).texture  # other colors: another field
    made = studio.fields.made
    studio.quick(subject(SUN), 128)
    again = studio.quick(subject(LAMP, SUN), 128).texture
    assert studio.fields.made == made
    np.testing.assert_array_equal(again, after)


def test_few_texels_show_the_same_at_the_size_of_the_image():
    studio, wanted = Studio(media.Media()), subject(LAMP)
    picture = studio.quick(wanted, 64)
    assert picture.texture.shape == (256, 256, 3)
    assert off(picture, studio.exact(wanted))[0] < 0.02


def test_around_a_chart_its_border_goes_on():
    coverage = np.zeros((8, 8), np.float32)
    coverage[2:6, 2:6], coverage[2:6, 6] = 1, 0.5
    receiver = FramedReceiver(Receiver(coverage, ()), margin=1)
    texture = np.zeros((8, 8, 3), np.float32)
    texture[2:6, 2:6], texture[2:6, 6] = 3, 1.5
    shown = receiver.continued(texture)
    assert (shown[1:7, 1:8] == 3).all()
    expected = np.zeros((8, 8), bool)
    expected[1:7, 1:8] = True
    np.testing.assert_array_equal(receiver.region, expected)


def test_pace_keeps_to_the_budget_and_tries_again():
    pace, sides = Pace(), []
    assert pace.side() == FIRST_SIDE
    for _ in range(60):
        sides.append(pace.side())
        pace.note(sides[-1], 1.5 * BUDGET_SECONDS * (sides[-1] / SIDES[-1]) ** 2)
    assert sides[:3] == [256, 512, 256]
    assert sides[3:].count(512) < 10
    assert 512 in sides[3:]


def test_pace_of_what_is_always_too_slow():
    pace = Pace()
    for _ in range(10):
        pace.note(pace.side(), 10.0)
    assert pace.side() == SIDES[0]


def test_the_nearest_medium_serves():
    found = media.nearest(Medium(0.83, 1.42))
    assert found.name.startswith("g0.8_ior1.4_thicknessinf")


def wait_for(condition, seconds=20):
    began = time.monotonic()
    while not condition():
        assert time.monotonic() < began + seconds
        time.sleep(0.002)


def test_a_painter_follows_changes_and_is_exact_at_rest():
    painter, seen = Painter(rest_seconds=0.1), []

    def look():
        seen.extend(painter.take().values())
        return seen

    try:
        for x in (0.1, 0.2, 0.3):
            painter.show([subject(PointLight("Lamp", 10.0, WHITE, True, (x, 0.0, 0.3)))])
            before = len(seen)
            wait_for(lambda before=before: len(look()) > before)
        wait_for(lambda: look()[-1].is_exact)
        shown = len(seen)
        painter.show([subject(PointLight("Lamp", 10.0, WHITE, True, (0.3, 0.0, 0.3)))])  # the same
        wait_for(lambda: not painter.is_busy())
        assert len(look()) == shown
    finally:
        painter.end()
        assert painter.join(10)


def test_an_exact_picture_stops_when_something_changes():
    painter = Painter(rest_seconds=0.01)
    try:
        painter.show([subject(*(replace_name(LAMP, i) for i in range(60)), size=2048)])
        wait_for(painter.take)
        time.sleep(0.3)  # in the midst of it
        changed = time.monotonic()
        painter.show([subject(SUN, size=64)])
        wait_for(lambda: any(picture.texture.shape[0] == 64 for picture in painter.take().values()))
        assert time.monotonic() < changed + 5
    finally:
        painter.end()
        assert painter.join(20)


def test_a_new_medium_has_a_pace_of_its_own():
    painter, sides = Painter(rest_seconds=0.01), []
    quick = painter._studio.quick
    painter._studio.quick = lambda subject, side, progress: sides.append(side) or quick(subject, side, progress)

    def show(*lights, **rest):
        painter.show([subject(*lights, **rest)])
        wait_for(lambda: painter._done == painter._generation)

    try:
        show(LAMP)
        for side in SIDES:
            painter.paces[Target("Floor"), False].note(side, 10.0)
        show(LAMP, albedo=(0.9, 0.9, 0.6))
        show(SUN, albedo=(0.9, 0.9, 0.6))
        assert sides == [FIRST_SIDE, SIDES[0], FIRST_SIDE]
    finally:
        painter.end()
        assert painter.join(10)


def replace_name(light, number):
    place = (light.position[0] * math.cos(number), light.position[1] * math.sin(number), 0.3)
    return PointLight(f"{light.name} {number}", light.strength, light.color, True, place)


def test_what_was_adopted_is_not_painted_until_it_changes():
    painter = Painter(rest_seconds=0.01)
    try:
        painter.show([subject(LAMP)])
        painter.adopt([subject(LAMP)])
        painter.show([subject(LAMP)])
        wait_for(lambda: not painter._done < painter._generation)
        assert not painter.take()
        painter.show([subject(SUN)])
        wait_for(painter.take)
    finally:
        painter.end()
        assert painter.join(10)


def test_what_goes_wrong_is_said():
    painter = Painter(rest_seconds=0.01)
    try:
        painter.show([subject(LAMP, albedo=(1.0, 0.5, 0.5))])
        wait_for(lambda: any("albedo" in picture.error for picture in painter.take().values()))
    finally:
        painter.end()
        assert painter.join(10)


def test_a_medium_is_simulated_in_the_background(monkeypatch, tmp_path):
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path))
    monkeypatch.setattr(media, "PATIENCE_SECONDS", 0.01)
    news, medium = threading.Event(), Medium(0.31, 1.31)
    found = media.Media(news.set)
    try:
        stand_in, is_own = found.serve(medium)
        assert not is_own
        assert stand_in.medium != medium
        found.want([medium])
        assert news.wait(60)
        own, is_own = found.serve(medium)
        assert is_own
        assert own.medium == medium
    finally:
        found.end()
        assert found.join(10)


@pytest.mark.parametrize(
    ("ior", "total", "worst"), [(1.0, 0.02, 0.05), (1.2, 0.02, 0.06)], ids=["not refracted", "little refracted"]
)
def test_media_of_many_terms_are_quick_too(ior, total, worst):
    """By fewer terms, and less exact."""
    library(Medium(0.8, ior), "preview")
    studio, wanted = Studio(media.Media()), subject(LAMP, ior=ior)
    errors = off(studio.quick(wanted, 256), studio.exact(wanted))
    began = time.process_time()
    studio.quick(wanted, 256)
    assert time.process_time() < began + 0.5
    assert errors[0] < total
    assert errors[1] < worst


@pytest.mark.parametrize("blur", [0.0, 0.5])
def test_a_texture_is_in_quick_pictures_with_all_its_detail(blur):
    """Squares of two colours, of 8 texels of 256; the quick picture has 64."""
    plain = subject(LAMP)
    receiver = build_receiver(fit_uv_maps(FLOOR), 256, 256)
    bright = np.add.outer(np.arange(256) // 8, np.arange(256) // 8) % 2
    colors = np.repeat(np.where(bright, 0.7, 0.3)[..., None], 3, axis=2).astype(np.float32)
    texture = Texture(receiver, (colors,), blur)
    textured = replace(plain, texture=texture, surface=replace(plain.surface, base_color=(0.5, 0.5, 0.5)))
    assert textured.key != plain.key
    assert textured.key != replace(textured, texture=replace(texture, blur=1.0)).key
    studio = Studio(media.Media())
    quick, exact = studio.quick(textured, 64), studio.exact(textured)
    job = BakeJob("Floor", texture.on(receiver), textured.illumination, textured.surface, textured.settings)
    np.testing.assert_allclose(exact.texture, job.run()["Combined"], rtol=1e-4, atol=1e-6)
    total, worst = off(quick, exact)
    assert total < (0.01 if blur == 0 else 0.05)
    assert worst < (0.02 if blur == 0 else 0.1)
