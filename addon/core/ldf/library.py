"""LDF sources: libraries of any medium, shipped, cached, or simulated and then cached; and folders of samples."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from ..disk import whole_file
from ..errors import BakeError
from ..native import native
from ..progress import Callback, Progress
from ..recent import keep_recent
from .curvatures import curvatures_for, curved_angles_for, curved_photons_for, with_curvatures

PHOTONS = {"preview": 80_000, "final": 4_000_000}
"""Photons per angle for a medium with g .8 and ior 1. More: less noise, more time; see `photons_for`."""

_MAX_PHOTONS = 4_000_000
"""Largest number of photons per angle. More: less noise in media of little scattering, more time."""

SIMULATING = {
    "preview": "Simulating the material (quick preview)",
    "final": "Simulating the material (only the first time)",
}
"""Names of the stage of a simulation, by quality."""

_FILE_VERSION = 10
"""Version of the simulation. Increment it when the simulation changes, so that cached files are made again."""

_CURVED_FILE_VERSION = 1
"""Version of the simulation of curved surfaces, as `_FILE_VERSION`."""

SHIPPED_FOLDER = Path(__file__).resolve().parents[2] / "library"
"""Libraries that came with the package, made by ``tools/make_library.py``."""


def angles_for(medium: native.Medium) -> Sequence[float]:
    """Angles of incidence to simulate, degrees.

    With refraction the light inside changes slowly with the angle outside. Without it, light leaves the more suddenly
    near grazing the more the phase function peaks forward. Interpolation between these angles changes totals by at most
    .15 % below 75 degrees and .8 % up to 85 degrees (besides 1e-6 of the incident power), for g -.5 to .95, thicknesses
    from .5 and all albedos.
    """
    if medium.ior < 1.02 and medium.thickness <= max(4.0, 0.5 / (1.0 - medium.g)):
        # The beam's exit on the far side moves to infinity toward grazing.
        return (0.0, 10.0, 20.0, 30.0, 39.0, 47.0, 54.0, 60.0, 65.0, 69.0, 72.5, 75.3, 77.6, 79.5, 81.1, 82.5, 83.4,
                84.1, 84.6, 85.0, 86.2, 88.5)  # fmt: skip
    if medium.ior > 1.0 and medium.thickness < 2.0:
        # Light from the far side surrounds the beam's mirror image, which moves with the angle.
        return (*map(float, range(0, 73, 6)), 76.0, 80.0, 84.0, 88.0)
    if medium.ior >= 1.2:
        return (0.0, 12.0, 24.0, 36.0, 47.0, 57.0, 66.0, 73.0, 79.0, 84.0, 88.0)
    if medium.g <= 0.85:
        return (0.0, 11.0, 22.0, 33.0, 43.0, 52.0, 60.0, 67.0, 73.0, 78.0, 82.0, 85.5, 88.5)
    return (0.0, 9.0, 18.0, 27.0, 36.0, 44.5, 52.0, 58.5, 64.5, 70.0, 74.5, 78.5, 82.0, 85.0, 87.0, 89.0)


_chosen = {"folder": ""}


def choose_cache_folder(folder: str | Path) -> None:
    """Set the folder of cached libraries; empty: the default of `cache_folder`."""
    _chosen["folder"] = str(folder)


def cache_folder() -> Path:
    """Folder of cached libraries: ``$BEAMSPREAD_CACHE``, else the chosen one, else the user's cache folder."""
    if folder := os.environ.get("BEAMSPREAD_CACHE") or _chosen["folder"]:
        return Path(folder)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "beamspread"


def photons_for(medium: native.Medium, quality: str) -> int:
    """Photons per angle that take about the same time in every medium.

    The number of scatterings before light leaves grows like 1 / (1 - g), in a slab at most like its thickness, and with
    internal reflection like ior^2.
    """
    scatterings = min(1.0 / (1.0 - medium.g), 1.0 + medium.thickness)
    return round(min(5.0 * PHOTONS[quality] / scatterings / medium.ior**2, _MAX_PHOTONS))


def make(
    medium: native.Medium, quality: str, progress: Callback | None = None, kernel: str = "", threads: int = 0
) -> native.LdfLibrary:
    """Simulate the library of a medium and make its totals exact."""
    photons = photons_for(medium, quality)
    simulated = native.simulate(medium, angles_for(medium), photons, progress=progress, kernel=kernel, threads=threads)
    return simulated.calibrated()


