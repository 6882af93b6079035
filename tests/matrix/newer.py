"""Makes a zip for testing upgrades: newer by one patch version than a given one, with one file less.

    newer.py ZIP OUTPUT_FOLDER

The native module says its version too, in as many characters, which are changed in place.
"""

import sys
import zipfile
from pathlib import Path


def main(path: Path, folder: Path) -> Path:
    """The path of the zip that it makes."""
    name, old, rest = path.name.split("-", 2)
    numbers = [int(number) for number in old.split(".")]
    new = ".".join(map(str, (*numbers[:2], numbers[2] + 1)))
    with zipfile.ZipFile(path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    del files["beamspread/LICENSE"]
    for entry, data in files.items():
        base = entry.partition("/")[2]
        if base in {"VERSION", "blender_manifest.toml"}:
            files[entry] = data.replace(old.encode(), new.encode(), 1)
        elif base == "__init__.py":
            written = [", ".join(version.split(".")).encode() for version in (old, new)]
            files[entry] = data.replace(*written, 1)
        elif base.startswith("_native."):
            if len(old) != len(new) or data.count(old.encode() + b"\0") != 1:
                raise SystemExit(f"{entry}: no single place of the version {old}")
            files[entry] = data.replace(old.encode() + b"\0", new.encode() + b"\0")
    target = folder / f"{name}-{new}-{rest}"
    with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as archive:
        for entry, data in files.items():
            archive.writestr(entry, data)
    return target


if __name__ == "__main__":
    print(main(Path(sys.argv[1]), Path(sys.argv[2])))
