"""The message where the native module can't be loaded."""

import shutil
import subprocess
import sys
from pathlib import Path

import beamspread
import pytest

from spoilt_modules import ALL

IMPORT = "import sys; sys.path.insert(0, {folder!r}); import beamspread"


@pytest.fixture
def package(tmp_path):
    """A copy of the package."""
    copy = tmp_path / "beamspread"
    shutil.copytree(Path(beamspread.__file__).parent, copy, ignore=shutil.ignore_patterns("__pycache__", "library"))
    return copy


def imported(package):
    """Stderr of a Python that imports this package, and its exit code."""
    code = IMPORT.format(folder=str(package.parent))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    return done.stderr, done.returncode


@pytest.mark.parametrize("spoil", ALL, ids=lambda spoil: spoil.__name__)
def test_the_message_names_the_cause_and_the_file_that_is_needed(package, spoil):
    cause = spoil(package)
    output, code = imported(package)
    assert code == 1
    message = output[output.rindex("ImportError: ") :]
    python = f"{sys.version_info[0]}.{sys.version_info[1]}"
    assert f"beamspread has no working native module for Python {python} in {package}: " in message
    assert cause in message
    assert f"Needed: _native.cpython-{python.replace('.', '')}-" in message
    assert "Install the zip of Beamspread 0." in message


def test_a_complete_copy_is_imported(package):
    assert imported(package) == ("", 0)


def test_a_module_of_another_version_asks_for_a_restart(package):
    (package / "VERSION").write_text("9.9.9\n")
    output, code = imported(package)
    assert code == 1
    assert "Beamspread 9.9.9 was installed while 0." in output
    assert "restart Blender" in output
