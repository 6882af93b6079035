"""Ways in which a package's native module can be useless for this Python.

Each function spoils the module of a copy of the package and returns words that the message must contain.
"""

from importlib.machinery import EXTENSION_SUFFIXES


def module_of(package):
    """The module that this Python loads."""
    return package / f"_native{EXTENSION_SUFFIXES[0]}"


def remove(package):
    module_of(package).unlink()
    return "the file for it is missing"


def of_another_python(package):
    module_of(package).rename(package / "_native.cpython-399-x86_64-linux-gnu.so")
    return "Found there: _native.cpython-399-x86_64-linux-gnu.so"


def empty(package):
    module_of(package).write_bytes(b"")
    return "file too short"


def of_all_pythons_and_empty(package):
    module_of(package).unlink()
    (package / f"_native{EXTENSION_SUFFIXES[-1]}").write_bytes(b"")
    return "file too short"


def for_a_newer_glibc(package):
    """A module that asks for a version of glibc that no system has."""
    data = module_of(package).read_bytes()
    version = max(name for name in (b"GLIBC_2.14\0", b"GLIBC_2.17\0", b"GLIBC_2.2.5\0") if name in data)
    newer = b"9" * (len(version) - 7)
    module_of(package).write_bytes(data.replace(version, b"GLIBC_" + newer + b"\0"))
    return f"GLIBC_{newer.decode()}' not found"


ALL = [remove, of_another_python, empty, of_all_pythons_and_empty, for_a_newer_glibc]
