"""A whole bake in Blender against the least that the same Blender can do: start, load the file, save such an image.

    PYTHONPATH=build/stage build/venv/bin/python tests/bench/whole_bake.py [--resolution N] [--runs N]

A floor under a sun, with a monkey that throws a shadow. The library of the medium is in the cache: the first bake of a
medium simulates it. Wall seconds are worth something on an idle machine only; CPU seconds are those of all threads.
"""

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STAGE = ROOT / "build" / "stage"
INSIDE = ROOT / "tests" / "bench" / "in_blender" / "whole_bake.py"
BPY_MODULE = ROOT / "build" / "bpy-4.5"


def command(program, scene, script, *arguments):
    """Run a script on a scene, in Blender or in a Python with the bpy module."""
    scene = [str(scene)] if scene else []
    if program == sys.executable:
        # batch.py takes its options as they come, without a "--" in front.
        dashes = [] if script.name == "batch.py" else ["--"]
        return [program, str(script), *scene, *dashes, *arguments]
    return [
        program,
        "-b",
        "--factory-startup",
        *scene,
        "--python-exit-code",
        "1",
        "--python",
        str(script),
        "--",
        *arguments,
    ]


def run(arguments):
    """Wall and CPU seconds of a process, and its output."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    path = [STAGE, BPY_MODULE] if arguments[0] == sys.executable else [STAGE]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, path))}
    # Python keeps its compiled files, its default.
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(arguments, env=environment, capture_output=True, text=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(arguments)} failed:\n{done.stdout}{done.stderr}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, done.stdout


def summary(pairs, index):
    """Least seconds of both, their ratio, and the median ratio of those that ran one after the other."""
    saved, baked = (min(run[index] for run in runs) for runs in zip(*pairs))
    return saved, baked, baked / saved, statistics.median(bake[index] / save[index] for save, bake in pairs)


def measure(program, folder, resolution, runs):
    size = str(resolution)
    run(command(program, None, INSIDE, "make", folder, size))
    version = "bpy module 4.5" if program == sys.executable else run([program, "--version"])[2].splitlines()[0]
    for scene in sorted(Path(folder).glob("*.blend")):
        bake = command(program, scene, STAGE / "beamspread" / "batch.py", "--output", folder)
        save = command(program, scene, INSIDE, "save", str(Path(folder) / "saved.exr"), size)
        run(bake)  # fills the cache and warms the disk's
        pairs = [(run(save), run(bake)) for _ in range(runs)]
        rows = zip(summary(pairs, 0), summary(pairs, 1))
        print(f"{version}, {scene.stem}, {size} x {size}:  wall s  CPU s")
        for name, (wall, cpu) in zip(("start, load, save", "start, load, bake", "ratio", "median of pairs"), rows):
            print(f"  {name:22} {wall:8.2f}  {cpu:.2f}")
        for line in run(command(program, scene, INSIDE, "phases", folder))[2].splitlines():
            if line.startswith("phase "):
                name, _, numbers = line.removeprefix("phase ").partition(": ")
                wall, cpu = numbers.split()
                print(f"    {name:22} {wall:>7}  {cpu}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--resolution", type=int, default=1024)
    parser.add_argument("--runs", type=int, default=5)
    options = parser.parse_args()
    programs = [shutil.which("blender"), sys.executable if BPY_MODULE.exists() else None]
    for program in filter(None, programs):
        with tempfile.TemporaryDirectory() as folder:
            measure(program, folder, options.resolution, options.runs)


main()
