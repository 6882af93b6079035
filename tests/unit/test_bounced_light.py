"""Bounced light against closed forms. Tolerances are three times the noise where the comment names no other reason."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from beamspread.core.native import native
from beamspread.core.scene.lights import STRATA, WEIGHTS

from shapes import FACES, SQUARE, box, occluders, rotation, sphere

UNIT = (1.0, 1.0, 1.0)


def grey(albedo):
    return native.Reflector(native.ColorTexture((albedo,) * 3))


def mesh(vertices, triangles, *reflectors, **options):
    return native.OccluderMesh(np.ascontiguousarray(vertices), triangles, reflectors=list(reflectors), **options)


def grid(centre=(0.0, 0.0, 1e-4), size=(1.0, 1.0), nodes=(8, 8)):
    """A rectangle of nodes that looks up."""
    corner = np.array(centre) - (size[0] / 2, size[1] / 2, 0)
    axes = {"x_axis": (1.0, 0.0, 0.0), "y_axis": (0.0, 1.0, 0.0), "normal": (0.0, 0.0, 1.0)}
    return {"corner": corner, **axes, "size": size, "nodes": nodes}


def bounced(scene, lights, grids=None, **options):
    options = {"direct": 1.0, "max_bounces": 200, "max_samples": 1024, **options}
    lit = [(light, strength if np.ndim(strength) else (strength,) * 3, scene) for light, strength in lights]
    return native.bounced_light(grids or [grid()], STRATA, lit, scene, **options)


@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_all_points_in_a_sphere_have_the_same_irradiance(albedo):
    """A lamp in the middle lights the wall evenly; exitances add up to a geometric series."""
    scene = native.Occluders([mesh(*sphere(48)[:2], grey(albedo))])
    found = bounced(
        scene, [(native.PointLight((0, 0, 0)), 4 * np.pi)], [grid((0, 0, -0.9), (0.2, 0.2))], tolerance=4e-3
    )
    wanted = albedo / (1 - albedo)
    # Flat faces lie nearer to the lamp, by up to 1e-3.
    assert found["irradiance"] == pytest.approx(wanted, rel=1e-3 + 3 * found["noise"] * (1 + wanted) / wanted)
    by_node = np.pi * np.tensordot(WEIGHTS, found["radiance"][0], 1)
    assert by_node.mean() == pytest.approx(found["irradiance"], rel=1e-5)


def test_threads_change_no_bit():
    scene = native.Occluders([mesh(*sphere(12)[:2], grey(0.7)), mesh(SQUARE, FACES, grey(0.5))])
    lamps = [(native.PointLight((0.2, 0, 0.5), 0.1), 10.0), (native.SunLight((0, 0.5, -1)), 1.0)]
    results = [bounced(scene, lamps, seed=3, threads=threads)["radiance"][0] for threads in (1, 2)]
    assert results[0].any()
    np.testing.assert_array_equal(*results)


def test_black_surfaces_and_open_scenes_need_no_paths():
    lamps = [(native.PointLight((0, 0, 1)), 1.0)]
    assert bounced(occluders(sphere(6)[:2]), lamps)["paths"] == 0
    assert bounced(native.Occluders([]), lamps)["paths"] == 0
    # Paths upward meet nothing.
    below = native.Occluders([mesh(SQUARE - (0, 0, 1), FACES, grey(0.8))])
    found = bounced(below, lamps)
    assert found["irradiance"] == 0
    assert found["paths"] == 2 * 64 * len(STRATA)


# Rays straight up, and within a degree of 60 degrees from the normal.
UPRIGHT = np.array([(0.0, 1e-6, 0.0, 1.0)])
OBLIQUE = np.array([(0.735, 0.03, 0.0, 1.0)])


def reflectance(reflector, strata):
    """Reflectance of a ceiling under even light from below, toward the directions of the strata."""
    scene = native.Occluders([mesh(SQUARE * 1e3 + (0, 0, 1), FACES, reflector)])
    sky = native.EnvironmentLight(np.ones((4, 8, 3), np.float32), np.eye(3))
    lights = [(sky, UNIT, None)]
    found = native.bounced_light([grid()], strata, lights, scene, 0.0, max_bounces=1, tolerance=4e-3, max_samples=1024)
    return found["radiance"][0].mean((0, 1, 2)), 3 * found["noise"]


def ggx_albedo(cosine, f0, alpha, steps=400):
    """Directional albedo of a GGX lobe with Schlick's term, by midpoints over the hemisphere."""
    mu, phi = np.meshgrid((np.arange(steps) + 0.5) / steps, (np.arange(steps) + 0.5) / steps * 2 * np.pi)
    light = np.stack([np.sqrt(1 - mu**2) * np.cos(phi), np.sqrt(1 - mu**2) * np.sin(phi), mu], -1)
    view = np.array([np.sqrt(1 - cosine**2), 0, cosine])
    half = (light + view) / np.linalg.norm(light + view, axis=-1, keepdims=True)
    density = alpha**2 / (np.pi * ((alpha**2 - 1) * half[..., 2] ** 2 + 1) ** 2)

    def masked(c):
        return (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) - 1) / 2

    fresnel = f0 + (1 - f0) * (1 - half @ view) ** 5
    return (2 * np.pi * fresnel * density / (1 + masked(cosine) + masked(mu)) / (4 * cosine)).mean()


