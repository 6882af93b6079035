"""Errors of bounced light that Cycles finds, with and without the filter, by samples: in Blender 4.5.

PYTHONPATH=build/stage build/venv/bin/python tests/bench/bounced.py [REFERENCE_SAMPLES]
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main():
    inside = ROOT / "tests" / "bench" / "in_blender" / "bounced.py"
    path = os.pathsep.join(map(str, [ROOT / "build" / "stage", ROOT / "build" / "bpy-4.5"]))
    for scene in ("room", "wall"):
        done = subprocess.run(
            [sys.executable, str(inside), scene, *sys.argv[1:]],
            env=os.environ | {"PYTHONPATH": path},
            capture_output=True,
            text=True,
        )
        if done.returncode != 0:
            raise RuntimeError(done.stdout + done.stderr)
        print(*(line for line in done.stdout.splitlines() if line.startswith("|")), sep="\n")


if __name__ == "__main__":
    main()
