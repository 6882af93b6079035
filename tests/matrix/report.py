"""The line of one Blender in tests/matrix.sh: report.py NAME FOLDER REFERENCE_FOLDER SECONDS [FAILURES]

Compares the images of FOLDER/out with those of the reference, by one reader, of the staged module: no texel may differ
by more than 1e-4 of the image's maximum. Exit code 0 if all is well.

Blender 4.5 rounds the corners of bevels otherwise than 3.4. So three texels of such objects may differ: those of the
margin where several islands meet.
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "build" / "stage"))
from beamspread.core.native import native

TOLERANCE = 1e-4
BEVELED, OTHER_TEXELS = ("soap_bar",), 3


def difference(path: Path, reference: Path) -> float:
    """Largest difference, relative to the reference's maximum."""
    image, other = native.read_exr(str(path))[0], native.read_exr(str(reference))[0]
    if image.shape != other.shape:
        return float("inf")
    # Not a number anywhere is a difference of its own.
    texels = np.sort(np.nan_to_num(np.abs(image - other).max(axis=-1) / other.max(), nan=np.inf), axis=None)
    return float(texels[-1 - OTHER_TEXELS * (reference.parent.name in BEVELED)])


def result(folder: Path, reference: Path, facts: dict) -> str:
    if facts.get("problem"):
        return f"no module for Python {'.'.join(facts['python'].split('.')[:2])}: said so, and nothing was lost"
    differences = {path: difference(folder / "out" / path, reference / path) for path in images(reference)}
    if not differences or images(folder / "out") != images(reference):
        return "FAILED: other images were written than in 3.4.1"
    worst = max(differences, key=differences.get)
    if differences[worst] > TOLERANCE:
        return f"FAILED: {worst} differs by {differences[worst]:.1e}"
    return f"ok: {len(differences)} images within {differences[worst]:.1e} of 3.4.1"


def images(folder: Path) -> list[Path]:
    return sorted(path.relative_to(folder) for path in folder.rglob("*.exr"))


def main() -> int:
    name, folder, reference, seconds, failure = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]), *sys.argv[4:6]
    path = folder / "facts.json"
    facts = json.loads(path.read_text()) if path.exists() else {}
    said = failure or result(folder, reference, facts)
    columns = [facts.get(key, "?") for key in ("blender", "python", "glibc", "numpy")]
    print("{:9} {:12} {:8} {:6} {:7} {:>6}  {}".format(name, *columns, seconds, said), flush=True)
    return 0 if said.startswith("ok") else 1


if __name__ == "__main__":
    sys.exit(main())
