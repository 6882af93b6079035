"""The process of Cycles: it stays, forgets each request, and leaves nothing behind however it or its parent ends."""

import gc
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import beamspread
import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.cycles import cycles_light, process
from beamspread.blender.cycles.folders import PREFIX
from beamspread.blender.cycles.scene_copy import FILE, SceneCopy
from beamspread.core.errors import BakeError
from beamspread.core.native import native
from beamspread.core.progress import Progress
from beamspread.core.scene.lights import STRATA

PARENT, STAGE = Path(__file__).with_name("cycles_parent.py"), Path(beamspread.__file__).parents[1]
IS_POSIX = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


earlier: set[Path] = set()
"""Folders that objects of earlier tests hold until the process ends."""


@pytest.fixture(autouse=True)
def ended():
    process.end()
    gc.collect()
    earlier.clear()
    earlier.update(folders(os.getpid()))
    yield
    process.end()


def pid():
    return process._kept._child._process.pid


def is_there(number):
    """True if the process runs, or is stopped; an orphan that has ended may wait as a zombie."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def ends(number, seconds=20.0):
    until = time.monotonic() + seconds
    while is_there(number) and time.monotonic() < until:
        time.sleep(0.05)
    return not is_there(number)


def folders(parent):
    """New folders of Cycles' process, among the temporary files of this process or of those that tests start."""
    places = {tempfile.gettempdir(), os.environ["TMPDIR"]}
    found = (folder for place in places for folder in Path(place).glob(f"{PREFIX}{parent}-*"))
    return [folder for folder in found if folder not in earlier]


def new_copy():
    return SceneCopy(bpy.context.scene, bpy.context.view_layer)


def add_scene():
    scenes.add_world((0.2, 0.3, 0.4, 1))
    material = scenes.diffuse_material((0.8, 0.5, 0.2))
    scenes.add_mesh("Wall", [(-1, 0, 0), (1, 0, 0), (1, 0.3, 1), (-1, 0.3, 1)], [(0, 1, 2, 3)]).data.materials.append(
        material
    )
    panel = scenes.add_mesh("Panel", [(0.2, 0.1, 0.8), (0.8, 0, 0.8), (0.8, 0.6, 0.9)], [(0, 1, 2)])
    panel.data.materials.append(scenes.glowing_material(2.0))
    plane = scenes.add_plane(material=scenes.add_material(color_mode="BASE_COLOR"))
    scenes.add_sun(30, 40, 2.0)
    return plane


def requests():
    """One request of each kind: bounced light, light of an object, the world."""
    axes = {"x_axis": [1, 0, 0], "y_axis": [0, 1, 0], "normal": [0, 0, 1]}
    chart = {"corner": [-1, -1, 1e-4], **axes, "size": [2, 2], "nodes": [8, 8]}
    fields = cycles_light.REQUEST | {"charts": [chart], "strata": STRATA.tolist(), "most_samples": 8}
    world = {"width": 64, "height": 32, "samples": 2, "fine_samples": 4}
    reflectances = {"Medium": [0.5, 0.6, 0.7]}
    return [
        ("fields", fields | {"light": "INDIRECT", "reflectances": reflectances, "with_world": False}),
        ("fields", fields | {"light": "DIRECT", "only": ["Panel"]}),
        ("world", world),
        ("fields", fields | {"light": "INDIRECT"}),
    ]


def test_it_stays_and_answers_as_a_fresh_process():
    """Bit for bit, in any order, also of a copy of another scene before."""
    add_scene()
    with new_copy() as copy:
        fresh = []
        for task, request in requests():
            fresh.append(process.run(copy, task, request))
            process.end()
        process.run(copy, "world", requests()[2][1])
        number = pid()
        again = [process.run(copy, task, request) for task, request in [*requests(), *requests()[::-1]]]
        assert pid() == number
        bpy.data.objects["Sun"].data.energy = 7.0
        with new_copy() as brighter:
            bright = process.run(brighter, *requests()[0])
        last = process.run(copy, *requests()[0])
        assert pid() == number
    for first, second in zip([*fresh, *fresh[::-1]], again):
        assert first.keys() == second.keys()
        for name in first:
            np.testing.assert_array_equal(first[name], second[name])
    assert bright["radiance_0"].mean() > 1.5 * last["radiance_0"].mean()
    np.testing.assert_array_equal(last["radiance_0"], fresh[0]["radiance_0"])
    assert len(folders(os.getpid())) == 1  # its own


