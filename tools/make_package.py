"""Packs the staged package into one zip that Blender installs, as a legacy add-on and as an extension.

    tools/make_package.py STAGED_PACKAGE MODULES LICENCES OUTPUT_FOLDER

takes modules and the licences of the libraries in them from their folders, and
makes OUTPUT_FOLDER/beamspread-VERSION-PLATFORM.zip with one folder, `beamspread`: Blender 3.4 can't install files at
the archive's root. Pages of docs/ go in as HTML (tools/make_help.py). The same files give the same bytes. CMake's
target `package` calls this. A module of MODULES that is for all Pythons replaces the staged one, which is for one.
"""

import platform
import re
import sys
import zipfile
from pathlib import Path

from make_help import help_files
from version import versions

ROOT = Path(__file__).resolve().parent.parent
FOLDER = "beamspread"
# The earliest that a zip knows.
TIME = (1980, 1, 1, 0, 0, 0)
MOST_BYTES = 40_000_000
# Type stubs are for editors: the wheel has them.
LEFT_OUT = re.compile(r"(^|/)__pycache__/|\.pyc$|\.pyi$|^py\.typed$|/\.|^\.|^CMakeFiles/|^docs/")
SUFFIXES = {".py", ".exr", ".csv", ".toml", ".so", ".pyd"}
MODULE = re.compile(r"^_native(\.(cpython-3\d+|cp3\d+|abi3)[^/.]*)?\.(so|pyd)$")
FOR_ALL_PYTHONS = {"_native.so", "_native.pyd"}


def platform_here() -> str:
    """This system in the words of Blender's manifests; the packed modules were built here."""
    system = {"linux": "linux", "darwin": "macos", "win32": "windows"}[sys.platform]
    return f"{system}-{'arm64' if platform.machine().lower() in {'arm64', 'aarch64'} else 'x64'}"


def of_platform(manifest: bytes, name: str) -> bytes:
    """The manifest, for this platform alone."""
    changed, count = re.subn(rb"^platforms = .*$", b'platforms = ["%b"]' % name.encode(), manifest, flags=re.MULTILINE)
    if count != 1:
        sys.exit("the manifest names no platforms")
    return changed


def licences(folder: Path) -> dict[str, bytes]:
    """File in the zip -> text: of Beamspread, and of each library that is in the modules."""
    texts = {path.name: path.read_bytes() for path in sorted(folder.glob("*.txt"))}
    if not texts:
        sys.exit(f"{folder} has no licences: build first")
    return {"LICENSE": (ROOT / "LICENSE").read_bytes()} | {f"LICENSES/{name}": text for name, text in texts.items()}


def content(staged: Path, modules: Path, licences_folder: Path) -> dict[str, bytes]:
    """Name in the package -> bytes."""
    names = {path.name for path in modules.glob("_native.*")}
    for_all = names & FOR_ALL_PYTHONS
    files = {name: (modules / name).read_bytes() for name in for_all or names}
    for path in sorted(staged.rglob("*")):
        name = path.relative_to(staged).as_posix()
        if path.is_dir() or LEFT_OUT.search(name) or (for_all and MODULE.match(name)):
            continue
        if path.suffix not in SUFFIXES and name != "VERSION":
            sys.exit(f"{path}: no such file belongs into a package; tools/make_package.py lists what does")
        files[name] = path.read_bytes()
    if not any(MODULE.match(name) for name in files):
        sys.exit(f"{staged} has no native module: build first")
    pages = {f"docs/{name}": page for name, page in help_files().items()}
    return {**files, **pages, **licences(licences_folder)}


def write(path: Path, files: dict[str, bytes]) -> None:
    """A zip of these files in one folder, whole or not at all."""
    partial = path.with_suffix(".partial")
    with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # Without an entry of its own Blender's legacy installer leaves an older version's folder where it is and writes
        # into its files: even into the native module that is in use, which ends the process.
        folder = zipfile.ZipInfo(f"{FOLDER}/", TIME)
        folder.create_system, folder.external_attr = 3, (0o40755 << 16) | 0x10
        archive.writestr(folder, b"")
        for name in sorted(files):
            entry = zipfile.ZipInfo(f"{FOLDER}/{name}", TIME)
            entry.create_system = 3  # Unix, wherever this runs
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
    if partial.stat().st_size > MOST_BYTES:
        sys.exit(f"{partial} has {partial.stat().st_size} bytes, more than {MOST_BYTES}")
    partial.replace(path)


def main(staged: Path, modules: Path, licences_folder: Path, output: Path) -> Path:
    said = versions(staged)
    if len(set(said.values())) > 1:
        sys.exit(f"versions differ: {said}; tools/version.py writes them anew")
    files = content(staged, modules, licences_folder)
    files["blender_manifest.toml"] = of_platform(files["blender_manifest.toml"], platform_here())
    path = output / f"beamspread-{said['VERSION']}-{platform_here()}.zip"
    for old in output.glob("beamspread-*.zip"):
        old.unlink()
    write(path, files)
    packed = [name for name in sorted(files) if MODULE.match(name)]
    print(f"{path}: {path.stat().st_size / 1e6:.1f} MB, {len(files)} files, {', '.join(packed)}")
    return path


if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    main(*map(Path, sys.argv[1:]))
