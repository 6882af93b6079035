"""What images, and files of frames, remember of the bakes in them: what each has read, and what there was to say."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from ....core.exr_header import text_of
from ....core.target import Target
from .fingerprint import Parts

# Text, since names of objects may be longer than Blender's own keys.
KEY = "beamspread_bakes"

# Of an EXR file.
ATTRIBUTE = "beamspread:bake"


@dataclass(frozen=True)
class Record:
    """One bake in an image: digests of what it read, what it said, and whether its pixels were not saved then."""

    parts: Parts
    warnings: tuple[str, ...] = ()
    is_dirty: bool = False
    notes: tuple[str, ...] = ()

    def changed(self, now: Parts) -> list[str]:
        """Names of the parts that are no longer the same; of those that older files don't know nothing is said."""
        return [name for name, digest in now.items() if self.parts.get(name, digest) != digest]


def record_of(image, target: Target) -> Record | None:
    """Of the target's bake in the image, or None if it has none."""
    return _record(_all(image).get(str(target)))


def record_in(path: Path) -> Record | None:
    """Of the bake in a file, or None if it says nothing of one."""
    return _record(_read(text_of(path, ATTRIBUTE)))


def in_file(record: Record) -> dict[str, str]:
    """Attributes by which a file says so."""
    return {ATTRIBUTE: json.dumps(asdict(record))}


def keep_record(image, target: Target, record: Record) -> None:
    image[KEY] = json.dumps(_all(image) | {str(target): asdict(record)})


def _all(image) -> dict:
    return _read(image.get(KEY, "{}"))


def _read(text: str) -> dict:
    try:
        known = json.loads(text)
    except (TypeError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _record(found: dict | None) -> Record | None:
    if not found:
        return None
    return Record(found["parts"], tuple(found["warnings"]), found["is_dirty"], tuple(found.get("notes", ())))
