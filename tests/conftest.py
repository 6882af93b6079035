"""Marks the long tests: `pytest -m "not long"` leaves them out, as `tests/run.sh` does without `--all`."""

from pathlib import Path

import pytest

LONG = Path(__file__).parent / "long_tests.txt"


def long_tests():
    """Beginnings of the ids of long tests."""
    return [line for line in LONG.read_text().splitlines() if line and not line.startswith("#")]


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Mark the long tests; an entry of the list that no test of its module has is an error."""
    collected = {item.nodeid.partition("::")[0] for item in items}
    are_whole = not any("::" in argument for argument in config.args)
    for beginning in long_tests():
        found = [item for item in items if item.nodeid.startswith(beginning)]
        for item in found:
            item.add_marker("long")
        if not found and are_whole and beginning.partition("::")[0] in collected:
            raise pytest.UsageError(f"{LONG.name} has a test that does not exist: {beginning}")
