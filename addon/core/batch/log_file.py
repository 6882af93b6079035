"""The log of a batch in a file."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def unwritable(path: str | None) -> str:
    """Why the log can't be written to a file; "" if it can, or if there is none."""
    try:
        if path is not None:
            Path(path).open("a", encoding="utf-8").close()
    except OSError as error:
        return f"The log {path} cannot be written: {error}"
    return ""


@contextmanager
def log_file(path: str | None, heading: str) -> Iterator[None]:
    """Append a heading and all that the package logs to the file at `path`, None: nowhere."""
    if path is None:
        yield
        return
    logger = logging.getLogger(__name__.rpartition(".core.")[0])
    level, handler = logger.level, logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.DEBUG)
    try:
        logger.debug(heading)
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)
        handler.close()
