"""Preferences where the package is an enabled add-on, by its own name or as an extension."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import beamspread
import bpy
import panel_layout
import pytest
from beamspread.blender.preferences import CUSTOM_PRESET, BeamspreadPreferences
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
def new_node():
    tree = bpy.data.materials.new("New").node_tree or bpy.data.node_groups.new("New", "ShaderNodeTree")
    return tree.nodes.new("BeamspreadNode")
untouched = list(new_node().mean_free_path)
own.new_base_color, own.new_path, own.new_ior = (.25, .5, .75), 2.0, 1.25
bpy.context.scene.unit_settings.scale_length = 0.1
node = new_node()
found.append([untouched, list(node.base_color), list(node.mean_free_path), node.ior, node.color_mode])
own.new_preset = "marble"
found.append(new_node().preset)
opened = []
for prefix, mapping in bpy.utils.manual_map():
    opened += [prefix + rest for pattern, rest in mapping if "beamspread" in pattern]
found.append(opened)
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
    threads, memory_limit, during, node, preset, pages, after = json.loads(answer.read_text())
    assert (threads, memory_limit, during) == (3, 100 * 2**20, str(chosen))
    untouched, color, path, ior, mode = node
    assert untouched == pytest.approx([0.01] * 3)
    assert color == pytest.approx([0.25, 0.5, 0.75])
    assert path == pytest.approx([0.02] * 3)  # 2 mm in units of 10 cm
    assert (ior, mode) == (1.25, "BASE_COLOR")
    assert preset == "marble"
    files = {page.partition("#")[0] for page in pages}
    assert len(pages) > 10
    assert all(Path(file.removeprefix("file://")).is_file() for file in files), files
    assert after != during


class Layout(panel_layout.Layout):
    """Takes properties as well, among the lines."""

    def prop(self, _owner, name, **_options):
        self.said += f"<{name}> "

    def label(self, text, icon="NONE"):
        super().label(text, icon)


def test_the_values_of_new_nodes_are_named_so():
    layout = Layout()
    BeamspreadPreferences.draw(SimpleNamespace(layout=layout, new_preset=CUSTOM_PRESET), panel_layout.context())
    assert "Values of new nodes: <new_preset> <new_base_color> <new_path> <new_ior> <threads>" in layout.said
