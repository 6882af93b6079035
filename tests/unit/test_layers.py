"""Folders include only folders above them: CMakeLists.txt lists those of native/, docstrings those of addon/."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NATIVE = ROOT / "native"
ADDON = ROOT / "addon"


def native_folders():
    """Each folder of native/ and the folders that it may include."""
    known = {}
    for folder, *direct in map(
        str.split, re.findall(r"^beamspread_folder\((.*)\)$", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)
    ):
        known[folder] = {folder, *direct}.union(*(known[name] for name in direct))
    return known | {"python": {"python", *known}, "fft/instruction_sets": {"fft/instruction_sets"}}


def test_native_includes_point_upwards():
    may_include = native_folders()
    wrong = [
        f"{path.relative_to(NATIVE)} includes {header}"
        for path in [*NATIVE.rglob("*.cpp"), *NATIVE.rglob("*.h")]
        for header in re.findall(r'^#include "([^"]+)"', path.read_text(), re.MULTILINE)
        if (NATIVE / header).exists()
        and str(Path(header).parent) not in may_include[str(path.relative_to(NATIVE).parent)] | {"fft/instruction_sets"}
    ]
    assert not wrong


def listed(package):
    """Parts of a package in the order that its docstring lists them."""
    docstring = ast.get_docstring(ast.parse((ADDON / package / "__init__.py").read_text()))
    return [*re.findall(r"^    (\w+) {2,}", docstring, re.MULTILINE)]


def imports(path):
    """Absolute names of the imports from the package, and top names of all other imports."""
    package = path.relative_to(ADDON).parent.parts
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (name.name.split(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level:
            home = [*package[: len(package) - node.level + 1], *filter(None, [node.module])]
            yield from (".".join([*home, name.name]) for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.split(".")[0]


def test_every_part_of_addon_is_listed():
    for package in ("core", "blender"):
        there = {path.stem for path in (ADDON / package).iterdir() if path.name[0] != "_"}
        assert there == set(listed(package))


def test_python_imports_point_upwards():
    wrong = []
    for package in ("core", "blender"):
        order = listed(package)
        for path in (ADDON / package).rglob("*.py"):
            part = path.relative_to(ADDON / package).parts[0].removesuffix(".py")
            if part == "__init__":
                continue
            above = {f"{package}.{name}" for name in order[: order.index(part) + 1]}
            for name in imports(path):
                home = ".".join(name.split(".")[:2])
                inside = name.split(".")[0] in ("core", "blender", "batch", "_native")
                allowed = home in above or (package == "blender" and home.split(".")[0] == "core")
                allowed = allowed or (part, name) == ("native", "_native")
                if (inside and not allowed) or (package == "core" and name in ("bpy", "mathutils")):
                    wrong.append(f"{path.relative_to(ADDON)} imports {name}")
    assert not wrong


def test_no_test_module_imports_from_another():
    """Code that several tests need is in a module of helpers."""
    wrong = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in (ROOT / "tests").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in ([node.module or ""] if isinstance(node, ast.ImportFrom) else [one.name for one in node.names])
        if name.startswith("test_")
    ]
    assert not wrong