def lobe(f0, roughness, albedo=0.0, is_layered=False):
    return native.Reflector(native.ColorTexture((albedo,) * 3), (f0,) * 3, roughness, is_layered)


def test_a_rough_lobe_has_its_closed_form():
    """For alpha 1 at normal incidence D = 1 / pi and G = 2 c / (1 + c), so that the albedo is 1 - ln 2."""
    found, error = reflectance(lobe(1.0, 1.0), UPRIGHT)
    np.testing.assert_allclose(found, 1 - np.log(2), rtol=error)


@pytest.mark.parametrize(("strata", "cosine"), [(UPRIGHT, 1.0), (OBLIQUE, 0.5)])
@pytest.mark.parametrize(("f0", "roughness"), [(0.04, 0.5), (0.6, 0.8)])
def test_lobes_reflect_their_directional_albedo(strata, cosine, f0, roughness):
    alone, error = reflectance(lobe(f0, roughness), strata)
    wanted = ggx_albedo(cosine, f0, roughness**2)
    np.testing.assert_allclose(alone, wanted, rtol=error)
    added, error = reflectance(lobe(f0, roughness, 0.3), strata)
    np.testing.assert_allclose(added, wanted + 0.3, rtol=error)
    layered, error = reflectance(lobe(f0, roughness, 0.3, True), strata)
    whole = ggx_albedo(cosine, 1.0, roughness**2)
    kept = wanted * (1 + f0 * (1 / whole - 1))  # Turquin 2019
    # The table of albedos is right within 2e-3.
    np.testing.assert_allclose(layered, kept + 0.3 * (1 - kept), rtol=error + 2e-3)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
def test_a_layered_white_metal_loses_nothing(roughness):
    found, error = reflectance(lobe(1.0, roughness, is_layered=True), OBLIQUE)
    np.testing.assert_allclose(found, 1.0, rtol=error + 2e-3)


def test_several_reflections_by_lobes_keep_energy():
    """White furnace: in a closed sphere of layered white metal all light stays, here of 12 reflections by .5."""
    scene = native.Occluders([mesh(*sphere(32)[:2], lobe(0.5, 0.6, 1.0, True))])
    lamp = [(native.PointLight((0, 0, 0)), 4 * np.pi)]
    found = bounced(scene, lamp, [grid((0, 0, -0.9), (0.2, 0.2))], max_bounces=12, tolerance=0.01)
    # A layer takes from the white below it as much as it reflects: each reflection keeps all light.
    assert found["irradiance"] == pytest.approx(12, rel=0.02)


def polygon_irradiance(points, corners, normal):
    """Irradiance by polygons of radiance 1 above the horizon (Lambert 1760), (...)."""
    to = corners - points[..., None, :]
    to /= np.linalg.norm(to, axis=-1, keepdims=True)
    onward = np.roll(to, -1, axis=-2)
    across = np.cross(to, onward)
    sine = np.linalg.norm(across, axis=-1)
    angle = np.arctan2(sine, (to * onward).sum(-1))
    return np.abs((angle * (across @ normal) / sine).sum(-1)) / 2


def nodes_of(grid):
    """Positions (rows, columns, 3) of the middles of the nodes' surroundings."""
    columns, rows = grid["nodes"]
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    return (
        grid["corner"]
        + x[..., None] * grid["size"][0] * np.array(grid["x_axis"])
        + y[..., None] * grid["size"][1] * np.array(grid["y_axis"])
    )


def by_node(found, part=0):
    """Irradiance at each node, mean of the channels."""
    return np.pi * np.tensordot(WEIGHTS, found["radiance"][part], 1).mean(-1)