CHILD = """
import json, sys, time
import numpy as np
mark = sys.argv[sys.argv.index("--") + 1]
for path in sys.stdin:
    request = json.load(open(path.strip()))
    time.sleep(0.6)
    print(mark, 0.0, flush=True)
    time.sleep(0.6)
    np.savez(request["output"], done=np.ones(1))
    print(mark, "done", flush=True)
"""


def test_it_says_that_cycles_starts_until_it_answers(monkeypatch, tmp_path):
    child, stages = tmp_path / "child.py", []
    child.write_text(CHILD)
    monkeypatch.setattr(process, "CHILD", child)
    progress = Progress(lambda _fraction: stages.append(progress.stage))
    with new_copy() as copy:
        assert process.run(copy, "any", {}, progress, "Searching")["done"] == 1
    assert [*dict.fromkeys(stages)] == ["Searching (Cycles starts)", "Searching"]


LONG = {"width": 2048, "height": 1024, "samples": 100_000, "fine_samples": 1}
SHORT = LONG | {"width": 16, "height": 8, "samples": 1}


@IS_POSIX
def test_a_killed_child_is_said_and_the_next_request_has_another():
    scenes.add_world()
    with new_copy() as copy:
        process.run(copy, "world", SHORT)
        os.kill(pid(), signal.SIGKILL)
        process._kept._child._process.wait()
        assert process.run(copy, "world", SHORT)["radiance"].min() > 0

        def kill(_fraction):
            if process._kept._child.has_answered:
                os.kill(pid(), signal.SIGKILL)

        with pytest.raises(BakeError, match="exit code -9"):
            process.run(copy, "world", LONG, kill)
        assert process.run(copy, "world", SHORT)["radiance"].min() > 0
    process.end()
    assert not folders(os.getpid())


@IS_POSIX
def test_a_stopped_child_can_be_cancelled_and_goes_on_when_asked():
    scenes.add_world()
    with new_copy() as copy:
        process.run(copy, "world", SHORT)
        os.kill(pid(), signal.SIGSTOP)
        if sys.platform == "linux":
            assert process.run(copy, "world", SHORT)["radiance"].min() > 0

        began = time.monotonic()

        def stop(_fraction):
            if process._kept._child.has_answered:
                os.kill(pid(), signal.SIGSTOP)
            return time.monotonic() - began < 1

        number = pid()
        with pytest.raises(native.Cancelled):
            process.run(copy, "world", LONG, stop)
        assert ends(number, 0)
    process.end()
    assert not folders(os.getpid())


@IS_POSIX
@pytest.mark.parametrize(
    "is_stopped",
    [
        False,
        pytest.param(
            True, marks=pytest.mark.skipif(sys.platform != "linux", reason="only Linux wakes stopped processes")
        ),
    ],
)
def test_an_orphan_ends_and_removes_all(is_stopped):
    """While it renders: its parent is killed."""
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python"] if bpy.app.binary_path else [sys.executable]
    with subprocess.Popen([*program, str(PARENT), "--", str(STAGE)], stdout=subprocess.PIPE, text=True) as parent:
        try:
            line = next(line for line in parent.stdout if line.startswith("renders"))
            number = int(line.split()[1])
            assert folders(parent.pid)
            if is_stopped:
                os.kill(number, signal.SIGSTOP)
        finally:
            parent.kill()
    assert ends(number)
    assert not folders(parent.pid)


@IS_POSIX
def test_nothing_is_left_of_an_orphan_whose_folder_went_before_it_began(tmp_path):
    """A window may be closed right after a bake has asked for Cycles."""
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python"] if bpy.app.binary_path else [sys.executable]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    words = [str(process.CHILD), "--", "mark", "60", str(os.getpid())]
    child = subprocess.Popen([*program, *words], stdin=subprocess.PIPE, env=environment)
    child.stdin.close()
    assert child.wait(60) == 0
    assert [path.name for path in tmp_path.iterdir() if not path.name.startswith("pulse-")] == []


@IS_POSIX
def test_an_orphan_whose_parent_ended_before_it_began_removes_its_folder(tmp_path):
    """A window may be closed right after a bake began, before it can remove the folder that it has just made."""
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    folder = tmp_path / f"{PREFIX}{gone.pid}-abc"
    folder.mkdir()
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python"] if bpy.app.binary_path else [sys.executable]
    words = [str(process.CHILD), "--", "mark", "60", str(gone.pid)]
    environment = os.environ | {"TMPDIR": str(folder)}
    child = subprocess.Popen([*program, *words], stdin=subprocess.PIPE, env=environment)
    child.stdin.close()
    assert child.wait(60) == 0
    assert [path.name for path in tmp_path.iterdir() if not path.name.startswith("pulse-")] == []


