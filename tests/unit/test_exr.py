"""EXR files: an independent reader checks written files, and an independent writer makes the files to read."""

import resource
import struct
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from beamspread.core.disk import is_half, text_of
from beamspread.core.native import native
from hypothesis import example, given, settings
from hypothesis import strategies as st

from full_disk import full_after
from plain_exr import DEEP, FLOAT, HALF, MAGIC, TILED, attribute, header, plain_exr, plain_multi_part, read_plain


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.exr"


def image(height=5, width=7, channels=3, seed=0):
    return np.random.default_rng(seed).normal(size=(height, width, channels)).astype(np.float32)


@pytest.mark.parametrize(("compression", "code"), [("zip", b"\3"), ("none", b"\0")])
def test_written_file_has_rows_top_down_and_standard_attributes(path, compression, code):
    pixels = image(37, 21)
    native.write_exr(str(path), pixels, ["R", "G", "B"], {"theta": 12.5}, compression=compression)
    attributes, channels = read_plain(path.read_bytes())
    assert attributes["compression"] == ("compression", code)
    for i, name in enumerate("RGB"):
        np.testing.assert_array_equal(channels[name], pixels[::-1, :, i])
    assert struct.unpack("<4i", attributes["displayWindow"][1]) == (0, 0, 20, 36)
    assert attributes["theta"] == ("double", struct.pack("<d", 12.5))


@settings(max_examples=30, deadline=None)
@given(
    height=st.integers(1, 40),
    width=st.integers(1, 40),
    names=st.lists(st.text("abcRGBA.0123", min_size=1, max_size=40), min_size=1, max_size=5, unique=True),
    seed=st.integers(0, 9),
)
def test_round_trip_keeps_bits_and_the_order_of_channels(tmp_path_factory, height, width, names, seed):
    path = str(tmp_path_factory.mktemp("exr") / "a.exr")
    pixels = image(height, width, len(names), seed)
    native.write_exr(path, pixels, names)
    again, channels, attributes = native.read_exr(path)
    assert channels == names
    assert attributes == {}
    assert again.dtype == np.float32
    np.testing.assert_array_equal(again, pixels)


def test_unknown_compression_is_named(path):
    with pytest.raises(ValueError, match=r"compression.*'piz'.*'zip', 'none'"):
        native.write_exr(str(path), image(2, 2), ["R", "G", "B"], compression="piz")


def test_special_values_survive(path):
    values = [0.18, 2.5, -0.1, 1e-30, 3e38, np.inf, -np.inf, np.nan, 0.0, -0.0]
    pixels = np.array(values, np.float32).reshape(1, -1, 1)
    native.write_exr(str(path), pixels, ["Y"])
    again = native.read_exr(str(path))[0]
    np.testing.assert_array_equal(again.view(np.uint32), pixels.view(np.uint32))


def test_attributes_of_every_type(path):
    path = str(path)
    attributes = {
        "text": "LDF of marble, µm",
        "empty": "",
        "long": "x" * 5000,
        "double": 0.1,
        "int": -7,
        "list": [1.5, -2.0],
        "none": [],
        "array": np.array([0.25, 4.0]),
    }
    native.write_exr(path, image(), ["R", "G", "B"], attributes)
    expected = attributes | {"array": [0.25, 4.0]}
    assert native.read_exr(path)[2] == expected


@pytest.mark.parametrize("origin", [(0, 0), (-3, 1000)])
def test_reads_half_float_and_unsigned_channels(path, origin):
    values = np.abs(np.round(image(4, 6, 4) * 100)) + [0.5, 0.25, 0.125, 0]
    path.write_bytes(plain_exr(values, [("A", HALF), ("B", FLOAT), ("G", HALF), ("R", 0)], origin=origin))
    pixels, channels, _ = native.read_exr(str(path))
    assert channels == ["R", "G", "B", "A"]
    np.testing.assert_array_equal(pixels[::-1], values[..., ::-1])


@pytest.mark.parametrize("compression", ["zip", "none"])
def test_writes_half_float(path, compression):
    pixels = image(37, 21)
    native.write_exr(str(path), pixels, ["R", "G", "B"], compression=compression, half=True)
    np.testing.assert_array_equal(native.read_exr(str(path))[0], pixels.astype(np.float16))
    assert is_half(path)
    assert path.stat().st_size < pixels.nbytes
    native.write_exr(str(path), pixels, ["R", "G", "B"], compression=compression)
    assert not is_half(path)


