"""The native module, loaded so that its own libraries win over those of the host process.

Embree's functions have the same names in versions 3 and 4: inside a Blender that brings Embree 4, a
module linked to Embree 3 would call version 4 and crash later. RTLD_DEEPBIND makes the module
look up symbols in its own dependencies first.
"""

import importlib
import os
import sys
from pathlib import Path

from . import missing


def _load():
    if not hasattr(os, "RTLD_DEEPBIND") or os.environ.get("BEAMSPREAD_NO_DEEPBIND"):  # for sanitizers
        return importlib.import_module(".._native", __package__)
    flags = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_LOCAL | os.RTLD_DEEPBIND)
    try:
        return importlib.import_module(".._native", __package__)
    finally:
        sys.setdlopenflags(flags)


class _Missing:
    """Stands for the module where it can't be loaded: an add-on must be able to register and say why."""

    def __getattr__(self, name: str):
        raise ImportError(problem)


problem = ""
"""Why the module is missing, in a few sentences; empty when all is well."""

_FOLDER = Path(__file__).resolve().parents[1]

try:
    missing.check(_FOLDER)
    native = _load()
    missing.check_version(_FOLDER, native.__version__)
except (ImportError, OSError) as error:
    problem = missing.problem_of(_FOLDER, error)
    native = _Missing()
