"""A batch that is stopped, resumed, or limited to some objects: its files and their names."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from beamspread.blender.images import files
from beamspread.core.native import native
from mathutils import Matrix
from nodes import Nodes
from scenes import add_lamp, add_material, add_plane, add_sun, batch_command, run_batch, save_scene

SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143}


def cycles_of(process):
    """Numbers of the Blenders that it has started for Cycles and that still run."""
    numbers = set()
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            number, _, rest = entry.read_text().partition(" (")
            command = entry.with_name("cmdline").read_text()
        except OSError:
            continue
        state, parent = rest.rpartition(") ")[2].split()[:2]
        if int(parent) == process.pid and state != "Z" and "child.py" in command:
            numbers.add(int(number))
    return numbers


def wait_for(answer, process, seconds=60):
    deadline = time.monotonic() + seconds
    while not (result := answer()):
        assert process.poll() is None, "it has ended"
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)
    return result


def start(scene, *arguments):
    """A batch in a process group of its own, as a terminal's; it and its report."""
    report, log = scene.parent / "report.json", scene.parent / "log.txt"
    command = batch_command(scene, *arguments, "--report", report)
    with log.open("w") as file:
        return subprocess.Popen(command, stdout=file, stderr=file, start_new_session=True), report, log


def two_slow_planes(folder):
    """Planes that take minutes each by the direct solver."""
    for number, name in enumerate(("First", "Second")):
        add_plane(name, matrix=Matrix.Translation((5 * number, 0, 0)), material=add_material(name))
    add_lamp((0, 0, 1))
    return save_scene(folder)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_a_batch_soon_and_leaves_a_report(tmp_path, number):
    scene = two_slow_planes(tmp_path)
    process, report, log = start(
        scene, "--solver", "direct", "--resolution", 1024, "--no-indirect", "--verbose", "--output", tmp_path / "out"
    )
    try:
        wait_for(lambda: "'First': " in log.read_text(), process)  # now it solves
        began = time.monotonic()
        process.send_signal(number)
        assert process.wait(60) == SIGNALS[number], log.read_text()
        assert time.monotonic() - began < 20
    finally:
        process.kill()
    bakes = json.loads(report.read_text())["bakes"]
    assert [(record["object"], record["status"], record["path"]) for record in bakes] == [
        ("First", "cancelled", ""),
        ("Second", "cancelled", ""),
    ]
    assert "Traceback" not in log.read_text()
    assert "stopped, 2 of 2 bakes are left" in log.read_text()
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("number", SIGNALS)
def test_cycles_ends_as_well(tmp_path, number):
    """A terminal's Ctrl-C goes to all processes at once: Cycles' own end must not count as its failure."""
    add_plane(material=add_material())
    glass = Nodes(bpy.data.materials.new("Glass"), clear=True)
    add_plane("Pane", matrix=Matrix.Translation((0, 0, 3)), material=glass.finish(glass.add("BsdfGlass")))
    add_lamp((0, 0, 1))
    bpy.context.scene.beamspread.use_indirect = True
    process, report, log = start(save_scene(tmp_path), "--resolution", 1024, "--output", tmp_path / "out")
    try:
        (child,) = wait_for(lambda: cycles_of(process), process)
        if number == signal.SIGINT:
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        assert process.wait(60) == SIGNALS[number], log.read_text()
    finally:
        process.kill()
    assert not Path(f"/proc/{child}").exists()
    assert [record["status"] for record in json.loads(report.read_text())["bakes"]] == ["cancelled"]


def run(*arguments):
    """Bake in this process; {object: record}."""
    return {record.object: record for record in run_batch(*arguments).bakes}


@pytest.mark.parametrize("chosen", [["A b"], ["A/b"], ["A b", "A/b"], ["A/b", "A b"], ["Plain"]])
def test_a_files_name_depends_on_the_scene_alone(tmp_path, chosen):
    for number, name in enumerate(("A/b", "A b", "Plain")):
        matrix = Matrix.Translation((5 * number, 0, 0))
        add_plane(name, matrix=matrix, material=bpy.data.materials.get("M") or add_material("M"))
    add_sun(0)
    bpy.context.scene.beamspread.resolution = 16
    names = {name: Path(record.path).name for name, record in run("--output", tmp_path / "all").items()}
    assert len(set(names.values())) == 3
    assert names["Plain"] == "Plain_M.exr"
    assert "A_b_M.exr" in names.values()
    some = run("--output", tmp_path / "some", "--object", *chosen)
    assert {name: Path(record.path).name for name, record in some.items()} == {name: names[name] for name in chosen}


def test_resume_bakes_missing_damaged_and_older_files(tmp_path):
    names = ("Kept", "Missing", "Damaged", "Old", "Failed")
    for number, name in enumerate(names):
        add_plane(name, matrix=Matrix.Translation((5 * number, 0, 0)), material=add_material(name))
    add_sun(0)
    scene = save_scene(tmp_path)
    os.utime(scene, (time.time() - 100,) * 2)
    report = tmp_path / "report.json"
    arguments = ["--output", tmp_path / "out", "--report", report]
    first = run_batch(*arguments)
    assert first.all_written()
    records = {record.object: record for record in first.bakes}
    Path(records["Missing"].path).unlink()
    whole = Path(records["Damaged"].path).read_bytes()
    Path(records["Damaged"].path).write_bytes(whole[:-100])
    os.utime(records["Old"].path, (time.time() - 200,) * 2)
    records["Failed"].status = "failed"
    first.save(str(report))
    kept = Path(records["Kept"].path).stat().st_mtime_ns
    second = run_batch(*arguments, "--resume")
    statuses = {record.object: record.status for record in second.bakes}
    assert statuses == {name: "skipped" if name == "Kept" else "written" for name in names}
    assert Path(records["Kept"].path).stat().st_mtime_ns == kept
    assert second.all_written()
    for name in names:
        assert native.read_exr(records[name].path)[0].any()
    # Another size, or another pass, is another bake.
    for more in (["--resolution", "16"], ["--pass", "irradiance"], ["--format", "PNG"]):
        assert {record.status for record in run(*arguments, "--resume", *more).values()} == {"written"}


def test_resume_takes_an_images_own_file_only_by_its_report(tmp_path):
    path = tmp_path / "own.png"
    files.write_file(path, np.full((16, 16, 3), 0.5, np.float32), "PNG")
    add_plane(material=add_material(image=bpy.data.images.load(str(path))))
    add_sun(0)
    os.utime(save_scene(tmp_path), (time.time() - 100,) * 2)
    report = tmp_path / "report.json"
    first = run_batch("--resume", "--report", report)
    assert [record.status for record in first.bakes] == ["written"]
    first.save(str(report))
    assert [record.status for record in run("--resume", "--report", report).values()] == ["skipped"]
