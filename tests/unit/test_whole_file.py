"""Files are whole or as they were, and what killed processes have left goes."""

import os
import subprocess
import sys
import time

import pytest
from beamspread.core import whole_file as module
from beamspread.core.whole_file import whole_file

KILLED = """
import os, signal
from beamspread.core.whole_file import whole_file
with whole_file({path!r}) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture(autouse=True)
def as_a_new_process(monkeypatch):
    monkeypatch.setattr(module, "_tidied", set())


def write(path, text="whole"):
    with whole_file(path) as temporary:
        temporary.write_text(text)


def killed(path):
    """A temporary file of a process that was killed while it wrote."""
    subprocess.run([sys.executable, "-c", KILLED.format(path=str(path))], check=False)
    (left,) = path.parent.glob("*.tmp*")
    return left


def aged(path):
    old = time.time() - 2 * module.LEFT_SECONDS
    os.utime(path, (old, old))
    return path


def test_what_a_killed_process_has_left_goes_with_the_next_file(tmp_path):
    left = killed(tmp_path / "light.exr")
    aged(left)
    write(tmp_path / "other.exr")
    assert [one.name for one in tmp_path.iterdir()] == ["other.exr"]


def test_what_may_still_be_written_stays(tmp_path):
    left = killed(tmp_path / "light.exr")  # a moment ago: perhaps by a process of another container
    running = aged_file(tmp_path, left.name.replace(left.name.split("-")[1], str(os.getpid())))
    elsewhere = aged_file(tmp_path, left.name.replace(module._MACHINE, "abcdef"))
    own = [aged_file(tmp_path, name) for name in ("mine.tmp.exr", "light.12-3.tmp.exr", "light.exr.tmp")]
    write(tmp_path / "other.exr")
    assert all(one.exists() for one in (left, running, elsewhere, *own))


def aged_file(folder, name):
    path = folder / name
    path.write_text("")
    return aged(path)


def test_an_error_leaves_what_was_there(tmp_path):
    path = tmp_path / "light.exr"
    write(path)
    with pytest.raises(AttributeError), whole_file(path) as temporary:
        temporary.no_such_method()
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]
