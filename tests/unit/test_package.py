"""The zip that artists install."""

import ast
import re
import subprocess
import sys
import zipfile
from html.parser import HTMLParser
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import beamspread
import pytest

ROOT = Path(__file__).resolve().parents[2]
STAGED = Path(beamspread.__file__).resolve().parent
MODULE_OF_ALL = "_native.so"
MODULE_OF_ANOTHER = "_native.cpython-313-x86_64-linux-gnu.so"

LIBRARIES = {"ducc", "eigen", "embree", "glm", "highway", "imath", "openexr", "pybind11", "tbb", "zlib"}


def packed(folder, staged=STAGED, module=MODULE_OF_ALL):
    """The further module is made up: its content isn't read."""
    modules = folder / "more"
    modules.mkdir(exist_ok=True)
    (modules / module).write_bytes(b"further")
    licences = max(ROOT.glob("build/deps/*/licenses"), key=lambda path: path.stat().st_mtime)
    return subprocess.run(
        [sys.executable, "-B", ROOT / "tools" / "make_package.py", staged, modules, licences, folder],
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("package")
    done = packed(folder)
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("*.zip")
    return path


@pytest.fixture(scope="module")
def files(path):
    """Name -> bytes."""
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("/")}


def test_its_name_and_size(path):
    version = (STAGED / "VERSION").read_text().strip()
    assert path.name == f"beamspread-{version}-linux-x64.zip"
    assert path.stat().st_size <= 40_000_000


def test_all_of_it_is_in_one_folder_which_is_named(path, files):
    assert {name.split("/")[0] for name in files} == {"beamspread"}
    assert not any("_native_test" in name for name in files)
    with zipfile.ZipFile(path) as archive:  # Blender 3.4 removes an older version's folder only then
        assert archive.namelist()[0] == "beamspread/"


def test_it_holds_the_staged_files_and_licences_and_nothing_else(files):
    names = {name.removeprefix("beamspread/") for name in files}
    staged = {path.relative_to(STAGED).as_posix() for path in STAGED.rglob("*") if path.is_file()}
    staged = {name for name in staged if "__pycache__" not in name and not name.endswith((".pyi", "py.typed"))}
    staged = {name for name in staged if not name.startswith(("docs/", "_native."))}
    pages = {name for name in names if name.startswith("docs/")}
    licences = {name for name in names if name.startswith("LICENSES/")}
    assert names == staged | licences | pages | {"LICENSE", MODULE_OF_ALL}
    assert {Path(name).suffix for name in pages} == {".html", ".webp"}
    assert licences == {f"LICENSES/{name}.txt" for name in LIBRARIES}
    for name in ("__init__.py", "blender_manifest.toml", "batch.py", "data/materials.csv", "VERSION"):
        assert f"beamspread/{name}" in files
    assert sum(name.startswith("library/") for name in names) == 24  # planes and curved surfaces
    assert all(files[f"beamspread/{name}"] == (STAGED / name).read_bytes() for name in staged)


def test_without_a_module_for_all_pythons_it_holds_one_for_each(tmp_path):
    assert packed(tmp_path, module=MODULE_OF_ANOTHER).returncode == 0
    (path,) = tmp_path.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        modules = {Path(name).name for name in archive.namelist() if "/_native." in name}
    assert modules == {f"_native{EXTENSION_SUFFIXES[0]}", MODULE_OF_ANOTHER}


def test_help_buttons_find_their_pages(files):
    sources = [text.decode() for name, text in files.items() if name.endswith(".py")]
    pages = {
        page
        for text in sources
        for page in re.findall(r'(?:draw_help\(self\.layout, |documentation\()"([\w-]+)"', text)
    }
    assert pages == {"guide", "performance", "python-and-batch"}
    assert {f"beamspread/docs/{page}.html" for page in pages} <= set(files)


class Page(HTMLParser):
    """Anchors of a page, and the targets of its links and pictures."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.targets = set(), set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        known = dict(attributes)
        self.anchors |= {known.get("id"), known.get("name")}
        self.targets |= {known[name] for name in ("href", "src") if name in known}


def test_help_is_whole_its_links_and_pictures_are_in_it(files):
    texts = {name.removeprefix("beamspread/docs/"): text for name, text in files.items() if "/docs/" in name}
    pages = {name: Page(text.decode()) for name, text in texts.items() if name.endswith(".html")}
    assert len(pages) == 7
    local = {(name, target) for name, page in pages.items() for target in page.targets if "://" not in target}
    assert len(local) > 60
    for name, target in sorted(local):
        path, _, anchor = target.partition("#")
        assert (path or name) in texts, (name, target)
        assert not anchor or anchor in pages[path or name].anchors, (name, target)
    assert sum(name.endswith(".webp") for name in texts) > 15
    assert all(text[8:12] == b"WEBP" for name, text in texts.items() if name.endswith(".webp"))
    # Tables, and code in them with a vertical bar, as GitHub shows them.
    assert "<td><code>--format EXR|EXR_HALF|PNG|PNG16|HDR</code></td>" in texts["python-and-batch.html"].decode()


def test_f1_leads_to_headings_of_the_help(files):
    source = ast.parse(files["beamspread/blender/preferences.py"])
    assigned = [node for node in source.body if isinstance(node, ast.Assign)]
    (manual,) = [node.value for node in assigned if getattr(node.targets[0], "id", "") == "MANUAL"]
    for pattern, page, heading in ast.literal_eval(manual):
        assert heading in Page(files[f"beamspread/docs/{page}.html"].decode()).anchors, pattern


def test_blender_reads_its_bl_info_without_running_it(files):
    tree = ast.parse(files["beamspread/__init__.py"])
    (info,) = [node.value for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == "bl_info"]
    assert ast.literal_eval(info)["blender"] == (3, 4, 0)


def test_the_same_files_give_the_same_bytes(path, tmp_path):
    assert packed(tmp_path).returncode == 0
    assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_strange_files_and_versions_that_differ_are_refused(tmp_path):
    import shutil

    staged = tmp_path / "beamspread"
    shutil.copytree(STAGED, staged, ignore=shutil.ignore_patterns("__pycache__", "library"))
    (staged / "data" / "notes.txt").write_text("left behind")
    done = packed(tmp_path, staged)
    assert "notes.txt: no such file belongs into a package" in done.stderr
    (staged / "data" / "notes.txt").unlink()
    (staged / "VERSION").write_text("7.0.0\n")
    done = packed(tmp_path, staged)
    assert "versions differ" in done.stderr
    assert list(tmp_path.glob("*.zip")) == []


BLENDER_EXT = ROOT / "build/bpy-4.5/bpy/4.5/scripts/addons_core/bl_pkg/cli/blender_ext.py"


@pytest.mark.skipif(not BLENDER_EXT.exists(), reason="tools/setup.sh --tests fetches the official Blender")
def test_blender_finds_it_a_valid_extension(path):
    done = subprocess.run([sys.executable, "-B", BLENDER_EXT, "validate", path], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "error" not in (done.stdout + done.stderr).lower()


def test_no_module_of_the_package_adds_to_the_search_path(files):
    """Extensions share one Python: a folder in its search path hides other add-ons' modules."""
    adds = re.compile(r"sys\.path\.(insert|append|extend)|sys\.path\[[^\]]*\] *=(?! *\[folder for folder in sys\.path)")
    found = [name for name, text in files.items() if name.endswith(".py") and adds.search(text.decode())]
    assert found == []
