"""Every test starts from an empty file."""

import threading

import bpy
import pytest
from beamspread.blender.live import timer


@pytest.fixture(autouse=True)
def empty_file():
    """An empty scene for Cycles; the add-on stays registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.beamspread.quality = "preview"
    bpy.context.scene.beamspread.use_indirect = False  # starts another Blender; test_indirect.py asks for it


@pytest.fixture
def live_switched_off():
    """Live ends after the test, and its threads with it."""
    yield
    timer.end()
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("Beamspread")]
