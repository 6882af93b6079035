"""Each compiled variant of the Fourier transforms against numpy in double precision, and the choice among them."""

import functools
import re
import subprocess
from pathlib import Path

import _native_test
import numpy as np
import pytest

SETS = _native_test.fft_instruction_sets()
ROUNDING = 2.0**-24

# Powers of two, other even sizes, odd ones, primes (those above some hundred as convolutions of twice the length).
SIZES = [1, 2, 3, 4, 7, 16, 30, 105, 243, 256, 1000, 1009, 1155, 2048, 2310, 4099, 8192, 10007]
# Sizes of the solver: multiples of the vectors' length, and others.
LINES = [1, 5, 16, 37]


def tolerance(size):
    """Relative error of a transform in single precision, root mean square over the frequencies.

    Higham 2002, Accuracy and Stability of Numerical Algorithms, theorem 24.2: at most 8 units of rounding for each of
    log2(size) steps; a prime size takes three transforms of at most four times the length.
    """
    return 3 * 8 * ROUNDING * np.log2(4 * size)


def assert_near(got, wanted, size):
    assert got.shape == wanted.shape
    error = np.linalg.norm(got - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert error.max() < tolerance(size)


def random_lines(count, size, kind):
    rng = np.random.default_rng(1000 * size + count)
    values = rng.normal(size=(count, size)).astype(np.float32)
    return values if kind is float else (values + 1j * rng.normal(size=(count, size))).astype(np.complex64)


@pytest.mark.parametrize("instruction_set", SETS)
@pytest.mark.parametrize("size", SIZES)
def test_lines_agree_with_numpy(size, instruction_set):
    for count in LINES:
        real, lines = random_lines(count, size, float), random_lines(count, size, complex)
        half = _native_test.real_lines(real, instruction_set)
        assert_near(half, np.fft.rfft(real.astype(float)), size)
        assert_near(_native_test.half_lines(half, size, instruction_set), size * real.astype(float), size)
        exact = lines.astype(complex)
        assert_near(_native_test.complex_lines(lines, True, instruction_set), np.fft.fft(exact), size)
        assert_near(_native_test.complex_lines(lines, False, instruction_set), size * np.fft.ifft(exact), size)


@pytest.mark.parametrize("instruction_set", SETS)
@pytest.mark.parametrize(("height", "width"), [(1, 2), (64, 128), (45, 98), (101, 1000), (243, 30)])
def test_planes_agree_with_numpy(height, width, instruction_set):
    values = random_lines(height, width, float)
    wanted = np.fft.rfft2(values.astype(float))
    error = np.abs(_native_test.real_transform(values, instruction_set=instruction_set) - wanted)
    assert np.linalg.norm(error) < tolerance(height * width) * np.linalg.norm(wanted)


def test_the_fastest_is_the_default_and_every_thread_gives_the_same():
    values = random_lines(300, 420, float)
    wanted = _native_test.real_transform(values, 1, SETS[0])
    np.testing.assert_array_equal(_native_test.real_transform(values), wanted)
    assert SETS[-1] == "baseline"
    assert set(SETS) <= {"avx512", "avx2", "baseline"}


def test_the_sets_are_those_of_the_processor():
    flags = set(re.search(r"^flags\s*:(.*)", Path("/proc/cpuinfo").read_text(), re.MULTILINE)[1].split())
    assert ("avx2" in SETS) == ({"avx2", "fma", "bmi2"} <= flags)
    assert ("avx512" in SETS) == ({"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"} <= flags)


@pytest.mark.parametrize("minimum", [1, 2, 97, 512, 1009, 2048, 4099, 10007, 65537, 104729])
def test_fast_sizes_have_small_factors_and_lines_are_not_whole_pages(minimum):
    size = _native_test.fast_size(minimum)
    assert minimum <= size <= max(1.2 * minimum, minimum + 4)
    assert size * np.dtype(np.complex64).itemsize % 4096 != 0
    rest = size
    for factor in (2, 3, 5, 7, 11):
        while rest % factor == 0:
            rest //= factor
    assert (rest, size % 2) == (1, 0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: _native_test.real_lines(np.ones((2, 4), np.float32), "sse9"), "instruction_set.*'sse9'.*'baseline'"),
        (
            lambda: _native_test.half_lines(np.ones((2, 3), np.complex64), 4, "AVX2"),
            "instruction_set.*'AVX2'.*'baseline'",
        ),
        (lambda: _native_test.half_lines(np.ones((2, 3), np.complex64), 6), "size.*6"),
        (lambda: _native_test.complex_lines(np.ones((0, 3), np.complex64), True), r"values.*\(0, 3\).*not empty"),
        (lambda: _native_test.complex_lines(np.ones((1, 3), np.complex64), True, "mmx"), "instruction_set.*'mmx'"),
        (lambda: _native_test.real_transform(np.ones((2, 3), np.float32)), "values.*3 columns.*even"),
        (lambda: _native_test.real_transform(np.ones((2, 4), np.float32), 1, "avx"), "instruction_set.*'avx'"),
    ],
)
def test_bad_arguments_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


