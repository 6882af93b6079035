"""Each kind of light against closed forms and brute force in numpy."""

import math

import numpy as np
import pytest
from _native_test import irradiance, sample
from beamspread.core.native import native

PI = math.pi
UP = (0.0, 0.0, 1.0)
FRAME = np.eye(3)
TILTED = np.array([[6, 2, -3], [-3, 6, -2], [2, 3, 6]]) / 7  # a rotation
POINT = (0.1, -0.2, 0.05)
NORMALS = {"up": UP, "oblique": (0.6, 0.0, 0.8), "grazing": (0.99, 0.0, -math.sqrt(1 - 0.99**2))}
rng = np.random.default_rng(3)
IMAGE = rng.random((6, 10, 3)).astype(np.float32)
CORNERS = rng.normal((0, 0, 1.5), 0.7, (12, 3))
TRIANGLES = np.arange(12, dtype=np.uint32).reshape(4, 3)
GLOW = rng.random((4, 3)).astype(np.float32)

LIGHTS = {
    "sun": native.SunLight((0.2, 0.1, -1), 0.8),
    "flat sun": native.SunLight((0.2, 0.1, -1), 0.8, "flat"),
    "sphere": native.PointLight((0.3, 0.2, 0.7), 0.5, "sphere"),
    "sphere around": native.PointLight((0.3, 0.2, 0.3), 0.9, "sphere"),
    "disk": native.PointLight((0.3, 0.2, 0.7), 0.5, "disk"),
    "spot": native.SpotLight((0.3, 0.2, 0.9), TILTED, 1.6, 0.6, "scaled", 0.3, "sphere"),
    "spot around": native.SpotLight((0.3, 0.2, 0.3), TILTED, 1.6, 0.6, "scaled", 0.9, "sphere"),
    "old spot": native.SpotLight((0.3, 0.2, 0.9), TILTED, 1.6, 0.6, "legacy", 0.3, "disk"),
    "area": native.AreaLight((0.2, 0.1, 0.4), TILTED, 1.5, 0.8),
    "far area": native.AreaLight((3.0, 0.9, 6.0), TILTED, 1.5, 0.8),
    "ellipse": native.AreaLight((0.2, 0.1, 0.4), TILTED, 1.5, 0.8, True),
    "far ellipse": native.AreaLight((3.0, 0.9, 6.0), TILTED, 1.5, 0.8, True),
    "spread": native.AreaLight((0.2, 0.1, 0.4), TILTED, 1.5, 0.8, False, 1.9),
    "spread ellipse": native.AreaLight((0.2, 0.1, 0.4), TILTED, 1.5, 0.8, True, 1.9),
    "environment": native.EnvironmentLight(IMAGE, TILTED),
    "mesh": native.MeshLight(CORNERS, TRIANGLES, GLOW),
}
# Hard borders within the sampled square take more rays for the same error.
RAYS = 2**16


def lattice(count):
    """Evenly spread places of the unit square: a rank-1 lattice by the golden ratio."""
    i = np.arange(count)
    return np.stack([(i + 0.5) / count, (i * (math.sqrt(5) - 1) / 2) % 1], axis=-1)


def sampled(light, point, normal, rays=RAYS):
    """The irradiance by rays."""
    travel, distance, flux = sample(light, point, normal, lattice(rays))
    np.testing.assert_allclose(np.linalg.norm(travel, axis=1), 1, atol=1e-9)
    assert (distance > 0).all()
    return (flux * np.maximum(-travel @ np.array(normal), 0)[:, None]).mean(axis=0)


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS.keys())
@pytest.mark.parametrize("name", LIGHTS)
def test_rays_add_up_to_the_irradiance(name, normal):
    """Two ways that share nothing but the light's definition. 65536 rays know it to 3e-4, where rays miss to 1e-3; the
    rings of spots are right to 2e-3.
    """
    light = LIGHTS[name]
    exact = np.array(irradiance(light, POINT, normal))
    tolerance = 2e-3 if "sp" in name else 5e-4
    assert exact.max() > 0
    np.testing.assert_allclose(sampled(light, POINT, normal), exact, rtol=tolerance, atol=tolerance * exact.max() / 10)


