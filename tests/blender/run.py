"""Runs the tests of this folder inside Blender and passes pytest's exit code on.

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/run.py -- [pytest arguments]

or `python tests/blender/run.py -- [pytest arguments]` where `import bpy` works. BEAMSPREAD_TEST_SITE names the
site-packages that have pytest, BEAMSPREAD_STAGE the folder of the built package.
"""

import os
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent


def test_site() -> Path:
    """Site-packages of the set-up's virtual environment."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return Path(os.environ.get("BEAMSPREAD_TEST_SITE", ROOT / "build" / "venv" / "lib" / version / "site-packages"))


def main() -> int:
    """Run pytest with the add-on registered."""
    stage = Path(os.environ.get("BEAMSPREAD_STAGE", ROOT / "build" / "stage"))
    # At the end: Blender's own numpy comes first.
    sys.path.append(str(test_site()))
    sys.path[:0] = [str(stage), str(FOLDER), str(FOLDER.parent)]
    os.chdir(ROOT)

    import beamspread
    import bpy
    import pytest

    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    if not any(argument.startswith("tests/") for argument in arguments):
        arguments.append("tests/blender")
    beamspread.register()
    try:
        return int(pytest.main(["-p", "no:cacheprovider", "-o", f"pythonpath={stage}", *arguments]))
    finally:
        # Classes left registered can keep newer versions from exiting, and so can nodes of a class that is gone.
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        beamspread.unregister()


if __name__ == "__main__":
    code = main()
    from beamspread.batch import leave

    leave(code)
