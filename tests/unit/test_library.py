"""LdfLibrary without its physics, which tests/statistical checks."""

import math
import os
import subprocess
import sys
import time
from pathlib import Path

import beamspread
import numpy as np
import pytest
from beamspread import Cancelled, LdfLibrary, Medium, simulate
from hypothesis import given, settings
from hypothesis import strategies as st

from plain_exr import count_refused, damaged_copies

MAKE_LIBRARY = Path(__file__).parents[2] / "tools" / "make_library.py"


@pytest.fixture(scope="module")
def small():
    return simulate(Medium(0.8, 1.3), [0, 20, 40, 60], 2000)


@pytest.fixture(scope="module")
def slab():
    return simulate(Medium(0.5, 1.0, 2.0), [0, 20, 40, 60], 2000)


@pytest.fixture(scope="module")
def mirrors():
    """Counts around two poles on each side, and fills a file of more numbers than one thread reads."""
    return simulate(Medium(0.9, 1.5, 0.5), [60, 65, 70, 75, 80, 85], 40_000)


def same(a, b):
    angles = a.angles
    return angles == b.angles and all(
        np.array_equal(a.image(angle, 0.9, 9, 0.7, side=side), b.image(angle, 0.9, 9, 0.7, side=side))
        and np.array_equal(
            a.image_standard_error(angle, 0.9, 9, 0.7, side=side), b.image_standard_error(angle, 0.9, 9, 0.7, side=side)
        )
        and a.reflectance(angle, 0.9) == b.reflectance(angle, 0.9)
        for angle in angles
        for side in ("reflected", "transmitted")
    )


def test_same_bits_for_any_number_of_threads():
    runs = [simulate(Medium(0.8, 1.4, 5.0), [0, 45], 3000, seed=3, threads=threads) for threads in (1, 2, 5)]
    assert same(runs[0], runs[1])
    assert same(runs[0], runs[2])


def test_the_seed_counts():
    assert not same(*(simulate(Medium(), [30], 1000, seed=seed) for seed in (1, 2)))


def test_an_angle_does_not_depend_on_the_others():
    alone, together = simulate(Medium(), [30], 1000), simulate(Medium(), [0, 30, 60], 1000)
    assert alone.reflectance(30, 0.9) == together.reflectance(30, 0.9)


@pytest.mark.parametrize("fixture", ["small", "slab", "mirrors"])
def test_files_keep_everything(fixture, request, tmp_path):
    library = request.getfixturevalue(fixture)
    library.save(tmp_path / "a.exr")
    loaded = LdfLibrary.load(str(tmp_path / "a.exr"))
    assert same(library, loaded)
    assert loaded.medium == library.medium
    assert (loaded.photons, loaded.seed) == (library.photons, library.seed)
    assert loaded.standard_error(60, 0.5) == library.standard_error(60, 0.5)


