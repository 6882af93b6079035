"""Facts that an image keeps about the bakes in it: one text under one key of the image.

A target whose bake is recorded in an image owns its part of it, so that no other bake overwrites the result unasked.
Targets are recorded by name: pointers would keep deleted objects in the file.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import NamedTuple

import bpy
from bpy.app.handlers import persistent

from ...core.bake.pace import pace
from ...core.bake.runner import Bake
from ...core.disk import text_of
from ...core.messages import Level, Message, note, warning
from ...core.target import FRONT, Target
from .. import compat
from ..node.find import BakeTarget, targets_of
from ..read.digests import SCHEME
from ..read.visibility import with_instanced
from ..registration import all_or_nothing, handlers
from . import icons

KEY = "beamspread"
"""Key of the group in an image: "facts", JSON, and "former", a pointer that keeps that image in the file."""

VERSION = 1
"""Version of the JSON."""

OLD_KEYS = {name: f"beamspread_{name}" for name in ("results", "bakes", "stamp", "undone", "frames", "former")}
"""Keys of images in files of earlier versions, one for each fact."""

OLD_PREVIEW = "beamspread_preview"
"""Key of images that Live of earlier versions made for nodes without an image."""

ATTRIBUTE = "beamspread:bake"
"""EXR attribute that holds the record of a frame of a batch."""

_sessions: dict[Target, int] = {}
"""Session number of each target's object."""


