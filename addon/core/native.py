"""The compiled module, or a stand-in that raises a message if the module can't be loaded."""

import importlib
from pathlib import Path
from typing import TYPE_CHECKING

from . import missing


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
        missing.check_version(_FOLDER, native.__version__)
    except (ImportError, OSError) as error:
        problem = missing.problem_of(_FOLDER, error)
        native = _Missing()
