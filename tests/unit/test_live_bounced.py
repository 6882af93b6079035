"""Light that bounces in Live: coarse soon after a change, and as in a bake at rest."""

import gc
import time
from dataclasses import replace

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.bake.bounced import BouncedLight
from beamspread.core.bake.job import BakeJob
from beamspread.core.bake.steps import Solve
from beamspread.core.bake.surface import Surface
from beamspread.core.live.live_target import LiveTarget
from beamspread.core.live.renderer import for_live
from beamspread.core.material import Material
from beamspread.core.native import native
from beamspread.core.recent import keep_with
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import PointLight, WorldLight
from beamspread.core.scene.occluders import Mesh, Occluder
from beamspread.core.scene.polygons import Polygons
from beamspread.core.scene.receiver import build_receiver
from beamspread.core.target import Target

SIDE = 128
CORNERS = np.array([(-1.0, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
FLOOR = Polygons(CORNERS, CORNERS[:, :2] / 2 + 0.5, np.array([0, 4]), np.array([(0.0, 0, 1)]))
WALL = np.array([(-1.0, -1, 0.01), (-1, 1, 0.01), (-1, 1, 2), (-1, -1, 2)])
QUAD = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.fixture(autouse=True)
def library_at_hand():
    library(Medium(0.8, 1.4), "preview")


def target_by_wall(x=0.3, max_bounces=(4, 4, 4), albedo=(0.8, 0.1, 0.1)):
    """A floor beside a wall that returns the light of a lamp."""
    wall = Mesh(WALL, QUAD, reflectors=(native.Reflector(native.ColorTexture(albedo)),))
    lamp = PointLight("Lamp", 10.0, (1.0, 1.0, 1.0), True, (x, 0.2, 0.5))
    material = Material(albedo=(0.99, 0.9, 0.6), mean_free_path=(0.02,) * 3, anisotropy=0.8, ior=1.4)
    settings = for_live(BakeSettings(margin=0, quality="preview"))
    illumination = Illumination([lamp], [Occluder("Wall", wall)])
    return LiveTarget(
        Target("Floor"), FLOOR, (SIDE, SIDE), SIDE, illumination, Surface(material), settings, max_bounces=max_bounces
    )


def baked(target):
    """The texture of a bake of the target."""
    receiver = build_receiver(flatten(target.polygons), SIDE, SIDE)
    steps = BouncedLight(target.max_bounces), Solve()
    return BakeJob("Floor", receiver, target.illumination, target.surface, target.settings, steps).run().texture


def test_an_exact_rendering_is_the_bake(renderer):
    target = target_by_wall()
    np.testing.assert_array_equal(renderer.exact(target).texture, baked(target))


def test_coarse_bounced_light_is_nearly_that_of_the_bake(renderer):
    """Its noise is 5 % of all light at 24 x 24 nodes; means over the floor are right to a part of that."""
    target = target_by_wall()
    direct = renderer.quick(target, SIDE).texture
    quick, exact = renderer.quick_bounced(target).texture, renderer.exact(target).texture
    bounced = exact - renderer.exact(replace(target, max_bounces=None)).texture
    assert (bounced / exact)[..., 0].mean() > 0.05
    np.testing.assert_allclose((quick - direct)[..., 0].mean(), bounced[..., 0].mean(), rtol=0.03)
    # Red light of a red wall.
    assert (quick - direct)[..., 0].mean() > 5 * (quick - direct)[..., 1].mean()


def test_a_quick_rendering_keeps_the_last_known_bounced_light(renderer):
    first, second = target_by_wall(0.3), target_by_wall(-0.3)
    direct = renderer.quick(first, SIDE).texture
    bounced = renderer.quick_bounced(first).texture - direct
    np.testing.assert_allclose(renderer.quick(first, SIDE).texture, direct + bounced, rtol=1e-6)
    without = renderer.quick(replace(second, max_bounces=None), SIDE).texture
    np.testing.assert_allclose(renderer.quick(second, SIDE).texture - without, bounced, atol=1e-6 * direct.max())


def test_bounced_light_goes_with_its_wall(renderer):
    renderer.quick(target_by_wall(), SIDE)
    renderer.quick_bounced(target_by_wall())
    black = target_by_wall(albedo=(0.0, 0.0, 0.0))
    direct = renderer.quick(replace(black, max_bounces=None), SIDE).texture
    renderer.quick(black, SIDE)
    np.testing.assert_array_equal(renderer.quick_bounced(black).texture, direct)


def renderings_of(thread, until):
    """Renderings until a condition holds for the last one, for at most 20 s of CPU time."""
    seen, began = [], time.process_time()
    while not (seen and until(seen[-1])):
        assert time.process_time() < began + 20
        renderings = list(thread.take().values())
        seen += renderings
        time.sleep(0.001)
    return seen


def test_direct_light_comes_first_and_the_bake_last(thread):
    target = target_by_wall()
    thread.show([target])
    seen = renderings_of(thread, lambda rendering: rendering.is_exact)
    np.testing.assert_array_equal(seen[-1].texture, baked(target))
    assert not any(rendering.is_exact for rendering in seen[:-1])
    thread.show([target_by_wall(-0.3)])
    renderings_of(thread, lambda rendering: rendering.is_exact)


def test_bounced_light_follows_a_target_that_never_rests(thread, monkeypatch):
    monkeypatch.setattr("beamspread.core.live.render_thread.MAX_WAIT_SECONDS", 0.0)
    added = []
    quick_bounced = thread._renderer.quick_bounced
    monkeypatch.setattr(thread._renderer, "quick_bounced", lambda *rest: added.append(1) or quick_bounced(*rest))
    for number in range(200):
        thread.show([target_by_wall(0.3 + 1e-3 * number)])
        time.sleep(0.005)
    assert len(added) > 2


def test_better_light_on_its_way_is_awaited(thread):
    thread.show([replace(target_by_wall(), is_final=False)])
    began = time.process_time()
    while thread._done != thread._generation:
        assert time.process_time() < began + 20
        time.sleep(0.002)
    assert not any(rendering.is_exact for rendering in thread.take().values())
    thread.show([target_by_wall()])
    renderings_of(thread, lambda rendering: rendering.is_exact)


def test_a_coarse_world_keeps_its_light():
    rows = 600
    radiance = np.random.default_rng(1).random((rows, 2 * rows, 3), np.float32)
    light = WorldLight("World", 1.0, (1.0, 1.0, 1.0), True, radiance, AXES)
    coarse = light.coarse(200)
    assert coarse.radiance.shape == (200, 400, 3)
    assert light.coarse(rows) is light
    np.testing.assert_allclose(coarse.radiance.mean((0, 1), float), radiance.mean((0, 1), float), rtol=1e-6)
    assert light.native() is light.native()


def test_a_kept_value_goes_with_its_array():
    array, made = np.zeros(3), []
    for key in ("a", "a", "b"):
        keep_with(array, key, lambda: made.append(1) or len(made))
    assert len(made) == 2
    address = id(array)
    del array
    gc.collect()
    from beamspread.core import recent

    assert not any(entry[0] == address for entry in recent._of_arrays)
