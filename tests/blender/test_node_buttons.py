"""The node's buttons, and the material's output after a first bake."""

import math
import subprocess
import sys

import bpy
import numpy as np
import pytest
from beamspread.blender import compat, popup
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.node import draw, principled
from beamspread.blender.node.buttons import BEAMSPREAD_OT_from_principled
from beamspread.core.material import Walk, ior_of_reflectance, mean_free_path
from scenes import (
    add_camera,
    add_material,
    add_plane,
    add_sun,
    bake,
    known_image,
    messages_of,
    node_of,
    pixels,
    reopen,
    select,
)

IS_BEFORE_4 = bpy.app.version < (4, 0, 0)


def surface_of(material):
    return material.node_tree.get_output_node("ALL").inputs["Surface"].links[0].from_node


def principled_of(material):
    return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")


def set_input(node, value, *names):
    next(node.inputs[name] for name in names if name in node.inputs).default_value = value


@pytest.fixture
def plane():
    bpy.context.scene.beamspread.resolution = 16
    add_sun(0)
    obj = add_plane(material=add_material(shader=True))
    select(obj)
    return obj


class TestPreset:
    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("albedo", (0.5, 0.5, 0.5)),
            ("mean_free_path", (0.1, 0.1, 0.1)),
            ("anisotropy", 0.3),
            ("ior", 1.2),
            ("base_color", (0.5, 0.5, 0.5)),
            ("path_length", 0.1),
            ("path_color", (1.0, 0.5, 0.5)),
        ],
    )
    def test_becomes_custom_by_editing(self, name, value):
        node = node_of(add_material())
        node.preset = "marble"
        assert node.preset == "marble"
        setattr(node, name, value)
        assert node.preset == "CUSTOM"

    def test_stays_where_nothing_of_it_is_edited(self, tmp_path):
        material = add_material()
        material.use_fake_user = True
        node = node_of(material)
        node.preset = "marble"
        node.thickness, node.image = 0.1, bpy.data.images.new("Baked", 4, 4)
        node.preset = "cream"
        assert node.preset == "cream"
        reopen(tmp_path)
        assert node_of(bpy.data.materials["Medium"]).preset == "cream"

    def test_comes_back_by_undo(self):
        add_material().use_fake_user = True
        node_of(bpy.data.materials["Medium"]).preset = "marble"
        bpy.ops.ed.undo_push(message="preset")
        node_of(bpy.data.materials["Medium"]).ior = 1.2
        bpy.ops.ed.undo_push(message="edited")
        bpy.ops.ed.undo()
        assert node_of(bpy.data.materials["Medium"]).preset == "marble"
        bpy.ops.ed.redo()
        assert node_of(bpy.data.materials["Medium"]).preset == "CUSTOM"


class TestFormerShader:
    def test_first_bake_keeps_it_says_so_and_gives_it_back(self, plane, capfd, tmp_path):
        material = plane.data.materials[0]
        bake(plane)
        said = capfd.readouterr().out
        sentence = "'Medium' now shows the bake."
        assert f"Info: {sentence}" in said
        row = next(iter(state.rows.values()))
        for _ in range(2):  # as the bake has said it, and as its image remembers it
            assert row.status == Status.BAKED
            assert sentence in row.messages[0].text
            stale.refresh(bpy.context)
            row = next(iter(state.rows.values()))
        assert surface_of(material) == node_of(material)
        reopen(tmp_path)
        plane, material = bpy.data.objects["Plane"], bpy.data.materials["Medium"]
        select(plane)
        assert bpy.ops.beamspread.toggle_result() == {"FINISHED"}
        assert surface_of(material) == principled_of(material)
        capfd.readouterr()
        bake(plane)
        assert "Show Baked Result" in capfd.readouterr().out
        assert surface_of(material) == principled_of(material), "the choice stays"
        assert bpy.ops.beamspread.toggle_result() == {"FINISHED"}
        assert surface_of(material) == node_of(material)
        capfd.readouterr()
        bake(plane)
        assert "shows" not in capfd.readouterr().out

    def test_a_node_in_use_is_left_alone(self, plane):
        material = plane.data.materials[0]
        bsdf = principled_of(material)
        material.node_tree.links.new(bsdf.inputs["Base Color"], node_of(material).outputs["Color"])
        bake(plane)
        assert surface_of(material) == bsdf

    def test_one_that_was_deleted_is_an_error(self, plane):
        bake(plane)
        material = plane.data.materials[0]
        material.node_tree.nodes.remove(principled_of(material))
        assert "is gone" in messages_of(bpy.ops.beamspread.toggle_result)

    def test_without_a_node_the_buttons_are_off(self):
        add_plane(material=bpy.data.materials.new("Plain"))
        assert not bpy.ops.beamspread.toggle_result.poll()
        assert not bpy.ops.beamspread.from_principled.poll()


