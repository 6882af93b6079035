"""Irradiance and direction in Blender: against Cycles, and where the window, the engine and the batch keep them."""

import math
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.state import state
from beamspread.blender.ui import panels
from beamspread.core.native import native
from cycles_truth import TEXELS, add_receiver, cycles_irradiance
from mathutils import Matrix
from scenes import add_material, add_plane, add_sun, bake, messages_of, node_of, pixels, run_batch, select

SUN_ANGLE, SUN_AZIMUTH = 50, 35
# Images of data are packed as half floats: 11 bits.
HALF = 2**-11


def sun_travel(angle, azimuth):
    """Unit vector of travel of `add_sun`'s light over a plane in the world's axes."""
    theta, beta = math.radians(angle), math.radians(azimuth)
    return np.array([math.sin(theta) * math.cos(beta), math.sin(theta) * math.sin(beta), -math.cos(theta)])


@pytest.fixture(autouse=True)
def settings():
    state.forget()
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.margin, settings.use_indirect = 32, 0, False
    return settings


@pytest.mark.parametrize("uvs", ["square", "oblique"])
def test_irradiance_is_pi_times_the_diffuse_bake_of_cycles(uvs, settings, tmp_path):
    """The whole way through the batch, a wall's shadow included, to the tolerances of test_cycles_irradiance.py.

    Texels that the plane's border or a shadow's border crosses are left to the mean: Cycles samples the part inside.
    """
    charts = {
        "square": scenes.SQUARE_UVS,
        "oblique": ((np.array(scenes.SQUARE_UVS) - 0.5) @ [[0.5, 0.3], [-0.3, 0.5]]) + 0.5,
    }
    matrix = Matrix.Translation((0.3, -0.2, 0.5)) @ Matrix.Rotation(0.6, 4, (1, 2, 3))
    plane, image = add_receiver(matrix, charts[uvs])
    scenes.add_blocker(0.4, matrix)
    add_sun(SUN_ANGLE, SUN_AZIMUTH, 2.0, (1, 0.5, 0.25), matrix)
    expected = cycles_irradiance(plane, image)
    plane.data.materials[0] = add_material()
    settings.samples = 8
    (record,) = run_batch("--pass", "irradiance", "--resolution", TEXELS, "--output", tmp_path).bakes
    assert (record.output, record.lights, record.left_out, record.dark) == ("IRRADIANCE", 1, [], False)
    assert record.path == str(tmp_path / "Receiver_Medium_Irradiance.exr")
    ours = native.read_exr(record.path)[0]
    even = np.ones((TEXELS, TEXELS), bool)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            even &= np.isclose(np.roll(expected, (dy, dx), (0, 1)), expected, rtol=0.03).all(axis=-1)
    lit = even & (expected[..., 0] > 0.1)
    assert lit.sum() > 0.15 * TEXELS**2
    assert ours[lit] == pytest.approx(expected[lit], rel=0.01)
    # Cycles leaves out texels whose middle lies outside the plane, we don't.
    baked = expected.any(axis=-1)
    assert ours[baked].sum() == pytest.approx(expected.sum(), rel=3e-3)


def test_direction_follows_the_texture(settings):
    """A texture that is turned by a quarter against the plane: its columns run along -y, its rows along +x."""
    settings.output = "DIRECTION"
    turned = np.roll(np.array(scenes.SQUARE_UVS), 1, axis=0)
    plane = add_plane(uvs=turned, material=add_material())
    add_sun(SUN_ANGLE, SUN_AZIMUTH)
    select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    x, y, z = sun_travel(SUN_ANGLE, SUN_AZIMUTH)
    (corner_u,) = np.argwhere((turned == (1, 0)).all(axis=1))[0]
    along = (
        np.array(scenes.SQUARE_UVS)[corner_u]
        - np.array(scenes.SQUARE_UVS)[np.argwhere((turned == 0).all(axis=1))[0, 0]]
    )
    across = np.array([-along[1], along[0]])
    expected = [along @ (x, y), across @ (x, y), z]
    baked = pixels(bpy.data.images["Plane_Medium Direction"])
    assert baked == pytest.approx(np.broadcast_to(expected, baked.shape), abs=1e-6)


def test_passes_go_into_images_of_their_own_and_leave_the_nodes_alone(settings):
    plane = add_plane(material=add_material())
    sun = add_sun(SUN_ANGLE, SUN_AZIMUTH, strength=100.0)
    (luminance,) = bake(plane)
    node = node_of(plane.data.materials[0])
    sun.data.energy = 7000.0
    expected = {
        "IRRADIANCE": np.full(3, 7000 * math.cos(math.radians(SUN_ANGLE))),
        "DIRECTION": sun_travel(SUN_ANGLE, SUN_AZIMUTH),
    }
    for output, value in expected.items():
        settings.output = output
        assert np.array_equal(bake(plane)[0], luminance)
        image = bpy.data.images[f"Plane_Medium {output.capitalize()}"]
        assert image.is_float
        assert image.colorspace_settings.is_data
        shown = pixels(image)
        assert shown == pytest.approx(np.broadcast_to(value, shown.shape), rel=1e-5)
        image.reload()
        assert pixels(image) == pytest.approx(shown, rel=HALF)
    # Again, and of another size.
    node.image.scale(16, 8)
    bake(plane)
    assert sorted(one.name for one in bpy.data.images) == [
        f"Plane_Medium{end}" for end in ("", " Direction", " Irradiance")
    ]
    assert tuple(bpy.data.images["Plane_Medium Direction"].size) == (16, 8)
    assert tuple(bpy.data.images["Plane_Medium Irradiance"].size) == (32, 32)


