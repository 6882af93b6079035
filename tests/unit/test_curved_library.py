"""Curvatures of libraries without their physics, which tests/statistical/test_curved.py checks."""

import math

import beamspread
import numpy as np
import pytest
from beamspread import Cancelled, LdfLibrary, Medium, simulate
from beamspread.core.ldf import curvatures as nodes
from beamspread.core.ldf import library as module

from plain_exr import count_refused, damaged_copies

CURVATURES = [-0.05, 0.02, 0.2]
IMAGE = (40, 0.9, 9, 0.7)


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(0.8, 1.3), [0, 20, 40, 60, 80], 2000, curvatures=CURVATURES)


@pytest.fixture(scope="module")
def plane():
    return simulate(Medium(0.8, 1.3), [0, 20, 40, 60, 80], 2000)


def same(a, b):
    assert a.curvatures == b.curvatures
    return all(
        np.array_equal(a.image(*IMAGE, curvature=curvature), b.image(*IMAGE, curvature=curvature))
        and a.reflectance(40, 0.9, curvature) == b.reflectance(40, 0.9, curvature)
        and a.standard_error(40, 0.9, curvature=curvature) == b.standard_error(40, 0.9, curvature=curvature)
        for curvature in (*a.curvatures, 0.5 * (a.curvatures[0] + a.curvatures[1]))
    )


def test_a_library_always_has_the_plane(library):
    assert library.curvatures == [-0.05, 0, 0.02, 0.2]
    assert simulate(Medium(), [0], 100, curvatures=[0.0]).curvatures == [0]


def test_the_plane_keeps_its_bits(library, plane):
    assert plane.curvatures == [0]
    assert np.array_equal(library.image(*IMAGE), plane.image(*IMAGE))
    assert np.array_equal(library.image(*IMAGE, curvature=0.0), plane.image(*IMAGE))
    assert library.reflectance(40, 0.9, 0.0) == plane.reflectance(40, 0.9)
    assert library.standard_error(40, 0.9, curvature=0.0) == plane.standard_error(40, 0.9)


def test_same_bits_for_any_number_of_threads():
    runs = [
        simulate(Medium(0.8, 1.4), [0, 45], 3000, seed=3, threads=threads, curvatures=CURVATURES)
        for threads in (1, 2, 5)
    ]
    assert same(runs[0], runs[1])
    assert same(runs[0], runs[2])


def test_a_curvature_does_not_depend_on_the_others(library):
    alone = simulate(Medium(0.8, 1.3), [0, 20, 40, 60, 80], 2000, curvatures=[0.2])
    assert alone.reflectance(20, 0.9, 0.2) == library.reflectance(20, 0.9, 0.2)
    assert np.array_equal(alone.image(*IMAGE, curvature=0.2), library.image(*IMAGE, curvature=0.2))