class TestFromPrincipled:
    @pytest.fixture
    def bsdf(self, plane):
        bsdf = principled_of(plane.data.materials[0])
        set_input(bsdf, 0.5, "Subsurface Weight", "Subsurface")
        set_input(bsdf, (0.8, 0.4, 0.2), "Subsurface Radius")
        for name in ("Base Color", "Subsurface Color"):
            if name in bsdf.inputs:
                bsdf.inputs[name].default_value = (0.7, 0.5, 0.3, 1)
        set_input(bsdf, 0.3, "Roughness")
        set_input(bsdf, 0.5, "Specular IOR Level", "Specular")
        if IS_BEFORE_4:
            bsdf.subsurface_method = "RANDOM_WALK_FIXED_RADIUS"
        else:
            set_input(bsdf, 0.05, "Subsurface Scale")
            set_input(bsdf, 1.5, "IOR")
            bsdf.subsurface_method = "RANDOM_WALK_LEGACY" if bpy.app.version >= (5, 2, 0) else "RANDOM_WALK"
        return bsdf

    def scale(self):
        return 0.5 if IS_BEFORE_4 else 0.05

    def test_values(self, plane, bsdf):
        assert bpy.ops.beamspread.from_principled() == {"FINISHED"}
        node = node_of(plane.data.materials[0])
        assert (node.color_mode, node.preset) == ("BASE_COLOR", "CUSTOM")
        assert list(node.base_color) == pytest.approx([0.7, 0.5, 0.3])
        expected = [radius * self.scale() / (4 * math.pi) for radius in (0.8, 0.4, 0.2)]
        assert list(node.mean_free_path) == pytest.approx(expected)
        assert node.anisotropy == 0
        assert node.ior == pytest.approx(1.5)
        assert node.inputs["Roughness"].default_value == pytest.approx(0.3)

    def test_radius_that_depends_on_the_color_and_anisotropy(self, plane, bsdf):
        bsdf.subsurface_method = "RANDOM_WALK" if IS_BEFORE_4 else "RANDOM_WALK_SKIN"
        bsdf.inputs["Subsurface Anisotropy"].default_value = 0.5
        bsdf.inputs["Subsurface IOR"].default_value = 1.4
        bpy.ops.beamspread.from_principled()
        node = node_of(plane.data.materials[0])
        lengths = [
            mean_free_path(radius * self.scale(), Walk.SKIN, color, 1.4, 0.5)
            for radius, color in zip((0.8, 0.4, 0.2), (0.7, 0.5, 0.3))
        ]
        assert list(node.mean_free_path) == pytest.approx(lengths, rel=1e-5)
        assert node.anisotropy == 0.5

    def test_links(self, plane, bsdf):
        material = plane.data.materials[0]
        tree, node = material.node_tree, node_of(material)
        image, bump = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
        for name in ("Base Color", "Subsurface Color"):
            if name in bsdf.inputs:
                tree.links.new(bsdf.inputs[name], image.outputs["Color"])
        tree.links.new(bsdf.inputs["Roughness"], image.outputs["Alpha"])
        tree.links.new(bsdf.inputs["Normal"], bump.outputs["Normal"])
        bpy.ops.beamspread.from_principled()
        sources = [node.inputs[name].links[0].from_socket for name in ("Base Color", "Roughness", "Normal")]
        assert sources == [image.outputs["Color"], image.outputs["Alpha"], bump.outputs["Normal"]]
        assert bsdf.inputs["Normal"].is_linked
        assert node.has_texture()

    def test_after_a_bake_it_is_the_former_shader(self, plane, bsdf):
        bake(plane)
        material = plane.data.materials[0]
        other = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
        assert principled.find_shader(node_of(material)) == bsdf != other

    def test_without_subsurface_the_mean_free_path_stays_and_it_is_said(self, plane, bsdf, capfd, monkeypatch):
        set_input(bsdf, 0.0, "Subsurface Weight", "Subsurface")
        bsdf.inputs["Metallic"].default_value = 1.0
        shown = []
        monkeypatch.setattr(popup, "show_soon", lambda title, sentences: shown.append((title, sentences)))
        bpy.ops.beamspread.from_principled()
        assert not shown
        monkeypatch.setattr(BEAMSPREAD_OT_from_principled, "_in_window", True)
        bpy.ops.beamspread.from_principled()
        said = capfd.readouterr().out
        assert "no subsurface scattering" in said
        assert "no Metallic" in said
        ((title, (of_path, of_metal)),) = shown
        assert bsdf.name in title
        assert "no subsurface scattering" in of_path
        assert "no Metallic" in of_metal
        assert list(node_of(plane.data.materials[0]).mean_free_path) == pytest.approx([0.05] * 3)

    def test_material_without_one(self, plane):
        material = plane.data.materials[0]
        material.node_tree.nodes.remove(principled_of(material))
        assert "no Principled BSDF" in messages_of(bpy.ops.beamspread.from_principled)


