"""The batch's report and file names."""

import json

from beamspread.core.batch.report import BakeRecord, Report

KEYS = {"object", "material", "frame", "path", "width", "height", "seconds", "status", "message"}
KEYS |= {"output", "lights", "left_out", "indirect", "dark", "estimated_seconds", "exposure", "side"}


def test_saved_report_has_the_documented_keys(tmp_path):
    path = tmp_path / "new" / "report.json"
    Report([BakeRecord("Böden", "Stein", 3, "a.exr", 4, 5, 0.5, "written")]).save(str(path))
    document = json.loads(path.read_text(encoding="utf-8"))
    assert set(document) == {"bakes"}
    assert set(document["bakes"][0]) == KEYS
    assert document["bakes"][0]["object"] == "Böden"
    assert list(path.parent.iterdir()) == [path]


def test_all_written_needs_at_least_one_bake():
    assert not Report().all_written()
    assert Report([BakeRecord("A", status="written")]).all_written()
    assert not Report([BakeRecord("A", status="written"), BakeRecord("B", status="failed")]).all_written()
    assert Report([BakeRecord("A", status="written"), BakeRecord("B", status="skipped")]).all_written()
    assert not Report([BakeRecord("A", status="written"), BakeRecord("B", status="cancelled")]).all_written()


def test_a_record_reads_as_a_line():
    written = BakeRecord("Floor", "Marble", 3, "f.exr", 4, 5, 0.25, "written")
    assert str(written) == "Floor / Marble, frame 3: written f.exr (4 x 5, 0.2 s)"
    assert str(BakeRecord("Floor", frame=1, message="No.")) == "Floor, frame 1: failed: No."