def file_name(medium: native.Medium, quality: str) -> str:
    """Name of the file of a medium's shipped library."""
    return f"g{medium.g:g}_ior{medium.ior:g}_thickness{medium.thickness:g}_{quality}.exr"


def curved_file_name(medium: native.Medium, quality: str) -> str:
    """Name of the shipped file of a medium's curved surfaces."""
    return file_name(medium, f"{quality}_curved" if quality != "final" else "curved")


def _cache_path(medium: native.Medium, quality: str) -> Path:
    key = repr(
        (_FILE_VERSION, medium.g, medium.ior, medium.thickness, angles_for(medium), photons_for(medium, quality))
    )
    digest = hashlib.sha256(key.encode()).hexdigest()[:16]
    name = Path(file_name(medium, quality))
    return cache_folder() / f"{name.stem}_{digest}.exr"


def _curved_cache_path(medium: native.Medium, quality: str) -> Path:
    photons = curved_photons_for(medium, quality)
    key = repr((_CURVED_FILE_VERSION, medium, curvatures_for(medium), curved_angles_for(medium), photons))
    digest = hashlib.sha256(key.encode()).hexdigest()[:16]
    return cache_folder() / f"{Path(file_name(medium, quality)).stem}_curved_{digest}.exr"


def _load(path: Path, medium: native.Medium) -> native.LdfLibrary | None:
    """The library in a file; None if the file is missing, damaged or of another medium."""
    try:
        loaded = native.LdfLibrary.load(path)
    except OSError:
        return None
    complete = loaded.is_calibrated and tuple(loaded.angles) == angles_for(medium)
    return loaded if complete and loaded.medium == medium else None


def _load_shipped(medium: native.Medium, quality: str) -> native.LdfLibrary | None:
    """A shipped library of at least this quality, or None."""
    for name in (quality, "final"):
        if shipped := _load(SHIPPED_FOLDER / file_name(medium, name), medium):
            return shipped
    return None


