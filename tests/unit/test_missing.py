"""What is said where the native module can't be loaded."""

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
    place = tmp_path / "beamspread"
    shutil.copytree(Path(beamspread.__file__).parent, place, ignore=shutil.ignore_patterns("__pycache__", "library"))
    return place


def imported(package):
    """Stderr of a Python that imports this package, and its exit code."""
    code = IMPORT.format(folder=str(package.parent))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    return done.stderr, done.returncode


@pytest.mark.parametrize("spoil", ALL, ids=lambda spoil: spoil.__name__)
def test_cause_what_is_needed_and_where_to_get_it_are_said(package, spoil):
    said = spoil(package)
    output, code = imported(package)
    assert code == 1
    message = output[output.rindex("ImportError: ") :]
    python = f"{sys.version_info[0]}.{sys.version_info[1]}"
    assert f"beamspread has no working native module for Python {python} in {package}: " in message
    assert said in message
    assert f"Needed: _native.cpython-{python.replace('.', '')}-" in message
    assert "To mend it: get the zip of Beamspread 0." in message


def test_a_whole_copy_is_imported(package):
    assert imported(package) == ("", 0)


def test_checksums_of_other_files_are_of_no_concern(package):
    (package / "native.sha256").write_text(f"{'0' * 64}  _native.cp311-win_amd64.pyd\n")
    assert imported(package) == ("", 0)


def test_a_blender_that_suits_the_files_is_named(package):
    for module in package.glob("_native.cpython*"):
        module.unlink()
    here = sys.implementation._multiarch
    other = "313" if sys.version_info[:2] != (3, 13) else "311"
    (package / f"_native.cpython-{other}-{here}.so").write_bytes(b"")
    (package / "_native.cpython-310-sparc-linux-gnu.so").write_bytes(b"")
    output, _ = imported(package)
    blender = {"313": "5.1 and 5.2", "311": "4.1 to 5.0"}[other]
    assert f"or use Blender {blender} from blender.org" in output
    assert "Blender 3.1" not in output