# Mean free path over radius times scale at color .5 and IOR 1.4, by method, and the anisotropy that is copied of .6.
# From Cycles' sources (bssrdf_setup_radius, subsurface_random_walk_remap), with numbers worked out by hand:
# 1 / (4 pi) = .0795775; the dipole of Jensen et al. 2001 with a reflectance of .5 has 1 - alpha' = .02237.
FIXED, SKIN, FREE_PATH = 0.0795775, 0.25906, 1.0
PATHS = {
    "BURLEY": (FIXED, 0.0),
    "RANDOM_WALK_FIXED_RADIUS": (0.4 * FIXED, 0.6),
    "RANDOM_WALK_LEGACY": (0.4 * FIXED, 0.6),
    "RANDOM_WALK_SKIN": (0.4 * SKIN, 0.6),
    "RANDOM_WALK": (0.4 * SKIN, 0.6) if IS_BEFORE_4 else (0.4 * FIXED, 0.6),
}
if bpy.app.version >= (5, 2, 0):
    PATHS["RANDOM_WALK"] = (FREE_PATH, 0.6)
KINDS = {"BsdfPrincipled": "subsurface_method", "SubsurfaceScattering": "falloff"}


def methods_of(kind):
    """All methods that this Blender has."""
    node = getattr(bpy.types, f"ShaderNode{kind}")
    return [(kind, item.identifier) for item in node.bl_rna.properties[KINDS[kind]].enum_items]


class TestMethods:
    """Each method of each Blender."""

    def shader(self, plane, kind, method="BURLEY"):
        tree = plane.data.materials[0].node_tree
        tree.nodes.remove(principled_of(plane.data.materials[0]))
        shader = tree.nodes.new(f"ShaderNode{kind}")
        setattr(shader, KINDS[kind], method)
        for name, value in {
            "Color": (0.5, 0.5, 0.5, 1),
            "Base Color": (0.5, 0.5, 0.5, 1),
            "Subsurface Color": (0.5, 0.5, 0.5, 1),
            "Subsurface Weight": 1.0,
            "Subsurface": 1.0,
            "IOR": 1.4,
            "Subsurface IOR": 1.4,
            "Subsurface Anisotropy": 0.6,  # from 4.0 on Burley's profile has none
            "Anisotropy": 0.6,
        }.items():
            if name in shader.inputs:
                shader.inputs[name].default_value = value
        set_input(shader, (0.3, 0.2, 0.1), "Subsurface Radius", "Radius")
        for name in ("Subsurface Scale", "Scale"):
            if name in shader.inputs:
                shader.inputs[name].default_value = 0.1
        return shader

    @pytest.mark.parametrize(("kind", "method"), [pair for kind in KINDS for pair in methods_of(kind)])
    def test_path_and_anisotropy(self, plane, kind, method):
        """Within 1 %: Cycles finds alpha' in 12 steps, and the dipole's number above has 3 digits."""
        shader, node = self.shader(plane, kind, method), node_of(plane.data.materials[0])
        scale = 0.1 if any(name in shader.inputs for name in ("Subsurface Scale", "Scale")) else 1.0
        assert bpy.ops.beamspread.from_principled() == {"FINISHED"}
        factor, anisotropy = PATHS[method]
        expected = [factor * scale * radius for radius in (0.3, 0.2, 0.1)]
        assert list(node.mean_free_path) == pytest.approx(expected, rel=0.01)
        assert node.anisotropy == pytest.approx(anisotropy)
        assert list(node.base_color) == pytest.approx([0.5] * 3)

    def test_one_that_nobody_knows_leaves_the_path_and_says_so(self, plane, monkeypatch, capfd):
        self.shader(plane, "BsdfPrincipled")
        monkeypatch.setattr(compat, "subsurface_walk", lambda *_: None)
        bpy.ops.beamspread.from_principled()
        assert "method 'BURLEY' of 'Principled BSDF' is not known" in capfd.readouterr().out
        assert list(node_of(plane.data.materials[0]).mean_free_path) == pytest.approx([0.05] * 3)

    def test_a_subsurface_scattering_has_no_coat_and_gives_its_texture_and_normal(self, plane, capfd):
        shader, tree = self.shader(plane, "SubsurfaceScattering"), plane.data.materials[0].node_tree
        node = node_of(plane.data.materials[0])
        image, bump = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(shader.inputs["Color"], image.outputs["Color"])
        tree.links.new(shader.inputs["Normal"], bump.outputs["Normal"])
        bpy.ops.beamspread.from_principled()
        assert node.ior == 1
        assert "no glossy coat" in capfd.readouterr().out
        sources = [node.inputs[name].links[0].from_node for name in ("Base Color", "Normal")]
        assert sources == [image, bump]

    def test_one_that_scatters_comes_before_one_that_does_not(self, plane):
        principled_of(plane.data.materials[0])  # weight 0
        shader = plane.data.materials[0].node_tree.nodes.new("ShaderNodeSubsurfaceScattering")
        for link in list(plane.data.materials[0].node_tree.links):
            plane.data.materials[0].node_tree.links.remove(link)
        assert principled.find_shader(node_of(plane.data.materials[0])) == shader


