"""LDF libraries of any medium: from the cache, or simulated now and cached."""

import hashlib
import os
import sys
from pathlib import Path

from .._load import native

ANGLES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 58.0, 65.0, 71.0, 76.0, 80.0, 84.0, 88.0)
"""Simulated angles of incidence, degrees; denser toward grazing, where distributions change fastest."""

PHOTONS = {"preview": 32_000, "final": 800_000}
"""Photons per angle for a medium with g .8 and ior 1; see `photons_for`."""

_MAX_PHOTONS = 1_000_000

_FILE_VERSION = 2
"""Raised when the simulation changes, so that older cached files are made again."""


def cache_folder():
    """Folder of cached libraries: ``$BEAMSPREAD_CACHE``, or the user's cache folder."""
    if folder := os.environ.get("BEAMSPREAD_CACHE"):
        return Path(folder)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "beamspread"


def photons_for(medium, quality):
    """Photons per angle that take about the same time in every medium.

    The number of scatterings before light leaves grows like 1 / (1 - g), and internal reflection keeps it in longer.
    """
    effort = (1.0 - medium.g) / 0.2 / medium.ior**2
    return int(min(PHOTONS[quality] * effort, _MAX_PHOTONS))


def _cache_path(medium, quality):
    key = repr((_FILE_VERSION, medium.g, medium.ior, medium.thickness, ANGLES, photons_for(medium, quality)))
    digest = hashlib.sha256(key.encode()).hexdigest()[:16]
    name = f"g{medium.g:g}_ior{medium.ior:g}_thickness{medium.thickness:g}_{quality}_{digest}.exr"
    return cache_folder() / name


def _load_cached(path, medium):
    """The cached library, or None where there is none, or where the file is damaged or another medium's."""
    try:
        cached = native.LdfLibrary.load(path)
    except OSError:
        return None
    return cached if cached.medium == medium else None


def _store(result, path):
    """Caching is a convenience: a full or read-only disk must not cost the bake."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        result.save(path)
    except OSError:
        pass


_loaded = {}
"""The libraries used last, by path, oldest first."""

_LOADED_LIMIT = 8


def _remember(path, result):
    _loaded.pop(path, None)
    _loaded[path] = result
    while len(_loaded) > _LOADED_LIMIT:
        del _loaded[next(iter(_loaded))]
    return result


def library(medium, quality="final", progress=None):
    """LDF library of a medium for every angle of incidence and albedo.

    Parameters
    ----------
    medium : Medium
    quality : {"final", "preview"}
        Relative standard error of the totals up to 60 degrees: at most 0.4 % and 2 % for g up to .8.
    progress : callable, optional
        Called with the finished fraction while a simulation runs; returning False stops.

    Returns
    -------
    LdfLibrary
        From the cache folder if it is there, else simulated now and cached.

    Raises
    ------
    ValueError
        Unknown quality.
    Cancelled
        `progress` returned False.
    """
    if quality not in PHOTONS:
        raise ValueError(f"argument 'quality' is {quality!r}; allowed: 'final', 'preview'")
    path = _cache_path(medium, quality)
    known = _loaded.get(path) or _load_cached(path, medium)
    if known is None:
        known = native.simulate(medium, ANGLES, photons_for(medium, quality), progress=progress)
        _store(known, path)
    return _remember(path, known)
