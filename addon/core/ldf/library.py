"""LDF libraries of any medium: from the cache, or simulated now and cached."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from ..native import native
from ..progress import Progress, say
from ..recent import keep_recent

PHOTONS = {"preview": 80_000, "final": 4_000_000}
"""Photons per angle for a medium with g .8 and ior 1; see `photons_for`."""

SIMULATING = "Simulating the medium, once"
"""What takes so long, for whoever watches the progress."""

_MAX_PHOTONS = 4_000_000

_FILE_VERSION = 10
"""Raised when the simulation changes, so that older cached files are made again."""

SHIPPED_FOLDER = Path(__file__).resolve().parents[2] / "library"
"""Libraries that came with the package, made by ``tools/make_library.py``."""


def angles_for(medium: native.Medium) -> Sequence[float]:
    """Angles of incidence to simulate, degrees.

    Refraction lets the light inside change slowly with the angle outside; without it, the more a phase function peaks
    forward, the more suddenly light leaves again near grazing. With these angles interpolation moves no total from 0 to
    85 degrees by more than .15 % (.8 % from 75 degrees on), whatever the albedo, for g -.5 to .95 and
    thicknesses from .5, up to 1e-6 of the incident power.
    """
    if medium.ior < 1.02 and medium.thickness <= max(4.0, 0.5 / (1.0 - medium.g)):
        # The place where the beam leaves the far side runs away toward grazing.
        return (0.0, 10.0, 20.0, 30.0, 39.0, 47.0, 54.0, 60.0, 65.0, 69.0, 72.5, 75.3, 77.6, 79.5, 81.1, 82.5, 83.4,
                84.1, 84.6, 85.0, 86.2, 88.5)  # fmt: skip
    if medium.ior > 1.0 and medium.thickness < 2.0:
        # What comes back from the far side surrounds the beam's mirror image, which moves with the angle.
        return (*map(float, range(0, 73, 6)), 76.0, 80.0, 84.0, 88.0)
    if medium.ior >= 1.2:
        return (0.0, 12.0, 24.0, 36.0, 47.0, 57.0, 66.0, 73.0, 79.0, 84.0, 88.0)
    if medium.g <= 0.85:
        return (0.0, 11.0, 22.0, 33.0, 43.0, 52.0, 60.0, 67.0, 73.0, 78.0, 82.0, 85.5, 88.5)
    return (0.0, 9.0, 18.0, 27.0, 36.0, 44.5, 52.0, 58.5, 64.5, 70.0, 74.5, 78.5, 82.0, 85.0, 87.0, 89.0)


_chosen = {"folder": ""}


def choose_cache_folder(folder: str | Path) -> None:
    """Keep libraries in a folder of the user's from now on; empty: where `cache_folder` has it otherwise."""
    _chosen["folder"] = str(folder)


def cache_folder() -> Path:
    """Folder of cached libraries: ``$BEAMSPREAD_CACHE``, the one chosen, or the user's cache folder."""
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

    The number of scatterings before light leaves grows like 1 / (1 - g), in a slab no further than with its thickness,
    and internal reflection keeps light in longer.
    """
    scatterings = min(1.0 / (1.0 - medium.g), 1.0 + medium.thickness)
    return round(min(5.0 * PHOTONS[quality] / scatterings / medium.ior**2, _MAX_PHOTONS))


def make(
    medium: native.Medium, quality: str, progress: Progress | None = None, kernel: str = "", threads: int = 0
) -> native.LdfLibrary:
    """Simulate the library of a medium and make its totals exact."""
    photons = photons_for(medium, quality)
    simulated = native.simulate(medium, angles_for(medium), photons, progress=progress, kernel=kernel, threads=threads)
    return simulated.calibrated()


def file_name(medium: native.Medium, quality: str) -> str:
    """Name of the file that holds the library of a medium."""
    return f"g{medium.g:g}_ior{medium.ior:g}_thickness{medium.thickness:g}_{quality}.exr"


def _cache_path(medium: native.Medium, quality: str) -> Path:
    key = repr(
        (_FILE_VERSION, medium.g, medium.ior, medium.thickness, angles_for(medium), photons_for(medium, quality))
    )
    digest = hashlib.sha256(key.encode()).hexdigest()[:16]
    name = Path(file_name(medium, quality))
    return cache_folder() / f"{name.stem}_{digest}.exr"


def _load(path: Path, medium: native.Medium) -> native.LdfLibrary | None:
    """The library in a file; None where there is no such file, or where it is damaged or another medium's."""
    try:
        found = native.LdfLibrary.load(path)
    except OSError:
        return None
    whole = found.is_calibrated and tuple(found.angles) == angles_for(medium)
    return found if whole and found.medium == medium else None


