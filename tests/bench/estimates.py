"""Announced times against real ones: bakes of the examples, or of any scenes, in the bpy module of Blender 4.5.

    PYTHONPATH=build/stage build/venv/bin/python tests/bench/estimates.py [SCENE...] [--resolution N...] [--times N]

Each scene is baked in a session of its own, which has measured nothing yet; `--times` repeats it. Resolution 0 is the
scene's own. Scenes without a Beamspread node get a plane of marble. *Panel* is the time that panels announce, *scene*
the estimate once the scene was read. CPU seconds are those of all threads and of Cycles: on a busy machine, compare
their fraction that all cores would take.
*Left* is the error of the time left while the bake ran, over all of its time: its mean, and its maximum.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "blend_examples").glob("*.blend"))
BPY_MODULE = ROOT / "build" / "bpy-4.5"
INSIDE = ROOT / "tests" / "bench" / "in_blender" / "estimates.py"


def error_of_time_left(bake):
    """Mean and largest error of the time left, over all of the bake's time."""
    errors = [abs(left - (bake["seconds"] - now)) / bake["seconds"] for now, *_, left, _ in bake["looks"] if left]
    return (sum(errors) / len(errors), max(errors)) if errors else (0.0, 0.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("--resolution", nargs="*", type=int, default=[512, 1024])
    parser.add_argument("--times", type=int, default=1)
    parser.add_argument("--json", help="file for all measurements")
    options = parser.parse_args()
    environment = os.environ | {"PYTHONPATH": f"{BPY_MODULE}:{os.environ.get('PYTHONPATH', '')}"}
    bakes = []
    print(f"{'scene':24}{'texels':>12}{'panel':>8}{'scene':>8}{'real':>8}{'CPU':>8}{'left':>14}")
    for scene in options.scenes or EXAMPLES:
        for resolution in options.resolution:
            words = [str(INSIDE), str(scene), str(resolution), str(options.times)]
            done = subprocess.run([sys.executable, *words], env=environment, capture_output=True, text=True)
            if done.returncode:
                raise SystemExit(done.stderr)
            for line in done.stdout.splitlines():
                if not line.startswith('{"scene"'):
                    continue
                bake = json.loads(line)
                bakes.append(bake)
                texels, (mean, largest) = "x".join(map(str, bake["texels"])), error_of_time_left(bake)
                times = "".join(f"{bake[name]:8.2f}" for name in ("panel", "planned", "seconds", "cpu"))
                print(f"{bake['scene'][:23]:24}{texels:>12}{times}{mean:7.0%}{largest:7.0%}", flush=True)
    if options.json:
        Path(options.json).write_text(json.dumps(bakes))


if __name__ == "__main__":
    main()
