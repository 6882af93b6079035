"""LdfSample and its files."""

import math
import struct

import numpy as np
import pytest
from beamspread import LdfLibrary, LdfSample, Medium, simulate
from beamspread.core.native import native

from plain_exr import FLOAT, attribute, damaged_copies, plain_exr


@pytest.fixture(scope="module")
def library():
    return simulate(Medium(0.8, 1.3), [0, 20, 40, 60], 2000)


def picture(height=4, width=6):
    return np.random.default_rng(1).random((height, width), np.float32) / 10


def sample(**changes):
    values = {"image": picture(), "pitch": 0.5, "angle": 30.0, "albedo": 0.9, "beam_diameter": 2.0, "g": 0.8} | changes
    return LdfSample(**values)


def test_keeps_its_arguments():
    made = sample()
    assert (made.pitch, made.angle, made.albedo, made.beam_diameter, made.g) == (0.5, 30.0, 0.9, 2.0, 0.8)
    assert made.image.dtype == np.float32
    assert np.array_equal(made.image, picture())
    assert made.power == pytest.approx(picture().sum(dtype=np.float64) * 0.25)
    plain = LdfSample(picture(), 0.5, 30.0, 0.9)
    assert (plain.beam_diameter, plain.g) == (0.0, None)


def test_its_image_outlives_it_and_cannot_be_written():
    image = sample().image
    assert np.array_equal(image, picture())
    with pytest.raises(ValueError, match="read-only"):
        image[0, 0] = 1


def test_takes_any_real_array():
    for made in (picture().astype(np.float64), picture().tolist(), np.asfortranarray(picture()), picture()[:]):
        assert np.array_equal(sample(image=made).image, picture())
    assert sample(image=np.eye(3, dtype=int)).image[1, 1] == 1
    assert np.array_equal(sample(image=np.ma.array(picture())).image, picture())  # no value is masked


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image": np.zeros((2, 2, 3))}, r"'image' is float64 of shape \(2, 2, 3\)"),
        ({"image": np.zeros((0, 4))}, "'image' is of 0 x 4"),
        ({"image": np.zeros((2, 2), complex)}, "'image' is complex128"),
        ({"image": np.ma.masked_less([[0.1, 0.2]], 0.15)}, "'image' is an array with masked values"),
        ({"image": [["a"]]}, "'image' is <U1"),
        ({"image": [[1.0, math.nan]]}, "'image' is with a texel of nan"),
        ({"image": [[1.0, math.inf]]}, "'image' is with a texel of inf"),
        ({"image": [[1.0, -0.2]]}, "'image' is with a texel of -0.2"),
        ({"image": [[1.0, 2.0], [3.0]]}, "'image' is no array"),
        ({"pitch": 0}, "'pitch' is 0"),
        ({"pitch": math.inf}, "'pitch' is inf"),
        ({"pitch": 1e-30}, "'pitch' is 1e-30; allowed: 1e-6 <= pitch <= 1e18"),
        ({"angle": 90}, "'angle' is 90"),
        ({"angle": -1}, "'angle' is -1"),
        ({"albedo": 1}, "'albedo' is 1"),
        ({"albedo": math.nan}, "'albedo' is nan"),
        ({"beam_diameter": -1}, "'beam_diameter' is -1"),
        ({"g": 1}, "'g' is 1"),
    ],
)
def test_bad_arguments_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        sample(**changes)


def test_from_a_library(library):
    made = LdfSample.from_library(library, 25, 0.9, 15, 0.4)
    assert np.array_equal(made.image, library.image(25, 0.9, 15, 0.4))
    assert (made.pitch, made.angle, made.albedo, made.beam_diameter, made.g) == (0.4, 25, 0.9, 0, 0.8)
    with pytest.raises(ValueError, match="'side' is 'up'"):
        LdfSample.from_library(library, 25, 0.9, 15, 0.4, side="up")
    with pytest.raises(ValueError, match="'size' is -1"):
        LdfSample.from_library(library, 25, 0.9, -1, 0.4)


@pytest.mark.parametrize("g", [None, -0.3])
def test_files_keep_everything(tmp_path, g):
    made = sample(g=g, angle=1 / 3, albedo=0.1)
    made.save(tmp_path / "a.exr")
    loaded = LdfSample.load(str(tmp_path / "a.exr"))
    assert np.array_equal(loaded.image, made.image)
    for name in ("pitch", "angle", "albedo", "beam_diameter", "g"):
        assert getattr(loaded, name) == getattr(made, name)


