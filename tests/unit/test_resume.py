"""Bakes that --resume skips: by the files' times and by an earlier report."""

import os

import pytest
from beamspread.core.batch.report import BakeRecord, PreviousReport, Report

SAVED = 1000.0


def wanted(folder, seconds=1.0, **changes):
    """A bake whose file is this much newer than the scene."""
    path = folder / "out.exr"
    path.touch()
    os.utime(path, (SAVED + seconds, SAVED + seconds))
    values = {"path": str(path), "width": 8, "height": 4, "output": "LUMINANCE", "indirect": True}
    return BakeRecord("Floor", "Marble", 3, **(values | changes))


def earlier(folder, *records):
    report = folder / "report.json"
    Report([*records]).save(str(report))
    return PreviousReport(str(report), SAVED)


def test_without_a_report_the_newer_file_counts(tmp_path):
    for before in (
        PreviousReport(None, SAVED),
        PreviousReport(str(tmp_path / "missing.json"), SAVED),
        earlier(tmp_path),
    ):
        assert before.skipped(wanted(tmp_path)).status == "skipped"
        assert before.skipped(wanted(tmp_path, seconds=-1)) is None
        assert before.skipped(wanted(tmp_path, path=str(tmp_path / "missing.exr"))) is None
        assert before.skipped(wanted(tmp_path), needs_record=True) is None


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"bakes": 3}', '{"bakes": ["a", {}]}'])
def test_a_damaged_report_is_none(tmp_path, text):
    (tmp_path / "report.json").write_text(text)
    assert PreviousReport(str(tmp_path / "report.json"), SAVED).skipped(wanted(tmp_path)).status == "skipped"


def test_a_report_must_agree(tmp_path):
    done = wanted(tmp_path)
    done.status, done.dark, done.lights = "written", True, 2
    record = earlier(tmp_path, done).skipped(wanted(tmp_path), needs_record=True)
    assert (record.status, record.dark, record.lights, record.path) == ("skipped", True, 2, done.path)
    # Once more, with the report of the second run.
    assert earlier(tmp_path, record).skipped(wanted(tmp_path)) == record
    for name, value in {
        "output": "IRRADIANCE",
        "indirect": False,
        "width": 16,
        "status": "failed",
        "path": "x",
    }.items():
        other = wanted(tmp_path)
        other.status = "written"
        setattr(other, name, value)
        assert earlier(tmp_path, other).skipped(wanted(tmp_path)) is None, name
    done.frame = 4
    assert earlier(tmp_path, done).skipped(wanted(tmp_path), needs_record=True) is None