@IS_POSIX
@pytest.mark.skipif(not bpy.app.binary_path, reason="Blender as a module may hang when its script ends, by itself")
def test_nothing_is_left_where_a_script_ends_while_the_world_renders(tmp_path):
    """Without switching the add-on off: Cycles' process ends before its folder goes."""
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python"]
    command = [*program, str(PARENT), "--", str(STAGE), "leave"]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, env=environment, timeout=120)
    number = int(next(line for line in done.stdout.splitlines() if line.startswith("renders")).split()[1])
    assert ends(number)
    left = [path.name for path in tmp_path.rglob("*") if not path.name.startswith("pulse-")]
    assert [name for name in left if not name.startswith("blender_")] == []
    assert sum(name.startswith("blender_") for name in left) <= 1  # the parent's own


@IS_POSIX
def test_escape_while_the_world_renders_leaves_nothing(tmp_path, monkeypatch):
    """Cycles writes tiles of large pictures into its folder."""
    process.end()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    scenes.add_world()
    with new_copy() as copy:
        began = []

        def stop(_fraction):
            if process._kept._child.has_answered:
                began.append(time.monotonic())
            return not began or time.monotonic() - began[0] < 2

        with pytest.raises(native.Cancelled):
            process.run(copy, "world", LONG | {"width": 4096, "height": 2048}, stop)
    assert [*tmp_path.iterdir()] == []


def test_a_bake_removes_its_copy_of_the_scene_when_it_ends():
    """Not when Python collects its garbage, which may be much later: the copy is as large as the scene."""
    bpy.context.scene.beamspread.resolution = 16
    plane = add_scene()
    node = scenes.node_of(plane.data.materials[0])
    noise = node.id_data.nodes.new("ShaderNodeTexNoise")  # which Cycles evaluates
    node.id_data.links.new(node.inputs["Base Color"], noise.outputs["Color"])
    before = copies_of_scenes()
    gc.disable()
    try:
        scenes.bake(plane)
        assert process._kept._child is not None
        assert copies_of_scenes() == before
    finally:
        gc.enable()


def copies_of_scenes():
    return sorted(folder for folder in folders(os.getpid()) if (folder / FILE).exists())


@IS_POSIX
def test_an_orphan_without_work_ends():
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python"] if bpy.app.binary_path else [sys.executable]
    words = [str(process.CHILD), "--", "mark", "60", str(os.getpid())]
    child = subprocess.Popen([*program, *words], stdin=subprocess.PIPE)
    time.sleep(0.2)
    child.stdin.close()
    assert child.wait(30) == 0


def test_without_requests_it_ends_and_the_next_one_starts_another(monkeypatch):
    monkeypatch.setattr(process, "IDLE_SECONDS", 0.3)
    scenes.add_world()
    with new_copy() as copy:
        numbers = set()
        for pause in (0, 0.2, 0.3, 0.4, 2.0):
            time.sleep(pause)
            assert process.run(copy, "world", SHORT)["radiance"].min() > 0
            numbers.add(pid())
        assert len(numbers) > 1
        process._kept._child._process.wait(10)


def test_switching_the_add_on_off_ends_it():
    scenes.add_world()
    with new_copy() as copy:
        process.run(copy, "world", SHORT)
        number = pid()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    beamspread.unregister()
    try:
        assert not is_there(number)
    finally:
        beamspread.register()


def test_threads_take_turns():
    scenes.add_world()
    with new_copy() as copy:
        results = []
        threads = [threading.Thread(target=lambda: results.append(process.run(copy, "world", SHORT))) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len(results) == 3
    assert not folders(os.getpid())[1:]


def test_a_world_s_progress_follows_the_samples_of_cycles():
    """The time left then follows Cycles' speed, also on a busy machine. Worlds without detail are done too soon."""
    scenes.add_world()
    bpy.context.scene.world.node_tree.nodes.new("ShaderNodeTexNoise")
    told = []
    with new_copy() as copy:
        process.run(copy, "world", SHORT | {"width": 4096, "height": 2048, "samples": 2}, told.append)
    assert 0.35 in [round(fraction, 3) for fraction in told], told  # the first of two samples, as in bakes
    assert told == sorted(told)
