"""Baked meshes that bend against the tables of bodies, and against Cycles' path tracing of the medium."""

import bpy
import numpy as np
import scenes
from cycles_bodies import ANISOTROPY, MEAN_FREE_PATH, add_body, areas_of, cycles_exitance

from body_tables import BODIES, body_table, body_totals

ALBEDO = (0.6, 0.9, 0.95)
SIZE = 36, 18  # texels of Cycles' images; ours have four times as many each way
RADIUS = 30 * MEAN_FREE_PATH


def ball(points):
    return np.full(len(points), RADIUS)


def head(points):
    """Radii of 5 to 8 transport mean free paths: lobes around the axis and a waist, curvatures of both signs."""
    x, y, z = points.T
    around = (x * x + y * y) ** 1.5 * np.cos(3 * np.arctan2(y, x))
    return RADIUS * (1 + 0.12 * around + 0.15 * z * (1 - z * z) + 0.1 * z**3)


def medium_with_image(width, height):
    """A Beamspread material that bakes into an image of this size."""
    bpy.context.scene.beamspread.quality = "final"
    image = bpy.data.images.new("Baked", width, height, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    properties = {"albedo": ALBEDO, "mean_free_path": (MEAN_FREE_PATH,) * 3, "ior": 1.0, "anisotropy": ANISOTROPY}
    return scenes.add_material(image=image, **properties)


def baked_exitance(radius_of):
    """Exitance of a body by the add-on, (height, width, 3): means of 4 x 4 texels weighted by area."""
    body = add_body("Baked", radius_of, medium_with_image(4 * SIZE[0], 4 * SIZE[1]))
    (texture,) = scenes.bake(body)
    bpy.data.objects.remove(body)
    height, width = texture.shape[:2]
    area = areas_of(radius_of, (width, height))[..., None]
    parts = np.stack([np.pi * texture * area, np.broadcast_to(area, texture.shape)])
    power, area = parts.reshape(2, SIZE[1], height // SIZE[1], SIZE[0], width // SIZE[0], 3).sum((2, 4))
    return power / area


def errors(values, truth, areas):
    """Relative errors of the power of each channel, and of its distribution (L1)."""
    areas = areas[..., None]
    power = (truth * areas).sum((0, 1))
    difference = (values - truth) * areas
    return difference.sum((0, 1)) / power, np.abs(difference).sum((0, 1)) / power


def test_a_ball_is_as_bright_as_in_the_table():
    """Sphere of 6 transport mean free paths: total 1 %, .5 % of it the solver's tolerance; L1 2 %."""
    scenes.add_sun(0)
    baked = baked_exitance(ball).mean(1)[::-1]
    truth = np.stack([body_table("ball_6")[albedo][0] for albedo in ALBEDO], -1)
    areas = BODIES["ball_6"][0].areas.reshape(SIZE[1], 2)
    truth = (truth.reshape(SIZE[1], 2, 3) * areas[..., None]).sum(1) / areas.sum(1)[:, None]
    total, l1 = errors(baked[:, None], truth[:, None], areas.sum(1)[:, None])
    assert (np.abs(total) < 0.01).all(), total
    assert (l1 < 0.02).all(), l1


def test_a_tube_is_as_bright_as_in_the_table():
    """An open cylinder of 6 transport mean free paths, in the middle: total 1 %; L1 2 %."""
    segments, length = 96, 100 * MEAN_FREE_PATH
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    # UVs begin on the side of the lamp.
    ring = np.stack([-RADIUS * np.cos(angle[:-1]), -RADIUS * np.sin(angle[:-1])], 1)
    vertices = [(x, y, z) for z in (-length / 2, length / 2) for x, y in ring]
    faces = [(i, (i + 1) % segments, segments + (i + 1) % segments, segments + i) for i in range(segments)]
    uvs = [(u / segments, v) for i in range(segments) for u, v in ((i, 0), (i + 1, 0), (i + 1, 1), (i, 1))]
    tube = scenes.add_mesh("Tube", vertices, faces, uvs=uvs)
    tube.data.polygons.foreach_set("use_smooth", np.ones(segments, bool))
    tube.data.materials.append(medium_with_image(144, 76))
    scenes.add_sun(90)
    (texture,) = scenes.bake(tube)
    middle = np.pi * texture[34:42].mean(0).astype(float).reshape(72, 2, 3).mean(1)
    baked = (middle[:36] + middle[:35:-1]) / 2
    truth = np.stack([body_table("cylinder_6")[albedo][0] for albedo in ALBEDO], -1)
    total, l1 = errors(baked[:, None], truth[:, None], np.ones((36, 1)))
    assert (np.abs(total) < 0.01).all(), total
    assert (l1 < 0.02).all(), l1


def blocks(values, areas):
    """Means over 3 x 3 texels, weighted by area, and the areas."""
    parts = [(v * areas[..., None]).reshape(SIZE[1] // 3, 3, SIZE[0] // 3, 3, 3).sum((1, 3)) for v in values]
    area = areas.reshape(SIZE[1] // 3, 3, SIZE[0] // 3, 3).sum((1, 3))
    return [part / area[..., None] for part in parts], area


def test_path_tracing_of_a_lobed_body():
    """Totals 2 %, 1 % of it the reference's noise and .5 % the solver's tolerance.

    The L1 distance of means of 3 x 3 texels 4 % beyond noise."""
    scenes.add_sun(25, azimuth_deg=70)
    areas = areas_of(head, SIZE)
    traced = [cycles_exitance(head, ALBEDO, SIZE, 512, seed) for seed in (1, 2)]
    (baked, first, second), areas = blocks([baked_exitance(head), *traced], areas)
    total, l1 = errors(baked, (first + second) / 2, areas)
    # The mean of two runs is off by half of their difference, on average.
    noise = errors(first, second, areas)[1] / 2
    assert (np.abs(total) < 0.02).all(), total
    assert (np.sqrt(np.maximum(l1**2 - noise**2, 0)) < 0.04).all(), (l1, noise)


def test_path_tracing_agrees_with_the_table():
    """Totals: 1.5 %, three standard errors of the traced ball."""
    scenes.add_sun(0)
    traced = cycles_exitance(ball, ALBEDO, SIZE, 1024)
    areas = areas_of(ball, SIZE)[..., None]
    total = (traced * areas).sum((0, 1)) / (np.pi * RADIUS**2)
    assert np.abs(total / [body_totals("ball_6")[albedo][0] for albedo in ALBEDO] - 1).max() < 0.015
