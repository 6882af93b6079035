"""LDF samples of an artist's own: a folder of EXR files in place of a simulated library."""

from __future__ import annotations

from pathlib import Path

from .errors import BakeError


def load_folder(folder: str) -> list:
    """Every sample of a folder: one per ``.exr`` file, in the order of their names.

    Raises
    ------
    BakeError
        The folder is missing or holds no EXR file, or one of them is no sample; says which.
    """
    from .._load import native

    path = Path(folder)
    if not folder or not path.is_dir():
        raise BakeError(f"There is no folder of LDF samples at '{folder}': choose one in the Beamspread settings.")
    files = sorted(file for file in path.iterdir() if file.suffix.lower() == ".exr")
    if not files:
        raise BakeError(f"The folder of LDF samples '{folder}' holds no EXR file.")
    try:
        return [native.LdfSample.load(file) for file in files]
    except OSError as error:
        raise BakeError(f"{error}.") from error


def load_source(folder: str, method: str):
    """What `convolve` takes for the samples of a folder.

    Raises
    ------
    BakeError
        As `load_folder`; or the samples don't form a grid, or are of several media.
    """
    from .._load import native

    samples = load_folder(folder)
    try:
        return native.SampleSource(samples, method)
    except ValueError as error:
        raise BakeError(f"The LDF samples in '{folder}' can't be interpolated: {error}.") from error
