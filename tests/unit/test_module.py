"""The native module as a guest in somebody else's process."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import beamspread
import numpy as np
import pytest
from beamspread.core.native import native

ROOT = Path(__file__).resolve().parents[2]
STAGE = Path(beamspread.__file__).resolve().parent.parent
OF_ALL = ROOT / "build/release/modules/_native.so"
NUMPY_2 = ROOT / "build/numpy-2"
WHEEL_LIBRARIES = ROOT / "build/bpy-4.5/bpy/lib"

# The control words of x87 and SSE in fenv_t (x86-64: offsets 0 and 28) without the sticky exception flags.
FLOATING_POINT_MODE = """
import ctypes, struct
import numpy as np
libm = ctypes.CDLL("libm.so.6")
def mode():
    environment = ctypes.create_string_buffer(32)
    assert libm.fegetenv(environment) == 0
    return struct.unpack_from("<H", environment, 0)[0], struct.unpack_from("<I", environment, 28)[0] & ~0x3F
"""

EVERY_KIND_OF_CALL = """
from beamspread import Medium, convolve, simulate
from beamspread.core.native import native
library = simulate(Medium(), angles=[0, 30], photons=256)
for solver in ("fft", "direct", "adaptive"):
    convolve(np.ones((8, 8), np.float32), (0.0, 0.0, -1.0), library, 0.5, 1.0, 1.0, solver=solver)
occluders = native.Occluders([native.OccluderMesh(np.eye(3), np.array([[0, 1, 2]], np.uint32))])
grid = native.ReceiverGrid((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), pitch_x=1, pitch_y=1, width=4, height=4)
native.gather_rays(grid, native.SunLight((0, 0, -1)), occluders)
"""


NUMPY = """
import numpy as np
import beamspread as bs
from beamspread.core.native import native

ldf = bs.library(bs.Medium(0.8, 1.0))
irradiance = np.zeros((16, 24), np.float32)
irradiance[8, 8] = 1
directions = np.tile(np.array([0.6, 0, -0.8]), (16, 24, 1))
print(np.__version__)
for light in (irradiance, irradiance.astype(float), np.asfortranarray(irradiance), irradiance.astype(">f4")):
    luminance = bs.convolve(light, directions, ldf, 0.9, 2.0, 1.0)
    print(luminance.strides, luminance.dtype, f"{luminance.sum(dtype=float):.9g}")
image = ldf.image(30, 0.9, 33, 0.5)
print(image.strides, f"{image.sum(dtype=float):.9g}", bs.exact_totals(bs.Medium(), [0, 45], [0.5, 0.9])[0].tolist())
grid = native.ReceiverGrid((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), pitch_x=1, pitch_y=1, width=4, height=3)
for light in (native.SunLight((0.6, 0, -0.8)), native.PointLight((1, 1, 2))):
    arriving, flow = native.gather_rays(grid, light)
    print(arriving.strides, arriving.tolist(), flow.strides, flow.tolist())
"""


def run_python(code, stage=STAGE, **environment):
    """Stdout of a fresh interpreter that can import beamspread; its stderr has to stay empty."""
    result = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(stage), **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return result.stdout


def native_file():
    return Path(native.__file__)


@pytest.fixture(scope="module")
def stage_of_all(tmp_path_factory):
    """Folder that holds the package with the zip's module, which is for all Pythons."""
    if not OF_ALL.exists() or OF_ALL.stat().st_mtime < native_file().stat().st_mtime:
        pytest.skip("cmake --build build/release --target modules makes the zip's module anew")
    folder = tmp_path_factory.mktemp("of_all") / "beamspread"
    shutil.copytree(STAGE / "beamspread", folder, ignore=shutil.ignore_patterns("__pycache__", native_file().name))
    shutil.copy2(OF_ALL, folder)
    return folder.parent


@pytest.fixture(params=["of one Python", "of all Pythons"])
def stage(request):
    """Folder that holds the package."""
    return STAGE if request.param == "of one Python" else request.getfixturevalue("stage_of_all")


@pytest.fixture
def module(stage):
    (path,) = (stage / "beamspread").glob("_native.*so")
    return path


def test_exports_nothing_but_its_init_function(module):
    symbols = subprocess.run(
        ["nm", "--dynamic", "--defined-only", module], capture_output=True, text=True, check=True
    ).stdout
    assert [line.split()[-1] for line in symbols.splitlines()] == ["PyInit__native"]


def test_is_private_to_the_package():
    loaded = run_python("import beamspread, sys; print(*sorted(n for n in sys.modules if n.endswith('_native')))")
    assert loaded.split() == ["beamspread._native"]
    assert native_file().parent == Path(beamspread.__file__).parent


def test_import_needs_no_blender_and_prints_nothing():
    assert run_python("import beamspread, sys; assert 'bpy' not in sys.modules") == ""


def test_calls_print_nothing():
    assert run_python("import numpy as np" + EVERY_KIND_OF_CALL) == ""


def test_has_the_version_of_the_package():
    assert native.__version__ == (STAGE / "beamspread/VERSION").read_text().strip()


@pytest.mark.parametrize("call", ["import beamspread", EVERY_KIND_OF_CALL], ids=["import", "calls"])
def test_leaves_the_floating_point_mode_alone(call, stage):
    before, after = run_python(f"{FLOATING_POINT_MODE}\nprint(mode())\n{call}\nprint(mode())", stage).splitlines()
    assert before == after


