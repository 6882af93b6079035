"""All files state one version."""

import shutil
import sys
from pathlib import Path

import beamspread
import pytest
from beamspread.core.native import native

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tools"))
import version  # noqa: E402


def test_all_places_agree():
    said = version.versions(ROOT / "addon")
    assert len(said) == 3
    assert set(said.values()) == {native.__version__}
    assert ".".join(map(str, beamspread.bl_info["version"])) == native.__version__


def test_changelog_begins_with_it():
    headings = [line for line in (ROOT / "CHANGELOG.md").read_text().splitlines() if line.startswith("## ")]
    assert version.of_file(ROOT / "addon") in headings[0]


@pytest.fixture
def addon(tmp_path):
    for name in ("VERSION", "__init__.py", "blender_manifest.toml"):
        shutil.copy(ROOT / "addon" / name, tmp_path)
    return tmp_path


def test_one_command_changes_all(addon):
    version.change(addon, "12.0.3")
    assert set(version.versions(addon).values()) == {"12.0.3"}


def test_a_place_that_differs_is_seen(addon):
    (addon / "VERSION").write_text("0.9.9\n")
    assert len(set(version.versions(addon).values())) == 2


def test_a_text_that_is_no_version_is_refused(addon):
    before = version.versions(addon)
    for text in ("1.2", "1.2.3.4", "1.x.0"):
        with pytest.raises(ValueError):  # noqa: PT011
            version.change(addon, text)
    assert version.versions(addon) == before
