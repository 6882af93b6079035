"""Renderings that follow a scene: their errors, their caches, and when they appear."""

import math
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import BAKE_STEPS
from beamspread.core.bake.surface import Surface
from beamspread.core.live import library_service
from beamspread.core.live.framed_receiver import FramedReceiver
from beamspread.core.live.library_service import LibraryService
from beamspread.core.live.live_target import LiveTarget
from beamspread.core.live.render_thread import Work
from beamspread.core.live.renderer import SIDES, for_live, quick_side
from beamspread.core.material import Material
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import AreaLight, PointLight, SunLight
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import Receiver, build_receiver
from beamspread.core.scene.texture import MULTIPLIED, BaseColor, Texture, TextureUse
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


def live_target(*lights, size=256, **material):
    values = {"albedo": (0.99, 0.9, 0.6), "mean_free_path": (0.02,) * 3, "anisotropy": 0.8, "ior": 1.4} | material
    rest = Illumination(lights), Surface(Material(**values)), for_live(BakeSettings(margin=4))
    return LiveTarget(Target("Floor"), FLOOR, (size, size), size, *rest)


def errors_of(rendering, truth):
    """The sum of errors over the sum, and the worst texel over the brightest, in the worst channel."""
    error = np.abs(rendering.texture - truth.texture)
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
def test_quick_renderings_are_nearly_bakes(lights, total, worst, renderer):
    target = live_target(*lights)
    errors = errors_of(renderer.quick(target, 256), renderer.exact(target))
    assert errors[0] < total
    assert errors[1] < worst


def test_a_cached_field_serves_other_light_and_forgets_the_light_before(renderer):
    renderer.quick(live_target(LAMP), 128)
    first = renderer.quick(live_target(LAMP, SUN), 128).texture  # other colors: another field
    made = renderer.kernels.made
    renderer.quick(live_target(SUN), 128)
    again = renderer.quick(live_target(LAMP, SUN), 128).texture
    assert renderer.kernels.made == made
    np.testing.assert_array_equal(again, first)


def test_a_rendering_of_few_texels_has_the_size_of_the_image(renderer):
    target = live_target(LAMP)
    rendering = renderer.quick(target, 64)
    assert rendering.texture.shape == (256, 256, 3)
    assert errors_of(rendering, renderer.exact(target))[0] < 0.02


def test_values_of_a_chart_continue_around_it():
    coverage = np.zeros((8, 8), np.float32)
    coverage[2:6, 2:6], coverage[2:6, 6] = 1, 0.5
    framed = FramedReceiver(Receiver(coverage, ()), margin=1)
    texture = np.zeros((8, 8, 3), np.float32)
    texture[2:6, 2:6], texture[2:6, 6] = 3, 1.5
    continued = framed.continued(texture)
    assert (continued[1:7, 1:8] == 3).all()
    expected = np.zeros((8, 8), bool)
    expected[1:7, 1:8] = True
    np.testing.assert_array_equal(framed.region, expected)


def test_more_light_has_fewer_texels_and_any_light_has_some():
    assert quick_side([]) >= quick_side([LAMP]) > quick_side([AREA]) >= quick_side([AREA] * 100) == SIDES[0]


def test_a_medium_that_has_just_changed_has_few_texels(renderer):
    sides = []
    for target in (live_target(LAMP), live_target(SUN), live_target(SUN, albedo=(0.9, 0.9, 0.9))):
        sides.append(renderer.quick_side(target))
        renderer.quick(target, 48)
    assert sides == [128, 256, 128]


def wait_for(condition, seconds=20):
    """Wait for it, at most as many seconds of CPU time: other processes take none of that."""
    began = time.process_time()
    while not condition():
        assert time.process_time() < began + seconds
        time.sleep(0.002)


