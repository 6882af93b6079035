"""A job in a file: another process without Blender computes the same from it."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import beamspread
import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender import compat
from beamspread.blender.jobs.run.bake_plan import prepare_scene
from beamspread.blender.node.find import find_targets
from beamspread.core.bake.bounced import BouncedLight
from instance_scenes import SKEWED, add_instancer
from mathutils import Matrix

RUN = """
import pickle, sys
from pathlib import Path
import numpy as np
job = pickle.loads(Path(sys.argv[1]).read_bytes()).run()
assert "bpy" not in sys.modules
np.save(sys.argv[2], job.texture)
"""


def add_nodes(tree, *kinds):
    """Nodes of these kinds in a tree without others."""
    tree.nodes.clear()
    return [tree.nodes.new(f"ShaderNode{kind}") for kind in kinds]


def make_image(name, height, width, **properties):
    image = bpy.data.images.new(name, width, height, alpha=True, float_buffer=True)
    image.pixels.foreach_set(np.random.default_rng(3).random(width * height * 4, np.float32))
    for key, value in properties.items():
        setattr(image, key, value)
    image.pack()
    return image


def add_leaf(height):
    """A card whose texture lets light through, in a collection that stands in the scene twice."""
    material = bpy.data.materials.new("Leaf")
    compat.use_nodes(material)
    tree = material.node_tree
    texture, clear, solid, mix, output = add_nodes(
        tree, "TexImage", "BsdfTransparent", "BsdfDiffuse", "MixShader", "OutputMaterial"
    )
    texture.image = make_image("Leaf", 8, 16)
    for socket, source in ((mix.inputs[0], texture.outputs["Alpha"]), (mix.inputs[1], clear.outputs[0])):
        tree.links.new(socket, source)
    tree.links.new(clear.inputs["Color"], texture.outputs["Color"])
    tree.links.new(mix.inputs[2], solid.outputs[0])
    tree.links.new(output.inputs["Surface"], mix.outputs[0])
    card = scenes.add_plane("Leaf", (0.5, 0.5), Matrix.Translation((0, 0, height)), material=material)
    collection = bpy.data.collections.new("Leaves")
    bpy.context.scene.collection.objects.unlink(card)
    collection.objects.link(card)
    add_instancer(collection, Matrix.Translation((0.2, 0.1, 0.1)), "First")
    add_instancer(collection, Matrix.Translation((-0.8, -1, 0)) @ SKEWED, "Second")


def add_lights():
    scenes.add_sun(30)
    area = bpy.data.lights.new("Area", "AREA")
    area.energy, area.size = 50.0, 0.4
    lamp = bpy.data.objects.new("Area", area)
    lamp.location = (0.5, -0.4, 1.5)
    bpy.context.collection.objects.link(lamp)
    world = bpy.data.worlds.new("World")
    compat.use_nodes(world)
    bpy.context.scene.world = world
    sky, background, output = add_nodes(world.node_tree, "TexEnvironment", "Background", "OutputWorld")
    sky.image = make_image("Sky", 16, 32)
    world.node_tree.links.new(background.inputs["Color"], sky.outputs["Color"])
    world.node_tree.links.new(output.inputs["Surface"], background.outputs[0])
    glow = bpy.data.materials.new("Glow")
    compat.use_nodes(glow)
    emission, output = add_nodes(glow.node_tree, "Emission", "OutputMaterial")
    emission.inputs["Strength"].default_value = 5.0
    glow.node_tree.links.new(output.inputs["Surface"], emission.outputs[0])
    scenes.add_plane("Panel", (0.3, 0.3), Matrix.Translation((-0.6, 0.5, 0.8)), material=glow)


@pytest.mark.parametrize("output", ["LUMINANCE", "IRRADIANCE"])
def test_a_process_without_blender_gets_the_same_bits(output, tmp_path):
    add_lights()
    add_leaf(0.5)
    material = scenes.add_material(ior=1.4, thickness=0.3)
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = make_image("Stone", 8, 8)
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], texture.outputs["Color"])
    plane = scenes.add_plane(material=material)
    scenes.add_blocker(0.4)
    bpy.context.view_layer.update()
    settings = bpy.context.scene.beamspread
    settings.output, settings.quality, settings.use_indirect = output, "preview", True
    (bake,) = prepare_scene(bpy.context, find_targets([plane]), settings.for_bake(), 48)
    assert not bake.error
    illumination = bake.job.illumination
    assert len(illumination.lights) == 4
    assert illumination.triangle_count == 2 + 2 * 2 + 2 + 2  # plane, leaves, wall, panel
    assert any(isinstance(step, BouncedLight) for step in bake.job.steps)
    here = bake.job.run()  # its hierarchies stay in this process
    file, result = tmp_path / "bake.job", tmp_path / "texture.npy"
    file.write_bytes(pickle.dumps(bake.job))
    python = sys.executable if not bpy.app.binary_path else shutil.which("python3")
    environment = os.environ | {"PYTHONPATH": str(Path(beamspread.__file__).parent.parent)}
    command = [python, "-c", RUN, str(file), str(result)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)
    assert done.returncode == 0, done.stderr
    assert here.texture.std() > 0.1 * here.texture.mean() > 0
    np.testing.assert_array_equal(np.load(result), here.texture)
    assert pickle.loads(pickle.dumps(here)).messages() == here.messages()