def test_a_file_is_replaced_only_by_a_whole_one(small, tmp_path):
    path = tmp_path / "missing" / "a.exr"
    with pytest.raises(OSError, match="missing"):
        small.save(path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("fixture", ["small", "mirrors"])
def test_damaged_files_are_refused(fixture, request, tmp_path):
    library = request.getfixturevalue(fixture)
    path = tmp_path / "a.exr"
    library.save(path)
    copies = damaged_copies(path.read_bytes(), 300, header=4000)
    assert count_refused(path, LdfLibrary.load, lambda loaded: same(loaded, library), copies) > 200


@pytest.mark.parametrize("fixture", ["small", "slab", "mirrors"])
def test_files_of_another_version_are_refused(fixture, request, tmp_path):
    path = tmp_path / "a.exr"
    request.getfixturevalue(fixture).save(path)
    whole = path.read_bytes()
    name = b"beamspreadLdf\0int\0" + (4).to_bytes(4, "little")
    version = (8).to_bytes(4, "little")
    assert name + version in whole
    for other in (7, 9):
        path.write_bytes(whole.replace(name + version, name + other.to_bytes(4, "little")))
        with pytest.raises(OSError, match="another format version"):
            LdfLibrary.load(path)


def test_shipped_files_are_saved_as_they_are(tmp_path):
    """A change of the layout that forgets to make them again would show."""
    from beamspread.core.ldf import library as module

    shipped = sorted(path for path in module.SHIPPED_FOLDER.glob("*.exr") if "_curved" not in path.name)
    assert len(shipped) == 12
    for path in shipped:
        LdfLibrary.load(path).save(tmp_path / path.name)
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_files_that_are_no_library(tmp_path):
    from beamspread.core.native import native

    path = tmp_path / "picture.exr"
    native.write_exr(str(path), np.zeros((4, 4, 3), np.float32), channels=["R", "G", "B"])
    with pytest.raises(OSError, match="not an LDF library"):
        LdfLibrary.load(path)
    with pytest.raises(OSError, match="nowhere"):
        LdfLibrary.load(tmp_path / "nowhere.exr")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Medium(g=1.0), "'g' is 1;"),
        (lambda: Medium(g=math.nan), "'g' is nan"),
        (lambda: Medium(ior=0.9), "'ior' is 0.9"),
        (lambda: Medium(thickness=0), "'thickness' is 0"),
        (lambda: Medium(thickness=-1), "'thickness' is -1"),
        (lambda: simulate(Medium(), [], 100), "'angles' is empty"),
        (lambda: simulate(Medium(), [90], 100), "'angles' is 90"),
        (lambda: simulate(Medium(), [-1], 100), "'angles' is -1"),
        (lambda: simulate(Medium(), [math.nan], 100), "'angles' is nan"),
        (lambda: simulate(Medium(), [30, 30], 100), "'angles' is 30"),
        (lambda: simulate(Medium(), [30], 0), "'photons' is 0"),
        (lambda: simulate(Medium(), [30], -5), "'photons' is"),
        (lambda: simulate(Medium(), [30], 100, threads=-1), "'threads' is -1"),
    ],
)
def test_bad_simulations_name_the_argument(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda lib: lib.reflectance(30, 1.0), "'albedo' is 1; allowed: 0 <= albedo < 1"),
        (lambda lib: lib.reflectance(30, -0.1), "'albedo' is -0.1"),
        (lambda lib: lib.reflectance(30, math.nan), "'albedo' is nan"),
        (lambda lib: lib.reflectance(61, 0.5), "'angle' is 61; allowed: 0 <= angle <= 60"),
        (lambda lib: lib.transmittance(90, 0.5), "'angle' is 90"),
        (lambda lib: lib.image(30, 0.5, 0, 1.0), "'size' is 0"),
        (lambda lib: lib.image(30, 0.5, 9, 0.0), "'pitch' is 0"),
        (lambda lib: lib.image(30, 0.5, 9, 1e-30), "'pitch' is 1e-30; allowed: 1e-6 <= pitch <= 1e18"),
        (lambda lib: lib.image(30, 0.5, 9, 1e30), "'pitch' is 1e.30; allowed: 1e-6 <= pitch <= 1e18"),
        (lambda lib: lib.image(30, 0.5, 9, 1e-5, beam_diameter=1e-3), "'pitch' is 1e-05; allowed: pitch >= 1e-4"),
        (
            lambda lib: lib.image(30, 0.5, 9, 1.0, beam_diameter=2e4),
            "'beam_diameter' is 20000; allowed: up to 1e6 .* 1e4",
        ),
        (lambda lib: lib.image(30, 0.5, 9, 1e9, beam_diameter=1e7), "'beam_diameter' is 1e.07; allowed: up to 1e6"),
        (lambda lib: lib.image_standard_error(30, 0.5, 9, math.nan), "'pitch' is nan"),
        (lambda lib: lib.image(30, 0.5, 9, 1.0, side="up"), "'side' is 'up'"),
        (lambda lib: lib.image(30, 0.5, 9, 1.0, beam_diameter=-2.0), "'beam_diameter' is -2"),
    ],
)
def test_bad_questions_name_the_argument(small, call, message):
    with pytest.raises(ValueError, match=message):
        call(small)


def test_media_compare_with_anything():
    assert Medium(0.5) == Medium(0.5)
    assert Medium(0.5) != Medium(0.6)
    for other in (5, None, "Medium", (0.5, 1.0, math.inf)):
        assert (Medium(0.5) == other) is False
        assert (Medium(0.5) != other) is True


@pytest.mark.parametrize("nearly", [5e-324, 1e-60, 0.01])
def test_an_angle_next_to_0(nearly):
    """Its mirror image is as near: the spline takes both for one at 0, whose odd harmonics are noise."""
    angles = [10, 20, 30, 40]
    straight, library = (simulate(Medium(0.8, 1.4), [first, *angles], 2000) for first in (0.0, nearly))
    assert library.angles == [nearly, *angles]
    for angle in (nearly, 5):
        error = math.hypot(straight.standard_error(angle, 0.9), library.standard_error(angle, 0.9))
        assert abs(library.reflectance(angle, 0.9) - straight.reflectance(angle, 0.9)) < 5 * error
        errors = [run.image_standard_error(angle, 0.9, 9, 0.5).max() for run in (straight, library)]
        assert 0.25 < errors[1] / errors[0] < 4  # each known to a quarter