@pytest.mark.parametrize("offset", [(0, 0, 0), (3000.0, -2000.0, 500.0)])
def test_a_wall_in_the_sun(offset):
    """A square that faces the receiver: its exitance is even, so the receiver sees a polygon of one radiance."""
    wall = SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) * 0.4 + (1, 0, 0.5) + np.array(offset)
    scene = native.Occluders([mesh(wall, FACES, grey(0.6))], origin=offset)
    sun = np.array((1.0, 0.2, -0.5)) / np.linalg.norm((1.0, 0.2, -0.5))
    below = grid(np.array(offset) + (0, 0, 1e-3))
    found = bounced(scene, [(native.SunLight(sun), 2.0)], [below], direct=0.0, tolerance=2e-3)
    exitance = 0.6 * 2.0 * sun[0]
    wanted = exitance / np.pi * polygon_irradiance(nodes_of(below), wall, (0, 0, 1))
    assert found["irradiance"] == pytest.approx(wanted.mean(), rel=3 * found["noise"])
    # Each node has the noise of all before averaging, twice that after it.
    assert np.abs(by_node(found) / wanted - 1).max() < 0.05


def plates(count, distance):
    """Middles (N, 3) of the elements of a square, and form factors (N, N) to the square above it."""
    at = (np.arange(count) + 0.5) / count * 2 - 1
    x, y = (part.ravel() for part in np.meshgrid(at, at))
    squared = (x[:, None] - x) ** 2 + (y[:, None] - y) ** 2 + distance**2
    return np.stack([x, y, 0 * x], 1), distance**2 / (np.pi * squared**2) * (2 / count) ** 2


def test_two_plates_exchange_light():
    """Radiosity of two parallel squares by their form factors; the sun passes the upper one, which casts no shadow."""
    scene = native.Occluders([mesh(SQUARE, FACES, grey(0.9)), mesh(SQUARE + (0, 0, 1), FACES, grey(0.7))])
    lights = [(native.SunLight((0, 0, -1)), UNIT, None)]
    floor = grid(size=(2.0, 2.0))
    found = native.bounced_light([floor], STRATA, lights, scene, 0.0, max_samples=1024, tolerance=1e-3, max_bounces=60)
    _, factors = plates(32, 1.0)
    back_and_forth = 0.7 * factors @ (0.9 * factors)
    wanted = np.linalg.solve(np.eye(len(factors)) - back_and_forth, back_and_forth @ np.ones(len(factors)))
    # Elements are right within 1e-3.
    assert found["irradiance"] == pytest.approx(wanted.mean(), rel=1e-3 + 3 * found["noise"])
    blocks = wanted.reshape(8, 4, 8, 4).mean((1, 3))
    # Averaging halves the noise of a node; 64 nodes lie within 3.5 standard errors.
    assert np.abs(by_node(found) - blocks).max() < 3.5 * 2 * found["noise"] * wanted.mean()
    # Light that only one surface reflects does not get there: the upper plate is lit from above.
    once = native.bounced_light([floor], STRATA, lights, scene, 0.0, max_bounces=1)
    assert once["irradiance"] == 0
    twice = native.bounced_light([floor], STRATA, lights, scene, 0.0, max_samples=1024, tolerance=2e-3, max_bounces=2)
    wanted = (back_and_forth @ np.ones(len(factors))).mean()
    assert twice["irradiance"] == pytest.approx(wanted, rel=1e-3 + 3 * twice["noise"])


def test_the_sky_over_a_white_hollow():
    """A hemisphere below an even sky: exitances add up over a cavity that sees the sky by half its directions."""
    points, triangles, _ = sphere(48)
    bowl = triangles[(points[triangles][..., 2].mean(1)) < 0]
    scene = native.Occluders([mesh(points, bowl, grey(0.5))])
    sky = native.EnvironmentLight(np.ones((8, 16, 3), np.float32), np.eye(3))
    bottom = grid((0, 0, -0.9), (0.2, 0.2))
    found = bounced(scene, [(sky, UNIT)], [bottom], tolerance=4e-3)
    # In a sphere all points see each other by the same form factor, 1/2 in all for the bowl, whose irradiance is even:
    # E = pi/2 / (1 - .5 * .5) by sky and bowl. From the bottom, .1 above the wall, the sky's share of even light is
    # that of the disk of its opening.
    even = np.pi / 2 / (1 - 0.25)
    seen = 1 - 1 / (1 + 0.9**2)  # at the middle, by the bowl
    assert found["irradiance"] == pytest.approx(0.5 * even * seen, rel=5e-3 + 3 * found["noise"])