def brute_force(radiance, normal, steps=700):
    """The integral of radiance(directions) cos(theta) over the hemisphere, by even steps of the projected disk."""
    ticks = (np.arange(steps) + 0.5) / steps * 2 - 1
    x, y = np.meshgrid(ticks, ticks)
    inside = x**2 + y**2 < 1
    x, y = x[inside], y[inside]
    normal = np.array(normal)
    across = np.cross(normal, (0.3, 0.5, -0.7))
    across /= np.linalg.norm(across)
    z = np.sqrt(1 - x**2 - y**2)
    directions = x[:, None] * across + y[:, None] * np.cross(normal, across) + z[:, None] * normal
    return radiance(directions).sum(axis=0, dtype=float) * 4 / steps**2


def area_radiance(position, frame, size, is_round, spread):
    """By intersection of rays from POINT with the lamp, in W/(m^2 sr) for 1 W."""
    area = size[0] * size[1] * np.linalg.norm(frame[0]) * np.linalg.norm(frame[1]) * (PI / 4 if is_round else 1)

    def radiance(directions):
        local = np.linalg.inv(np.array(frame).T)
        origin, way = local @ (np.array(POINT) - position), directions @ local.T
        with np.errstate(divide="ignore"):
            distance = -origin[2] / way[:, 2]
        u, v = ((origin + distance[:, None] * way)[:, :2] / size).T
        on = (u**2 + v**2 < 0.25) if is_round else (np.maximum(abs(u), abs(v)) < 0.5)
        cosine = directions @ np.array(frame[2]) / np.linalg.norm(frame[2])
        lit = on & (distance > 0) & (cosine > 0)
        half = spread / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            tangent = np.sqrt(1 - cosine**2) / cosine
        grid = np.maximum((math.tan(half) - tangent) / (math.tan(half) - half), 0) if spread < 3.1 else 1
        return np.where(lit, grid, 0) / (4 * area)

    return radiance


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS.keys())
@pytest.mark.parametrize("spread", [PI, 2.4, 1.2, 0.5])
@pytest.mark.parametrize("is_round", [False, True], ids=["rectangle", "ellipse"])
@pytest.mark.parametrize("place", [(0.1, 0.0, 0.6), (0.5, -0.9, 0.5)], ids=["above", "beside"])
def test_area_equals_brute_force(place, is_round, spread, normal):
    """The brute force counts 400000 directions, to 1e-3 of the light of a wide lamp."""
    frame, size = TILTED * np.array([[1.5], [-0.7], [2.0]]), (1.0, 0.9)
    light = native.AreaLight(place, frame, *size, is_round, spread)
    wanted = brute_force(area_radiance(np.array(place), frame, size, is_round, spread), normal)
    whole = 1 / (4 * 1.5 * 0.7 * 0.9)
    assert irradiance(light, POINT, normal)[0] == pytest.approx(wanted, rel=2e-3, abs=1e-3 * whole)


@pytest.mark.parametrize("height", [0.01, 0.5, 4.0])
def test_rectangle_above_its_corner_is_lamberts(height):
    """A rectangle a x b parallel to the plane at height h, seen from below a corner (Lambert 1760):
    E = L/2 (A atan(B / s) / s...) with s = sqrt(h^2 + a^2) and so on.
    """
    a, b = 0.8, 0.5
    light = native.AreaLight((a / 2, b / 2, height), FRAME, a, b)
    x, y = math.hypot(a, height), math.hypot(b, height)
    wanted = 1 / (4 * a * b) / 2 * (a / x * math.atan(b / x) + b / y * math.atan(a / y))
    assert irradiance(light, (0, 0, 0), UP)[0] == pytest.approx(wanted, rel=1e-12)
    assert sampled(light, (0, 0, 0), UP)[0] == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("height", [0.02, 0.5, 4.0])
def test_disk_above_its_centre(height):
    """E = pi L r^2 / (r^2 + h^2); the closed form along azimuths is as exact."""
    light = native.AreaLight((0, 0, height), FRAME, 1.2, 1.2, True)
    wanted = 1 / (4 * 0.36) * 0.36 / (0.36 + height**2)
    assert irradiance(light, (0, 0, 0), UP)[0] == pytest.approx(wanted, rel=1e-12)
    assert sampled(light, (0, 0, 0), UP)[0] == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("radius", [0.0, 0.2, 0.99])
