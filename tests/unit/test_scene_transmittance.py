"""Light past see-through triangles against closed forms."""

import math
import pickle

import numpy as np
import pytest
from beamspread.core.native import native
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import gather_beams
from shapes import FACES, SQUARE, cast, make_grid, points_of, soup

DOWN = native.SunLight((0, 0, -1))
UVS = (SQUARE[:, :2] / 2 + 0.5)[FACES].astype(np.float32)  # row v = 0 at y = -1
# Images keep 16 bits.
LEVEL = 0.5 / 65535


def grid(width=16, height=None):
    return native.ReceiverGrid(**make_grid(width, height))


def card(transmittance, height=1.0, scale=1.0, uvs=None):
    materials = np.zeros((2, 1), np.uint32)
    vertices = SQUARE * scale + (0, 0, height)
    uvs = None if uvs is None else np.ascontiguousarray(uvs, np.float32).reshape(-1, 6)
    return native.OccluderMesh(vertices, FACES, None, [transmittance], materials, uvs)


def image(texels, **options):
    texels = np.ascontiguousarray(texels, np.float32)
    return native.ColorTexture.from_image(texels if texels.ndim == 3 else texels[..., None], **options)


def light_past(meshes, light=DOWN, samples=4, max_crossings=None, on=None, **options):
    occluders = native.Occluders(meshes, max_crossings=max_crossings)
    return gather_beams(on or grid(), light, occluders, samples, **options)[0]


def test_grey_cards_multiply_and_stay_scalar():
    colors = (0.3, 0.7, 0.45)
    cards = [card(native.ColorTexture((t, t, t)), 1 + i) for i, t in enumerate(colors)]
    lit = light_past(cards)
    assert lit.shape == (16, 16)
    # Rays pass the diagonal, which both triangles of a card report: its transmittance counts once there, too. Single
    # precision of the sum of 16 rays.
    np.testing.assert_allclose(lit, np.prod(np.float32(colors)), rtol=3e-7)
    assert not light_past([*cards, card(native.ColorTexture((0, 0, 0)), 5)]).any()


def test_color_gives_three_channels():
    red, blue = (0.8, 0.25, 0.0), (0.5, 0.25, 1.0)
    lit = light_past([card(native.ColorTexture(red), 1), card(native.ColorTexture(blue), 2)])
    assert lit.shape == (16, 16, 3)
    np.testing.assert_allclose(lit, np.broadcast_to(np.float32(red) * np.float32(blue), lit.shape), rtol=3e-7)


