"""A copy of the package without its native module: one clear message, never a traceback."""

import shutil
import subprocess
import sys
from pathlib import Path

import beamspread
import bpy
import pytest
from scenes import add_material, add_plane

IN_BLENDER = """
import sys
sys.path.insert(0, {folder!r})
import bpy, beamspread
beamspread.register()
try:
    bpy.ops.beamspread.bake()
except RuntimeError as error:
    print("MESSAGE", error)
beamspread.unregister()
"""


@pytest.fixture
def incomplete(tmp_path):
    """Folder that holds the package without `_native`."""
    source = Path(beamspread.__file__).parent
    shutil.copytree(source, tmp_path / "beamspread", ignore=shutil.ignore_patterns("_native*", "__pycache__"))
    return tmp_path


def blender_command(script, *arguments, scene=None):
    """Command line of a fresh Blender, or of Python where Blender is a module."""
    if bpy.app.binary_path:
        opened = [str(scene)] if scene else []
        return [bpy.app.binary_path, "-b", "--factory-startup", *opened, "--python", str(script), "--", *arguments]
    return [sys.executable, str(script), *([str(scene)] if scene else []), *arguments]


def test_add_on_registers_and_says_what_is_missing(incomplete):
    script = incomplete / "script.py"
    script.write_text(IN_BLENDER.format(folder=str(incomplete)))
    done = subprocess.run(blender_command(script), capture_output=True, text=True, timeout=120)
    output = done.stdout + done.stderr
    assert "MESSAGE Error: beamspread has no working native module for Python" in output
    assert "Traceback" not in output


def test_batch_says_what_is_missing(incomplete):
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
