"""Folders of LDF samples, EXR files that replace a simulated library."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from ..errors import BakeError
from ..native import native


def load_source(folder: str, method: str):
    """LDF source, for `convolve`, of the samples in a folder: one per ``.exr`` file, sorted by name.

    Files are read again only after a change.

    Raises
    ------
    BakeError
        The folder is missing or has no EXR file, a file is no sample, or the samples don't form a grid of one medium.
    """
    path = Path(folder)
    if not folder or not path.is_dir():
        raise BakeError(f"There is no folder of LDF samples at '{folder}'.", "Choose one in the Beamspread settings.")
    files = sorted(file for file in path.iterdir() if file.suffix.lower() == ".exr")
    if not files:
        raise BakeError(
            f"The folder of LDF samples '{folder}' holds no EXR file.", "Choose another in the Beamspread settings."
        )
    try:
        stats = [file.stat() for file in files]
        return _load(tuple((file, stat.st_mtime_ns, stat.st_size) for file, stat in zip(files, stats)), method)
    except OSError as error:
        raise BakeError(f"{error}.") from error
    except ValueError as error:
        raise BakeError(f"The LDF samples in '{folder}' can't be interpolated: {error}.") from error


@lru_cache(maxsize=1)
def _load(files: tuple[tuple[Path, int, int], ...], method: str):
    """Source of the samples in files; times and sizes are part of the cache's key."""
    return native.SampleSource([native.LdfSample.load(file) for file, _, _ in files], method)
