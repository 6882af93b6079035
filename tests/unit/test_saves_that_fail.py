"""Saves that fail for lack of memory or disk leave the earlier file, or have written a whole one.

Every allocation and every write of a save fails in turn, once or from then on, in a process that preloads fail_calls.c.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("fail_calls.c")

# Argument: the saved kind. Prints the calls that were tried and those whose file was damaged or left beside it.
SWEEP = """
import ctypes, json, os, sys
from pathlib import Path
import numpy as np
import beamspread as bs
from beamspread.core.native import native

calls = ctypes.PyDLL(os.environ["LD_PRELOAD"])
calls.start_failing.argtypes = [ctypes.c_int, ctypes.c_long, ctypes.c_int]
calls.stop_failing.restype = ctypes.c_long
pixels = np.random.default_rng(0).random((40, 30, 3), np.float32)
path = Path(sys.argv[2])


def make(kind):
    if kind == "library":
        return bs.simulate(bs.Medium(), angles=[0], photons=64, threads=1).save
    if kind == "sample":
        return bs.LdfSample(pixels[..., 0].copy(), 0.5, 0, 0.5).save
    names = ["R", "G", "B"]
    return lambda path: native.write_exr(path, pixels, names, {"a": "text"}, compression=kind.split()[1])


save = make(sys.argv[1])
save(str(path))
whole = path.read_bytes()
tried, bad = 0, []
for kind, name in ((1, "allocation"), (2, "write")):
    calls.start_failing(kind, -1, 0)
    save(str(path))
    total = calls.stop_failing()
    points = sorted({*range(0, total, max(1, total // 100)), *range(max(0, total - 20), total)})
    for once in (0, 1):
        for point in points:
            path.write_bytes(b"earlier")
            raised = False
            calls.start_failing(kind, point, once)
            try:
                save(str(path))
            except (OSError, MemoryError):
                raised = True
            calls.stop_failing()
            content = path.read_bytes()
            beside = [entry.name for entry in path.parent.iterdir() if entry != path]
            if content != (b"earlier" if raised else whole) or beside:
                bad.append([name, point, once, raised, beside])
            for entry in beside:
                (path.parent / entry).unlink()
            tried += 1
print(json.dumps([tried, bad]))
"""


@pytest.fixture(scope="module")
def fail_calls(tmp_path_factory):
    library = tmp_path_factory.mktemp("fail") / "fail_calls.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", SOURCE, "-o", library, "-ldl"], check=True)
    return library


@pytest.mark.parametrize("kind", ["library", "sample", "exr zip", "exr none"])
def test_the_earlier_file_stays_unless_the_new_one_is_whole(kind, fail_calls, tmp_path):
    (tmp_path / "files").mkdir()
    arguments = [sys.executable, "-c", SWEEP, kind, tmp_path / "files" / "a.exr"]
    environment = {**os.environ, "LD_PRELOAD": str(fail_calls), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(arguments, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    tried, bad = json.loads(done.stdout)
    assert tried > 100
    assert bad == []
