"""The command line, run as people run it: `python -m beamspread`."""

import os
import pty
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from beamspread import LdfLibrary, Medium, presets, simulate
from beamspread.core.cli import plot
from beamspread.core.cli.commands import totals_table
from PIL import Image

COMMAND = [sys.executable, "-m", "beamspread"]
SMALL = ["--angles", "0", "30", "60", "--photons", "400"]


@pytest.fixture
def run(tmp_path):
    """Run a command in an empty folder; (exit code, stdout, stderr)."""

    def call(*arguments, command=COMMAND):
        done = subprocess.run(
            [*command, *map(str, arguments)], cwd=tmp_path, env=environment(tmp_path), capture_output=True, text=True
        )
        return done.returncode, done.stdout, done.stderr

    return call


def environment(folder):
    return os.environ | {"BEAMSPREAD_CACHE": str(folder / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}


@pytest.fixture(scope="module")
def slab_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("library") / "slab.exr"
    simulate(Medium(0.5, 1.3, 3.0), [0, 30, 60, 88], 2000).save(path)
    return path


def test_library_saves_the_calibrated_simulation(run, tmp_path):
    code, out, err = run(
        "library", "--g", "-.3", "--ior", "1.3", "--thickness", "5", *SMALL, "--seed", "7", "-o", "a.exr"
    )
    assert (code, err) == (0, "")
    assert "a.exr: g -0.3, ior 1.3, slab of 5 mean free paths" in out
    loaded = LdfLibrary.load(tmp_path / "a.exr")
    expected = simulate(Medium(-0.3, 1.3, 5.0), [0, 30, 60], 400, seed=7).calibrated()
    assert (loaded.medium, loaded.angles, loaded.photons, loaded.seed) == (expected.medium, [0, 30, 60], 400, 7)
    assert loaded.reflectance(30, 0.9) == expected.reflectance(30, 0.9)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.exr"]


def test_ldf_prints_totals_and_draws(run, tmp_path, slab_file):
    code, out, err = run("ldf", "--library", slab_file, "--angle", "45", "--albedo", ".9", ".99", "-o", "map.png")
    assert (code, err) == (0, "")
    library = LdfLibrary.load(slab_file)
    rows = [line.split() for line in out.splitlines()[1:]]
    assert rows[0] == ["albedo", "reflectance", "+-", "transmittance", "+-"]
    for row, albedo in zip(rows[1:], (0.9, 0.99)):
        numbers = list(map(float, row))
        totals = [albedo, library.reflectance(45, albedo), library.transmittance(45, albedo)]
        assert [numbers[0], numbers[1], numbers[3]] == pytest.approx(totals, abs=6e-6)
        errors = [library.standard_error(45, albedo), library.standard_error(45, albedo, "transmitted")]
        assert [numbers[2], numbers[4]] == pytest.approx(errors, rel=0.5)
    with Image.open(tmp_path / "map.png") as drawn:
        pixels = np.asarray(drawn.convert("L"))
    assert min(pixels.shape) > 600
    assert len(np.unique(pixels)) > 100
    assert [entry.name for entry in tmp_path.iterdir()] == ["map.png"]


def test_ldf_without_output_only_prints(run, tmp_path, slab_file):
    code, out, _ = run("ldf", "--library", slab_file, "--albedo", ".5")
    assert code == 0
    assert len(out.splitlines()) == 3
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("name", "magic"), [("a.pdf", b"%PDF"), ("a.svg", b"<?xml")])
def test_other_formats(run, tmp_path, slab_file, name, magic):
    options = ["--side", "transmitted", "--size", "20", "--pitch", "0.5"]
    assert run("ldf", "--library", slab_file, "--angle", "0", *options, "-o", name)[0] == 0
    assert (tmp_path / name).read_bytes().startswith(magic)


def test_ldf_simulates_a_medium_once(run, tmp_path):
    arguments = ["ldf", "--g", "0", "--thickness", "1", "--quality", "preview", "--albedo", ".9"]
    first = run(*arguments)
    assert first[0] == 0
    (cached,) = (tmp_path / "cache").iterdir()
    changed = cached.stat().st_mtime_ns
    assert run(*arguments) == first
    assert cached.stat().st_mtime_ns == changed


def test_presets_are_listed(run):
    code, out, err = run("presets")
    assert (code, err) == (0, "")
    listed = {line.split()[0] for line in out.splitlines()}
    assert set(presets()) <= listed
    assert "0.750 0.714 0.681" in out


