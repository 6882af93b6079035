"""A package whose native module is missing or useless: one clear message, no traceback, and nothing lost."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import beamspread
import bpy
import pytest
from scenes import add_material, add_plane, add_sun, bake, blender_command, node_of, pixels

from spoilt_modules import empty, remove

IN_BLENDER = """
import json, sys
sys.path.insert(0, {folder!r})
import bpy, beamspread
beamspread.register()
try:
    bpy.ops.beamspread.bake()
except RuntimeError as error:
    print("MESSAGE", error)
bpy.ops.wm.open_mainfile(filepath={scene!r})
material = bpy.data.materials["Medium"]
node = next(node for node in material.node_tree.nodes if node.bl_idname == "BeamspreadNode")
shown = node.node_tree.nodes["Image"].image
surface = material.node_tree.get_output_node("ALL").inputs["Surface"]
print("SEEN", json.dumps(dict(
    type=type(node).__name__, image=node.image.name, shown=shown.name,
    size=list(shown.size), pixels=list(shown.pixels)[:8], linked=surface.links[0].from_node == node)))
copied = material.copy()
bpy.data.materials.remove(copied)
try:
    bpy.ops.beamspread.bake(objects="ALL")
except RuntimeError as error:
    print("AGAIN", error)
bpy.ops.wm.save_as_mainfile(filepath={scene!r})
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
beamspread.unregister()
"""


@pytest.fixture(params=[remove, empty], ids=lambda spoil: spoil.__name__)
def spoilt(request, tmp_path):
    """Folder that holds the package with a useless module, and words of the message."""
    source = Path(beamspread.__file__).parent
    shutil.copytree(source, tmp_path / "beamspread", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path, request.param(tmp_path / "beamspread")


@pytest.fixture
def incomplete(tmp_path):
    """Folder that holds the package without `_native`."""
    source = Path(beamspread.__file__).parent
    shutil.copytree(source, tmp_path / "beamspread", ignore=shutil.ignore_patterns("_native*", "__pycache__"))
    return tmp_path


def baked_scene(path):
    """Save a file with a baked, packed image; the pixels of the image."""
    material = add_material(ior=1.3, linked=True)
    plane = add_plane(material=material)
    add_sun(0)
    bpy.context.scene.beamspread.resolution = 16
    bake(plane)
    node_of(material).anisotropy = 0.7
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return pixels(node_of(material).image)


def test_the_add_on_registers_with_a_message_and_loses_nothing(spoilt):
    folder, cause = spoilt
    scene = folder / "baked.blend"
    before = baked_scene(scene)
    assert before.max() > 0
    script = folder / "script.py"
    script.write_text(IN_BLENDER.format(folder=str(folder), scene=str(scene)))
    done = subprocess.run(blender_command(script), capture_output=True, text=True, timeout=120)
    output = done.stdout + done.stderr
    assert "Traceback" not in output
    (message,) = [line for line in output.splitlines() if line.startswith("MESSAGE")]
    assert message.startswith("MESSAGE Error: beamspread has no working native module for Python")
    # The log has the message, too.
    (logged,) = [line for line in done.stderr.splitlines() if line.startswith("Beamspread: ")]
    for text in (message, logged):
        assert cause in text
        assert f"Needed: _native.cpython-{sys.version_info[0]}{sys.version_info[1]}-" in text
        assert "Install the zip of Beamspread" in text
    assert "AGAIN Error: beamspread has no working native module" in output
    (seen,) = [json.loads(line[5:]) for line in output.splitlines() if line.startswith("SEEN ")]
    assert seen["type"] == "BeamspreadNode"
    assert seen["linked"]
    assert (seen["shown"], seen["size"]) == (seen["image"], [16, 16])
    assert max(seen["pixels"][:3]) > 0
    # With the module, everything is as before.
    bpy.ops.wm.open_mainfile(filepath=str(scene))
    node = node_of(bpy.data.materials["Medium"])
    assert (node.ior, node.anisotropy) == (pytest.approx(1.3), pytest.approx(0.7))
    assert (pixels(node.image) == before).all()


def test_a_batch_ends_with_the_message(incomplete):
    add_plane(material=add_material())
    scene = incomplete / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(scene))
    command = blender_command(incomplete / "beamspread" / "batch.py", scene=scene)
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "no working native module" in done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_outside_blender_the_import_fails_with_that_message(incomplete):
    code = f"import sys; sys.path.insert(0, {str(incomplete)!r}); import beamspread"
    python = sys.executable if not bpy.app.binary_path else shutil.which("python3")
    done = subprocess.run([python, "-S", "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode != 0
    assert "ImportError: beamspread has no working native module for Python" in done.stderr
