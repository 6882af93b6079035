"""Caches: of the entries used last, and of values that live as long as an array."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Hashable
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def keep_recent(cache: dict, key, value, capacity: int):
    """Make the value the most recent entry, drop the oldest beyond `capacity`, and return the value."""
    cache.pop(key, None)
    cache[key] = value
    while len(cache) > capacity:
        del cache[next(iter(cache))]
    return value


_of_arrays: dict[tuple, tuple[weakref.ref, object]] = {}


def keep_with(array: np.ndarray, key: Hashable, make: Callable[[], T]) -> T:
    """The value that was made first for an array, which must not change, and a key; it goes with the array.

    A value that holds the array would keep it.
    """
    entry = id(array), key
    known = _of_arrays.get(entry)
    if known is not None and known[0]() is array:
        return known[1]
    value = make()
    _of_arrays[entry] = weakref.ref(array, lambda _: _of_arrays.pop(entry, None)), value
    return value