@pytest.mark.parametrize("which", ["reflected", "transmitted"])
def test_image_at_the_ends_of_the_allowed_range(small, slab, which):
    """Power per area: around O the same seen from ever nearer (a pencil's as 1 / pitch), evenly in a huge disk."""
    library = small if which == "reflected" else slab
    total = library.reflectance(30, 0.9) if which == "reflected" else library.transmittance(30, 0.9)
    far = library.image(30, 0.9, 8, 1e18, side=which).sum(dtype=np.float64) * 1e36
    assert far == pytest.approx(total, rel=1e-5)
    near = [library.image(30, 0.9, 8, pitch, side=which) for pitch in (1e-5, 1e-6)]
    assert near[1].mean() / near[0].mean() == pytest.approx(10 if which == "reflected" else 1, rel=1e-4)
    for pitch, diameter in ((1.0, 1e4), (100.0, 1e6)):
        disk = library.image(30, 0.9, 8, pitch, side=which, beam_diameter=diameter)
        assert disk == pytest.approx(np.full((8, 8), total / (math.pi / 4 * diameter**2)), rel=1e-3)


@pytest.mark.parametrize("stop_at", [0.0, 0.3, 0.9])
def test_cancel_and_run_again(stop_at):
    seen = []

    def progress(fraction):
        seen.append(fraction)
        return fraction < stop_at

    with pytest.raises(Cancelled):
        simulate(Medium(), [0, 40], 60_000, progress=progress)
    assert seen == sorted(seen)
    assert seen[-1] >= stop_at
    assert simulate(Medium(), [0], 100, progress=lambda f: None).photons == 100


def test_an_error_in_the_callback_comes_through():
    with pytest.raises(KeyError, match="mine"):
        simulate(Medium(), [0], 10_000, progress=lambda f: {}["mine"])


def test_an_error_in_the_callback_stops_every_thread():
    """The work in hand of each thread would take half a minute."""
    begin = time.monotonic()
    with pytest.raises(KeyError, match="mine"):
        simulate(Medium(), [0], 10**8, threads=4, progress=lambda f: f == 0 or {}["mine"])
    assert time.monotonic() - begin < 10


def test_image_is_the_same_seen_at_half_the_pitch(small):
    """To 0.3 %: where a texel's border crosses from one radius bin to the next, Gauss's rule crosses a kink."""
    fine = small.image(35, 0.9, 60, 0.25).reshape(30, 2, 30, 2).mean(axis=(1, 3))
    coarse = small.image(35, 0.9, 30, 0.5)
    assert fine == pytest.approx(coarse, rel=3e-3)
    assert fine.sum() == pytest.approx(coarse.sum(), rel=1e-6)


def test_image_is_even_in_v_and_round_at_normal_incidence(small):
    image = small.image(40, 0.9, 31, 0.3)
    assert image == pytest.approx(image[::-1], rel=1e-5)
    image = small.image(0, 0.9, 31, 0.3)
    assert image == pytest.approx(image.T, rel=1e-4)
    assert image == pytest.approx(image[:, ::-1], rel=1e-5)


@settings(max_examples=25, deadline=None)
@given(st.floats(0, 60), st.floats(0.05, 0.999), st.floats(-2.5, 3.5), st.integers(1, 40), st.sampled_from([0, 1]))
def test_no_power_is_lost_or_doubled(angle, albedo, log_pitch, size, which):
    """A window holds at most R and, if it is larger than the radial bins reach, exactly R."""
    library, side = (simulated_once(), "reflected") if which == 0 else (simulated_slab_once(), "transmitted")
    total = library.reflectance(angle, albedo) if which == 0 else library.transmittance(angle, albedo)
    pitch = 10.0**log_pitch
    power = float(library.image(angle, albedo, size, pitch, side=side).sum(dtype=np.float64)) * pitch**2
    assert power <= total * (1 + 1e-5)
    if size * pitch > 2 * 2**12 * 1.01 + 20:
        assert power == pytest.approx(total, rel=1e-5)


_kept = {}


def simulated_once():
    return _kept.setdefault("half-space", simulate(Medium(0.8), [0, 20, 40, 60], 4000))


def simulated_slab_once():
    return _kept.setdefault("slab", simulate(Medium(0.5, 1.4, 2.0), [0, 20, 40, 60], 4000))