def test_between_curvatures_the_kernel_is_linear(library):
    """Continuous at every node, so at 0; rounding of float32 alone differs."""
    curvatures = library.curvatures
    for low, high in zip(curvatures, curvatures[1:]):
        middle = library.image(*IMAGE, curvature=0.75 * low + 0.25 * high)
        ends = [library.image(*IMAGE, curvature=curvature) for curvature in (low, high)]
        np.testing.assert_allclose(middle, 0.75 * ends[0] + 0.25 * ends[1], rtol=1e-5, atol=1e-8)
        expected = 0.75 * library.reflectance(50, 0.9, low) + 0.25 * library.reflectance(50, 0.9, high)
        assert library.reflectance(50, 0.9, 0.75 * low + 0.25 * high) == pytest.approx(expected, rel=1e-12)
    for near in (-1e-12, 1e-12):
        np.testing.assert_allclose(library.image(*IMAGE, curvature=near), library.image(*IMAGE), rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("curvature", [-0.05, 0.01, 0.2])
@pytest.mark.parametrize("angle", [0, 30, 80])
def test_images_hold_the_total(library, curvature, angle):
    """Between angles, too; harmonics and float32 leave 1e-5."""
    size, pitch = 16, 400.0 if curvature < 0.2 else 2.0
    image = library.image(angle, 0.5, size, pitch, curvature=curvature)
    assert image.sum() * pitch**2 == pytest.approx(library.reflectance(angle, 0.5, curvature), rel=1e-5)


def test_fewer_angles_than_the_plane(plane, library):
    """The difference to the plane is interpolated: angles of both agree, and so do totals of images between."""
    coarse = plane.with_curved([-0.05, 0.2], [0, 40, 80], 2000)
    for angle in (0, 40, 80):
        assert coarse.reflectance(angle, 0.9, 0.2) == pytest.approx(library.reflectance(angle, 0.9, 0.2), rel=1e-9)
    for angle in (0, 20, 33):
        image = coarse.image(angle, 0.9, 16, 400.0, curvature=0.2)
        assert image.sum() * 400**2 == pytest.approx(coarse.reflectance(angle, 0.9, 0.2), rel=1e-5)


def test_files_keep_curvatures(library, tmp_path):
    library.save(tmp_path / "a.exr")
    assert same(library, LdfLibrary.load(tmp_path / "a.exr"))


def test_files_without_curvatures_stay_as_they_are(library, plane, tmp_path):
    plane.save(tmp_path / "plane.exr")
    library.save(tmp_path / "a.exr")
    again = LdfLibrary.load(tmp_path / "plane.exr")
    assert again.curvatures == [0]
    again.save(tmp_path / "again.exr")
    assert (tmp_path / "again.exr").read_bytes() == (tmp_path / "plane.exr").read_bytes()
    assert (tmp_path / "a.exr").stat().st_size > (tmp_path / "plane.exr").stat().st_size


def test_files_of_curvatures_alone(library, plane, tmp_path):
    library.save(tmp_path / "curved.exr", with_plane=False)
    assert same(library, plane.with_curved_from(tmp_path / "curved.exr"))
    with pytest.raises(OSError, match="holds no plane"):
        LdfLibrary.load(tmp_path / "curved.exr")
    with pytest.raises(ValueError, match="same medium"):
        simulate(Medium(), [0], 100).with_curved_from(tmp_path / "curved.exr")
    with pytest.raises(ValueError, match="'with_plane'"):
        plane.save(tmp_path / "nothing.exr", with_plane=False)


def test_damaged_files_are_refused(library, tmp_path):
    path = tmp_path / "a.exr"
    library.save(path)
    copies = damaged_copies(path.read_bytes(), 150, header=20_000)
    assert count_refused(path, LdfLibrary.load, lambda loaded: same(loaded, library), copies) > 100


def test_a_calibrated_library_keeps_its_curvatures(library):
    calibrated = library.calibrated()
    assert calibrated.curvatures == library.curvatures
    assert calibrated.reflectance(40, 0.9, 0.2) == library.reflectance(40, 0.9, 0.2)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda _: simulate(Medium(0.8, 1.0, 3.0), [0], 100, curvatures=[0.1]),
            "'curvatures' is 0.1; allowed: 0 for a",
        ),
        (lambda _: simulate(Medium(), [0], 100, curvatures=[0.1, 0.1]), "'curvatures' is 0.1; allowed: distinct"),
        (lambda _: simulate(Medium(), [0], 100, curvatures=[math.nan]), "'curvatures' is nan"),
        (lambda _: simulate(Medium(), [0], 100, curvatures=[101]), "'curvatures' is 101"),
        (lambda library: library.reflectance(0, 0.9, 0.3), "'curvature' is 0.3; allowed: -0.05 <= curvature <= 0.2"),
        (lambda library: library.image(0, 0.9, 8, 1.0, curvature=-0.06), "'curvature' is -0.06"),
        (lambda library: library.image(0, 0.9, 8, 1.0, curvature=math.nan), "'curvature' is nan"),
        (lambda library: library.standard_error(0, 0.9, curvature=1.0), "'curvature' is 1;"),
        (lambda library: library.with_curved([0.1], [], 100), "'angles' is empty"),
    ],
)
def test_bad_arguments(call, message, library):
    with pytest.raises(ValueError, match=message):
        call(library)


def test_slabs_allow_the_curvature_0():
    assert simulate(Medium(0.8, 1.0, 3.0), [0], 100, curvatures=[0]).curvatures == [0]


def test_cancel():
    with pytest.raises(Cancelled):
        simulate(Medium(), [0, 60], 100_000, curvatures=CURVATURES, progress=lambda fraction: fraction < 0.3)


@pytest.mark.parametrize(
    "medium", [Medium(0.0), Medium(0.8), Medium(0.9, 1.4), Medium(0.7), Medium(-0.5, 1.3)], ids=str
)
def test_simulated_curvatures_cover_the_range(medium):
    """From -1/3 to 2 per transport mean free path. Diameters of balls are edges of bins: four per octave."""
    curvatures = nodes.curvatures_for(medium)
    assert list(curvatures) == sorted(set(curvatures))
    length = 1 / (1 - max(medium.g, 0))
    assert curvatures[0] * length == pytest.approx(-1 / 3)
    assert 2 <= curvatures[-1] * length <= 2.5
    for curvature in curvatures:
        fraction, _ = math.frexp(2 / curvature)
        assert curvature < 0 or fraction * 8 == pytest.approx(round(fraction * 8), abs=1e-9)
    assert all(0.9 < b / a < 2.4 for a, b in zip(curvatures, curvatures[1:]) if a > 0)