def test_a_pass_alone_links_nothing(settings):
    settings.output = "IRRADIANCE"
    plane = add_plane(material=add_material())
    add_sun(0)
    select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    node = node_of(plane.data.materials[0])
    assert node.image is None
    assert not node.outputs["BSDF"].is_linked


def test_two_planes_share_a_pass_as_they_share_the_image(settings):
    settings.output = "IRRADIANCE"
    image = bpy.data.images.new("Atlas", 32, 16, float_buffer=True)
    material = add_material(image=image)
    left = add_plane("Left", uvs=[(0, 0), (0.5, 0), (0.5, 1), (0, 1)], material=material)
    right = add_plane("Right", uvs=[(0.5, 0), (1, 0), (1, 1), (0.5, 1)], material=material)
    right.location.x = 5
    add_sun(0, strength=3.0)
    bake(left, right)
    assert pixels(bpy.data.images["Atlas Irradiance"]) == pytest.approx(np.full((16, 32, 3), 3.0))
    assert not pixels(image).any()


def test_a_batch_leaves_the_nodes_own_file_to_luminance(settings, tmp_path):
    path = tmp_path / "own.exr"
    native.write_exr(str(path), np.full((8, 8, 3), 0.25, np.float32), ["R", "G", "B"])
    add_plane(material=add_material(image=bpy.data.images.load(str(path))))
    add_sun(SUN_ANGLE, SUN_AZIMUTH)
    settings.output_dir, settings.output = str(tmp_path / "out"), "DIRECTION"
    (record,) = run_batch().bakes
    assert (record.status, record.output) == ("written", "DIRECTION")
    assert record.path == str(tmp_path / "out" / "Plane_Medium_Direction.exr")
    stored = native.read_exr(record.path)[0]
    assert stored == pytest.approx(np.broadcast_to(sun_travel(SUN_ANGLE, SUN_AZIMUTH), stored.shape), abs=1e-6)
    assert (native.read_exr(str(path))[0] == 0.25).all()
    (record,) = run_batch("--pass", "luminance").bakes
    assert (record.path, record.output) == (str(path), "LUMINANCE")


def test_a_png_cant_hold_directions(tmp_path):
    add_plane(material=add_material())
    add_sun(0)
    (record,) = run_batch("--pass", "DIRECTION", "--format", "PNG", "--output", tmp_path).bakes
    assert record.status == "failed"
    assert "A PNG can't hold directions" in record.message
    assert list(tmp_path.iterdir()) == []


def with_active_image(material, image):
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.nodes.active = node


def test_blenders_own_bake_fills_the_active_image_unless_the_node_shows_it(settings):
    bpy.context.scene.render.engine = "BEAMSPREAD"
    settings.output = "IRRADIANCE"
    shown, other = (bpy.data.images.new(name, 16, 16, float_buffer=True) for name in ("Shown", "Other"))
    plane = add_plane(material=add_material(image=shown))
    add_sun(0, strength=3.0)
    select(plane)
    with_active_image(plane.data.materials[0], shown)
    messages_of(lambda: bpy.ops.object.bake(type="COMBINED"))
    assert "The image 'Shown' shows luminance in the Beamspread node" in state.lines()[0]
    assert not pixels(shown).any()
    state.forget()
    with_active_image(plane.data.materials[0], other)
    assert bpy.ops.object.bake(type="COMBINED") == {"FINISHED"}
    assert state.lines() == []
    assert pixels(other) == pytest.approx(np.full((16, 16, 3), 3.0))


class Layout:
    """Records the labels that a panel draws."""

    def __init__(self):
        self.properties, self.text = [], []

    def column(self, **_options):
        return self

    row = box = column

    def prop(self, _owner, name, **_options):
        self.properties.append(name)

    def label(self, text, **_options):
        self.text.append(text)

    def operator(self, *_arguments, **_options):
        return self


def drawn(*panels_drawn):
    layout = Layout()
    for panel in panels_drawn:
        panel.draw(SimpleNamespace(layout=layout), Context())
    return layout


class Context:
    """Characters that fit a panel 300 pixels wide; without a window, Blender has no scale of its interface."""

    region = SimpleNamespace(width=300, type="WINDOW")
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))

    def __getattr__(self, name):
        return getattr(bpy.context, name)


def test_the_panel_shows_the_settings_that_count(settings):
    plain, expert = panels.BEAMSPREAD_PT_render, panels.BEAMSPREAD_PT_expert
    select(add_plane(material=add_material()))
    assert {"output", "use_indirect"} <= set(drawn(plain).properties)
    assert {"solver", "quality", "samples", "margin"} <= set(drawn(expert).properties)
    assert panels.BEAMSPREAD_PT_samples.poll(bpy.context)
    assert "distributions" in drawn(panels.BEAMSPREAD_PT_samples).properties
    settings.output = "IRRADIANCE"
    assert not panels.BEAMSPREAD_PT_samples.poll(bpy.context)
    assert {"output", "use_indirect", "samples"} <= set(drawn(plain, expert).properties)
    assert not {"solver", "distributions", "quality"} & set(drawn(plain, expert).properties)
