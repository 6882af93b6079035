"""README is short, and the targets of all links in the pages exist."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def page(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_readme_is_short():
    assert len(page("README.md").split()) <= 900


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_lead_somewhere(path):
    links = re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text(encoding="utf-8"))
    assert [link for link in links if not (path.parent / link).exists()] == []


def test_each_line_of_accuracy_names_its_test():
    rows = re.findall(r"^\|(?! quantity |---).*$", page("docs/accuracy.md"), re.MULTILINE)
    named = [re.findall(r"`(tests/\S+\.py)::(\w+)`", row.split("|")[-2]) for row in rows]
    assert len(rows) > 40
    assert [row for row, tests in zip(rows, named) if not tests] == []
    everywhere = set(re.findall(r"(tests/\S+\.py)::(\w+)", page("docs/accuracy.md")))
    assert [f"{file}::{test}" for file, test in everywhere if f"def {test}(" not in page(file)] == []


def test_each_section_of_performance_has_its_command():
    sections = page("docs/performance.md").split("\n## ")[1:]
    names = [re.findall(r"^    tests/bench/run\.sh (\w+)$", section, re.MULTILINE) for section in sections]
    assert [section[:30] for section, found in zip(sections, names) if len(found) != 1] == []
    for (name,) in names:
        assert any((ROOT / "tests" / "bench" / f"{name}{ending}").exists() for ending in (".py", ".cpp"))


def test_architecture_has_the_folders_of_cmake():
    folders = re.findall(r"^beamspread_folder\((\S+) ?(.*)\)$", page("CMakeLists.txt"), re.MULTILINE)
    cells = [", ".join(f"`{name}`" for name in used.split()) for _, used in folders]
    core = page("docs/architecture.md").split("## The package")[0]
    rows = re.findall(r"^\| (`\S+`) \| (.*?) ?\| ", core, re.MULTILINE)
    assert rows[:-1] == [(f"`{folder}`", cell) for (folder, _), cell in zip(folders, cells)]


def test_each_row_of_tuning_names_a_constant_of_its_file():
    rows = re.findall(r"^\| (.*?) \| ((?:native|addon)/\S+) \|", page("docs/tuning.md"), re.MULTILINE)
    assert len(rows) > 100
    names = [(name.split("::")[-1], file) for cell, file in rows for name in re.findall(r"`([^`]+)`", cell)]
    assert [(name, file) for name, file in names if not re.search(rf"\b{re.escape(name)}\b", page(file))] == []