def _store(result: native.LdfLibrary, path: Path, with_plane: bool) -> None:
    """Save a library to the cache; a full or read-only disk must not fail the bake."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as temporary:
            result.save(temporary, with_plane)
    except OSError:
        pass


def cached_files() -> list[Path]:
    """Files of cached libraries. Other files in the folder belong to others, and temporary ones to `whole_file`."""
    try:
        paths = cache_folder().glob("g*_ior*_thickness*_*.exr")
        return sorted(path for path in paths if path.is_file() and ".tmp." not in path.name)
    except OSError:
        return []


def clear_cache() -> int:
    """Remove all libraries from the cache folder and from memory. Returns the freed bytes."""
    freed = 0
    for path in cached_files():
        try:
            size = path.stat().st_size
            path.unlink()
            freed += size
        except OSError:  # in use by another process, or removed by it
            continue
    _loaded.clear()
    return freed


def is_known(medium: native.Medium, quality: str, curved: bool = False) -> bool:
    """True if `library` need not simulate. Checks names of files alone; damaged files are simulated again."""
    known = _is_any(_cache_path(medium, quality), [file_name(medium, name) for name in (quality, "final")])
    if not curved or not curvatures_for(medium):
        return known
    names = [curved_file_name(medium, name) for name in (quality, "final")]
    return known and _is_any(_curved_cache_path(medium, quality), names)


def _is_any(path: Path, shipped: Sequence[str]) -> bool:
    return path in _loaded or path.is_file() or any((SHIPPED_FOLDER / name).is_file() for name in shipped)


_loaded: dict[Path, native.LdfLibrary] = {}
"""Cache of recently used libraries by path, oldest first."""

_MAX_LOADED = 8
"""Capacity of `_loaded`. Larger: fewer files read again, more memory."""


def library(
    medium: native.Medium,
    quality: str = "final",
    progress: Callback | None = None,
    threads: int = 0,
    curved: bool = False,
) -> native.LdfLibrary:
    """Load the LDF library of a medium, for every angle of incidence and albedo, or simulate it (up to minutes).

    Parameters
    ----------
    medium : Medium
    quality : {"final", "preview"}
        Amount of noise in the maps, see `LdfLibrary.image_standard_error`. Totals are exact with either, see
        `LdfLibrary.calibrated`.
    progress : callable, optional
        Called with the finished fraction while a simulation runs. It stops the simulation by returning False.
    threads : int
        Number of threads; 0: all. The result does not depend on it.
    curved : bool
        True for a library that also has curved surfaces, see `LdfLibrary.curvatures`: from -1/3 to 1 per transport mean
        free path ``1 / (1 - g)``. A slab has none: a bent slab uses the LDF of the flat one.

    Returns
    -------
    LdfLibrary
        The shipped library, else the cached one, else one that is simulated and cached.

    Raises
    ------
    ValueError
        An argument is no Medium, quality or function. Names the argument.
    Cancelled
        `progress` returned False.
    """
    if not isinstance(medium, native.Medium):
        raise ValueError(f"argument 'medium' is {medium!r}; allowed: a Medium")
    if quality not in PHOTONS:
        raise ValueError(f"argument 'quality' is {quality!r}; allowed: 'final', 'preview'")
    progress = Progress.of(progress)
    curved = curved and bool(curvatures_for(medium))
    if available := _available_library(medium, quality, curved):
        return available
    plane = _available_library(medium, quality)
    if plane and not curved:
        return plane
    parts = iter(progress.split([1.0] * (curved + (not plane))))
    if not plane:
        part = next(parts)
        part.begin(SIMULATING[quality])
        plane = _keep(make(medium, quality, part, threads=threads), _cache_path(medium, quality))
    if not curved:
        return plane
    part = next(parts)
    part.begin(SIMULATING[quality])
    result = with_curvatures(plane, quality, part, threads=threads)
    return _keep(result, _curved_cache_path(medium, quality), with_plane=False)


def _keep(simulated: native.LdfLibrary, path: Path, with_plane: bool = True) -> native.LdfLibrary:
    """Cache a library in a file and in memory."""
    _store(simulated, path, with_plane)
    return keep_recent(_loaded, path, simulated, _MAX_LOADED)


def known_library(medium: native.Medium, curved: bool = False) -> native.LdfLibrary | None:
    """The best shipped or cached library of a medium; None if it must be simulated."""
    return _available_library(medium, "final", curved) or _available_library(medium, "preview", curved)


def _available_library(medium: native.Medium, quality: str, curved: bool = False) -> native.LdfLibrary | None:
    if curved and curvatures_for(medium):
        return _available_curved(medium, quality)
    path = _cache_path(medium, quality)
    available = _loaded.get(path) or _load_shipped(medium, quality) or _load(path, medium)
    return available and keep_recent(_loaded, path, available, _MAX_LOADED)


def _available_curved(medium: native.Medium, quality: str) -> native.LdfLibrary | None:
    path = _curved_cache_path(medium, quality)
    available = _loaded.get(path)
    if not available and (plane := _available_library(medium, quality)):
        files = [SHIPPED_FOLDER / curved_file_name(medium, name) for name in (quality, "final")]
        for file in (*files, path):
            available = available or _load_curved(file, plane)
    return available and keep_recent(_loaded, path, available, _MAX_LOADED)


def _load_curved(path: Path, plane: native.LdfLibrary) -> native.LdfLibrary | None:
    """A library with the curved surfaces in a file; None if the file is missing, damaged or of another medium."""
    try:
        loaded = plane.with_curved_from(path)
    except (OSError, ValueError):
        return None
    nodes = sorted((0.0, *curvatures_for(plane.medium)))
    return loaded if loaded.curvatures == nodes else None


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
        return _load_samples(tuple((file, stat.st_mtime_ns, stat.st_size) for file, stat in zip(files, stats)), method)
    except OSError as error:
        raise BakeError(f"{error}.") from error
    except ValueError as error:
        raise BakeError(f"The LDF samples in '{folder}' can't be interpolated: {error}.") from error


@lru_cache(maxsize=1)
def _load_samples(files: tuple[tuple[Path, int, int], ...], method: str):
    """Source of the samples in files; times and sizes are part of the cache's key."""
    return native.SampleSource([native.LdfSample.load(file) for file, _, _ in files], method)
