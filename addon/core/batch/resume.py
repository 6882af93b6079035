"""Bakes that an earlier run has written, which `--resume` skips."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path

from ..bake.runner import SKIPPED, WRITTEN
from .report import BakeRecord

KEPT = "An earlier run wrote it, after the scene was last saved."


class PreviousReport:
    """Records in the report of an earlier run; none if there is no report or it is damaged.

    Parameters
    ----------
    report : path of the report, or None.
    since : time when the scene was saved, as files have it. Older files belong to another state of the scene.
    """

    def __init__(self, report: str | None, since: float) -> None:
        self._since = since
        self._records: dict[tuple, BakeRecord] = {}
        known = {field.name for field in fields(BakeRecord)}
        for entry in _entries(report):
            record = BakeRecord(**{key: value for key, value in entry.items() if key in known})
            self._records[record.object, record.material, record.frame] = record

    def skipped(self, wanted: BakeRecord, needs_record: bool = False) -> BakeRecord | None:
        """The record of a bake that can be skipped, or None.

        The file of `wanted` must be newer than the scene. If the report has the bake, the bake must have been written
        to that file, with the same size, output and indirect light. The caller checks that the file is complete.

        Parameters
        ----------
        needs_record : True if the report must have the bake, because the file may be the artist's.
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
