"""File names that every file system accepts, one for each target and layer."""

from __future__ import annotations

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable

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
        first, *others = sorted(group, key=lambda names: ("_".join(names) != stem(names), len(names), names))
        result[first] = stem(first)
        result |= {names: f"{stem(names)}_{_letters(names)}" for names in others}
    return result


def stem(names: Iterable[str]) -> str:
    """The names, joined, in letters that every file system accepts."""
    return "_".join(re.sub(r"[^\w.-]+", "_", name).strip("._") or "unnamed" for name in names)


def _letters(names: tuple[str, ...]) -> str:
    return hashlib.sha256("\0".join(names).encode()).hexdigest()[:HASH_LETTERS]
