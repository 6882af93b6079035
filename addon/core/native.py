"""The compiled module, or a stand-in that raises a message if the module can't be loaded."""

from __future__ import annotations

import importlib
import platform
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import TYPE_CHECKING

WANTED = [f"_native{suffix}" for suffix in (EXTENSION_SUFFIXES[0], EXTENSION_SUFFIXES[-1])]
"""Names of the files that this Python loads: its own module, or one for several Pythons."""


class AnotherVersionError(ImportError):
    """The process holds the module of another version of the package; the text is for the artist."""


def _check_version(folder: Path, loaded: str) -> None:
    """Raise AnotherVersionError if the module is not of this package's version, as after an update without a restart.

    A process can't exchange a native module.
    """
    version = _version(folder)
    if loaded != version:
        raise AnotherVersionError(
            f"Beamspread {version} was installed while {loaded} was in use: restart Blender to use it. "
            "Until then nothing can be baked; nodes, settings and baked images stay as they are."
        )


def _problem_of(folder: Path, error: Exception) -> str:
    """Message about the error that loading the native module of the package in `folder` raised."""
    if isinstance(error, AnotherVersionError):
        return str(error)
    modules = sorted(path.name for path in folder.glob("_native.*") if path.suffix in {".so", ".pyd"})
    cause = str(error).strip().rstrip(".") if set(WANTED) & set(modules) else "the file for it is missing"
    return (
        f"beamspread has no working native module for Python {sys.version_info.major}.{sys.version_info.minor} in "
        f"{folder}: {cause}. Needed: {' or '.join(WANTED)} for {platform.system()} {platform.machine()}. "
        f"Found there: {', '.join(modules) or 'none'}. Install the zip of Beamspread {_version(folder)} for this "
        "Python and system, and restart Blender. Until then nothing can be baked; nodes, settings and baked images "
        "stay as they are."
    )


def _version(folder: Path) -> str:
    return (folder / "VERSION").read_text(encoding="utf-8").strip()


class _Missing:
    """Lets the add-on register without the module: every use raises ImportError with the message."""

    def __getattr__(self, name: str):
        raise ImportError(problem)


problem = ""
"""Message that says why the module can't be used; empty if it can."""

_FOLDER = Path(__file__).resolve().parents[1]

if TYPE_CHECKING:
    from .. import _native

    native = _native
else:
    try:
        native = importlib.import_module(".._native", __package__)
        _check_version(_FOLDER, native.__version__)
    except (ImportError, OSError) as error:
        problem = _problem_of(_FOLDER, error)
        native = _Missing()