@dataclass(frozen=True)
class Record:
    """One bake.

    Attributes
    ----------
    parts : digest of each part of the scene that the bake read; empty if unknown.
    warnings, notes : messages of the bake.
    is_dirty : True if the image had unsaved pixels right after the bake.
    scheme : number of the way in which the digests were made; 1 in files of earlier versions.
    ratios : measured over estimated seconds of the bake's steps, by their kind, see `Pace`.
    """

    parts: dict[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    is_dirty: bool = False
    notes: tuple[str, ...] = ()
    scheme: int = SCHEME
    ratios: dict[str, float] = field(default_factory=dict)

    def is_comparable(self) -> bool:
        """True if the digests can be compared with present ones."""
        return self.scheme == SCHEME

    def changed(self, now: dict[str, str]) -> list[str]:
        """Names of the parts whose digest differs. Parts that the record lacks count as unchanged.

        The first word of a part is its digest. More words are digests of single objects; earlier versions lack them.
        """
        return [name for name, part in now.items() if self.parts.get(name, part).split(" ")[0] != part.split(" ")[0]]

    def messages(self) -> tuple[Message, ...]:
        """Messages of the bake, whose subjects are not recorded."""
        return (*(warning("", text) for text in self.warnings), *(note("", text) for text in self.notes))


class Frames(NamedTuple):
    """First and last frame of an image sequence, and the size of its images in texels."""

    first: int
    last: int
    width: int
    height: int


@dataclass
class ImageFacts:
    """Facts about one image.

    Attributes
    ----------
    bakes : record of each target whose result the image holds.
    stamp : identifies the last bake in the image; undo restores it together with packed pixels.
    is_undone : True if the last bake was undone, which leaves the image's file as it is.
    frames : frames of a batch; None unless the image is such a sequence.
    former : image that the node showed before this sequence.
    """

    bakes: dict[Target, Record] = field(default_factory=dict)
    stamp: str = ""
    is_undone: bool = False
    frames: Frames | None = None
    former: bpy.types.Image | None = None


def record_of_bake(bake: Bake, parts: dict[str, str], is_dirty: bool = False) -> Record:
    """Record of a bake that has read these parts."""
    warnings, notes = (tuple(map(str, bake.messages.of(level))) for level in (Level.WARNING, Level.INFO))
    return Record(parts, warnings, is_dirty, notes, ratios=pace.ratios_of(bake.target.object_name))


def facts_of(image) -> ImageFacts:
    """Facts of an image; empty ones if it has none."""
    group = image.get(KEY)
    if group is None:
        return _migrated(image)
    known = _parsed(group["facts"])
    return ImageFacts(
        {Target(*names): _record(entry) for *names, entry in known.get("bakes", [])},
        known.get("stamp", ""),
        known.get("is_undone", False),
        Frames(*known["frames"]) if known.get("frames") else None,
        group.get("former"),
    )


def set_facts(image, facts: ImageFacts) -> None:
    """Replace the facts of an image."""
    # Earlier versions know no sides.
    sides = {target: [target.side] if target.side != FRONT else [] for target in facts.bakes}
    bakes = [
        (target.object_name, target.material_name, *sides[target], asdict(record))
        for target, record in facts.bakes.items()
    ]
    known = {"version": VERSION, "bakes": bakes, "stamp": facts.stamp, "is_undone": facts.is_undone}
    pointers = {} if facts.former is None else {"former": facts.former}
    image[KEY] = {"facts": json.dumps(known | {"frames": facts.frames}), **pointers}
    for key in OLD_KEYS.values():
        image.pop(key, None)


def note_bake(image, target: Target, record: Record | None = None) -> None:
    """Record a bake of the target; without a record, only that the target owns its part of the image.

    Targets that were renamed get their new names. Targets that no longer show the image lose their record.
    """
    facts = facts_of(image)
    users = users_of(image) if facts.bakes else []
    bakes = {user: entry for name, entry in facts.bakes.items() for user in _known_as(name, users)}
    facts.bakes = bakes | {target: record or bakes.get(target, Record())}
    set_facts(image, facts)
    remember([target])


def record_of(image, target: Target) -> Record | None:
    """Record of the target's bake in the image, or None. The target may have been renamed since."""
    bakes = facts_of(image).bakes
    users = users_of(image) if bakes and target not in bakes else []
    renamed = (name for name in bakes if name not in users and _known_as(name, users) == [target])
    record = bakes.get(target if target in bakes else next(renamed, None))
    return record if record is not None and record.parts else None


def follow_name(image, target: Target) -> None:
    """Keep the record of a target that was renamed under its new name: a copy would make its old name ambiguous."""
    facts = facts_of(image)
    if target in facts.bakes or image.library is not None:
        return
    users = users_of(image)
    old = next((name for name in facts.bakes if name not in users and _known_as(name, users) == [target]), None)
    if old is not None:
        facts.bakes = {target if name == old else name: record for name, record in facts.bakes.items()}
        set_facts(image, facts)


def owners_of(image, users: list[Target] | None = None) -> list[Target]:
    """Targets whose results the image holds and that still show it, by their present names.

    `users` is the result of `users_of`, if it is known.
    """
    bakes = facts_of(image).bakes
    if users is None:
        users = users_of(image) if bakes else []
    return list(dict.fromkeys(user for name in bakes for user in _known_as(name, users)))


def users_of(image) -> list[Target]:
    """Targets in any scene whose Beamspread node shows the image."""
    return [target.name for target in _all_targets() if target.image == image]


def users_of_material(name: str) -> list[Target]:
    """Targets in any scene that have the material of that name."""
    return [target.name for target in _all_targets() if target.material.name == name]


def _all_targets() -> list[BakeTarget]:
    objects = with_instanced(obj for obj in bpy.data.objects if obj.users_scene)
    return [target for obj in objects for target in targets_of(obj)]


def file_of(image) -> Path | None:
    """Absolute path of the image's file, None if its pixels live in the .blend file."""
    if image.source == "GENERATED" or image.packed_file is not None or not image.filepath:
        return None
    return Path(os.path.normpath(bpy.path.abspath(image.filepath, library=image.library)))


def is_sequence(image) -> bool:
    """True if the image is a sequence that was made here."""
    return image is not None and image.source == "SEQUENCE" and facts_of(image).frames is not None


def size_of_frames(image) -> tuple[int, int]:
    """Width and height of such a sequence's frames, which `Image.size` does not tell."""
    frames = facts_of(image).frames
    return frames.width, frames.height


def file_at(image, frame: int) -> Path | None:
    """The file that such a sequence has for a frame, or None."""
    frames, path = facts_of(image).frames, file_of(image)
    if not frames.first <= frame <= frames.last:
        return None
    return path.with_name(re.sub(r"\d+$", f"{frame:04d}", path.stem) + path.suffix)


def record_in(path: Path) -> Record | None:
    """Record of the bake in an EXR file, or None."""
    entry = _parsed(text_of(path, ATTRIBUTE))
    return _record(entry) if entry else None


def attributes_of(record: Record) -> dict[str, str]:
    """Attributes of an EXR file from which `record_in` reads the record."""
    return {ATTRIBUTE: json.dumps(asdict(record))}


def remember(targets: Iterable[Target]) -> None:
    """Remember which objects have the names of targets, so that these are known again although copies stand beside."""
    for target in targets:
        _sessions[target] = _session_of(target)


def _session_of(target: Target) -> int:
    obj = bpy.data.objects.get(target.object_name)
    return 0 if obj is None else compat.session_id(obj)


def _known_as(name: Target, users: list[Target]) -> list[Target]:
    """Users of the image that a recorded name stands for: itself, else those of its material, else of its object."""
    if name in users:
        return [name]
    session = _sessions.get(name, 0)
    for user in users if session else ():
        if user.image_key == name.image_key and _session_of(user) == session:
            return [user]
    same_material = [user for user in users if user.material_name == name.material_name]
    return same_material or [user for user in users if user.object_name == name.object_name]


def _migrated(image) -> ImageFacts:
    """Facts of an image from a file of an earlier version."""
    old = {name: image[key] for name, key in OLD_KEYS.items() if key in image}
    owners = [Target(*names) for names in json.loads(old.get("results", "[]"))]
    records = {name: _record(entry) for name, entry in _parsed(old.get("bakes", "{}")).items()}
    bakes = {owner: records.pop(str(owner), Record()) for owner in owners}
    bakes |= {Target(*name.split(" / ", 1)): record for name, record in records.items()}
    frames = Frames(*old["frames"]) if "frames" in old else None
    return ImageFacts(bakes, old.get("stamp", ""), "undone" in old, frames, old.get("former"))


def _parsed(text: str) -> dict:
    """Content of a JSON text; an empty dictionary if it is damaged."""
    try:
        known = json.loads(text)
    except (TypeError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _record(entry: dict) -> Record:
    warnings, notes = entry.get("warnings", ()), entry.get("notes", ())
    rest = tuple(warnings), entry.get("is_dirty", False), tuple(notes), entry.get("scheme", 1), entry.get("ratios", {})
    return Record(entry.get("parts", {}), *rest)


@persistent
def _remove_old_previews(*_arguments) -> None:
    """Remove images that Live of earlier versions made, unless they were saved or packed: their nodes had no image."""
    for image in [image for image in bpy.data.images if OLD_PREVIEW in image]:
        if image.source == "GENERATED" and image.packed_file is None:
            icons.remove(image)
        else:
            del image[OLD_PREVIEW]


@persistent
def _forget(*_arguments) -> None:
    """Forget the objects of targets: undo and loading replace objects."""
    _sessions.clear()


register, unregister = all_or_nothing(
    *handlers(load_post=_remove_old_previews),
    *handlers(load_post=_forget, undo_post=_forget, redo_post=_forget),
)