def test_a_file_is_replaced_only_by_a_whole_one(tmp_path):
    with pytest.raises(OSError, match="missing"):
        sample().save(tmp_path / "missing" / "a.exr")
    assert list(tmp_path.iterdir()) == []


# --- files of others: written here byte by byte ---------------------------------------------------------------------


def number(name, value):
    return attribute(name, "float", struct.pack("<f", value))


NEEDED = {"pitch": 0.5, "angle": 30.0, "albedo": 0.9}


def write(path, values=None, channels=("Y",), numbers=NEEDED, extra=b""):
    if values is None:
        values = picture()[:, :, None].repeat(len(channels), axis=2)
    extra = b"".join(number(name, value) for name, value in numbers.items()) + extra
    path.write_bytes(plain_exr(values, [(channel, FLOAT) for channel in channels], extra=extra))
    return path


def test_reads_files_of_others(tmp_path):
    loaded = LdfSample.load(write(tmp_path / "a.exr"))
    assert np.array_equal(loaded.image, picture()[::-1])  # the first line is that of the largest v
    assert loaded.albedo == pytest.approx(0.9)
    assert (loaded.pitch, loaded.angle, loaded.beam_diameter, loaded.g) == (0.5, 30, 0, None)
    LdfSample.load(write(tmp_path / "b.exr", channels=("exitance",)))
    whole = attribute("beamDiameter", "int", struct.pack("<i", 3)) + number("g", 0.5) + number("author", 1)
    loaded = LdfSample.load(write(tmp_path / "c.exr", channels=("A", "Y", "Z"), extra=whole))
    assert (loaded.beam_diameter, loaded.g) == (3, 0.5)


def pixel(value):
    values = picture()[:, :, None]
    values[1, 2] = value
    return values


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"numbers": {}}, "has no attribute 'pitch', 'angle', 'albedo'; needed are"),
        ({"numbers": {"pitch": 1, "albedo": 0.5}}, "has no attribute 'angle';"),
        ({"numbers": NEEDED | {"albedo": 1}}, "'albedo' is 1;"),
        ({"numbers": NEEDED | {"pitch": math.nan}}, "'pitch' is nan"),
        ({"numbers": NEEDED | {"pitch": -1}}, "'pitch' is -1"),
        ({"numbers": NEEDED | {"angle": math.inf}}, "'angle' is inf"),
        ({"numbers": NEEDED | {"beamDiameter": -2}}, "'beam_diameter' is -2"),
        ({"numbers": NEEDED | {"g": 7}}, "'g' is 7"),
        ({"extra": attribute("g", "string", b"high")}, "attribute 'g' that is no number"),
        ({"channels": ("B", "G", "R")}, "has the channels 'R', 'G', 'B'; needed is 'Y'"),
        ({"values": pixel(math.nan)}, "texel of nan"),
        ({"values": pixel(math.inf)}, "texel of inf"),
        ({"values": pixel(-1)}, "texel of -1"),
    ],
)
def test_names_the_fault_of_a_file(tmp_path, changes, message):
    path = write(tmp_path / "a.exr", **changes)
    with pytest.raises(OSError, match=message) as error:
        LdfSample.load(path)
    assert str(path) in str(error.value)


def test_other_files(tmp_path, library):
    with pytest.raises(OSError, match="nowhere"):
        LdfSample.load(tmp_path / "nowhere.exr")
    library.save(tmp_path / "library.exr")
    with pytest.raises(OSError, match=r"holds a whole library, which LdfLibrary\.load reads"):
        LdfSample.load(tmp_path / "library.exr")
    sample().save(tmp_path / "sample.exr")
    with pytest.raises(OSError, match="not an LDF library"):
        LdfLibrary.load(tmp_path / "sample.exr")
    values = np.zeros((1, 20000, 1), np.float32)
    native.write_exr(str(tmp_path / "long.exr"), values, ["Y"], {"pitch": 1.0, "angle": 0.0, "albedo": 0.5})
    with pytest.raises(OSError, match="sides of 1 to 16384"):
        LdfSample.load(tmp_path / "long.exr")


def test_damaged_files_are_refused(tmp_path):
    path = tmp_path / "a.exr"
    sample(image=np.random.default_rng(2).random((40, 30)) / 200).save(path)
    refused = 0
    for damaged in damaged_copies(path.read_bytes(), 120, header=700):
        path.write_bytes(damaged)
        try:
            loaded = LdfSample.load(path)
        except OSError as error:
            assert str(path) in str(error)  # noqa: PT017 - either outcome is fine, a crash is not
            refused += 1
        else:
            assert np.isfinite(loaded.image).all()
    assert refused > 60