def test_sphere_is_a_point_at_its_centre(radius):
    """The whole ball is above the plane. The disk that faces the point is weaker by d^2 / (d^2 + r^2)."""
    position = np.array([0.6, 0.0, 1.0])
    distance, cosine = np.linalg.norm(position), position[2] / np.linalg.norm(position)
    sphere = irradiance(native.PointLight(position, radius, "sphere"), (0, 0, 0), UP)[0]
    assert sphere == pytest.approx(cosine / (4 * PI * distance**2), rel=1e-12)
    disk = irradiance(native.PointLight(position, radius, "disk"), (0, 0, 0), UP)[0]
    if radius < 0.9:
        assert disk == pytest.approx(cosine / (4 * PI * (distance**2 + radius**2)), rel=1e-12)


@pytest.mark.parametrize("height", [0.3, 0.0, -0.2])
def test_half_sunk_sphere(height):
    """Against the integral over the visible cone, by 16 million points."""
    light = native.PointLight((0.9, 0, height), 0.5, "sphere")
    distance = math.hypot(0.9, height)
    half, axis = math.asin(0.5 / distance), math.atan2(0.9, height)
    steps = (np.arange(4000) + 0.5) / 4000
    cosine = 1 - steps[:, None] * (1 - math.cos(half))
    upward = math.cos(axis) * cosine + math.sin(axis) * np.sqrt(1 - cosine**2) * np.cos(PI * steps)
    whole = np.maximum(upward, 0).mean() * 2 * PI * (1 - math.cos(half))
    assert irradiance(light, (0, 0, 0), UP)[0] == pytest.approx(whole / (4 * PI**2 * 0.25), rel=1e-4)


def test_sun_of_no_angle_is_a_direction():
    for disk in ("even", "flat"):
        light = native.SunLight((0.6, 0, -0.8), 0.0, disk)
        assert irradiance(light, POINT, UP)[0] == pytest.approx(0.8, rel=1e-12)
        travel, _, flux = sample(light, POINT, UP, lattice(4))
        np.testing.assert_allclose(travel, np.tile((0.6, 0, -0.8), (4, 1)), atol=1e-12)
        np.testing.assert_allclose(flux, 1, rtol=1e-6)


def test_flat_sun_is_weaker_by_its_mean_cosine():
    """2 (sqrt(1 + R^2) - 1) / R^2, R the tangent of half the angle."""
    tangent = math.tan(0.5)
    light = native.SunLight((0, 0, -1), 1.0, "flat")
    wanted = 2 * (math.sqrt(1 + tangent**2) - 1) / tangent**2
    assert irradiance(light, POINT, UP)[0] == pytest.approx(wanted, rel=1e-5)
    assert irradiance(native.SunLight((0, 0, -1), 1.0, "even"), POINT, UP)[0] == pytest.approx(1, rel=1e-12)


def environment_radiance(image, to_world):
    """Radiance of world directions, by the nearest pixel."""
    height, width = image.shape[:2]

    def radiance(directions):
        x, y, z = (directions @ np.array(to_world)).T  # the transpose turns back
        column = ((PI - np.arctan2(y, x)) / (2 * PI) * width).astype(int) % width
        row = np.minimum(((np.arcsin(np.clip(z, -1, 1)) / PI + 0.5) * height).astype(int), height - 1)
        return image[row, column]

    return radiance


def test_a_world_that_was_prepared_for_one_normal_serves_others():
    """It keeps what it prepared last."""
    normals = [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.0, 1.0)]
    light = native.EnvironmentLight(IMAGE, TILTED)
    for normal in normals:
        fresh = irradiance(native.EnvironmentLight(IMAGE, TILTED), (0.0, 0.0, 0.0), normal)
        assert irradiance(light, (0.0, 0.0, 0.0), normal) == fresh
    assert irradiance(light, (0.0, 0.0, 0.0), normals[1]) != fresh


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS.keys())
def test_environment_equals_brute_force(normal):
    light = native.EnvironmentLight(IMAGE, TILTED)
    wanted = brute_force(environment_radiance(IMAGE, TILTED), normal)
    np.testing.assert_allclose(irradiance(light, POINT, normal), wanted, rtol=1e-3)


