"""Folders include only what stands above them; CMakeLists.txt says which those are."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NATIVE = ROOT / "native"


def native_folders():
    """Each folder of native/ and the folders that it may include."""
    known = {}
    for folder, *direct in map(
        str.split, re.findall(r"^beamspread_folder\((.*)\)$", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)
    ):
        known[folder] = {folder, *direct}.union(*(known[name] for name in direct))
    return known | {"python": {"python", *known}, "fft/targets": {"fft/targets"}}


def test_native_includes_point_upwards():
    may_include = native_folders()
    wrong = [
        f"{path.relative_to(NATIVE)} includes {header}"
        for path in [*NATIVE.rglob("*.cpp"), *NATIVE.rglob("*.h")]
        for header in re.findall(r'^#include "([^"]+)"', path.read_text(), re.MULTILINE)
        if (NATIVE / header).exists()
        and str(Path(header).parent) not in may_include[str(path.relative_to(NATIVE).parent)] | {"fft/targets"}
    ]
    assert not wrong