def test_shipped_files_are_made_again_bit_by_bit(tmp_path):
    """The command that makes them, for a small one, by the kernel that every processor has."""
    from beamspread.core.ldf import library as module

    medium = Medium(0.9, 1.5, 0.5)
    choice = ["--medium", "0.9", "1.5", "0.5", "--quality", "preview", "--kernel", "scalar"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    files = []
    for name in ("one", "two"):
        command = [sys.executable, MAKE_LIBRARY, *choice, "--output", tmp_path / name]
        subprocess.run(command, check=True, env=environment, capture_output=True)
        files.append(tmp_path / name / module.file_name(medium, "preview"))
    assert files[0].read_bytes() == files[1].read_bytes()
    assert same(LdfLibrary.load(files[0]), module.make(medium, "preview", kernel="scalar"))


class TestCache:
    @pytest.fixture(autouse=True)
    def folder(self, tmp_path, monkeypatch):
        from beamspread.core.ldf import library as module

        monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path / "cache"))
        monkeypatch.setattr(module, "SHIPPED_FOLDER", tmp_path / "shipped")
        monkeypatch.setattr(module, "angles_for", lambda medium: (0.0, 45.0, 88.0))
        monkeypatch.setattr(module, "PHOTONS", {"preview": 200, "final": 2000})
        module._loaded.clear()
        yield tmp_path / "cache"
        module._loaded.clear()

    def forget(self):
        from beamspread.core.ldf import library as module

        module._loaded.clear()

    def test_simulates_once(self, folder):
        first = beamspread.library(Medium(0.3))
        assert beamspread.library(Medium(0.3)) is first
        self.forget()
        assert same(beamspread.library(Medium(0.3), progress=lambda f: pytest.fail("simulated again")), first)
        assert len(list(folder.iterdir())) == 1

    def test_damaged_and_foreign_files_are_made_again(self, folder):
        first = beamspread.library(Medium(0.3))
        (path,) = folder.iterdir()
        other = simulate(Medium(0.4), [0, 45], 100)
        for damage in (lambda: path.write_bytes(path.read_bytes()[:1000]), lambda: other.save(path)):
            damage()
            self.forget()
            assert same(beamspread.library(Medium(0.3)), first)
            assert LdfLibrary.load(path).medium == Medium(0.3)

    def test_any_damage_is_repaired(self, folder):
        first = beamspread.library(Medium(0.3))
        (path,) = folder.iterdir()
        whole = path.read_bytes()
        rng = np.random.default_rng(2)
        for case in range(12):
            damaged = bytearray(whole)
            damaged[rng.integers(0, len(whole) if case % 2 else 4000)] ^= 1 << int(rng.integers(8))
            path.write_bytes(damaged)
            self.forget()
            assert same(beamspread.library(Medium(0.3)), first)

    def test_files_made_otherwise_are_made_again(self, folder):
        beamspread.library(Medium(0.3))
        (path,) = folder.iterdir()
        for other in (simulate(Medium(0.3), [0, 45, 88], 300), simulate(Medium(0.3), [0, 40, 88], 300).calibrated()):
            other.save(path)
            self.forget()
            made = beamspread.library(Medium(0.3))
            assert made.is_calibrated
            assert made.angles == [0.0, 45.0, 88.0]

    def test_a_folder_in_place_of_the_file_costs_nothing(self, folder):
        first = beamspread.library(Medium(0.3))
        (path,) = folder.iterdir()
        path.unlink()
        path.mkdir()
        self.forget()
        assert same(beamspread.library(Medium(0.3)), first)
        assert path.is_dir()

    def test_nothing_is_left_beside_the_files(self, folder):
        beamspread.library(Medium(0.3))
        beamspread.library(Medium(0.4), quality="preview")
        assert sorted(path.suffix for path in folder.iterdir()) == [".exr", ".exr"]

    def test_shipped_libraries_come_first(self, folder, tmp_path):
        from beamspread.core.ldf import library as module

        medium = Medium(0.3, 1.1, 2.0)
        shipped = module.make(medium, "final")
        (tmp_path / "shipped").mkdir()
        path = tmp_path / "shipped" / module.file_name(medium, "final")
        shipped.save(path)
        for quality in ("final", "preview"):
            self.forget()
            found = beamspread.library(medium, quality=quality, progress=lambda f: pytest.fail("simulated"))
            assert same(found, shipped)
        assert not folder.exists()
        path.write_bytes(path.read_bytes()[:-100])
        self.forget()
        assert same(beamspread.library(medium), shipped)
        assert len(list(folder.iterdir())) == 1

    def test_an_unwritable_folder_costs_nothing(self, folder):
        folder.write_text("a file where the folder should be")
        assert beamspread.library(Medium(0.3)).medium == Medium(0.3)

    def test_cancel(self):
        with pytest.raises(Cancelled):
            beamspread.library(Medium(0.3), progress=lambda f: False)
        assert beamspread.library(Medium(0.3)).angles == [0.0, 45.0, 88.0]

    @pytest.mark.parametrize("medium", [None, 0.8, (0.8, 1.0, 2.0)])
    def test_no_medium(self, medium):
        with pytest.raises(ValueError, match=r"'medium' is .*; allowed: a Medium"):
            beamspread.library(medium)

    def test_unknown_quality(self):
        with pytest.raises(ValueError, match="'quality' is 'best'"):
            beamspread.library(Medium(0.3), quality="best")
