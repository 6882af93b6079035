"""Make the LDF libraries that come with the add-on: addon/library/*.exr, where `beamspread.library` looks first.

    PYTHONPATH=build/stage build/venv/bin/python tools/make_library.py

Every medium of the grid below, in final quality: one file of its plane and one of its curved surfaces, which the
package loads for meshes that bend. `--only` makes one of the two. `--medium G IOR THICKNESS` (as often as wanted) makes
others instead, `--quality` and `--output` say how and where. Which random numbers a photon gets depends on the width of
the processor's vectors; `--kernel scalar` gives the same files anywhere.
"""

import argparse
import itertools
import math
import sys
import time
from pathlib import Path

from beamspread import Medium
from beamspread.core.ldf.curvatures import curvatures_for, with_curvatures
from beamspread.core.ldf.library import PHOTONS, curved_file_name, file_name, library, make

GRID = [Medium(g, ior, math.inf) for g, ior in itertools.product((0.0, 0.8, 0.9), (1.0, 1.3, 1.4, 1.5))]
"""Half-spaces of the materials that are asked for most: presets of unknown g (0), and what forward scattering does."""

MAX_BYTES = 40e6
"""What all files together may take of the package."""


def main():
    """Make the files that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--medium", nargs=3, type=float, action="append", metavar=("G", "IOR", "THICKNESS"))
    parser.add_argument("--quality", choices=sorted(PHOTONS), default="final")
    parser.add_argument("--kernel", default="", help="of the photon walk, see beamspread._native.walk_kernels()")
    parser.add_argument("--output", type=Path, default=Path(__file__).parents[1] / "addon" / "library")
    parser.add_argument("--only", choices=("plane", "curved"))
    options = parser.parse_args()
    media = [Medium(*numbers) for numbers in options.medium or ()] or GRID
    options.output.mkdir(exist_ok=True)
    paths = []
    for medium in media:
        if options.only != "curved":
            start = time.monotonic()
            plane = make(medium, options.quality, kernel=options.kernel)
            paths.append(options.output / file_name(medium, options.quality))
            plane.save(paths[-1])
            report(paths[-1], time.monotonic() - start)
        if options.only != "plane" and curvatures_for(medium):
            start = time.monotonic()
            plane = plane if options.only != "curved" else library(medium, options.quality)
            paths.append(options.output / curved_file_name(medium, options.quality))
            with_curvatures(plane, options.quality, kernel=options.kernel).save(paths[-1], with_plane=False)
            report(paths[-1], time.monotonic() - start)
    total = sum(path.stat().st_size for path in paths)
    print(f"{len(paths)} files, {total / 1e6:.1f} MB")
    if total > MAX_BYTES:
        sys.exit(f"more than the {MAX_BYTES / 1e6:g} MB that the package may take")


def report(path: Path, seconds: float) -> None:
    """Print a file's size and the time that it took."""
    print(f"{path.name}: {path.stat().st_size / 1e6:.2f} MB, {seconds:.1f} s", flush=True)


if __name__ == "__main__":
    main()
