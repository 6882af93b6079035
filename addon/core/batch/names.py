"""Names of files that every file system takes, each for one thing of the scene alone."""

from __future__ import annotations

import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable

HASH_LETTERS = 6


def file_stems(things: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """A file name without its ending for each of these, which are tuples of names; no two names differ by case alone.

    What is given decides, not its order: of several that would be called the same, the one that was changed least
    keeps that name, and the others get letters of their own.
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
    """The names, of letters that every file system takes."""
    return "_".join(re.sub(r"[^\w.-]+", "_", name).strip("._") or "unnamed" for name in names)


def _letters(names: tuple[str, ...]) -> str:
    return hashlib.sha256("\0".join(names).encode()).hexdigest()[:HASH_LETTERS]