def test_takes_nothing_but_python_from_a_host(module):
    """Symbols that it looks up in its process are Python's and the C library's, none of its own libraries'."""
    symbols = subprocess.run(
        ["nm", "--dynamic", "--undefined-only", module], capture_output=True, text=True, check=True
    ).stdout
    names = [line.split()[-1] for line in symbols.splitlines()]
    ours = {n for n in names if not re.match(r"_?Py|.*@(GLIBC|GCC)_[0-9.]+$", n)}
    # Symbols that every compiler asks for and does without.
    assert ours <= {"__gmon_start__", "_ITM_deregisterTMCloneTable", "_ITM_registerTMCloneTable", "__cxa_pure_virtual"}
    needed = subprocess.run(["readelf", "--dynamic", module], capture_output=True, text=True, check=True).stdout
    libraries = re.findall(r"\(NEEDED\).*\[(.*?)\]", needed)
    assert set(libraries) <= {"libc.so.6", "libm.so.6", "libgcc_s.so.1", "ld-linux-x86-64.so.2"}
    assert not re.search("RPATH|RUNPATH", needed)


def test_oldest_glibc(module):
    """docs/install.md promises it."""
    symbols = subprocess.run(["nm", "--dynamic", module], capture_output=True, text=True, check=True).stdout
    assert max(tuple(map(int, version)) for version in re.findall(r"@GLIBC_(\d+)\.(\d+)", symbols)) <= (2, 34)


@pytest.mark.parametrize("how", ["preloaded", "loaded globally"])
def test_libraries_of_the_host_do_not_win(how, stage):
    """Embree 4's functions have the names of Embree 3's, and a host's TBB or OpenEXR may be of any version."""
    hosts = [str(next(WHEEL_LIBRARIES.glob(f"{name}.so*"))) for name in ("libembree4", "libtbb", "libOpenEXR")]
    if how == "preloaded":
        given, load = {"LD_PRELOAD": ":".join(hosts), "LD_LIBRARY_PATH": str(WHEEL_LIBRARIES)}, ""
    else:
        given, load = {}, "import ctypes\n" + "".join(f"ctypes.CDLL({h!r}, mode=ctypes.RTLD_GLOBAL)\n" for h in hosts)
    loaded = "\nprint(sum(name in open('/proc/self/maps').read() for name in ('libembree4', 'libtbb', 'libOpenEXR')))"
    assert run_python(f"import numpy as np\n{load}{EVERY_KIND_OF_CALL}{loaded}", stage, **given).split() == ["3"]


def test_runs_with_an_allocator_of_the_host():
    """Debian's Blender brings jemalloc: memory of one allocator must never go to the other."""
    jemalloc = next(Path("/usr/lib").glob("*/libjemalloc.so.2"))
    loaded = "\nprint('jemalloc' in open('/proc/self/maps').read())"
    assert run_python(f"import numpy as np{EVERY_KIND_OF_CALL}{loaded}", LD_PRELOAD=str(jemalloc)) == "True\n"


def test_numpy_2_reads_and_gives_the_same_arrays():
    here = np.__version__
    ours = run_python(NUMPY).splitlines()
    theirs = run_python(NUMPY, PYTHONPATH=os.pathsep.join(map(str, (NUMPY_2, STAGE)))).splitlines()
    assert ours[0] == here
    assert int(theirs[0].partition(".")[0]) >= 2 > int(here.partition(".")[0])
    assert theirs[1:] == ours[1:]


def test_the_module_of_all_pythons_gives_the_same_bits(stage_of_all):
    assert run_python(NUMPY, stage_of_all) == run_python(NUMPY)


ERRORS = """
import beamspread as bs
from beamspread.core.native import native
for kind, call in (
    (ValueError, lambda: native.Medium(2.0)),
    (OSError, lambda: bs.LdfLibrary.load("no such file.exr")),
    (native.Cancelled, lambda: bs.simulate(bs.Medium(), angles=[0], photons=1 << 16, progress=lambda done: False)),
):
    try:
        call()
    except kind as error:
        print(type(error).__name__, error)
"""


def test_errors_of_the_engine_become_pythons(stage):
    """Bindings catch the engine's exceptions by their types, which the module of all Pythons has several times."""
    said = run_python(ERRORS, stage)
    assert [line.split()[0] for line in said.splitlines()] == ["ValueError", "OSError", "Cancelled"], said


HOST = """
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>

void* PyExc_ImportError;
static const char* version;

const char* Py_GetVersion(void) { return version; }

void* PyErr_Format(void* kind, const char* text, ...)
{
    va_list values;
    va_start(values, text);
    vprintf(text, values);
    va_end(values);
    return NULL;
}

int main(int count, char** arguments)
{
    version = arguments[2];
    void* module = dlopen(arguments[1], RTLD_NOW);
    void* (*init)(void) = module ? (void* (*)(void))dlsym(module, "PyInit__native") : NULL;
    return !init || init();
}
"""


def test_the_module_of_all_pythons_refuses_others(stage_of_all, tmp_path):
    """In a program that calls itself another Python, and has no functions of Python but those of the refusal."""
    (tmp_path / "host.c").write_text(HOST)
    host = tmp_path / "host"
    subprocess.run(["cc", "-rdynamic", tmp_path / "host.c", "-o", host, "-ldl"], check=True)
    known = rf"the module is for Python (3\.\d+, )*3\.{sys.version_info[1]}(, 3\.\d+)*"
    own = f"3.{sys.version_info[1]}.0"
    for version, lock in (
        ("3.9.7 (main)", ""),
        ("3.110.0 (main)", ""),
        ("4.11.0 (main)", ""),
        (f"{own} free-threading build (main)", " with the global interpreter lock"),
    ):
        arguments = [host, stage_of_all / "beamspread" / OF_ALL.name, version]
        said = subprocess.run(arguments, capture_output=True, text=True, check=True).stdout
        assert re.fullmatch(known + lock, said), said