def test_even_environment_gives_pi():
    for shape in ((1, 1, 3), (64, 128, 3), (7, 300, 3)):
        light = native.EnvironmentLight(np.ones(shape, np.float32), FRAME)
        np.testing.assert_allclose(irradiance(light, POINT, NORMALS["oblique"]), PI, rtol=1e-5)
        assert not light.is_colored


def test_a_sun_in_the_environment_gets_its_share_of_the_rays():
    """A pixel a hundred thousand times as bright as the sky: rays all carry the same light, within the cosine's change
    in a cell.
    """
    image = np.ones((256, 512, 3), np.float32)
    image[200, 100] = 1e5
    light = native.EnvironmentLight(image, FRAME)
    travel, _, flux = sample(light, POINT, UP, lattice(4096))
    carried = flux[:, 0] * -travel[:, 2]
    sky = image.sum() - 3e5
    assert sky > 0
    elevation = PI * (np.array([200, 201]) / 256 - 0.5)
    solid_angle = 2 * PI / 512 * (math.sin(elevation[1]) - math.sin(elevation[0]))
    of_sun = 1e5 * solid_angle * math.sin(elevation.mean())
    direction = np.array([math.cos(elevation.mean()), 0, -math.sin(elevation.mean())])
    azimuth = PI - 2 * PI * 100.5 / 512
    direction = np.array([-direction[0] * math.cos(azimuth), -direction[0] * math.sin(azimuth), direction[2]])
    hits = (travel @ direction > math.cos(0.013)).mean()
    assert hits == pytest.approx(of_sun / (of_sun + PI), abs=2e-3)
    bright = carried > 0.5 * carried.mean()
    assert bright.mean() > 0.97
    assert carried[bright].std() < 0.03 * carried.mean()


def test_mesh_is_lambertian_on_both_sides():
    """Two triangles as a square are the area lamp of the same radiance, and light the other side as well."""
    corners = np.array([(-0.5, -0.4, 0.8), (0.5, -0.4, 0.8), (0.5, 0.4, 0.8), (-0.5, 0.4, 0.8)])
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    mesh = native.MeshLight(corners, triangles, np.full((2, 3), 1 / (4 * 0.8), np.float32))
    area = native.AreaLight((0, 0, 0.8), FRAME, 1.0, 0.8)
    np.testing.assert_allclose(irradiance(mesh, POINT, UP), irradiance(area, POINT, UP), rtol=1e-6)
    above = (POINT[0], POINT[1], 1.6 - POINT[2])
    np.testing.assert_allclose(irradiance(mesh, above, (0, 0, -1)), irradiance(area, POINT, UP), rtol=1e-6)
    assert irradiance(area, above, (0, 0, -1))[0] == 0


def test_dark_and_missing():
    for light in (
        native.AreaLight((0, 0, 1), FRAME, 0, 0),
        native.AreaLight((0, 0, 1), FRAME, 1, 0),
        native.AreaLight((0, 0, -1), FRAME, 1, 1),
        native.AreaLight((0, 0, 1), -FRAME, 1, 1),
        native.MeshLight(CORNERS, TRIANGLES, np.zeros((4, 3), np.float32)),
        native.MeshLight(np.zeros((0, 3)), np.zeros((0, 3), np.uint32), np.zeros((0, 3), np.float32)),
        native.EnvironmentLight(np.zeros((2, 4, 3), np.float32), FRAME),
        native.SunLight((0, 0, 1), 0.5),
        native.PointLight((0, 0, -1), 0.5, "sphere"),
    ):
        assert irradiance(light, (0, 0, 0), UP) == (0, 0, 0)
        travel, _, flux = sample(light, (0, 0, 0), UP, lattice(16))
        assert (flux * np.maximum(-travel[:, 2:], 0) == 0).all()


