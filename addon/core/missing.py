"""Why the native module can't be loaded: what lies in the package, what this Blender needs, where to get it.

Reads files alone: nothing here may need the module.
"""

from __future__ import annotations

import hashlib
import platform
import re
import struct
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

CHECKSUMS = "native.sha256"
"""Beside the modules in a zip: their sha256, as the program sha256sum writes them."""

_MODULE = re.compile(r"^_native\.(?:cpython-|cp)(?P<major>3)(?P<minor>\d+)(?:-(?P<platform>[^.]*))?\.(?:so|pyd)$")

_BLENDERS = {"3.10": "3.4 to 4.0", "3.11": "4.1 to 5.0", "3.13": "5.1 and 5.2"}
"""Which Blenders from blender.org that the add-on runs in bring which Python."""

_GLIBC = re.compile(r"version [`']GLIBC_([0-9.]+)' not found")
_LIBRARY = re.compile(r"^(\S+\.so\S*): cannot open shared object file")


class AnotherVersionError(ImportError):
    """The module in the process is of another version than the package: its text is for the artist."""


def problem_of(folder: Path, error: Exception) -> str:
    """A few sentences for the artist about the error that loading the module of this package ended with."""
    if isinstance(error, AnotherVersionError):
        return str(error)
    python = _python()
    found = ", ".join(sorted(_said_of(path.name) for path in modules(folder))) or "none at all"
    return (
        f"beamspread has no working native module for Python {python} in {folder}: {_cause(folder, error)}. "
        f"Found there: {found}. Needed: {wanted()} ({_here()}). {_remedy(folder)} "
        "Until then nothing can be baked; nodes, settings and baked images stay as they are."
    )


def modules(folder: Path) -> list[Path]:
    """The native modules in a package, for whatever Python and platform."""
    return sorted(path for path in folder.glob("_native.*") if path.suffix in {".so", ".pyd"})


def wanted() -> str:
    """Name of the file that this Python looks for first."""
    return f"_native{EXTENSION_SUFFIXES[0]}"


def check(folder: Path) -> None:
    """Refuse a module that was damaged on its way: to run it could end the process.

    Without checksums only its length is looked at. Raises ImportError.
    """
    path = folder / wanted()
    if not path.is_file():
        return
    for line in _read(folder / CHECKSUMS).splitlines():
        digest, _, name = line.partition("  ")
        if name == path.name and digest != hashlib.sha256(path.read_bytes()).hexdigest():
            raise ImportError(f"{path.name} is damaged: it is not the file that was packed")
    if not _is_whole(path):
        raise ImportError(f"{path.name} is damaged: its end is missing")


def check_version(folder: Path, loaded: str) -> None:
    """Refuse a module of another version: a process can't exchange one, so that it is the former one's after an update.

    Raises AnotherVersionError.
    """
    version = _read(folder / "VERSION").strip()
    if loaded != version:
        raise AnotherVersionError(
            f"Beamspread {version} was installed while {loaded} was in use: restart Blender to go on with it. "
            "Until then nothing can be baked; nodes, settings and baked images stay as they are."
        )


def _is_whole(path: Path) -> bool:
    """Whether a 64-bit ELF file is as long as its table of sections, which comes last, says. Other files pass."""
    with path.open("rb") as file:
        head = file.read(64)
        if len(head) < 64 or head[:5] != b"\x7fELF\x02":
            return head[:2] == b"MZ" or head[:4] in {b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe"}
        (table,) = struct.unpack_from("<Q", head, 0x28)
        size, count = struct.unpack_from("<HH", head, 0x3A)
    return path.stat().st_size >= table + size * count


def _cause(folder: Path, error: Exception) -> str:
    """What kept the module from loading."""
    text = str(error).strip().rstrip(".")
    if needed := _GLIBC.search(text):
        return f"it needs glibc {needed[1]} or newer, and this system has {_glibc() or 'another C library'}"
    if isinstance(error, ModuleNotFoundError) and not (folder / wanted()).exists():
        return "the file for it is missing"
    if library := _LIBRARY.match(text):
        return f"a library that it needs, {library[1]}, is not on this system"
    return text


def _remedy(folder: Path) -> str:
    """Where to get what is needed."""
    version = _read(folder / "VERSION").strip() or "VERSION"
    of_here = [
        found for path in modules(folder) if (found := _MODULE.match(path.name)) and _is_of_here(found["platform"])
    ]
    pythons = [f"{found['major']}.{found['minor']}" for found in of_here]
    blenders = [f"Blender {_BLENDERS[python]}" for python in pythons if python in _BLENDERS and python != _python()]
    instead = f", or use {' or '.join(blenders)} from blender.org, which suits the files found" if blenders else ""
    return (
        f"To mend it: get the zip of Beamspread {version} that is made for {_machine()} and this Python from where "
        f"this one came from, install it over this one and restart Blender{instead}."
    )


def _said_of(name: str) -> str:
    if not (found := _MODULE.match(name)):
        return name
    return f"{name} (for Python {found['major']}.{found['minor']})"


def _is_of_here(platform_tag: str | None) -> bool:
    """Whether a module's name says that it was made for this system."""
    here = _MODULE.match(wanted())
    return here is not None and platform_tag == here["platform"]


def _python() -> str:
    return f"{sys.version_info.major}.{sys.version_info.minor}"


def _machine() -> str:
    return f"{platform.system() or sys.platform} {platform.machine()}"


def _glibc() -> str:
    name, version = platform.libc_ver()
    return f"{name} {version}" if name else ""


def _here() -> str:
    return ", ".join(filter(None, [_machine(), f"Python {_python()}", _glibc()]))


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""