def test_the_direction_is_weighed_by_irradiance():
    """A lamp past a card that dims one half: the mean direction of the texels below its border leans to the other."""
    lamp = native.PointLight((0.0, 0.0, 2.0))
    half = SQUARE * (0.5, 1, 0) - (0.5, 0, -1e-3)
    one = native.OccluderMesh(half, FACES, None, [native.ColorTexture((0.25,) * 3)], np.zeros((2, 1), np.uint32))
    wide = grid(1, 1)
    plain = gather_beams(wide, lamp, None, 8)
    dimmed = gather_beams(wide, lamp, native.Occluders([one]), 8)
    # The mirror images of the other rays keep a quarter of their light.
    np.testing.assert_allclose(dimmed[0], plain[0] * 0.625, rtol=1e-6)
    j, i = np.divmod(np.arange(64), 8)  # see beams.cpp
    x, y = (i + (j + 0.5) / 8) / 4 - 1, (j + (i + 0.5) / 8) / 4 - 1
    to = np.stack([x, y, np.full_like(x, -2)], -1)
    flow = (to / np.linalg.norm(to, axis=-1, keepdims=True) ** 4 * np.where(x < 0, 0.25, 1)[:, None]).sum(0)
    np.testing.assert_allclose(dimmed[1][0, 0], flow / np.linalg.norm(flow), atol=1e-6)
    assert dimmed[1][0, 0, 0] > 0.05


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 60), height=st.sampled_from([0.7, 2.0]))
def test_every_crossing_counts_once(seed, count, height):
    """A lamp, whose rays go all ways, against each ray and triangle by Moeller and Trumbore."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform((-1, -1, 0.05), (1, 1, 0.6), (count, 1, 3)) + rng.normal(0, 0.5, (count, 3, 3))
    corners[..., 2] = np.abs(corners[..., 2])
    left = rng.uniform(0.2, 0.95, count).astype(np.float32)
    grey = [native.ColorTexture((t,) * 3) for t in left]
    mesh = native.OccluderMesh(*soup(corners), None, grey, np.arange(count, dtype=np.uint32)[:, None])
    lamp = np.array([0.1, 0.05, height])
    got = light_past([mesh], native.PointLight(lamp), samples=1) / light_past([], native.PointLight(lamp), samples=1)
    points = points_of(make_grid(16), 1)[:, :, 0]
    crossed, doubt = cast(points, lamp - points, 1.0, *soup(corners))
    wanted = np.where(crossed, left[:, None, None], 1).prod(0)
    clear = doubt > 1e-4  # else rounding decides whether a ray meets an edge
    assert clear.mean() > 0.8
    # Single precision of the quotient of two irradiances.
    np.testing.assert_allclose(got[clear], wanted[clear], rtol=1e-6)


@pytest.mark.parametrize("channels", [1, 3])
def test_an_image_is_looked_up_bilinearly_by_uv(channels):
    rng = np.random.default_rng(4)
    texels = rng.random((5, 4, channels), np.float32)
    size = 32
    lit = light_past([card(image(texels), uvs=UVS)], samples=1, on=grid(size, size))
    # Texel (i, j) holds for u = (i + 1/2) / width, as in Cycles, and repeats; one ray starts at each texel's middle.
    place = (np.arange(size) + 0.5) / size
    x, y = place * 4 - 0.5, place * 5 - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = (x - i)[None, :, None], (y - j)[:, None, None]

    def at(dj, di):
        return texels[((j + dj) % 5)[:, None], ((i + di) % 4)[None, :]]

    wanted = (at(0, 0) * (1 - a) + at(0, 1) * a) * (1 - b) + (at(1, 0) * (1 - a) + at(1, 1) * a) * b
    np.testing.assert_allclose(lit.reshape(size, size, -1), wanted, atol=LEVEL + 1e-6)


def wrapped(extension, i, count):
    if extension == "repeat":
        return i % count
    if extension == "extend":
        return np.clip(i, 0, count - 1)
    return np.where(i // count % 2 == 0, i % count, count - 1 - i % count)


@pytest.mark.parametrize("extension", ["repeat", "extend", "mirror", "clip"])
def test_beyond_the_border(extension):
    texels = np.random.default_rng(5).random((3, 3, 3), np.float32)
    outside = (0.9, 0.1, 0.5)
    see_through = image(texels, extension=extension, is_smooth=False, outside=outside)
    # Three images along each side, the middle one from 0 to 1.
    lit = light_past([card(see_through, uvs=UVS * 3 - 1)], samples=1, on=grid(9, 9))
    i = np.arange(9) - 3
    if extension == "clip":
        wanted = np.broadcast_to(np.float32(outside), (9, 9, 3)).copy()
        wanted[3:6, 3:6] = texels
    else:
        place = wrapped(extension, i, 3)
        wanted = texels[place[:, None], place[None, :]]
    np.testing.assert_allclose(lit, wanted, atol=LEVEL + 1e-6)


def test_stripes_are_exact_in_the_mean():
    """Coloured stripes, 8 rays across each texel: every texel is the mean of its stripes."""
    stripes = np.array([(1, 0, 0), (0, 1, 0.5), (0.2, 0.2, 1), (0, 0, 0)], np.float32)[None]
    lit = light_past([card(image(stripes, is_smooth=False), uvs=UVS * (8, 1))], samples=8, on=grid(16, 16))
    # Eight images of four stripes on 16 texels: half an image each, two stripes.
    wanted = np.stack([stripes[0, :2].mean(0), stripes[0, 2:].mean(0)] * 8)
    np.testing.assert_allclose(lit, np.broadcast_to(wanted, lit.shape), atol=2 * LEVEL)


def test_the_order_of_triangles_does_not_change_a_bit():
    rng = np.random.default_rng(8)
    corners = rng.uniform(-1.5, 1.5, (60, 3, 3)) * (1, 1, 0.3) + (0, 0, 1)
    materials = rng.integers(0, 5, (60, 1)).astype(np.uint32)
    see_through = [native.ColorTexture(rng.uniform(0.5, 1, 3)) for _ in range(5)]

    def lit(order):
        triangles = np.ascontiguousarray(np.arange(180, dtype=np.uint32).reshape(-1, 3)[order])
        return light_past([native.OccluderMesh(corners.reshape(-1, 3), triangles, None, see_through, materials[order])])

    straight = lit(np.arange(60))
    assert len(np.unique(straight)) > 100
    np.testing.assert_array_equal(straight, lit(rng.permutation(60)))


def test_a_ray_ends_after_so_many_crossings():
    cards = [card(native.ColorTexture((0.9,) * 3), 1 + 0.1 * i) for i in range(5)]
    np.testing.assert_allclose(light_past(cards, max_crossings=5), 0.9**5, rtol=1e-6)
    assert not light_past(cards, max_crossings=4).any()


@pytest.mark.parametrize("extension", ["repeat", "extend", "clip", "mirror"])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("is_smooth", [False, True])
def test_a_pickle_of_an_image_lets_the_same_light_through(extension, channels, is_smooth):
    texels = np.random.default_rng(1).random((3, 5, channels))
    before = image(texels, extension=extension, is_smooth=is_smooth, outside=(0.9, 0.5, 0.2))
    lit, again = (light_past([card(item, uvs=3 * UVS - 1)]) for item in (before, pickle.loads(pickle.dumps(before))))
    np.testing.assert_array_equal(lit, again)


def test_a_pickle_of_a_color_lets_the_same_light_through():
    before = native.ColorTexture((0.3, 0.7, 0.1))
    lit, again = (light_past([card(item)]) for item in (before, pickle.loads(pickle.dumps(before))))
    np.testing.assert_array_equal(lit, again)


def test_occluders_know_whether_they_are_opaque_and_colored():
    def facts(*transmittances):
        occluders = native.Occluders([card(transmittance) for transmittance in transmittances])
        return occluders.is_opaque, occluders.is_colored

    opaque, clear = native.ColorTexture((0, 0, 0)), native.ColorTexture((1, 1, 1))
    assert opaque.is_black
    assert facts(opaque) == facts(clear) == facts(opaque, clear) == (True, False)
    assert facts(opaque, image(np.full((2, 2), 0.5))) == (False, False)
    assert facts(native.ColorTexture((0.5, 0.5, 0.4))) == (False, True)
    assert facts(image(np.full((2, 2), 0.5), extension="clip", outside=(1, 0, 0))) == (False, True)
    assert (light_past([card(clear)]) == 1).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: native.ColorTexture((0.5, 1.5, 0)), r"color.*1\.5.*0 to 1"),
        (lambda: native.ColorTexture((0.5, math.nan, 0)), "color.*nan"),
        (lambda: image(np.full((2, 2), -0.1)), r"texels.*-0\.1.*0 to 1"),
        (lambda: image(np.zeros((0, 2))), "texels.*empty"),
        (lambda: image(np.zeros((2, 2, 4))), r"texels.*\(2, 2, 4\)"),
        (lambda: native.ColorTexture.from_image(np.zeros((2, 2, 1))), "texels.*float64.*float32"),
        (lambda: image(np.zeros((2, 2)), extension="wrap"), "extension.*'wrap'.*'repeat'"),
        (lambda: image(np.zeros((2, 2)), outside=(2, 0, 0)), r"outside.*2.*0 to 1"),
        (lambda: light_past([card(native.ColorTexture((1, 0, 0)), uvs=UVS * math.nan)]), "uvs.*nan"),
        (lambda: light_past([card(native.ColorTexture((1, 0, 0)), uvs=UVS * 1e7)]), "uvs.*-1e6 to 1e6"),
        (
            lambda: light_past([native.OccluderMesh(SQUARE, FACES, None, [], np.zeros((2, 1), np.uint32))]),
            "materials.*0.*below the number of transmittances, 0",
        ),
        (
            lambda: light_past([native.OccluderMesh(SQUARE, FACES, None, [], np.zeros((1, 1), np.uint32))]),
            "materials.*1 numbers.*2 triangles",
        ),
        (lambda: native.OccluderMesh(SQUARE, FACES, np.zeros((1, 3, 4))), r"placements.*\(1, 3, 4\).*\(K, 12\)"),
        (
            lambda: light_past([native.OccluderMesh(SQUARE, FACES, np.full((1, 12), math.inf))]),
            "placements.*inf.*finite",
        ),
    ],
)
def test_bad_arguments_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
