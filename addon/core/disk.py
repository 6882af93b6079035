"""Files on disk: complete or unchanged, their names, and facts from the headers of OpenEXR files."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import time
import uuid
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from .native import native

try:
    import fcntl
except ImportError:  # Windows: temporary files of killed processes stay
    fcntl = None

_TEMPORARY = re.compile(r".+\.beamspread-[0-9a-f]{8}\.tmp(\..+)?")
"""Names of temporary files, and of those that the native module writes beside them. Running processes lock theirs."""

_SPARE_BYTES = 1 << 14
"""Room that a disk must have left after a file is written. Blender and other writers ignore errors of a full disk."""

_MIN_AGE_SECONDS = 60.0
"""Age from which an unlocked temporary file counts as a leftover. A younger one may not be locked yet."""

_tidied: set[Path] = set()
"""Folders that this process has searched for leftovers."""


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Path of a temporary file beside `path`, with the same ending; it replaces `path` when the block ends.

    If the block raises, the temporary file is removed and `path` keeps its content. A link stays a link, and a file
    keeps its permissions. Temporary files that killed processes left in the folder are removed.

    Raises
    ------
    OSError
        The file cannot be written completely.
    """
    with whole_files([path]) as (temporary,):
        yield temporary


@contextmanager
def whole_files(paths: Iterable[str | Path]) -> Iterator[list[Path]]:
    """`whole_file` for several files. No file is replaced before all are written."""
    targets = [Path(path).resolve() for path in paths]
    temporaries: list[Path] = []
    locks: list[int | None] = []
    try:
        for target in targets:
            _remove_leftovers(target.parent)
            temporaries.append(target.with_name(f"{target.stem}.beamspread-{uuid.uuid4().hex[:8]}.tmp{target.suffix}"))
            locks.append(_create_locked(temporaries[-1]))
        yield temporaries
        for target, temporary in zip(targets, temporaries):
            _flush(temporary)
            if target.exists():
                shutil.copymode(target, temporary)
        for target, temporary in zip(targets, temporaries):
            temporary.replace(target)
    finally:
        for temporary in temporaries:
            temporary.unlink(missing_ok=True)
        for lock in filter(lambda lock: lock is not None, locks):
            os.close(lock)


def _create_locked(temporary: Path) -> int | None:
    """Create the file and lock it; the descriptor that holds the lock, None on systems without locks."""
    if fcntl is None:
        return None
    lock = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
    _try_lock(lock)
    return lock


def _try_lock(descriptor: int) -> bool:
    """True if no other process holds the lock; False also on file systems without locks."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _remove_leftovers(folder: Path) -> None:
    """Remove temporary files that no process has locked, once per folder."""
    if fcntl is None or folder in _tidied:
        return
    _tidied.add(folder)
    try:
        leftovers = [entry.path for entry in os.scandir(folder) if _is_old_temporary(entry)]
        for path in leftovers:
            _remove_unlocked(Path(path))
    except OSError:
        return  # the writer reports problems of the folder


def _is_old_temporary(entry: os.DirEntry) -> bool:
    return bool(_TEMPORARY.fullmatch(entry.name)) and time.time() - entry.stat().st_mtime > _MIN_AGE_SECONDS


def _remove_unlocked(path: Path) -> None:
    with path.open("r+b") as file:
        if _try_lock(file.fileno()):
            path.unlink()


def _flush(path: Path) -> None:
    """Write everything to the disk, and raise OSError if the disk is full."""
    with path.open("r+b") as file:
        size = file.seek(0, os.SEEK_END)
        file.write(bytes(_SPARE_BYTES))
        file.flush()
        os.fsync(file.fileno())
        if size == 0:
            raise OSError("nothing was written")
        file.truncate(size)
        os.fsync(file.fileno())


def is_half(path: Path) -> bool:
    """True if there is an OpenEXR file whose channels all have 16 bits; the first part of several counts."""
    return bool(_first_part(path).get("half"))


def text_of(path: Path, name: str) -> str:
    """The text of an attribute; "" if the file or the attribute is missing."""
    value = _first_part(path).get("attributes", {}).get(name)
    return value if isinstance(value, str) else ""


def _first_part(path: Path) -> dict:
    try:
        return native.read_exr_header(str(path))[0]
    except OSError:
        return {}


HASH_LETTERS = 6
"""Letters that tell equal file names apart."""


def file_stems(things: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """File name without its extension for each tuple of names. No two file names differ only by case.

    The result does not depend on the order. If several would get the same file name, the tuple that changed least
    keeps it, and the others get additional letters.
    """
    groups = defaultdict(list)
    for names in dict.fromkeys(things):
        groups[stem(names).lower()].append(names)
    result = {}
    for group in groups.values():
        first, *rest = sorted(group, key=lambda names: ("_".join(names) != stem(names), len(names), names))
        result[first] = stem(first)
        result |= {names: f"{stem(names)}_{_letters(names)}" for names in rest}
    return result


def stem(names: Iterable[str]) -> str:
    """The names, joined, in letters that every file system accepts."""
    return "_".join(re.sub(r"[^\w.-]+", "_", name).strip("._") or "unnamed" for name in names)


def _letters(names: tuple[str, ...]) -> str:
    return hashlib.sha256("\0".join(names).encode()).hexdigest()[:HASH_LETTERS]
