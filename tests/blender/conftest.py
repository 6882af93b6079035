"""Every test starts from an empty file."""

import threading

import bpy
import pytest
from beamspread.blender.cycles import cycles_light
from beamspread.blender.live import timer
from beamspread.core.scene.illumination import Illumination


@pytest.fixture(autouse=True, scope="session")
def folder_of_children(tmp_path_factory):
    """Blenders that tests start and kill leave their folders among the files of the tests, which pytest removes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(tmp_path_factory.mktemp("temporary")))
        yield


@pytest.fixture(autouse=True)
def empty_file():
    """An empty scene for Cycles; the add-on stays registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.beamspread.quality = "preview"
    bpy.context.scene.beamspread.use_indirect = False  # starts another Blender; `few_nodes` asks for it


@pytest.fixture
def live_switched_off():
    """Live ends after the test, and its threads with it."""
    yield
    timer.end()
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("Beamspread")]


@pytest.fixture
def few_nodes(monkeypatch):
    """Bounced light by Cycles at few nodes, with noise far below that of bakes."""
    monkeypatch.setattr(cycles_light, "NODES", 32)
    monkeypatch.setattr(cycles_light, "NOISE", 5e-4)
    monkeypatch.setattr(Illumination, "bounce_problem", "They are off.")
    bpy.context.scene.beamspread.use_indirect = True
    bpy.context.scene.beamspread.margin = 0
