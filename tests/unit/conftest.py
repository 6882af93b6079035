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
    "test_tolerance",
    "test_two_levels",
    "test_unscattered",
}


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.parent == HERE and item.path.stem not in SLOW:
            item.add_marker("fast")