def test_renderings_follow_changes_and_are_exact_at_rest(thread):
    seen = []

    def update():
        seen.extend(thread.take().values())
        return seen

    for x in (0.1, 0.2, 0.3):
        thread.show([live_target(PointLight("Lamp", 10.0, WHITE, True, (x, 0.0, 0.3)))])
        before = len(seen)
        wait_for(lambda before=before: len(update()) > before)
    wait_for(lambda: update()[-1].is_exact)
    count = len(seen)
    thread.show([live_target(PointLight("Lamp", 10.0, WHITE, True, (0.3, 0.0, 0.3)))])  # the same
    wait_for(lambda: not thread.is_busy())
    assert len(update()) == count


def test_quick_renderings_can_be_awaited(thread):
    assert thread.await_quick(0)
    thread.show([live_target(LAMP)])
    assert thread.await_quick(60)
    (rendering,) = thread.take().values()
    assert not rendering.is_exact
    with thread._condition:  # nothing is rendered meanwhile
        thread.show([live_target(SUN)])
        assert not thread._condition.wait_for(lambda: thread._quickly_done == thread._generation, 0)


def test_an_exact_rendering_stops_at_the_next_change(thread):
    thread.show([live_target(*(moved(LAMP, number) for number in range(60)), size=2048)])
    wait_for(thread.take)
    time.sleep(0.3)  # the exact rendering takes longer
    thread.show([live_target(SUN, size=64)])
    wait_for(lambda: any(rendering.texture.shape[0] == 64 for rendering in thread.take().values()), seconds=5)


def moved(light, number):
    position = (light.position[0] * math.cos(number), light.position[1] * math.sin(number), 0.3)
    return PointLight(f"{light.name} {number}", light.strength, light.color, True, position)


def has_ended(thread):
    """True if the thread has rendered everything, whether or not the renderings were taken."""
    return lambda: thread._done == thread._generation


def test_an_adopted_target_is_rendered_only_after_its_next_change(thread):
    thread.show([live_target(LAMP)])
    thread.adopt([live_target(LAMP)])
    thread.show([live_target(LAMP)])
    wait_for(has_ended(thread))
    assert not thread.take()
    thread.show([live_target(SUN)])
    wait_for(thread.take)


def test_a_forgotten_target_is_rendered_again(thread):
    target = live_target(LAMP)
    thread.show([target])
    wait_for(has_ended(thread))
    assert thread.take()
    thread.show([])
    thread.forget([target.target])
    thread.show([target])
    wait_for(thread.take)


def test_an_error_is_handed_over(thread):
    thread.show([live_target(LAMP, albedo=(1.0, 0.5, 0.5))])
    wait_for(lambda: any("albedo" in str(rendering.error) for rendering in thread.take().values()))


def test_an_error_of_an_exact_rendering_is_handed_over(thread, tmp_path):
    """The folder of the LDF samples disappears while the target rests."""
    target = live_target(LAMP)
    target = replace(
        target, settings=replace(target.settings, distributions="angular", sample_folder=str(tmp_path / "gone"))
    )
    work = thread._work[target.target] = Work()
    thread._render_exactly(target, work, lambda _: True)
    (rendering,) = thread.take().values()
    assert "There is no folder" in str(rendering.error)


@pytest.fixture
def empty_cache(monkeypatch, tmp_path):
    """The folder of the cache, without libraries; simulations start soon."""
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path))
    monkeypatch.setattr(library_service, "PATIENCE_SECONDS", 0.01)
    return tmp_path


@pytest.mark.usefixtures("empty_cache")
def test_a_medium_is_simulated_in_the_background():
    ready, medium = threading.Event(), Medium(0.31, 1.31)
    service = LibraryService(ready.set)
    try:
        assert service.serve(medium) is None
        service.request([medium])
        assert ready.wait(60)
        assert service.serve(medium).medium == medium
    finally:
        service.end()
        assert service.join(10)


def test_a_target_keeps_its_libraries_until_those_of_a_new_medium_are_simulated(thread, empty_cache):
    thread.show([live_target(LAMP)])
    wait_for(has_ended(thread))
    thread.take()
    thread.show([live_target(LAMP, anisotropy=0.33, ior=1.33, mean_free_path=(0.05,) * 3)])
    wait_for(thread.take)
    assert not list(empty_cache.iterdir())
    wait_for(lambda: any(rendering.is_exact for rendering in thread.take().values()), 60)
    assert list(empty_cache.iterdir())


