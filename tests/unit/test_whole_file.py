"""Files are complete or unchanged, and leftovers of killed processes are removed."""

import errno
import os
import subprocess
import sys
import time
from contextlib import suppress

import pytest
from beamspread.core import disk as module
from beamspread.core.disk import whole_file

from full_disk import full_after

WRITER = """
import os, signal, time
from beamspread.core.disk import whole_file
with whole_file({path!r}) as temporary:
    temporary.write_text("half")
    print(temporary.name, flush=True)
    {then}
"""


@pytest.fixture(autouse=True)
def as_in_a_new_process(monkeypatch):
    monkeypatch.setattr(module, "_tidied", set())


def write(path, text="whole"):
    with whole_file(path) as temporary:
        temporary.write_text(text)


def start_writer(path, then):
    """Start a process that writes half a file; the process and its temporary file, which looks an hour old."""
    code = WRITER.format(path=str(path), then=then)
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    temporary = path.with_name(process.stdout.readline().strip())
    return process, aged(temporary)


def killed(path):
    """Temporary file of a process that was killed while it wrote."""
    process, temporary = start_writer(path, "os.kill(os.getpid(), signal.SIGKILL)")
    process.communicate()
    return aged(temporary)


def aged(path):
    hour_ago = time.time() - 3600
    os.utime(path, (hour_ago, hour_ago))
    return path


def test_a_leftover_of_a_killed_process_is_removed_by_the_next_write(tmp_path):
    leftover = killed(tmp_path / "light.exr")
    assert leftover.exists()
    write(tmp_path / "other.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["other.exr"]


def test_a_leftover_of_the_native_module_is_removed(tmp_path):
    leftover = killed(tmp_path / "light.exr")
    nested = leftover.with_name(f"{leftover.name}.1234-0.tmp")
    nested.write_text("half")
    aged(nested)
    write(tmp_path / "other.exr")
    assert [path.name for path in tmp_path.iterdir()] == ["other.exr"]


def test_temporary_files_in_use_and_foreign_files_stay(tmp_path):
    process, in_use = start_writer(tmp_path / "light.exr", "time.sleep(60)")
    try:
        young = killed(tmp_path / "young.exr")
        young.touch()
        foreign = [tmp_path / name for name in ("mine.tmp.exr", "light.12-3.tmp.exr", "light.exr.tmp")]
        for path in foreign:
            path.write_text("")
            aged(path)
        write(tmp_path / "other.exr")
        assert all(path.exists() for path in (in_use, young, *foreign))
    finally:
        process.kill()
        process.communicate()


def test_an_error_keeps_the_old_file(tmp_path):
    path = tmp_path / "light.exr"
    write(path)
    with pytest.raises(AttributeError), whole_file(path) as temporary:
        temporary.no_such_method()
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]


def write_and_ignore_errors(path):
    with whole_file(path) as temporary:
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT)
        with suppress(OSError):
            os.write(descriptor, bytes(100_000))  # as many as there is room for
        os.close(descriptor)


@pytest.mark.parametrize("size", [0, 1000, 70_000])
def test_a_writer_that_ignores_a_full_disk_does_not_replace_the_file(tmp_path, size):
    path = tmp_path / "light.exr"
    write(path)
    with full_after(size), pytest.raises(OSError, match="large") as raised:
        write_and_ignore_errors(path)
    assert raised.value.errno == errno.EFBIG
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_is_as_long_as_it_was_written_and_keeps_its_permissions(tmp_path):
    path = tmp_path / "light.exr"
    write(path)
    path.chmod(0o640)
    write(path, "x" * 100_000)
    assert path.read_text() == "x" * 100_000
    assert path.stat().st_mode & 0o777 == 0o640


def test_systems_without_file_locks_write_as_well(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "fcntl", None)
    leftover = killed(tmp_path / "light.exr")
    write(tmp_path / "light.exr")
    assert (tmp_path / "light.exr").read_text() == "whole"
    assert leftover.exists()


def test_several_files_are_replaced_together(tmp_path):
    """An empty second file is an error. The first file then keeps its content, too."""
    paths = [tmp_path / "first.exr", tmp_path / "second.exr"]
    for path in paths:
        path.write_text("old")
    with pytest.raises(OSError, match="nothing was written"), module.whole_files(paths) as temporaries:
        temporaries[0].write_text("new")
    assert [path.read_text() for path in paths] == ["old", "old"]
    with module.whole_files(paths) as temporaries:
        for temporary in temporaries:
            temporary.write_text("new")
    assert [path.read_text() for path in paths] == ["new", "new"]
    assert sorted(tmp_path.iterdir()) == paths
