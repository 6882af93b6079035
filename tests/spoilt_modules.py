"""Ways in which a package's native module for this Python can be of no use.

Each spoils the module of a copy of the package and returns the expected message.
"""

import hashlib
from importlib.machinery import EXTENSION_SUFFIXES


def module_of(package):
    """The module that this Python loads."""
    return package / f"_native{EXTENSION_SUFFIXES[0]}"


def remove(package):
    module_of(package).unlink()
    return "the file for it is missing"


def of_another_python(package):
    module_of(package).rename(package / "_native.cpython-399-x86_64-linux-gnu.so")
    return "_native.cpython-399-x86_64-linux-gnu.so (for Python 3.99)"


def of_another_platform(package):
    module_of(package).rename(package / "_native.cp311-win_amd64.pyd")
    return "_native.cp311-win_amd64.pyd (for Python 3.11)"


def cut_off(package):
    data = module_of(package).read_bytes()
    module_of(package).write_bytes(data[: len(data) // 2])
    return "is damaged: its end is missing"


def empty(package):
    module_of(package).write_bytes(b"")
    return "is damaged: its end is missing"


def zeros_within(package):
    """A block that never reached the disk: only the checksums of a zip tell."""
    module = module_of(package)
    data = bytearray(module.read_bytes())
    (package / "native.sha256").write_text(f"{hashlib.sha256(data).hexdigest()}  {module.name}\n")
    data[len(data) // 2 : len(data) // 2 + 65536] = bytes(65536)
    module.write_bytes(data)
    return "is damaged: it is not the file that was packed"


def for_a_newer_glibc(package):
    """A module that asks for a version of glibc that no system has."""
    data = module_of(package).read_bytes()
    version = max(name for name in (b"GLIBC_2.14\0", b"GLIBC_2.17\0", b"GLIBC_2.2.5\0") if name in data)
    newer = b"9" * (len(version) - 7)
    module_of(package).write_bytes(data.replace(version, b"GLIBC_" + newer + b"\0"))
    return f"it needs glibc {newer.decode()} or newer, and this system has glibc"


def without_a_library(package):
    """A module that needs a shared library which this system lacks."""
    data = module_of(package).read_bytes()
    module_of(package).write_bytes(data.replace(b"libm.so.6\0", b"libm.so.9\0"))
    return "a library that it needs, libm.so.9, is not on this system"


ALL = [
    remove,
    of_another_python,
    of_another_platform,
    cut_off,
    empty,
    zeros_within,
    for_a_newer_glibc,
    without_a_library,
]
