"""Textures of a material whose pixels change make its bake out of date."""

import bpy
import pytest
from beamspread.blender.jobs.state import Status
from scenes import bake, node_of
from standings import baked_plane, row, see_through, update


@pytest.fixture
def plane():
    return baked_plane()


def add_texture(material, socket, folder):
    """An image file of one color at an input."""
    image = bpy.data.images.new("Veil", 8, 8)
    image.filepath_raw, image.file_format = str(folder / "veil.png"), "PNG"
    image.save()
    image.source = "FILE"
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    material.node_tree.links.new(socket, node.outputs["Color"])
    return image


def paint(image, value):
    image.pixels.foreach_set([value] * len(image.pixels))
    image.update()
    update()


@pytest.mark.parametrize("kind", ["alpha", "base color"])
def test_pixels_of_textures(plane, kind, tmp_path):
    if kind == "alpha":
        see_through(plane)
        material = bpy.data.materials["Veil"]
        image = add_texture(material, material.node_tree.nodes["Principled BSDF"].inputs["Alpha"], tmp_path)
    else:
        image = add_texture(plane.data.materials[0], node_of(plane.data.materials[0]).inputs["Base Color"], tmp_path)
    bake(plane)
    assert row().status == Status.BAKED
    paint(image, 0.5)
    assert "textures" in row().messages[0].text
    bake(plane)
    assert row().status == Status.BAKED
    paint(image, 0.7)  # not saved between, and dirty before as after
    assert "textures" in row().messages[0].text
    image.save()
    bake(plane)
    assert row().status == Status.BAKED
    (tmp_path / "veil.png").write_bytes((tmp_path / "veil.png").read_bytes()[:-1] + b"x")  # by another program
    assert "textures" in row().messages[0].text
    image.pack()
    update()
    bake(plane)
    assert row().status == Status.BAKED


def test_a_copy_of_a_file_is_no_other_texture(plane, tmp_path):
    image = add_texture(plane.data.materials[0], node_of(plane.data.materials[0]).inputs["Base Color"], tmp_path)
    bake(plane)
    content = (tmp_path / "veil.png").read_bytes()
    (tmp_path / "veil.png").unlink()
    (tmp_path / "veil.png").write_bytes(content)
    assert not image.is_dirty
    assert row().status == Status.BAKED