def test_instances_reflect_as_real_meshes():
    points, triangles, uvs = sphere(8)
    texels = np.random.default_rng(0).random((4, 4, 3), np.float32)
    red = native.Reflector(native.ColorTexture.from_image(texels))
    turns = [np.c_[rotation(k) * (0.1 + 0.02 * k), (0.4 * (k % 3) - 0.4, 0.4 * (k // 3) - 0.4, 0.4)] for k in range(9)]
    placements = np.ascontiguousarray(turns).reshape(-1, 12)
    floor = mesh(SQUARE, FACES, grey(0.5))
    balls = mesh(points, triangles, red, placements=placements, reflector_uvs=uvs)
    lights = [(native.PointLight((0.3, 0.2, 1.5)), 10.0)]
    copied, shared = (native.Occluders([floor, balls], max_copied=most) for most in (10**6, 0))
    found = [bounced(scene, lights, [grid(size=(2, 2))], direct=0.0, tolerance=5e-3) for scene in (copied, shared)]
    assert found[0]["irradiance"] > 0.003
    np.testing.assert_allclose(*(part["radiance"][0].mean((1, 2)) for part in found), rtol=0.05, atol=1e-3)
    # The same random numbers meet the same surfaces but for the rounding of few rays.
    assert found[1]["irradiance"] == pytest.approx(found[0]["irradiance"], rel=1e-3)


def test_a_checkered_wall_reflects_its_colors():
    wall = SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) + (1, 0, 1)
    uvs = np.ascontiguousarray((SQUARE[:, :2] / 2 + 0.5)[FACES].reshape(-1, 6), np.float32)
    left_and_right = np.array([[(1, 0, 0), (0, 0, 1)]], np.float32)
    paint = native.Reflector(native.ColorTexture.from_image(left_and_right, extension="extend", is_smooth=False))
    scene = native.Occluders([mesh(wall, FACES, paint, reflector_uvs=uvs)])
    below = grid((0.5, 0, 1e-3), (0.2, 0.2), (4, 4))
    found = bounced(scene, [(native.SunLight((1, 0, 0)), np.pi)], [below], direct=0.0, tolerance=2e-3)
    got = np.pi * np.tensordot(WEIGHTS, found["radiance"][0], 1).mean((0, 1))
    # u runs along +y.
    halves = [np.where(np.arange(3) == 1, np.clip(wall, *limits), wall) for limits in ((-1, 0), (0, 1))]
    red, blue = (polygon_irradiance(nodes_of(below), half, (0, 0, 1)).mean() for half in halves)
    np.testing.assert_allclose(got, (red, 0, blue), rtol=0.01)


def test_see_through_surfaces_share_light():
    """A card of leaves before the wall lets through what its own light does not replace."""
    wall = SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) * 3 + (2, 0, 0)
    card = SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) * 30 + (1, 0, 0)
    leaves = native.ColorTexture((0.5, 0.25, 0.0))
    black = native.Reflector(native.ColorTexture((0.0, 0.0, 0.0)))
    below = grid((0, 0, 1e-3), (0.2, 0.2), (4, 4))
    sun = [(native.SunLight((1, 0, 0)), UNIT, None)]  # no shadows
    options = {"tolerance": 2e-3, "max_bounces": 1, "max_samples": 1024}
    materials = np.zeros((2, 1), np.uint32)
    cards = [
        mesh(card, FACES, reflector, transmittances=[leaves], materials=materials) for reflector in (black, grey(0.4))
    ]
    colors = []
    for parts in ([], cards[:1], cards[1:]):
        scene = native.Occluders([mesh(wall, FACES, grey(0.8)), *parts])
        found = native.bounced_light([below], STRATA, sun, scene, 0.0, **options)
        colors.append(np.pi * np.tensordot(WEIGHTS, found["radiance"][0], 1).mean((0, 1)))
    np.testing.assert_allclose(colors[1], colors[0] * (0.5, 0.25, 0), rtol=0.01)
    own = 0.4 / np.pi * polygon_irradiance(nodes_of(below), np.maximum(card, (0, -99, 0)), (0, 0, 1)).mean()
    np.testing.assert_allclose(colors[2], colors[1] + own, rtol=0.01)


def test_the_noise_is_the_error_over_seeds():
    low, high = (-1.0, -1.0, -1e-3), (1.0, 1.0, 1.5)
    scene = native.Occluders([mesh(*box(low, high), grey(0.6))])
    lights = [
        (native.AreaLight((x, 0.2, 1.2), np.eye(3), 0.3, 0.2, False, np.pi), 5.0) for x in np.linspace(-0.8, 0.8, 12)
    ]
    below = [grid(size=(1.8, 1.8), nodes=(16, 16))]
    found = [bounced(scene, lights, below, direct=2.0, tolerance=0.03, seed=seed) for seed in range(12)]
    values = np.stack([by_node(part) for part in found])
    kernel = np.array((1, 4, 1)) / 6
    inner = sum(
        kernel[i] * kernel[j] * (values - values.mean(0))[:, i : i + 14, j : j + 14] for i in range(3) for j in range(3)
    )
    error = np.sqrt((inner**2).mean() * 12 / 11) / (2.0 + values.mean())
    noise = np.sqrt(np.mean([part["noise"] ** 2 for part in found]))
    # The border's nodes are averaged less, and are counted in the noise: a quarter of all with up to twice the error.
    assert noise / 1.5 < error < noise * 1.1
    assert noise < 0.031


def test_a_sky_behind_a_window_is_a_glowing_pane():
    """Most rays to the sky end at walls, so that the guide chooses them; a pane of the same radiance needs no guide."""
    walls, faces = box((-1, -1, -1e-3), (1, 1, 1))
    side = SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) * (1, 0.3, 0.2) + (1, 0, 0.5)
    is_wall = ~(walls[faces][..., 0] > 0).all(1)
    frame = [
        SQUARE @ np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)]) * (1, y, z) + (1, *middle)
        for y, z, middle in [(0.35, 1, (-0.65, 0)), (0.35, 1, (0.65, 0)), (0.3, 0.3, (0, 0)), (0.3, 0.3, (0, 1))]
    ]
    parts = [mesh(walls, faces[is_wall], grey(0.6)), *(mesh(part, FACES, grey(0.6)) for part in frame)]
    room = native.Occluders(parts)
    sky = native.EnvironmentLight(np.ones((4, 8, 3), np.float32), np.eye(3))
    pane = native.MeshLight(side + (1e-6, 0, 0), FACES, np.ones((2, 3), np.float32))
    below = [grid((-0.2, 0, 1e-3), (1.4, 1.4))]
    found = [bounced(room, [(light, UNIT)], below, max_bounces=4, tolerance=2e-3) for light in (sky, pane)]
    assert found[0]["irradiance"] > 0.05
    error = 3 * np.hypot(found[0]["noise"], found[1]["noise"]) * (1 + found[0]["irradiance"])
    assert found[0]["irradiance"] == pytest.approx(found[1]["irradiance"], abs=error)


