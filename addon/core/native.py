"""The native module, which carries its libraries: nothing of the host's is taken for them, or the other way round."""

import importlib
import sys
from pathlib import Path


class _Missing:
    """Stands for the module where it can't be loaded: an add-on must be able to register and say why."""

    def __getattr__(self, name: str):
        raise ImportError(problem)


problem = ""
"""Why the module is missing, in one sentence; empty when all is well."""

try:
    native = importlib.import_module(".._native", __package__)
except ImportError as error:
    folder = Path(__file__).resolve().parents[1]
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    problem = (
        f"beamspread has no working native module for Python {version} in {folder} "
        f"(looked for _native.cpython-{version.replace('.', '')}-*.so): {error}"
    )
    native = _Missing()
