"""EXR files byte by byte: a plain writer and a plain reader, beside the library that is tested."""

import struct
import zlib

import numpy as np

MAGIC = 20000630
HALF, FLOAT = 1, 2
DTYPES = {0: "<u4", HALF: "<f2", FLOAT: "<f4"}
TILED, DEEP, MULTI_PART = 0x200, 0x800, 0x1000


# --- a plain writer -------------------------------------------------------------------------------------------------


def attribute(name, kind, data):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data


def header(width, height, channels, origin=(0, 0), sampling=1, compression=0, name=None, extra=b""):
    """`channels`: (name, type) pairs in order of names."""
    listing = b"".join(c.encode() + struct.pack("<xiIii", kind, 0, sampling, sampling) for c, kind in channels) + b"\0"
    x, y = origin
    window = struct.pack("<4i", x, y, x + width - 1, y + height - 1)
    attributes = [
        attribute("channels", "chlist", listing),
        attribute("compression", "compression", bytes([compression])),
        attribute("dataWindow", "box2i", window),
        attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"),
        attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    if name is not None:
        attributes.append(attribute("name", "string", name.encode()))
        attributes.append(attribute("type", "string", b"scanlineimage"))
        attributes.append(attribute("chunkCount", "int", struct.pack("<i", height)))
    return b"".join(attributes) + extra + b"\0"


def lines(values, channels, origin=(0, 0)):
    """Uncompressed scan lines of values (H, W, C), the first row at the top."""
    result = []
    for y, row in enumerate(values):
        data = b"".join(row[:, c].astype(DTYPES[kind]).tobytes() for c, (_, kind) in enumerate(channels))
        result.append(struct.pack("<ii", origin[1] + y, len(data)) + data)
    return result


def plain_exr(values, channels, **options):
    """A file of one part as bytes."""
    height, width = values.shape[:2]
    start = struct.pack("<ii", MAGIC, 2) + header(width, height, channels, **options)
    chunks = lines(values, channels, options.get("origin", (0, 0)))
    offsets = len(start) + 8 * height + np.cumsum([0] + [len(chunk) for chunk in chunks[:-1]])
    return start + struct.pack(f"<{height}q", *offsets) + b"".join(chunks)


def plain_multi_part(parts):
    """A file of several parts: name -> (values, channels)."""
    start = struct.pack("<ii", MAGIC, 2 | MULTI_PART)
    for name, (values, channels) in parts.items():
        start += header(values.shape[1], values.shape[0], channels, name=name)
    start += b"\0"
    position = len(start) + 8 * sum(len(values) for values, _ in parts.values())
    tables, data = b"", b""
    for number, (values, channels) in enumerate(parts.values()):
        for chunk in lines(values, channels):
            tables += struct.pack("<q", position + len(data))
            data += struct.pack("<i", number) + chunk
    return start + tables + data


# --- a plain reader -------------------------------------------------------------------------------------------------


def take_string(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def read_plain(data):
    """Attributes {name: (type, bytes)} and channels {name: (H, W), top row first} of a float file, unpacked or ZIP."""
    assert struct.unpack_from("<ii", data) == (MAGIC, 2)
    at, attributes = 8, {}
    while data[at]:
        name, at = take_string(data, at)
        kind, at = take_string(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name] = kind, data[at + 4 : at + 4 + size]
        at += 4 + size
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names, listing, position = [], attributes["channels"][1], 0
    while listing[position]:
        name, position = take_string(listing, position)
        assert struct.unpack_from("<i", listing, position) == (FLOAT,)
        names.append(name)
        position += 16
    lines_per_block = {b"\0": 1, b"\3": 16}[attributes["compression"][1]]
    rows = np.empty((height, len(names), width), "<f4")
    for offset in struct.unpack_from(f"<{-(-height // lines_per_block)}q", data, at + 1):
        y, size = struct.unpack_from("<ii", data, offset)
        count = min(lines_per_block, height - y)
        packed = data[offset + 8 : offset + 8 + size]
        rows[y : y + count] = unzip(packed, count * len(names) * width * 4).reshape(count, len(names), width)
    return attributes, {name: rows[:, i] for i, name in enumerate(names)}


def unzip(packed, size):
    """Undo deflate, the differences between bytes, and the split into two halves."""
    if len(packed) == size:
        return np.frombuffer(packed, "<f4")
    steps = np.frombuffer(zlib.decompress(packed), np.uint8).astype(np.int64)
    steps[1:] -= 128
    values = (np.cumsum(steps) & 255).astype(np.uint8)
    half = (size + 1) // 2
    result = np.empty(size, np.uint8)
    result[0::2], result[1::2] = values[:half], values[half:]
    return result.view("<f4")


def damaged_copies(whole, count, header):
    """Cut off, or with four other bytes anywhere or within the header, one after the other."""
    rng = np.random.default_rng(1)
    for case in range(count):
        if case % 3 == 0:
            yield whole[: rng.integers(1, len(whole))]
            continue
        damaged = bytearray(whole)
        for place in rng.integers(0, len(whole) if case % 3 == 1 else header, 4):
            damaged[place] ^= int(rng.integers(1, 256))
        yield bytes(damaged)


def count_refused(path, load, is_same, copies):
    """Write damaged copies to a path and load them: the number that is refused. The others must be the same."""
    refused = 0
    for damaged in copies:
        path.write_bytes(damaged)
        try:
            loaded = load(path)
        except OSError as error:
            assert str(path) in str(error)  # noqa: PT017 - either outcome is fine, a crash is not
            refused += 1
        else:
            assert is_same(loaded)  # the damaged byte does not matter: attributes of OpenEXR itself
    return refused
