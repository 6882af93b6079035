"""Bakes the slab of blend_examples/cycles_slab.py at several sample counts, for tests/bench/cycles.py.

    blender -b --factory-startup --python THIS -- FILE.npz SAMPLES...

The file gets, for each count, L / E of every texel and the CPU seconds of the bake.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "blend_examples"))
import cycles_slab


def main():
    path, *counts = sys.argv[sys.argv.index("--") + 1 :]
    _, image = cycles_slab.build_scene(1)
    cycles_slab.bake_texels(image, seed=1)  # compiles and builds for every later bake
    results = {}
    for count in map(int, counts):
        cycles_slab.set_up_cycles(count)
        start = time.process_time()
        results[f"luminance{count}"] = cycles_slab.bake_texels(image, seed=count)
        results[f"seconds{count}"] = time.process_time() - start
    np.savez(path, **results)


main()
