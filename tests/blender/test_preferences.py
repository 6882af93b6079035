"""Preferences where the package is an enabled add-on, by its own name or as an extension."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import beamspread
import bpy
import pytest
from scenes import blender_command

SCRIPT = """
import importlib, json, os, sys
import bpy
import addon_utils  # known once bpy is there
name, answer, chosen = {name!r}, {answer!r}, {chosen!r}
addon_utils.enable(name, default_set=True)
own = bpy.context.preferences.addons[name].preferences
own.threads, own.memory_limit, own.cache_folder = 3, 100, chosen
settings = bpy.context.scene.beamspread.for_bake()
library = importlib.import_module(name + ".core.ldf.library")
found = [settings.threads, settings.memory_limit, str(library.cache_folder())]
addon_utils.disable(name, default_set=True)
open(answer, "w").write(json.dumps([*found, str(library.cache_folder())]))
sys.stdout.flush()
os._exit(0)
"""


@pytest.mark.parametrize("name", ["beamspread", "bl_ext.user_default.beamspread"])
def test_preferences_reach_bakes_and_the_cache(name, tmp_path):
    if "." in name and bpy.app.version < (4, 2, 0):
        pytest.skip("extensions came with Blender 4.2")
    parent = "extensions/user_default" if "." in name else "scripts/addons"
    source = Path(beamspread.__file__).parent
    shutil.copytree(source, tmp_path / parent / "beamspread", ignore=shutil.ignore_patterns("__pycache__"))
    answer, chosen = tmp_path / "answer.json", tmp_path / "chosen"
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(name=name, answer=str(answer), chosen=str(chosen)))
    places = {"BLENDER_USER_SCRIPTS": str(tmp_path / "scripts"), "BLENDER_USER_RESOURCES": str(tmp_path)}
    environment = {key: value for key, value in os.environ.items() if key != "BEAMSPREAD_CACHE"} | places
    done = subprocess.run(blender_command(script), capture_output=True, text=True, timeout=120, env=environment)
    assert answer.exists(), done.stdout + done.stderr
    threads, memory_limit, during, after = json.loads(answer.read_text())
    assert (threads, memory_limit, during) == (3, 100 * 2**20, str(chosen))
    assert after != during