BUILD = next(
    (folder for folder in (Path(_native_test.__file__).parents[1], Path(_native_test.__file__).parents[1] / "release")
     if (folder / "ducc_baseline.o").exists()),
    None,
)  # fmt: skip
needs_objects = pytest.mark.skipif(
    BUILD is None or not (BUILD / "ducc_avx2.o").exists(), reason="no object files of an x86 build beside the package"
)
# AVX and later encode their instructions otherwise than SSE, and all their names begin with v, or with k for masks.
NEW_INSTRUCTION = re.compile(r"^\s+[0-9a-f]+:\s+(v[a-z0-9]+|k[a-z]+[bwdq])\s")


@functools.cache
def functions_with_new_instructions(path):
    """Mangled names of the functions in an object file that processors without AVX can't run, with their sections."""
    text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", path], capture_output=True, text=True, check=True)
    found, section, function = set(), "", ""
    for line in text.stdout.splitlines():
        if line.startswith("Disassembly of section"):
            section = line.split()[-1].rstrip(":")
        elif line.endswith(">:"):
            function = line.split("<", 1)[1][:-2]
        elif NEW_INSTRUCTION.match(line):
            found.add((section, function))
    return found


@needs_objects
def test_only_functions_for_newer_processors_use_their_instructions():
    """Functions that are chosen at run time stand in Highway's namespaces, one for each target.

    A function of the standard library among them would be the copy that the linker may keep for everybody.
    """
    objects = [BUILD / "ducc_baseline.o", *BUILD.glob("CMakeFiles/*.dir/native/**/*.o")]
    objects = [path for path in objects if not re.search(r"ducc_avx|bench_", str(path))]
    assert len(objects) > 50
    found = {function for path in objects for _, function in functions_with_new_instructions(path)}
    chosen = re.compile(r"\d+beamspread6N_AVX[23]\d+")
    assert {name for name in found if not chosen.search(name)} == set()
    assert any(map(chosen.search, found))  # the check itself works


@needs_objects
@pytest.mark.parametrize("target", ["avx2", "avx512"])
def test_a_target_shows_the_linker_its_entry_only(target):
    path = BUILD / f"ducc_{target}.o"
    symbols = subprocess.run(
        ["nm", "--defined-only", "--extern-only", "--format=posix", path], capture_output=True, text=True, check=True
    )
    assert [line.split()[0] for line in symbols.stdout.splitlines()] == [f"beamspread_fft_{target}"]
    groups = subprocess.run(["readelf", "--section-groups", path], capture_output=True, text=True, check=True)
    assert "no section groups" in groups.stdout
    found = functions_with_new_instructions(path)
    assert len(found) > 100
    # Constructors of globals run wherever the module is loaded, and the entry is called to learn where the rest is.
    assert not any(section.startswith(".text.startup") for section, _ in found)
    assert not any(name == f"beamspread_fft_{target}" for _, name in found)
