"""Files that are whole or as they were: written beside, checked, then renamed."""

from __future__ import annotations

import hashlib
import itertools
import os
import platform
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_numbers = itertools.count()
_tidied: set[Path] = set()

# Of this machine: on a disk that several share, none tells whether another's processes still run.
_MACHINE = hashlib.sha256(platform.node().encode()).hexdigest()[:6]

_TEMPORARY = re.compile(rf".+\.{_MACHINE}-(\d+)-\d+\.tmp(\.\w+)?")

# So old at least is what is left behind; where nobody can tell whether a process runs, a day.
LEFT_SECONDS, SURE_SECONDS = 60.0, 86400.0


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Path of a new file beside `path`, with its ending: takes its name once the block has written and checked it.

    Where the block raises, the new file is removed and what had the name keeps it. A link stays one. OSError where it
    can't be kept. What processes of this machine that were killed have left in the folder goes.
    """
    target = Path(path).resolve()
    _tidy(target.parent)
    temporary = target.with_name(f"{target.stem}.{_MACHINE}-{os.getpid()}-{next(_numbers)}.tmp{target.suffix}")
    try:
        yield temporary
        _flush(temporary)
        if target.exists():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _tidy(folder: Path) -> None:
    """Remove temporary files of processes that are gone, once per folder."""
    if folder in _tidied:
        return
    _tidied.add(folder)
    try:
        left = [one for one in os.scandir(folder) if (found := _TEMPORARY.fullmatch(one.name)) and _is_left(one, found)]
        for one in left:
            Path(one).unlink(missing_ok=True)
    except OSError:
        return  # writing says what is wrong with the folder


def _is_left(entry: os.DirEntry, found: re.Match) -> bool:
    age = time.time() - entry.stat(follow_symlinks=False).st_mtime
    if os.name != "posix":  # there the question would end the process
        return age > SURE_SECONDS
    return age > LEFT_SECONDS and not _runs(int(found[1]))


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # another user's
    return True


def _flush(path: Path) -> None:
    """Have the system write what it still holds back: some disks say only then that they are full."""
    with path.open("r+b") as file:
        os.fsync(file.fileno())