def test_half_is_told_by_the_header(path):
    assert not is_half(path)
    for channels, expected in (([("A", HALF), ("B", HALF)], True), ([("A", HALF), ("B", FLOAT)], False)):
        path.write_bytes(plain_exr(image(4, 6, 2), channels))
        assert is_half(path) == expected
    path.write_bytes(plain_multi_part({"a": (image(3, 4, 1), [("Y", HALF)]), "b": (image(3, 4, 1), [("Y", HALF)])}))
    assert is_half(path)
    whole = path.read_bytes()
    for damaged in (b"", b"nothing of the kind", whole[:9], whole[:40]):
        path.write_bytes(damaged)
        assert not is_half(path)


def test_a_text_is_told_by_the_header(path):
    assert text_of(path, "owner") == ""
    native.write_exr(str(path), image(), ["R", "G", "B"], {"owner": "näme"})
    assert text_of(path, "owner") == "näme"
    assert text_of(path, "other") == ""
    whole = path.read_bytes()
    for damaged in (b"", b"nothing of the kind", whole[:9], whole[:40]):
        path.write_bytes(damaged)
        assert text_of(path, "owner") == ""


def test_a_negative_attribute_size_ends_the_reading(path):
    """A reader that trusts the size returns to the start of the attribute without end: 18 bytes are enough."""
    path.write_bytes(struct.pack("<ii", MAGIC, 2) + b"a\0b\0" + struct.pack("<i", -8) + b"xx")
    assert not is_half(path)
    assert text_of(path, "owner") == ""
    for read in (native.read_exr, native.read_exr_header):
        with pytest.raises(OSError, match="cannot read"):
            read(str(path))


def test_header_tells_the_facts_of_each_part(path):
    native.write_exr(str(path), image(5, 7, 2), ["Y", "B"], {"owner": "me", "list": [1.0, 2.0]}, half=True)
    (part,) = native.read_exr_header(str(path))
    assert part == {
        "name": "",
        "width": 7,
        "height": 5,
        "channels": ["Y", "B"],
        "half": True,
        "attributes": {"owner": "me", "list": [1.0, 2.0]},
    }
    path.write_bytes(plain_multi_part({"a": (image(3, 4, 1), [("Y", HALF)]), "b": (image(3, 4, 1), [("Y", FLOAT)])}))
    parts = native.read_exr_header(str(path))
    assert [(part["name"], part["width"], part["half"]) for part in parts] == [("a", 4, True), ("b", 4, False)]


def test_layers_keep_together(path):
    names = ["A", "B", "G", "R", "Z", "far.B", "far.G", "far.R"]
    path.write_bytes(plain_exr(image(2, 2, 8), [(name, FLOAT) for name in names]))
    assert native.read_exr(str(path))[1] == ["R", "G", "B", "A", "Z", "far.R", "far.G", "far.B"]


def test_reads_one_named_part(path):
    near, far = image(3, 4, 1, 1), image(3, 4, 2, 2)
    path.write_bytes(plain_multi_part({"near": (near, [("Y", FLOAT)]), "far": (far, [("G", FLOAT), ("R", FLOAT)])}))
    pixels, channels, _ = native.read_exr(str(path), "far")
    assert channels == ["R", "G"]
    np.testing.assert_array_equal(pixels[::-1], far[..., ::-1])
    np.testing.assert_array_equal(native.read_exr(str(path), part="near")[0][::-1], near)
    with pytest.raises(OSError, match=r"has 2 parts"):
        native.read_exr(str(path))
    with pytest.raises(OSError, match=r"no part 'middle', only 'near', 'far'"):
        native.read_exr(str(path), "middle")


def test_failed_write_leaves_the_old_file_and_nothing_beside_it(path):
    native.write_exr(str(path), image(), ["R", "G", "B"])
    before = path.read_bytes()
    with pytest.raises(ValueError, match="channels"):
        native.write_exr(str(path), image(seed=1), ["R", "R", "B"])
    path.chmod(0o444)
    with pytest.raises(OSError, match=r"a\.exr': the file is read-only"):
        native.write_exr(str(path), image(seed=1), ["R", "G", "B"])
    assert path.read_bytes() == before
    path.chmod(0o640)
    native.write_exr(str(path), image(seed=1), ["R", "G", "B"])
    assert path.read_bytes() != before
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(path.parent.iterdir()) == [path]


def test_a_disk_that_is_full_leaves_the_old_file_and_nothing_beside_it(path):
    native.write_exr(str(path), image(), ["R", "G", "B"])
    before = path.read_bytes()
    with full_after(10_000), pytest.raises(OSError, match=r"cannot write '.*a\.exr': "):
        native.write_exr(str(path), image(90, 90), ["R", "G", "B"])
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(("name", "reason"), [("none/a.exr", "there is no folder"), ("", "it is a folder")])
def test_unwritable_places_are_named(tmp_path, name, reason):
    path = str(tmp_path / name)
    with pytest.raises(OSError, match=reason) as error:
        native.write_exr(path, image(), ["R", "G", "B"])
    assert path.rstrip("/") in str(error.value)