def test_albedo_of_a_color(run):
    code, out, err = run("albedo", "--color", "0", ".4", "1", "--g", "0", "--quality", "preview")
    assert (code, err) == (0, "")
    rows = [line.split() for line in out.splitlines()[2:]]
    assert [row[0] for row in rows] == ["red", "green", "blue"]
    assert float(rows[0][2]) == 0
    assert float(rows[1][3]) == pytest.approx(0.4, abs=1e-4)
    assert 0.9999 < float(rows[2][2]) < 1


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ([], 2, "COMMAND"),
        (["paint"], 2, "paint"),
        (["ldf", "--g", "1.5"], 2, "'g' is 1.5; allowed"),
        (["ldf", "--g", "much"], 2, "much"),
        (["ldf", "--ior", "0.5"], 2, "'ior' is 0.5"),
        (["ldf", "--thickness", "0"], 2, "'thickness' is 0"),
        (["ldf", "--albedo", "1"], 2, "'1' is not an albedo"),
        (["ldf", "--albedo", *[".5"] * 7], 2, "7 values; allowed: 1 to 6"),
        (["ldf", "--angle", "90"], 2, "'90' is not an angle"),
        (["ldf", "--size", "1"], 2, "whole number from 2 to 4096"),
        (["ldf", "--pitch", "-1"], 2, "length above 0"),
        (["ldf", "--side", "transmitted"], 2, "no far side"),
        (["ldf", "-o", "map.jpeg2"], 2, "ends in .png"),
        (["ldf", "-o", "nowhere/map.png"], 1, "folder nowhere"),
        (["ldf", "--library", "missing.exr"], 1, "missing.exr"),
        (["ldf", "--library", "missing.exr", "--g", "0"], 2, "leave out --g"),
        (["ldf", "--lib", "missing.exr"], 2, "--lib"),
        (["library"], 2, "-o"),
        (["library", "-o", "a.png"], 2, "ends in .exr"),
        (["library", "-o", "a.exr", "--photons", "0"], 2, "above 0"),
        (["library", "-o", "a.exr", "--angles", "10", "10"], 2, "distinct"),
        (["albedo", "--color", "2"], 2, "from 0 to 1"),
        (["albedo", "--color", ".5", ".5"], 2, "2 values"),
    ],
)
def test_mistakes_are_one_line_before_any_work(run, tmp_path, arguments, code, words):
    done, out, err = run(*arguments)
    assert (done, out) == (code, "")
    assert words in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_an_angle_that_a_saved_library_does_not_reach(run, tmp_path):
    simulate(Medium(), [0, 20], 100).save(tmp_path / "narrow.exr")
    code, _, err = run("ldf", "--library", "narrow.exr", "--angle", "30")
    assert code == 2
    assert "'angle' is 30; allowed: 0 <= angle <= 20" in err


@pytest.mark.parametrize("command", ["", "ldf", "library", "presets", "albedo"])
def test_help_teaches(run, command):
    code, out, _ = run(*([command] if command else []), "--help")
    assert code == 0
    assert command == "presets" or "mean free paths" in out
    assert command in ("", "presets") or f"python3 -m beamspread {command} --" in out


def test_without_matplotlib_only_pictures_fail(run, slab_file):
    block = "import runpy, sys; sys.modules['matplotlib'] = None; runpy.run_module('beamspread', run_name='__main__')"
    arguments = ["ldf", "--library", slab_file]
    assert run(*arguments, command=[sys.executable, "-c", block])[0] == 0
    code, out, err = run(*arguments, "-o", "map.png", command=[sys.executable, "-c", block])
    assert (code, out) == (1, "")
    assert "python3-matplotlib" in err


def test_reader_that_stops_reading(slab_file, tmp_path):
    """A closed pipe, as after `| head`: no traceback."""
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(
        [*COMMAND, "ldf", "--library", str(slab_file)],
        env=environment(tmp_path),
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
    )
    os.close(write)
    assert (done.returncode, done.stderr) == (1, "")


def start_on_terminal(folder, *arguments):
    """The process, and the other end of the terminal that its stderr is. Jobs in the background ignore Ctrl-C."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        ["env", "--default-signal=INT", *COMMAND, *arguments],
        cwd=folder,
        env=environment(folder),
        stdout=subprocess.PIPE,
        stderr=theirs,
        text=True,
    )
    os.close(theirs)
    return process, ours


def read_terminal(terminal, until=None):
    """Output of a terminal, to its end or until a text appears."""
    seen = b""
    while until is None or until not in seen:
        try:
            more = os.read(terminal, 4096)
        except OSError:  # how Linux says that the other end is closed
            break
        if not more:
            break
        seen += more
    return seen.decode()


def test_a_terminal_gets_a_bar_and_keeps_nothing_of_it(tmp_path):
    process, terminal = start_on_terminal(tmp_path, "library", *SMALL, "-o", "a.exr")
    seen = read_terminal(terminal)
    out, _ = process.communicate()
    assert process.returncode == 0
    assert "simulating [" in seen
    assert "100 %" in seen
    assert seen.endswith(" \r")
    assert "\r" not in out


def test_ctrl_c_leaves_at_once_and_nothing_behind(tmp_path):
    process, terminal = start_on_terminal(tmp_path, "library", "--photons", "1000000000", "-o", "a.exr")
    read_terminal(terminal, until=b"%")
    process.send_signal(signal.SIGINT)
    begin = time.monotonic()
    seen = read_terminal(terminal)
    out, _ = process.communicate()
    assert process.returncode == 130
    assert time.monotonic() - begin < 5
    assert out == ""
    assert seen.splitlines()[-1].endswith("beamspread library: cancelled")
    assert "Traceback" not in seen
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("count", [1, 2, 4, 6])
def test_any_number_of_maps_can_be_drawn(slab_file, tmp_path, count):
    library = LdfLibrary.load(slab_file)
    albedos = [0.0, 0.2, 0.5, 0.9, 0.99, 0.999][-count:]
    maps = plot.read_maps(library, 20, albedos, 31, 0.3, "transmitted")
    figure = plot.draw(maps, totals_table(library, 20, albedos), ["note"])
    boxes = [ax.get_position() for ax in figure.axes]
    assert len(boxes) == count + 3
    assert all(0 <= edge <= 1 for box in boxes for edge in box.extents)
    plot.save(figure, str(tmp_path / "map.png"))


def test_a_map_without_light_can_be_drawn(tmp_path):
    """Albedo 0 in a half-space: nothing comes back, and there is no logarithm of it."""
    library = simulate(Medium(), [0], 100)
    maps = plot.read_maps(library, 0, [0.0], 11, 1.0, "reflected")
    plot.save(plot.draw(maps, totals_table(library, 0, [0.0]), []), str(tmp_path / "map.png"))
    assert (tmp_path / "map.png").stat().st_size > 1000
