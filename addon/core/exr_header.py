"""What an OpenEXR file says of its channels, by its first bytes alone.

The layout is that of "OpenEXR File Layout" (openexr.com): a magic number and flags, then attributes, each of a name, a
type, a size and as many bytes; names end in a zero byte, numbers are little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

MAGIC = b"\x76\x2f\x31\x01"
LARGEST_HEADER = 1 << 20
HALF = 1


def is_half(path: Path) -> bool:
    """Whether there is an OpenEXR file whose channels all have 16 bits; of several parts the first counts."""
    try:
        types = _types_in(_attribute(path, "channels"))
    except (OSError, ValueError, IndexError, struct.error):
        return False
    return bool(types) and set(types) == {HALF}


def text_of(path: Path, name: str) -> str:
    """An attribute that is a text; "" where the file or the attribute is missing."""
    try:
        return _attribute(path, name).decode()
    except (OSError, ValueError, IndexError, struct.error):
        return ""


def _attribute(path: Path, name: str) -> bytes:
    with path.open("rb") as file:
        header = file.read(LARGEST_HEADER)
    return next((value for known, value in _attributes(header) if known == name.encode()), b"")


def _attributes(header: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 8 if header[:4] == MAGIC else len(header)
    while at < len(header) and header[at] != 0:
        name, at = _text(header, at)
        _kind, at = _text(header, at)
        (size,) = struct.unpack_from("<i", header, at)
        at += 4
        yield name, header[at : at + size]
        at += size


def _types_in(channels: bytes) -> list[int]:
    """Each entry: the name, its type, four bytes of flags and two sampling rates."""
    types, at = [], 0
    while channels and channels[at] != 0:
        _name, at = _text(channels, at)
        types.append(struct.unpack_from("<i", channels, at)[0])
        at += 16
    return types


def _text(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.index(b"\0", at)
    return data[at:end], end + 1
