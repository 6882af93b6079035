"""Folders of this process that other processes use: removed with their owner, also if that is killed."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
import weakref
from contextlib import suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows: folders of killed processes stay
    fcntl = None

PREFIX = "beamspread-cycles-"

# Age from which an unlocked folder counts as a leftover; a younger one may not be locked yet.
MIN_AGE_SECONDS = 60.0


class Folder:
    """A temporary folder, removed with the object, when the process ends, or by `remove()`.

    An object from a pickle is the same folder, which it leaves alone.
    """

    def __init__(self) -> None:
        remove_leftovers()
        self.path = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))
        self._remover = weakref.finalize(self, _remove, self.path, _lock(self.path))

    def __getstate__(self) -> dict:
        """State for a process that uses the folder and does not own it."""
        return {**self.__dict__, "_remover": None}

    def remove(self) -> None:
        """Remove the folder."""
        if self._remover is not None:
            self._remover()


def remove_leftovers() -> None:
    """Remove folders that no process has locked: those of processes that were killed."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):  # another user's, or removed meanwhile
            if fcntl is not None and time.time() - folder.stat().st_mtime > MIN_AGE_SECONDS:
                _remove(folder, _lock(folder))


def _lock(folder: Path) -> int | None:
    """Descriptor that holds a lock on a folder, None on systems without locks; OSError if another holds it."""
    if fcntl is None:
        return None
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _remove(folder: Path, lock: int | None) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    if lock is not None:
        os.close(lock)