@pytest.mark.parametrize(
    ("array", "channels", "attributes", "message"),
    [
        (image().astype(np.float64), "RGB", {}, "array.*float64"),
        (image()[..., 0], "RGB", {}, r"array.*\(\d+, \d+\)"),
        (image()[:, ::2], "RGB", {}, "array"),
        (image(), "RG", {}, "array.*3 channels"),
        (image(0, 4), "RGB", {}, "height.*0"),
        (image(4, 4, 0), "", {}, "channels.*empty"),
        (image(), ["R", "", "B"], {}, "channels"),
        (image(), ["R", "x" * 256, "B"], {}, "channels"),
        (image(), "RGB", {"dataWindow": "x"}, "attributes.*dataWindow"),
        (image(), "RGB", {"": 1}, "attributes"),
        (image(), "RGB", {"a": None}, "attributes.*'a'.*NoneType"),
        (image(), "RGB", {"a": 2**40}, "attributes.*'a'"),
        (image(), "RGB", {"a": ["b"]}, "attributes.*'a'"),
    ],
)
def test_bad_arguments(path, tmp_path, array, channels, attributes, message):
    with pytest.raises(ValueError, match=message):
        native.write_exr(str(path), array, list(channels), attributes)
    assert list(tmp_path.iterdir()) == []


def test_missing_and_foreign_files(tmp_path):
    path = tmp_path / "a.exr"
    with pytest.raises(OSError, match=r"a\.exr.*No such file"):
        native.read_exr(str(path))
    for content in (b"", b"\x89PNG\r\n\x1a\n" + bytes(200), struct.pack("<ii", MAGIC, 2)):
        path.write_bytes(content)
        with pytest.raises(OSError, match=r"cannot read '.*a\.exr'"):
            native.read_exr(str(path))
    with pytest.raises(OSError, match="cannot read"):
        native.read_exr(str(tmp_path))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"width": 50_000, "height": 50_000}, "more than 2\\^30|more pixels"),
        ({"width": 30_000, "height": 30_000, "compression": 3}, "more pixels than a file of its length"),
        ({"width": 2**31 - 1, "height": 1}, "its size|display window"),
        ({"width": 4, "height": 4, "sampling": 2}, "subsampled"),
        ({"width": 4, "height": 4, "channels": []}, "[Aa]t least one channel|no channels"),
    ],
)
def test_hostile_headers_are_refused_before_memory_is_taken(path, options, reason):
    options = {"channels": [("Y", FLOAT)]} | options
    path.write_bytes(struct.pack("<ii", MAGIC, 2) + header(**options) + bytes(400_000))
    with pytest.raises(OSError, match=reason):
        native.read_exr(str(path))


