"""A uniform sun: the interior must show R(angle, albedo) E / pi, R being the exact total without its specular part."""

import math

import bpy
import numpy as np
import pytest
from scenes import add_material, add_plane, add_sun, bake, diffuse_reflectance

ALBEDO = (0.99, 0.9, 0.6)


@pytest.mark.parametrize("angle", [0, 30, 60])
@pytest.mark.parametrize(("ior", "g"), [(1.0, 0.8), (1.5, 0.0)])
def test_interior_of_a_uniformly_lit_plane(angle, ior, g):
    scene = bpy.context.scene.beamspread
    scene.resolution, scene.quality = 64, "final"
    mean_free_path = 0.002
    material = add_material(albedo=ALBEDO, mean_free_path=(mean_free_path,) * 3, ior=ior, anisotropy=g)
    plane = add_plane(size=(2, 2), material=material)
    add_sun(angle, azimuth_deg=20, strength=3.0)
    (texture,) = bake(plane)
    irradiance = 3.0 * math.cos(math.radians(angle))
    expected = [diffuse_reflectance(ior, g, albedo, angle) * irradiance / math.pi for albedo in ALBEDO]
    interior = texture[24:40, 24:40].reshape(-1, 3)
    assert interior.mean(axis=0) == pytest.approx(expected, rel=0.01)
    assert interior.std(axis=0) == pytest.approx(0, abs=1e-3)


def test_colors_and_strengths_of_several_suns_add():
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material(albedo=(0.9,) * 3, mean_free_path=(0.002,) * 3))
    first = add_sun(0, strength=2.0, color=(1.0, 0.5, 0.0))
    (one,) = bake(plane)
    second = add_sun(0, strength=1.0, color=(0.0, 0.0, 1.0))
    (both,) = bake(plane)
    first.hide_render = True
    (other,) = bake(plane)
    second.data.energy = 0.0
    (dark,) = bake(plane)
    assert both == pytest.approx(one + other, abs=1e-5)
    assert one[16, 16, 1] == pytest.approx(one[16, 16, 0] / 2, rel=1e-4)
    assert one[16, 16, 2] == 0
    assert other[16, 16, 2] == pytest.approx(one[16, 16, 0] / 2, rel=1e-4)
    assert not dark.any()


def test_base_color_is_the_reflectance_under_diffuse_light():
    """Suns at the nodes of a Gauss-Legendre rule stand for diffuse light: irradiance 2 mu d mu over mu = 0..1."""
    scene, color = bpy.context.scene.beamspread, (0.7, 0.4, 0.1)
    scene.resolution, scene.quality = 32, "final"
    plane = add_plane(material=add_material(color_mode="BASE_COLOR", base_color=color, mean_free_path=(0.002,) * 3))
    for node, weight in zip(*np.polynomial.legendre.leggauss(6)):
        cosine = (1 + node) / 2
        # Its irradiance is strength times cosine: weight / 2 of the rule over 0..1, times 2 mu.
        add_sun(math.degrees(math.acos(cosine)), strength=weight)
    (texture,) = bake(plane)
    # Reflectance of the interior above.
    assert math.pi * texture[16, 16] == pytest.approx(color, rel=0.01)


def test_light_from_behind_leaves_it_black():
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material())
    add_sun(150)
    (texture,) = bake(plane)
    assert not texture.any()
