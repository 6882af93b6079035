"""Files that are whole or as they were: written beside, checked, then renamed."""

from __future__ import annotations

import itertools
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_numbers = itertools.count()


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Path of a new file beside `path`, with its ending: takes its name once the block has written and checked it.

    Where the block raises, the new file is removed and what had the name keeps it. A link stays one. OSError where it
    can't be kept.
    """
    target = Path(path).resolve()
    temporary = target.with_name(f"{target.stem}.{os.getpid()}-{next(_numbers)}.tmp{target.suffix}")
    try:
        yield temporary
        _flush(temporary)
        if target.exists():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    """Have the system write what it still holds back: some disks say only then that they are full."""
    with path.open("r+b") as file:
        os.fsync(file.fileno())