@contextmanager
def little_memory():
    """At most 300 MB more than the process has now."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 300_000_000, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.mark.parametrize("kind", ["string", "unknown", "floatvector", "stringvector", "preview", "chlist"])
def test_attributes_cannot_claim_more_than_the_file_holds(kind, path):
    claim = b"note\0" + kind.encode() + b"\0" + struct.pack("<i", 2**31 - 4)
    content = struct.pack("<ii", MAGIC, 2) + claim + struct.pack("<ii", 20_000, 20_000) + bytes(1000)
    path.write_bytes(content)
    with little_memory():
        for read in (native.read_exr, native.read_exr_header):
            with pytest.raises(OSError, match="cannot read"):
                read(str(path))


@pytest.mark.parametrize("compression", range(10))
def test_pixels_cannot_be_more_than_the_file_holds(compression, path):
    start = struct.pack("<ii", MAGIC, 2) + header(25_000, 25_000, [("Y", FLOAT)], compression=compression)
    path.write_bytes(start + bytes(10_000))
    with little_memory(), pytest.raises(OSError, match=r"more pixels than a file of its length|not complete|early"):
        native.read_exr(str(path))


def test_reads_tiles(path):
    values = image(3, 5, 1)
    tiles = attribute("tiles", "tiledesc", struct.pack("<IIB", 4, 4, 0))
    start = struct.pack("<ii", MAGIC, 2 | TILED) + header(5, 3, [("Y", FLOAT)], extra=tiles)
    chunks = [
        struct.pack("<5i", x, 0, 0, 0, part.nbytes) + part.tobytes()
        for x, part in enumerate((values[:, :4], values[:, 4:]))
    ]
    offsets = len(start) + 16, len(start) + 16 + len(chunks[0])
    path.write_bytes(start + struct.pack("<2q", *offsets) + b"".join(chunks))
    np.testing.assert_array_equal(native.read_exr(str(path))[0][::-1], values)

    huge = start.replace(struct.pack("<II", 4, 4), struct.pack("<II", 1 << 20, 1 << 20))
    path.write_bytes(huge + struct.pack("<q", len(huge) + 8) + b"".join(chunks))
    with pytest.raises(OSError, match="tiles are larger"):
        native.read_exr(str(path))


def test_deep_data_is_refused(path):
    kind = attribute("type", "string", b"deepscanline") + attribute("name", "string", b"deep")
    kind += attribute("version", "int", b"\1\0\0\0") + attribute("chunkCount", "int", b"\2\0\0\0")
    content = struct.pack("<ii", MAGIC, 2 | DEEP) + header(2, 2, [("Y", FLOAT)], extra=kind)
    path.write_bytes(content + struct.pack("<2q", len(content) + 16, len(content) + 16) + bytes(100))
    with pytest.raises(OSError, match="deep data"):
        native.read_exr(str(path))


def test_every_truncation_is_refused(path):
    native.write_exr(str(path), image(40, 9), ["R", "G", "B"], {"a": [1.0, 2.0]})
    content = path.read_bytes()
    for size in range(0, len(content) - 1, 7):
        path.write_bytes(content[:size])
        with pytest.raises(OSError, match="cannot read"):
            native.read_exr(str(path))


def utf8_or_marks(data):
    try:
        return data.decode()
    except UnicodeDecodeError:
        return "".join(chr(byte) if byte < 0x80 else "?" for byte in data)


@settings(max_examples=300, deadline=None)
@given(st.one_of(st.binary(max_size=12), st.text(max_size=9).map(lambda t: t.encode("utf-8", "surrogatepass"))))
@example(b"\xed\xa0\x80")  # a surrogate
@example(b"\xf4\x90\x80\x80")  # beyond the last code point
@example(b"\xe0\x80\xaf")  # longer than it need be
@example(b"a\xe2\x82")  # cut off
def test_text_that_is_not_utf8_gets_question_marks(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "text.exr"
    extra = attribute("note", "string", data)
    path.write_bytes(plain_exr(image(2, 2, 1), [("Y", FLOAT)], extra=extra))
    assert native.read_exr(str(path))[2] == {"note": utf8_or_marks(data)}


def test_names_that_are_not_utf8(path):
    extra = attribute("N?", "int", struct.pack("<i", 3))
    content = plain_exr(image(2, 2, 1), [("Y?", FLOAT)], extra=extra)
    path.write_bytes(content.replace(b"Y?", b"Y\xfe", 1).replace(b"N?", b"N\xfe", 1))
    assert native.read_exr(str(path))[1:] == (["Y?"], {"N?": 3})


def flip_bytes(content, flips):
    """Sets bytes after the magic number; positions wrap around within the header or within the whole."""
    damaged = bytearray(content)
    for position, span, value in flips:
        damaged[4 + position % (min(len(damaged), span) - 4)] = value
    return bytes(damaged)


@pytest.fixture(scope="module")
def sound_files(tmp_path_factory):
    path = tmp_path_factory.mktemp("sound") / "a.exr"
    native.write_exr(str(path), image(20, 9), ["R", "G", "B"], {"a": [1.0, 2.0], "b": "text"})
    pair = {"a": (image(3, 4, 1), [("Y", FLOAT)]), "b": (image(3, 4, 1), [("Y", HALF)])}
    return [path.read_bytes(), plain_exr(image(5, 5, 2), [("A", HALF), ("B", FLOAT)]), plain_multi_part(pair)]


@settings(max_examples=400, deadline=None)
@given(
    kind=st.integers(0, 2),
    # The header, the first few hundred bytes, holds most of the format.
    flips=st.lists(
        st.tuples(st.integers(0, 9999), st.sampled_from([400, 600, 9999]), st.integers(0, 255)), min_size=1, max_size=4
    ),
)
def test_damaged_bytes_never_crash(sound_files, tmp_path_factory, kind, flips):
    path = tmp_path_factory.getbasetemp() / "damaged.exr"
    path.write_bytes(flip_bytes(sound_files[kind], flips))
    part = "a" if kind == 2 else None
    try:
        pixels, channels, _ = native.read_exr(str(path), part)
    except OSError as error:
        message = str(error)
    else:
        message = path.name
        assert pixels.shape[2] == len(channels)
    assert path.name in message