def _load_shipped(medium: native.Medium, quality: str) -> native.LdfLibrary | None:
    """A shipped library of at least this quality, or None."""
    for name in (quality, "final"):
        if found := _load(SHIPPED_FOLDER / file_name(medium, name), medium):
            return found
    return None


def _store(result: native.LdfLibrary, path: Path) -> None:
    """Caching is a convenience: a full or read-only disk must not cost the bake."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        result.save(path)
    except OSError:
        pass


def cached_files() -> list[Path]:
    """The files of the cache, which hold libraries only: whatever else lies in the folder is not ours."""
    try:
        return sorted(path for path in cache_folder().glob("g*_ior*_thickness*_*.exr") if path.is_file())
    except OSError:
        return []


def clear_cache() -> int:
    """Remove the libraries from the cache, and forget those in memory; the bytes freed."""
    freed = 0
    for path in cached_files():
        try:
            size = path.stat().st_size
            path.unlink()
            freed += size
        except OSError:  # another process has it, or it is gone
            continue
    _loaded.clear()
    return freed


def is_known(medium: native.Medium, quality: str) -> bool:
    """Whether `library` need not simulate, as far as names of files tell: a damaged file is made again."""
    path = _cache_path(medium, quality)
    shipped = (SHIPPED_FOLDER / file_name(medium, name) for name in (quality, "final"))
    return path in _loaded or path.is_file() or any(one.is_file() for one in shipped)


_loaded: dict[Path, native.LdfLibrary] = {}
"""The libraries used last, by path, oldest first."""

_LOADED_LIMIT = 8


def library(
    medium: native.Medium, quality: str = "final", progress: Progress | None = None, threads: int = 0
) -> native.LdfLibrary:
    """LDF library of a medium for every angle of incidence and albedo.

    Parameters
    ----------
    medium : Medium
    quality : {"final", "preview"}
        Totals are exact either way, as `LdfLibrary.calibrated` has it; what differs is the noise of the maps, see
        `LdfLibrary.image_standard_error`.
    progress : callable, optional
        Called with the finished fraction while a simulation runs; only the answer False (or NumPy's) stops.
    threads : int
        0: all. The result does not depend on it.

    Returns
    -------
    LdfLibrary
        One that came with the package, else from the cache folder, else simulated now and cached.

    Raises
    ------
    ValueError
        Names the argument that is no Medium, quality or function.
    Cancelled
        `progress` returned False.
    """
    if not isinstance(medium, native.Medium):
        raise ValueError(f"argument 'medium' is {medium!r}; allowed: a Medium")
    if quality not in PHOTONS:
        raise ValueError(f"argument 'quality' is {quality!r}; allowed: 'final', 'preview'")
    if known := _at_hand(medium, quality):
        return known
    say(progress, SIMULATING + (" (preview)" if quality == "preview" else ""))
    made = make(medium, quality, progress, threads=threads)
    path = _cache_path(medium, quality)
    _store(made, path)
    return keep_recent(_loaded, path, made, _LOADED_LIMIT)


def known_library(medium: native.Medium) -> native.LdfLibrary | None:
    """The best library of a medium that came with the package or is cached; None where one would be simulated."""
    return _at_hand(medium, "final") or _at_hand(medium, "preview")


def _at_hand(medium: native.Medium, quality: str) -> native.LdfLibrary | None:
    path = _cache_path(medium, quality)
    found = _loaded.get(path) or _load_shipped(medium, quality) or _load(path, medium)
    return found and keep_recent(_loaded, path, found, _LOADED_LIMIT)