def test_a_target_whose_first_medium_has_no_library_waits_for_it(thread, empty_cache):
    target = live_target(LAMP, anisotropy=0.35, ior=1.35)
    thread.show([target])
    wait_for(lambda: thread.libraries.simulating)
    assert not thread.take()
    wait_for(thread.take, 60)
    assert list(empty_cache.iterdir())


@pytest.mark.parametrize(
    ("ior", "total", "worst"), [(1.0, 0.02, 0.05), (1.2, 0.02, 0.06)], ids=["not refracted", "little refracted"]
)
def test_media_of_many_terms_are_quick_too(ior, total, worst, renderer):
    """They have fewer terms, and larger errors."""
    library(Medium(0.8, ior), "preview")
    target = live_target(LAMP, ior=ior)
    errors = errors_of(renderer.quick(target, 256), renderer.exact(target))
    began = time.process_time()
    renderer.quick(target, 256)
    assert time.process_time() < began + 0.5
    assert errors[0] < total
    assert errors[1] < worst


@pytest.mark.parametrize("blur", [0.0, 0.5])
def test_quick_renderings_have_all_detail_of_a_texture(blur, renderer):
    """The texture has squares of 8 texels of 256; the quick rendering has 64 texels."""
    plain = live_target(LAMP)
    receiver = build_receiver(flatten(FLOOR), 256, 256)
    bright = np.add.outer(np.arange(256) // 8, np.arange(256) // 8) % 2
    colors = np.repeat(np.where(bright, 0.7, 0.3)[..., None], 3, axis=2).astype(np.float32)
    texture = Texture(receiver, (colors,), TextureUse(MULTIPLIED, blur))
    textured = replace(plain, texture=texture, surface=replace(plain.surface, base_color=(0.5, 0.5, 0.5)))
    assert textured.key != plain.key
    assert textured.key != replace(textured, texture=replace(texture, use=TextureUse(MULTIPLIED, 1.0))).key
    quick, exact = renderer.quick(textured, 64), renderer.exact(textured)
    job = BakeJob("Floor", texture.on(receiver), textured.illumination, textured.surface, textured.settings, BAKE_STEPS)
    np.testing.assert_allclose(exact.texture, job.run().texture, rtol=1e-4, atol=1e-6)
    total, worst = errors_of(quick, exact)
    assert total < (0.01 if blur == 0 else 0.05)
    assert worst < (0.02 if blur == 0 else 0.1)


def assert_exact_is_the_bake(exact, scattered, receiver):
    surface, texture = scattered.surface, scattered.texture
    job = BakeJob("Floor", texture.on(receiver), scattered.illumination, surface, scattered.settings, BAKE_STEPS)
    np.testing.assert_allclose(exact.texture, job.run().texture, rtol=1e-4, atol=1e-6)


def three_renderings(renderer, scattered):
    """A quick and an exact rendering, and an exact one by the convention."""
    multiplied = replace(scattered, texture=scattered.surface.multiplied(scattered.texture))
    return renderer.quick(scattered, 48), renderer.exact(scattered), renderer.exact(multiplied)


def checkered(**material):
    """A floor of 96 x 96 texels in whose checker light scatters, its receiver, and the floor without a texture."""
    plain = replace(live_target(LAMP, **material), size=(96, 96))
    receiver = build_receiver(flatten(FLOOR), 96, 96)
    bright = np.add.outer(np.arange(96) // 8, np.arange(96) // 8) % 2
    colors = np.repeat(np.where(bright, 0.95, 0.4)[..., None], 3, axis=2).astype(np.float32)
    texture = Texture(receiver, (colors,), TextureUse())
    return replace(plain, texture=texture, surface=plain.surface.colored(BaseColor(texture))), receiver, plain


def test_an_exact_rendering_of_a_texture_in_which_light_scatters_is_the_bake(renderer):
    scattered, receiver, _ = checkered(anisotropy=0.0, ior=1.0)  # of few scatterings: a tenth of the time
    assert_exact_is_the_bake(renderer.exact(scattered), scattered, receiver)


def test_quick_renderings_show_how_light_scatters_in_a_texture(renderer):
    """With a noise of 10 % at 48 texels: their mean is right within 2 %, and half of the convention's error is gone."""
    scattered, _, plain = checkered()
    quick, exact, other = three_renderings(renderer, scattered)
    for target in (plain, scattered):
        renderer.quick(target, 48)
        assert (renderer.quick_side(target) <= 128) == (target is scattered)  # paths take longer
    mean = exact.texture.mean()
    assert quick.texture.mean() == pytest.approx(mean, rel=0.02)
    assert np.abs(quick.texture - exact.texture).mean() < 0.5 * np.abs(other.texture - exact.texture).mean()


def arch(faces=16, radius=0.4):
    """Faces of half a cylinder without ends, whose axis is y."""
    turn = np.linspace(-np.pi / 2, np.pi / 2, faces + 1)
    at = np.stack([radius * np.sin(turn), 0 * turn, radius * np.cos(turn)], -1)
    corners, uvs = [], []
    for i in range(faces):
        corners += [at[i] - (0, 0.5, 0), at[i + 1] - (0, 0.5, 0), at[i + 1] + (0, 0.5, 0), at[i] + (0, 0.5, 0)]
        uvs += [(i / faces, 0), ((i + 1) / faces, 0), ((i + 1) / faces, 1), (i / faces, 1)]
    middles = (turn[1:] + turn[:-1]) / 2
    normals = np.stack([np.sin(middles), 0 * middles, np.cos(middles)], -1)
    return Polygons(np.array(corners), np.array(uvs, float), np.arange(0, 4 * faces + 1, 4), normals)


def test_textures_of_meshes_that_bend_scatter_light_in_live_as_in_bakes(renderer):
    """Exact renderings have the texels of a bake, quick ones half of the convention's error at most."""
    plain = live_target(SUN, size=48)
    plain = replace(plain, polygons=arch(), spread=0.2)
    receiver = build_receiver(flatten(plain.polygons, spread=plain.spread), 48, 48)
    assert receiver.is_bent
    shape = receiver.charts[0].grid.areas.shape
    colors = np.where(np.arange(shape[1]) // 6 % 2, 0.9, 0.4)[None, :, None] * np.ones((*shape, 3))
    texture = Texture(receiver, (colors.astype(np.float32),), TextureUse())
    surface = plain.surface.colored(BaseColor(texture))
    scattered = replace(plain, texture=texture, surface=surface)
    quick, exact, other = three_renderings(renderer, scattered)
    assert_exact_is_the_bake(exact, scattered, receiver)
    assert not any("multiplies" in str(message) for message in exact.messages)
    assert np.abs(quick.texture - exact.texture).mean() < 0.5 * np.abs(other.texture - exact.texture).mean()


@pytest.mark.parametrize("lights", [[LAMP], [AREA]], ids=["lamp", "area"])
def test_quick_renderings_of_many_planes_are_nearly_bakes(lights, renderer):
    """Planes of twelve sizes are solved together. Most of the error: bakes alone finish texels that edges cut."""
    edges = np.concatenate([[0], np.cumsum(np.arange(8, 20))]) / 162
    corners, starts = [], [0]
    for low, high in zip(edges, edges[1:]):
        corners += [(2 * low - 0.99, -1, 0), (2 * high - 1, -1, 0), (2 * high - 1, 1, 0), (2 * low - 0.99, 1, 0)]
        starts.append(len(corners))
    corners = np.array(corners, float)
    planes = Polygons(corners, corners[:, :2] / 2 + 0.5, np.array(starts), np.tile((0.0, 0, 1), (len(starts) - 1, 1)))
    target = replace(live_target(*lights), polygons=planes)
    assert errors_of(renderer.quick(target, 256), renderer.exact(target))[0] < 0.03
    assert renderer.kernels.made == 0
