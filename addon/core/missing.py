"""The message for an artist whose Blender can't load the native module."""

from __future__ import annotations

import platform
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

WANTED = f"_native{EXTENSION_SUFFIXES[0]}"
"""Name of the file that this Python looks for first."""


class AnotherVersionError(ImportError):
    """The process holds the module of another version of the package; the text is for the artist."""


def check_version(folder: Path, loaded: str) -> None:
    """Raise AnotherVersionError if the module is not of this package's version, as after an update without a restart.

    A process can't exchange a native module.
    """
    version = _version(folder)
    if loaded != version:
        raise AnotherVersionError(
            f"Beamspread {version} was installed while {loaded} was in use: restart Blender to use it. "
            "Until then nothing can be baked; nodes, settings and baked images stay as they are."
        )


def problem_of(folder: Path, error: Exception) -> str:
    """Message about the error that loading the native module of the package in `folder` raised."""
    if isinstance(error, AnotherVersionError):
        return str(error)
    modules = sorted(path.name for path in folder.glob("_native.*") if path.suffix in {".so", ".pyd"})
    cause = str(error).strip().rstrip(".") if WANTED in modules else "the file for it is missing"
    return (
        f"beamspread has no working native module for Python {sys.version_info.major}.{sys.version_info.minor} in "
        f"{folder}: {cause}. Needed: {WANTED} for {platform.system()} {platform.machine()}. "
        f"Found there: {', '.join(modules) or 'none'}. Install the zip of Beamspread {_version(folder)} for this "
        "Python and system, and restart Blender. Until then nothing can be baked; nodes, settings and baked images "
        "stay as they are."
    )


def _version(folder: Path) -> str:
    return (folder / "VERSION").read_text(encoding="utf-8").strip()
