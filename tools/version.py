"""The version of Beamspread: `tools/version.py` prints it, `tools/version.py 0.2.0` changes it everywhere.

addon/VERSION is the one that counts: CMake, the native module, the wheel and the zip read it. Blender reads two more
without running anything, so that they must be written out: bl_info of addon/__init__.py (legacy add-on) and the
extension's manifest. tests/unit/test_version.py compares them, and no zip is made while they differ.

Formats of files have numbers of their own, which change only when old files can't be read: libraries
(native/ldf/library/library_format.h) and the request for their simulation (_FILE_VERSION of addon/core/ldf/library.py).
"""

import ast
import re
import sys
from pathlib import Path

ADDON = Path(__file__).resolve().parent.parent / "addon"


def of_file(addon: Path) -> str:
    return (addon / "VERSION").read_text(encoding="utf-8").strip()


def of_bl_info(addon: Path) -> str:
    """Version in bl_info, read from the syntax tree as Blender does, without running the file."""
    tree = ast.parse((addon / "__init__.py").read_text(encoding="utf-8"))
    (value,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and [getattr(target, "id", "") for target in node.targets] == ["bl_info"]
    )
    return ".".join(str(number) for number in ast.literal_eval(value)["version"])


def of_manifest(addon: Path) -> str:
    manifest = (addon / "blender_manifest.toml").read_text(encoding="utf-8")
    return re.search(r'^version = "(.*)"$', manifest, re.MULTILINE)[1]


def versions(addon: Path) -> dict[str, str]:
    """Version that each file states."""
    return {
        "VERSION": of_file(addon),
        "__init__.py": of_bl_info(addon),
        "blender_manifest.toml": of_manifest(addon),
    }


def change(addon: Path, version: str) -> None:
    """Write the version, three numbers with points, into every place."""
    numbers = [int(number) for number in version.split(".")]
    if len(numbers) != 3:
        raise ValueError(f"a version has three numbers, not {version!r}")

    def write(name, pattern, text):
        path = addon / name
        old = path.read_text(encoding="utf-8")
        new, count = re.subn(pattern, text, old, count=1, flags=re.MULTILINE)
        if count != 1:
            raise ValueError(f"{path} names no version")
        path.write_text(new, encoding="utf-8")

    plain = ".".join(str(number) for number in numbers)
    write("VERSION", r"\A.*$", plain)
    write("__init__.py", r'^    "version": \(.*\),$', f'    "version": ({", ".join(str(n) for n in numbers)}),')
    write("blender_manifest.toml", r'^version = ".*"$', f'version = "{plain}"')


if __name__ == "__main__":
    if len(sys.argv) > 1:
        change(ADDON, sys.argv[1])
    said = versions(ADDON)
    print(said["VERSION"])
    if len(set(said.values())) > 1:
        sys.exit(f"these differ: {said}; tools/version.py {said['VERSION']} writes them anew")
