"""The native module, which carries its libraries: nothing of the host's is taken for them, or the other way round."""

import importlib
from pathlib import Path

from . import missing


class _Missing:
    """Stands for the module where it can't be loaded: an add-on must be able to register and say why."""

    def __getattr__(self, name: str):
        raise ImportError(problem)


problem = ""
"""Why the module is missing, in a few sentences; empty when all is well."""

_FOLDER = Path(__file__).resolve().parents[1]

try:
    missing.check(_FOLDER)
    native = importlib.import_module(".._native", __package__)
    missing.check_version(_FOLDER, native.__version__)
except (ImportError, OSError) as error:
    problem = missing.problem_of(_FOLDER, error)
    native = _Missing()
