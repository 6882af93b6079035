"""Bounced light against closed forms. Tolerances are three times the noise where the comment names no other reason."""

import numpy as np
import pytest
from beamspread.core.native import native
from beamspread.core.scene.lights import STRATA, WEIGHTS

from shapes import FACES, SQUARE, occluders, sphere

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
    options = {"direct": 1.0, "max_bounces": 200, **options}
    lit = [(light, strength if np.ndim(strength) else (strength,) * 3, scene) for light, strength in lights]
    return native.bounced_light(grids or [grid()], STRATA, lit, scene, **options)


@pytest.mark.parametrize("albedo", [0.3, 0.8])
def test_all_points_in_a_sphere_have_the_same_irradiance(albedo):
    """A lamp in the middle lights the wall evenly; exitances add up to a geometric series."""
    scene = native.Occluders([mesh(*sphere(48)[:2], grey(albedo))])
    found = bounced(
        scene, [(native.PointLight((0, 0, 0)), 4 * np.pi)], [grid((0, 0, -0.9), (0.2, 0.2))], tolerance=2e-3
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
