"""Facts that the header of an OpenEXR file tells without its pixels."""

from __future__ import annotations

from pathlib import Path

from .native import native


def is_half(path: Path) -> bool:
    """True if there is an OpenEXR file whose channels all have 16 bits; the first part of several counts."""
    return bool(_first_part(path).get("half"))


def text_of(path: Path, name: str) -> str:
    """The text of an attribute; "" if the file or the attribute is missing."""
    value = _first_part(path).get("attributes", {}).get(name)
    return value if isinstance(value, str) else ""


def _first_part(path: Path) -> dict:
    try:
        return native.read_exr_header(str(path))[0]
    except OSError:
        return {}