class TestLostInputs:
    @pytest.fixture
    def bsdf(self, plane):
        bsdf = principled_of(plane.data.materials[0])
        set_input(bsdf, 1.0, "Subsurface Weight", "Subsurface")
        return bsdf

    def test_nothing_is_lost_of_a_new_one(self, bsdf):
        assert principled.lost_inputs(bsdf) == []

    @pytest.mark.parametrize(
        ("said", "value", "names"),
        [
            ("Alpha", 0.5, ["Alpha"]),
            ("Metallic", 1.0, ["Metallic"]),
            ("Anisotropic", 0.5, ["Anisotropic"]),
            ("Specular Tint", 0.5 if IS_BEFORE_4 else (1, 0.5, 0.5, 1), ["Specular Tint"]),
            ("Emission", (0.1, 0, 0, 1) if IS_BEFORE_4 else 0.5, ["Emission" if IS_BEFORE_4 else "Emission Strength"]),
            ("Coat", 0.5, ["Coat Weight", "Clearcoat"]),
            ("Sheen", 0.5, ["Sheen Weight", "Sheen"]),
            ("Transmission", 0.5, ["Transmission Weight", "Transmission"]),
            ("Thin Film", 100.0, ["Thin Film Thickness"]),
            ("Thin Wall", True, ["Thin Wall"]),
            ("Diffuse Roughness", 0.5, ["Diffuse Roughness"]),
        ],
    )
    def test_each_is_named(self, bsdf, capfd, said, value, names):
        if not any(name in bsdf.inputs for name in names):
            pytest.skip("this Blender has no such input")
        set_input(bsdf, value, *names)
        bpy.ops.beamspread.from_principled()
        found = capfd.readouterr().out
        assert any(f"The node has no {name}" in found for name in (said, *names))

    def test_a_texture_counts_too(self, bsdf):
        tree = bsdf.id_data
        tree.links.new(bsdf.inputs["Alpha"], tree.nodes.new("ShaderNodeTexImage").outputs["Alpha"])
        assert principled.lost_inputs(bsdf) == ["Alpha"]

    @pytest.mark.skipif(IS_BEFORE_4, reason="the weight scaled the radius, and there was no diffuse share")
    def test_a_weight_between_0_and_1_loses_the_diffuse_share(self, bsdf, capfd):
        bsdf.inputs["Subsurface Weight"].default_value = 0.25
        bpy.ops.beamspread.from_principled()
        assert "its diffuse share of 75% is lost" in capfd.readouterr().out
        bsdf.inputs["Subsurface Weight"].default_value = 1.0
        bpy.ops.beamspread.from_principled()
        assert "share" not in capfd.readouterr().out

    def test_a_texture_of_the_weight_is_said(self, bsdf, capfd):
        tree = bsdf.id_data
        name = "Subsurface" if IS_BEFORE_4 else "Subsurface Weight"
        tree.links.new(bsdf.inputs[name], tree.nodes.new("ShaderNodeTexImage").outputs["Alpha"])
        bpy.ops.beamspread.from_principled()
        assert "it counts as 1" in capfd.readouterr().out

    @pytest.mark.skipif(not IS_BEFORE_4, reason="later ones have one color")
    def test_two_colors_are_mixed_by_the_weight(self, plane, bsdf, capfd):
        bsdf.inputs["Subsurface"].default_value = 0.25
        bsdf.inputs["Base Color"].default_value = (0.8, 0.4, 0.0, 1)
        bsdf.inputs["Subsurface Color"].default_value = (0.0, 0.8, 0.4, 1)
        bpy.ops.beamspread.from_principled()
        assert list(node_of(plane.data.materials[0]).base_color) == pytest.approx([0.6, 0.5, 0.1])
        tree = bsdf.id_data
        tree.links.new(bsdf.inputs["Base Color"], tree.nodes.new("ShaderNodeTexImage").outputs["Color"])
        bpy.ops.beamspread.from_principled()
        assert "Subsurface Color is ignored" in capfd.readouterr().out


