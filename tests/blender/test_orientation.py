"""Placement and UV map may turn, mirror and scale: the texture must follow, texel by texel."""

import math

import bpy
import numpy as np
import pytest
from beamspread.core.native import native
from mathutils import Matrix, Vector
from scenes import SQUARE_UVS, add_blocker, add_material, add_plane, add_sun, bake

# A chart whose sides differ, so that a swap of axes cannot hide.
SIZE = (2.0, 1.5)
RESOLUTION = 64
# The pattern of visibility samples within a texel does not turn with it, which shows at the shadow's border.
TOLERANCE = 0.02


def scene_texture(matrix=None, uvs=SQUARE_UVS, size=SIZE, object_matrix=None):
    """A plane under a slanted sun with a wall on it, all of it moved by `matrix`."""
    bpy.context.scene.beamspread.resolution = RESOLUTION
    matrix = matrix or Matrix()
    plane = add_plane(size=size, matrix=matrix @ (object_matrix or Matrix()), uvs=uvs, material=add_material())
    add_blocker(0.4, matrix)
    add_sun(45, azimuth_deg=25, matrix=matrix)
    return bake(plane)[0]


@pytest.fixture(scope="module")
def upright():
    """The plane as it is; tests compare with it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.beamspread.quality = "preview"
    bpy.context.scene.beamspread.use_indirect = False
    return scene_texture()


def test_light_spreads_where_it_travels(upright):
    """Sun towards +x and a little +y, wall at x = 0.2: shadow on its +x side, and light leaking from -x to +x."""
    height, width = upright.shape[:2]
    assert (width, height) == (64, 48)

    def value(x, y):
        return upright[int((y / SIZE[1] + 0.5) * height), int((x / SIZE[0] + 0.5) * width), 0]

    shadow, open_ground = value(0.4, 0.0), value(-0.5, 0.0)
    assert 0 < shadow < 0.5 * open_ground
    # Two mean free paths from the edge where light flows in and where it flows out; without its direction as bright.
    assert value(-0.9, -0.6) < 0.75 * value(0.9, -0.6)


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Rotation(math.radians(90), 4, "X"),
        Matrix.Translation((3, -2, 5)) @ Matrix.Rotation(math.radians(130), 4, Vector((1, 2, 3))),
        Matrix.Rotation(math.radians(180), 4, "Y"),
    ],
)
def test_whole_scene_turned(upright, matrix):
    assert scene_texture(matrix) == pytest.approx(upright, abs=TOLERANCE * upright.max())


@pytest.mark.parametrize("turns", [1, 2, 3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_uv_map_turned_and_mirrored(upright, turns, mirrored):
    uvs = np.array(SQUARE_UVS, float)
    expected = upright
    for _ in range(turns):
        # A quarter turn of the picture, counter-clockwise: (u, v) -> (1 - v, u).
        uvs = np.column_stack([1 - uvs[:, 1], uvs[:, 0]])
        # Rows run upward here, so that numpy's clockwise is the picture's counter-clockwise.
        expected = np.rot90(expected, -1)
    if mirrored:
        uvs[:, 0] = 1 - uvs[:, 0]
        expected = expected[:, ::-1]
    assert scene_texture(uvs=uvs) == pytest.approx(expected, abs=TOLERANCE * upright.max())


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -1, 1), (-1, -1, 1)])
def test_mirrored_object_mirrors_its_texture(upright, scale):
    """The mirrored object bakes the same light at the same position in the world; its UV map is mirrored, too."""
    expected = upright[:: scale[1], :: scale[0]]
    assert scene_texture(object_matrix=Matrix.Diagonal((*scale, 1))) == pytest.approx(
        expected, abs=TOLERANCE * upright.max()
    )


@pytest.mark.parametrize(
    "matrix",
    [
        Matrix.Translation((1000, -2000, 500)),
        Matrix.Diagonal((1e-3, 1e-3, 1e-3, 1)),
        Matrix.Diagonal((1e3, 1e3, 1e3, 1)) @ Matrix.Rotation(0.7, 4, Vector((1, 2, 3))),
    ],
)
def test_a_plane_never_shadows_itself(matrix):
    """Far from the origin, tiny and huge: an evenly lit plane stays even but for the loss at its border."""
    bpy.context.scene.beamspread.resolution = 64
    size = matrix.to_scale().x
    plane = add_plane(matrix=matrix, material=add_material(mean_free_path=(1e-4 * size,) * 3, anisotropy=0.0))
    add_sun(70, matrix=matrix.to_quaternion().to_matrix().to_4x4())
    (texture,) = bake(plane)
    red = texture[8:-8, 8:-8, 0]
    assert red.min() == pytest.approx(red.max(), rel=1e-3)


def test_non_uniform_scale(upright):
    texture = scene_texture(size=(1, 1), object_matrix=Matrix.Diagonal((SIZE[0], SIZE[1], 7, 1)))
    assert texture == pytest.approx(upright, abs=TOLERANCE * upright.max())


def test_flipped_face_takes_light_from_the_other_side(upright):
    """Negative z scale turns the normal down: the sun is behind it."""
    assert not scene_texture(object_matrix=Matrix.Diagonal((1, 1, -1, 1))).any()


def test_chart_in_a_corner(upright):
    """A half-size chart in a square texture shows the same image in its corner, at half the density."""
    uvs = np.array(SQUARE_UVS) * 0.5 + [0.5, 0.0]
    image = bpy.data.images.new("Atlas", 128, 96, float_buffer=True)
    plane = add_plane(size=SIZE, uvs=uvs, material=add_material(image=image))
    add_blocker(0.4)
    add_sun(45, azimuth_deg=25)
    bpy.context.scene.beamspread.margin = 0
    (texture,) = bake(plane)
    assert texture[:48, 64:] == pytest.approx(upright, abs=TOLERANCE * upright.max())
    assert not texture[48:].any()
    assert not texture[:, :64].any()


def test_turned_chart_in_the_texture(upright):
    """A chart turned by 30 degrees, its size kept, shows the light of the upright one."""
    angle = math.radians(30)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    corners = (np.array(SQUARE_UVS) - 0.5) * np.array(SIZE)
    uvs = corners @ turn.T / 3.2 + 0.5
    image = bpy.data.images.new("Turned", 102, 102, float_buffer=True)
    plane = add_plane(size=SIZE, uvs=uvs, material=add_material(image=image))
    add_blocker(0.4)
    add_sun(45, azimuth_deg=25)
    bpy.context.scene.beamspread.margin = 0
    (texture,) = bake(plane)
    # The chart has a part of the light of a texel across the edge.
    area, coverage = (3.2 / 102) ** 2, native.coverage(uvs * 102, np.array([4], np.uint32), 102, 102)
    assert coverage.sum() * area == pytest.approx(SIZE[0] * SIZE[1], rel=1e-5)
    whole, touched = ((texture * weight[..., None]).sum() * area for weight in (coverage > 0.999, coverage > 0))
    assert whole < upright.sum() * SIZE[0] * SIZE[1] / (64 * 48) < touched < 1.1 * whole
    # The centre of the wall's shadow through the same rotation: a texel's centre is at most a texel away.
    x, y = turn @ [0.4, 0.0]
    column, row = int((x / 3.2 + 0.5) * 102), int((y / 3.2 + 0.5) * 102)
    around = upright[23:26, 43:46, 0]
    assert around.min() < texture[row, column, 0] < around.max()