def test_a_glowing_panel_close_to_a_wall():
    """Rays over the solid angle of near faces: the panel is right and has no more noise than area lamps of its size."""
    room = native.Occluders([mesh(*box((-1, -1, -1e-3), (1, 1, 1)), grey(0.7))])
    turned = np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)])  # z along +x
    panel = native.MeshLight(SQUARE @ turned * 0.3 + (0.99, 0, 0.5), FACES, np.ones((2, 3), np.float32))
    power = 4 * 0.6 * 0.6  # of radiance 1
    lamps = [
        native.AreaLight((0.99, 0, 0.5), axes, 0.6, 0.6, False, np.pi) for axes in (turned, turned * [[1], [1], [-1]])
    ]
    below = [grid((-0.2, 0, 1e-3), (1.4, 1.4))]
    found = [
        bounced(room, lights, below, max_bounces=4, tolerance=4e-3)
        for lights in ([(panel, 1.0)], [(lamp, power) for lamp in lamps])
    ]
    error = 3 * np.hypot(found[0]["noise"], found[1]["noise"]) * (1 + found[0]["irradiance"])
    assert found[0]["irradiance"] == pytest.approx(found[1]["irradiance"], abs=error)
    assert found[0]["paths"] < 3 * found[1]["paths"]


def test_rays_from_a_wall_go_to_the_near_ones_of_many_glowing_faces():
    """A panel of 2048 faces has 4 times the noise of its two triangles, and 9 times if all faces are drawn alike."""
    room = native.Occluders([mesh(*box((-1, -1, -1e-3), (1, 1, 1)), grey(0.7))])
    turned = np.array([(0, 1, 0), (0, 0, 1), (1, 0, 0)])  # z along +x
    ticks = np.linspace(-1, 1, 33)
    places = np.stack(np.meshgrid(ticks, ticks), -1).reshape(-1, 2)
    first = (np.arange(32)[:, None] * 33 + np.arange(32)).reshape(-1, 1)
    faces = np.concatenate([first + (0, 1, 34), first + (0, 34, 33)]).astype(np.uint32)
    below = [grid((-0.2, 0, 1e-3), (1.4, 1.4))]
    found = []
    for corners, triangles in ((SQUARE, FACES), (np.pad(places, ((0, 0), (0, 1))), faces)):
        corners = np.ascontiguousarray(corners @ turned * 0.3 + (0.99, 0, 0.5))
        panel = native.MeshLight(corners, triangles, np.ones((len(triangles), 3), np.float32))
        options = {"direct": 0.0, "tolerance": 1e-9, "max_bounces": 4, "max_samples": 64}
        found.append(bounced(room, [(panel, 1.0)], below, **options))
    few, many = found
    error = 3 * np.hypot(few["noise"], many["noise"]) * few["irradiance"]
    assert many["irradiance"] == pytest.approx(few["irradiance"], abs=error)
    assert many["noise"] < 6 * few["noise"]