def test_specular_of_half_is_an_ior_of_1_5():
    assert ior_of_reflectance(0.08 * 0.5) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("lengths", "text"),
    [
        ((4e-4, 4e-4, 4e-4), "0.4 mm"),
        ((2e-5, 1e-5, 5e-6), "20, 10, 5 µm"),
        ((1.592e-3, 3.18e-4, 1.59e-4), "1.59, 0.318, 0.159 mm"),
        ((0.05, 0.2, 0.1), "5, 20, 10 cm"),
        ((2.0, 0.5, 0.0), "2, 0.5, 0 m"),
        ((0.0, 0.0, 0.0), "0 µm"),
    ],
)
def test_lengths_are_readable(lengths, text):
    assert draw.readable_lengths(lengths) == text


RENDERED_WITHOUT_ADDON = """
import bpy, sys
path, picture = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.open_mainfile(filepath=path)
assert bpy.types.Node.bl_rna_get_subclass_py("BeamspreadNode") is None
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 4, False
scene.render.resolution_x = scene.render.resolution_y = 8
scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", picture
bpy.ops.render.render(write_still=True)
"""


class TestPlainNodes:
    @pytest.fixture
    def baked(self, plane):
        """Seen from above, with an image of a known colour that is packed."""
        node = node_of(plane.data.materials[0])
        node.image = known_image()
        node.image.pack()
        add_camera()
        bpy.data.objects["Sun"].hide_render = True
        material = plane.data.materials[0]
        surface = material.node_tree.get_output_node("ALL").inputs["Surface"]
        material.node_tree.links.new(surface, node.outputs["BSDF"])
        return plane

    def render_without_add_on(self, tmp_path):
        path, script, picture = (tmp_path / name for name in ("farm.blend", "script.py", "farm.exr"))
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        script.write_text(RENDERED_WITHOUT_ADDON)
        program = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
        command = [*program, str(script)] if bpy.app.binary_path else [sys.executable, str(script)]
        subprocess.run([*command, "--", str(path), str(picture)], capture_output=True, text=True, check=True)
        return pixels(bpy.data.images.load(str(picture)))[4, 4]

    def test_a_blender_without_the_add_on_shows_them_alone(self, baked, tmp_path):
        assert np.array_equal(self.render_without_add_on(tmp_path), [0, 0, 0])
        assert bpy.ops.beamspread.make_plain(kind="GROUP") == {"FINISHED"}
        assert self.render_without_add_on(tmp_path) == pytest.approx([0.25, 0.5, 0.75], abs=1e-3)

    def test_a_bake_after_them_changes_both_and_they_can_go_again(self, baked):
        material = baked.data.materials[0]
        bpy.ops.beamspread.make_plain(kind="GROUP")
        plain = surface_of(material)
        assert plain.bl_idname == "ShaderNodeGroup"
        node = node_of(material)
        node.image, node.ior = None, 1.3
        bake(baked)
        assert node.image.name == plain.node_tree.nodes["Image"].image.name
        assert plain.node_tree.nodes["Fresnel"].inputs["IOR"].default_value == pytest.approx(1.3)
        assert surface_of(material) == plain
        bpy.ops.beamspread.make_plain(kind="GROUP")
        assert surface_of(material) == node
        assert "ShaderNodeGroup" not in [one.bl_idname for one in material.node_tree.nodes]

    def test_copies_of_the_material_part(self, baked):
        bpy.ops.beamspread.make_plain(kind="GROUP")
        material = baked.data.materials[0]
        copy = material.copy()
        node_of(copy).ior = 1.6
        iors = [surface_of(one).node_tree.nodes["Fresnel"].inputs["IOR"].default_value for one in (material, copy)]
        assert iors == pytest.approx([1.0, 1.6])