def test_slabs_have_no_curvatures():
    assert nodes.curvatures_for(Medium(0.8, 1.0, 5.0)) == ()


class TestLibrary:
    @pytest.fixture(autouse=True)
    def folders(self, tmp_path, monkeypatch):
        monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path / "cache"))
        monkeypatch.setattr(module, "SHIPPED_FOLDER", tmp_path / "shipped")
        monkeypatch.setattr(module, "angles_for", lambda medium: (0.0, 45.0, 88.0))
        monkeypatch.setattr(module, "PHOTONS", {"preview": 200, "final": 2000})
        monkeypatch.setattr(nodes, "PHOTONS", {"preview": 200, "final": 400})
        (tmp_path / "shipped").mkdir()
        module._loaded.clear()
        yield
        module._loaded.clear()

    def test_it_is_simulated_once_and_cached(self):
        medium = Medium(0.8, 1.1)
        plane = beamspread.library(medium, "preview")
        assert module.is_known(medium, "preview")
        assert not module.is_known(medium, "preview", curved=True)
        assert module.known_library(medium, curved=True) is None
        first = beamspread.library(medium, "preview", curved=True)
        assert first.curvatures == sorted((0.0, *nodes.curvatures_for(medium)))
        assert np.array_equal(first.image(*IMAGE), plane.image(*IMAGE))
        assert module.is_known(medium, "preview", curved=True)
        assert beamspread.library(medium, "preview", curved=True) is first
        module._loaded.clear()
        assert same(beamspread.library(medium, "preview", curved=True), first)
        assert same(module.known_library(medium, curved=True), first)
        assert len(module.cached_files()) == 2

    def test_both_at_once(self):
        fractions = []
        medium = Medium(0.8, 1.1)
        library = beamspread.library(medium, "preview", fractions.append, curved=True)
        assert len(library.curvatures) > 1
        assert fractions == sorted(fractions)
        assert fractions[-1] == 1
        assert module.is_known(medium, "preview", curved=True)

    def test_shipped_files_come_first(self, tmp_path):
        medium = Medium(0.8, 1.1)
        plane = module.make(medium, "final")
        plane.save(tmp_path / "shipped" / module.file_name(medium, "final"))
        curved = nodes.with_curvatures(plane, "final")
        curved.save(tmp_path / "shipped" / module.curved_file_name(medium, "final"), with_plane=False)
        for quality in ("final", "preview"):
            assert module.is_known(medium, quality, curved=True)
            assert same(beamspread.library(medium, quality, curved=True), curved)
        assert module.cached_files() == []

    def test_files_of_other_curvatures_are_made_again(self, tmp_path, plane):
        medium = Medium(0.8, 1.3)
        plane.save(tmp_path / "shipped" / module.file_name(medium, "final"))
        path = tmp_path / "shipped" / module.curved_file_name(medium, "final")
        plane.with_curved([0.1], [0, 60], 100).save(path, with_plane=False)
        library = beamspread.library(medium, "preview", curved=True)
        assert library.curvatures == sorted((0.0, *nodes.curvatures_for(medium)))

    def test_a_slab_is_the_flat_one(self):
        medium = Medium(0.8, 1.0, 3.0)
        flat = beamspread.library(medium, "preview")
        assert beamspread.library(medium, "preview", curved=True) is flat
        assert module.is_known(medium, "preview", curved=True)

    def test_cancel(self):
        with pytest.raises(Cancelled):
            beamspread.library(Medium(0.8, 1.1), "preview", lambda fraction: fraction < 0.7, curved=True)


def test_shipped_files_are_saved_as_they_are(tmp_path):
    """The twelve shipped media have curved surfaces, in less than 14 MB together."""
    shipped = sorted(module.SHIPPED_FOLDER.glob("*_curved.exr"))
    assert len(shipped) == 12
    assert sum(path.stat().st_size for path in shipped) < 14e6
    for path in shipped:
        plane = LdfLibrary.load(path.with_name(path.name.replace("curved", "final")))
        curved = plane.with_curved_from(path)
        assert curved.curvatures == sorted((0.0, *nodes.curvatures_for(plane.medium)))
        curved.save(tmp_path / path.name, with_plane=False)
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
        assert module.is_known(plane.medium, "final", curved=True)