def test_parallel_light_of_an_area():
    """Spread 0: pi times the radiance wherever the lamp is seen along its axis, nothing elsewhere."""
    light = native.AreaLight((0, 0, 2), FRAME, 1.0, 0.5, False, 0.0)
    assert irradiance(light, (0.49, 0.24, 0), UP)[0] == pytest.approx(PI / (4 * 0.5), rel=1e-12)
    assert irradiance(light, (0.51, 0.24, 0), UP)[0] == irradiance(light, (0.49, 0.26, 0), UP)[0] == 0
    nearly = native.AreaLight((0, 0, 2), FRAME, 1.0, 0.5, False, 0.01)
    assert irradiance(nearly, (0.4, 0.2, 0), UP)[0] == pytest.approx(PI / (4 * 0.5), rel=1e-4)


def test_spread_keeps_the_power():
    """Irradiance over a large plane in front of a lamp adds up to 1 W times pi / 4."""
    steps = 240
    for spread in (1.0, 0.4):
        light = native.AreaLight((0, 0, 1), FRAME, 0.6, 0.4, True, spread)
        grid = native.ReceiverGrid((-1.5, -1.5, 0), (1, 0, 0), (0, 1, 0), UP, 3 / steps, 3 / steps, steps, steps)
        power = native.gather_rays(grid, light, rays=2)[0][..., 0].sum() * (3 / steps) ** 2
        assert power == pytest.approx(PI / 4, rel=1e-3)


BAD = [
    (native.SunLight, ((0, 0, -1), -0.1), "angle", "-0.1"),
    (native.SunLight, ((0, 0, 0),), "direction", "0, 0, 0"),
    (native.SunLight, ((0, 0, math.inf),), "direction", "inf"),
    (native.SunLight, ((math.nan, 0, 1),), "direction", "nan"),
    (native.SunLight, ((0, 0, -1), 0.1, "round"), "disk", "'round'"),
    (native.PointLight, ((0, 0, 1), -1.0, "sphere"), "radius", "-1"),
    (native.PointLight, ((0, math.nan, 1),), "position", "nan"),
    (native.PointLight, ((0, 0, 1), 1.0, "ball"), "shape", "'ball'"),
    (native.SpotLight, ((0, math.inf, 1), FRAME, 1.0, 0.1), "position", "inf"),
    (native.SpotLight, ((0, 0, 1), 0 * FRAME, 1.0, 0.1), "frame", "singular"),
    (native.SpotLight, ((0, 0, 1), np.eye(2), 1.0, 0.1), "frame", r"\(2, 2\)"),
    (native.SpotLight, ((0, 0, 1), FRAME, 0.0, 0.5), "spot_size", "0"),
    (native.SpotLight, ((0, 0, 1), FRAME, 3.2, 0.5), "spot_size", "3.2"),
    (native.SpotLight, ((0, 0, 1), FRAME, 1.0, 1.1), "blend", "1.1"),
    (native.SpotLight, ((0, 0, 1), FRAME, 1.0, 0.5, "soft"), "falloff", "'soft'"),
    (native.AreaLight, ((0, 0, 1), FRAME, math.inf, 1.0), "size_x", "inf"),
    (native.AreaLight, ((0, 0, 1), FRAME, 1.0, -1.0), "size_y", "-1"),
    (native.AreaLight, ((0, 0, 1), FRAME, 1.0, 1.0, False, 3.2), "spread", "3.2"),
    (native.AreaLight, ((0, 0, 1), FRAME[:2], 1.0, 1.0), "frame", r"\(2, 3\)"),
    (native.EnvironmentLight, (-IMAGE, FRAME), "radiance", "-"),
    (native.EnvironmentLight, (IMAGE.astype(float), FRAME), "radiance", "float64"),
    (native.EnvironmentLight, (IMAGE, 2 * FRAME), "to_world", ""),
    (native.MeshLight, (CORNERS, TRIANGLES, GLOW[:3]), "radiance", "3"),
    (native.MeshLight, (CORNERS * math.nan, TRIANGLES, GLOW), "vertices", "nan"),
    (native.MeshLight, (CORNERS, TRIANGLES + np.uint32(1), GLOW), "triangles", "12"),
]


@pytest.mark.parametrize(("make", "arguments", "name", "value"), BAD)
def test_bad_arguments_are_named(make, arguments, name, value):
    with pytest.raises(ValueError, match=f"argument '{name}' is .*{value}.*; allowed: "):
        make(*arguments)
