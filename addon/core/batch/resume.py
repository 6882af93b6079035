"""What an earlier run has written, so that `--resume` need not bake it again."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

from ..bake.runner import SKIPPED, WRITTEN
from .report import BakeRecord

KEPT = "An earlier run wrote it, after the scene was last saved."


class Earlier:
    """The records of the report that an earlier run left, if it left one; none where that is damaged.

    Parameters
    ----------
    report : path of the report, or None.
    since : when the scene was saved, as files' times are; what is older shows another scene.
    """

    def __init__(self, report: str | None, since: float) -> None:
        self._since = since
        self._records: dict[tuple, BakeRecord] = {}
        known = {one.name for one in fields(BakeRecord)}
        for entry in _entries(report):
            record = BakeRecord(**{key: value for key, value in entry.items() if key in known})
            self._records[record.object, record.material, record.frame] = record

    def skipped(self, wanted: BakeRecord, needs_record: bool = False) -> BakeRecord | None:
        """The record of a bake that need not be made again, or None.

        The file of `wanted` must be newer than the scene; where the report has the bake, it must say that it was
        written to that file, with the same size, output and indirect light. That the file is whole is for the caller
        to see.

        Parameters
        ----------
        needs_record : whether the report must have it, as where the file may be the artist's own.
        """
        path = Path(wanted.path)
        if not path.is_file() or path.stat().st_mtime <= self._since:
            return None
        record = self._records.get((wanted.object, wanted.material, wanted.frame))
        if record is None:
            return None if needs_record else replace(wanted, status=SKIPPED, message=KEPT)
        same = all(getattr(record, name) == getattr(wanted, name) for name in ("output", "indirect", "width", "height"))
        if not same or record.status not in (WRITTEN, SKIPPED) or Path(record.path) != path:
            return None
        return replace(record, status=SKIPPED, message=record.message or KEPT)


def _entries(report: str | None) -> list[dict]:
    if report is None:
        return []
    try:
        entries = json.loads(Path(report).read_text(encoding="utf-8"))["bakes"]
        return [entry for entry in entries if isinstance(entry, dict) and "object" in entry]
    except (OSError, ValueError, KeyError, TypeError):
        return []