@pytest.mark.parametrize("offset", [(0, 0, 0), (3000.0, -2000.0, 500.0)])
@pytest.mark.parametrize("casts_shadows", [True, False])
def test_a_face_lights_not_itself(casts_shadows, offset):
    """No point of a ball sees another, and none has light of the face on which it lies."""
    vertices, triangles = sphere(8)[:2]
    vertices = np.ascontiguousarray(0.3 * vertices + (0, 0, 0.6) + offset)
    scene = native.Occluders([mesh(vertices, triangles, grey(0.8))], offset)
    ball = native.MeshLight(vertices, triangles, np.ones((len(triangles), 3), np.float32))
    below = [grid(np.array((0, 0, 1e-3)) + offset)]
    options = {"direct": 1.0, "max_bounces": 4, "max_samples": 64}
    found = native.bounced_light(below, STRATA, [(ball, UNIT, scene if casts_shadows else None)], scene, **options)
    assert found["paths"] > 0
    assert found["irradiance"] == 0


def test_a_budget_of_rays_ends_the_search():
    """At a tolerance that is out of reach, with the same bits for any number of threads."""
    scene = native.Occluders([mesh(*sphere(12)[:2], grey(0.7))])
    options = {"lights": [(native.PointLight((0.2, 0, 0.5)), 10.0)], "tolerance": 1e-5}
    whole = bounced(scene, **options)
    few, same = (bounced(scene, **options, max_rays=1e6, threads=threads) for threads in (1, 2))
    np.testing.assert_array_equal(few["radiance"][0], same["radiance"][0])
    # Paths in this sphere have 2 to 4 rays.
    assert 2.5e5 < few["paths"] < 5e5 < whole["paths"]
    assert few["noise"] > whole["noise"] > 1e-5
    assert few["irradiance"] == pytest.approx(whole["irradiance"], abs=4 * few["noise"] * (1 + whole["irradiance"]))


@pytest.mark.parametrize(("name", "size", "lines"), [("bounces", "2", 6), ("indirect", "24", 7)])
def test_the_benches_run_in_small(name, size, lines):
    bench = Path(__file__).resolve().parents[1] / "bench" / f"{name}.py"
    done = subprocess.run([sys.executable, str(bench), size], capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) == lines


@pytest.mark.parametrize(
    ("reflector", "limits", "same"),
    [(grey(0.7), (200, 3, 0), 3), (lobe(0.9, 0.8), (200, 1, 2), 3), (lobe(0.9, 0.8, 0.5), (200, 200, 200), 200)],
)
def test_bounce_limits_count_lambert_and_lobe_apart(reflector, limits, same):
    """Surfaces of one kind alone are limited by its own number; the ray to the receiver counts as diffuse."""
    scene = native.Occluders([mesh(*sphere(12)[:2], reflector)])
    lamp = [(native.PointLight((0.2, 0, 0.5), 0.1), 10.0)]
    results = [bounced(scene, lamp, max_bounces=limit, max_samples=8)["radiance"][0] for limit in (limits, same)]
    assert results[0].any()
    np.testing.assert_array_equal(*results)
    fewer = bounced(scene, lamp, max_bounces=(200, 1, 0), max_samples=8)["irradiance"]
    assert fewer < 0.9 * np.pi * np.tensordot(WEIGHTS, results[0], 1).mean()
