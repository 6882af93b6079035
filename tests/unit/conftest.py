"""Marks the quick modules: `pytest -m fast` runs them in less than a minute."""

import os
from pathlib import Path

import pytest

HERE = Path(__file__).parent

# Processes that tests start import the staged package, too.
os.environ.setdefault("PYTHONPATH", str(HERE.parents[1] / "build" / "stage"))

# Modules with more than five seconds of CPU time.
SLOW = {
    "test_adaptive",
    "test_beam_diameter",
    "test_cli",
    "test_convolve",
    "test_library",
    "test_light_field",
    "test_lights",
    "test_live",
    "test_memory",
    "test_ray_gather",
    "test_surface_solver",
    "test_tolerance",
    "test_two_levels",
    "test_unscattered",
}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.parent == HERE and item.path.stem not in SLOW:
            item.add_marker("fast")


@pytest.fixture
def renderer():
    """A renderer for Live."""
    from beamspread.core.live.library_service import LibraryService
    from beamspread.core.live.renderer import LiveRenderer

    return LiveRenderer(LibraryService())


@pytest.fixture
def thread():
    """A thread that renders for Live, and ends with the test."""
    from beamspread.core.live.render_thread import RenderThread

    thread = RenderThread(rest_seconds=0.01)
    yield thread
    thread.end()
    assert thread.join(20)
