"""Calls everything that the native module offers once, under a sanitizer: a mistake ends the process.

Plain Python instead of pytest, so that nothing else is in the process. Results are only checked for sanity.
"""

import tempfile
from pathlib import Path

import numpy as np
from beamspread import Cancelled, Medium, exact_totals, simulate
from beamspread.core.native import native

THREADS = 2
SIZE = 24


def cancelled_at(stop, work):
    """Call `work(progress)` and stop it as soon as a fraction of `stop` is reported."""
    try:
        work(lambda fraction: fraction < stop)
    except Cancelled:
        return
    raise AssertionError("progress returned False, but the work went on")


def refused(error, work, *arguments, **keywords):
    try:
        work(*arguments, **keywords)
    except error:
        return
    raise AssertionError(f"{work} accepted {arguments} {keywords}")


def libraries(folder):
    of_slab = Medium(g=0.5, ior=1.4, thickness=3.0)
    slab = simulate(of_slab, angles=[0, 30, 60, 85], photons=2000, seed=2, threads=THREADS)
    half_space = simulate(Medium(), angles=[0, 45], photons=500, threads=THREADS, progress=lambda fraction: True)
    for library in (slab, half_space):
        path = str(Path(folder) / "library.exr")
        library.save(path)
        again = type(library).load(path)
        assert again.medium == library.medium
        for side in ("reflected", "transmitted") if library is slab else ("reflected",):
            image = again.image(20.0, 0.9, 16, 0.3, side=side)
            assert np.isfinite(image).all()
        assert 0 < again.reflectance(10.0, 0.9) < 1
    cancelled_at(0.3, lambda progress: simulate(Medium(), [0], 100_000, threads=THREADS, progress=progress))
    refused(ValueError, simulate, Medium(), [95], 100)
    refused(OSError, type(slab).load, str(Path(folder) / "none.exr"))
    Path(folder, "broken.exr").write_bytes(Path(folder, "library.exr").read_bytes()[:3000])
    refused(OSError, type(slab).load, str(Path(folder) / "broken.exr"))
    calibrated = slab.calibrated(threads=THREADS)
    assert abs(calibrated.reflectance(30, 0.9) - exact_totals(slab.medium, [30], [0.9])[0][0, 0]) < 1e-3
    assert np.isfinite(calibrated.image_standard_error(20.0, 0.9, 8, 0.3)).all()
    calibrated.save(str(Path(folder) / "calibrated.exr"))
    for name in ("library.exr", "calibrated.exr"):
        fuzz(Path(folder, name).read_bytes(), str(Path(folder) / "fuzzed.exr"), type(slab))
    # Several threads read this one.
    large = simulate(Medium(0.9, 1.5, 0.5), angles=[60, 65, 70, 75, 80, 85], photons=20_000, threads=THREADS)
    large.save(str(Path(folder) / "large.exr"))
    fuzz(Path(folder, "large.exr").read_bytes(), str(Path(folder) / "fuzzed.exr"), type(slab), cases=30)
    return slab


def fuzz(whole, path, library, cases=150):
    """Load files with bytes changed or cut off, most in the headers: each is refused or fit for use."""
    rng = np.random.default_rng(1)
    for case in range(cases):
        damaged = bytearray(whole)
        if case % 5 == 0:
            damaged = damaged[: rng.integers(1, len(whole))]
        for place in rng.integers(0, min(len(damaged), 6000 if case % 2 else len(whole)), 1 + case % 4):
            damaged[place] = int(rng.integers(256))
        Path(path).write_bytes(damaged)
        try:
            loaded = library.load(path)
        except OSError:
            continue
        assert np.isfinite(loaded.image(loaded.angles[0], 0.9, 4, 1.0)).all()


def beams():
    grid = native.ReceiverGrid((-1, -1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), 2 / SIZE, 2 / SIZE, SIZE, SIZE)
    corners = np.array([[0, -1, 0.5], [0.5, -1, 0.5], [0.5, 1, 0.5], [0, 1, 0.5]])
    occluders = native.Occluders([native.OccluderMesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32))], (0, 0, 0))

    def gather(light, progress=None):
        irradiance, flow = native.gather_rays(grid, light, occluders, samples=3, threads=THREADS, progress=progress)
        flow[irradiance[..., 0] == 0] = (0, 0, -1)
        return irradiance[..., 0], flow / np.linalg.norm(flow, axis=2, keepdims=True)

    sun, _ = gather(native.SunLight((0.3, 0, -1)))
    assert sun.min() == 0 < sun.max()
    lamp = native.PointLight((0.2, 0, 1))
    point, point_direction = gather(lamp)
    spot, _ = gather(native.SpotLight((0.2, 0, 1), np.eye(3), 1.0, 0.2), lambda fraction: True)
    assert point.max() > 0
    assert spot.max() > 0
    cancelled_at(0, lambda progress: gather(native.SunLight((0, 0, -1)), progress))
    covered = native.coverage(np.array([[1.5, 1], [9, 1], [9, 8]], np.float64), np.array([3], np.uint32), SIZE, SIZE)
    assert 0 < covered.sum() < SIZE * SIZE
    return sun, point, point_direction


def rays(library):
    pitch = 0.2 / SIZE
    grid = native.ReceiverGrid((-0.1, -0.1, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), pitch, pitch, SIZE, SIZE)
    corners = np.array([[0, -1, 0.5], [0.5, -1, 0.5], [0.5, 1, 0.5], [0, 1, 0.5]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    tinted = native.OccluderMesh(
        corners, faces, None, [native.ColorTexture((0.5, 0.2, 0.1))], np.zeros((2, 1), np.uint32), None
    )
    occluders = native.Occluders([tinted], (0, 0, 0))
    image = np.random.default_rng(0).random((8, 16, 3)).astype(np.float32)
    lights = [
        native.SunLight((0.3, 0, -1), 0.2),
        native.AreaLight((0.1, 0, 1), np.eye(3), 0.3, 0.3),
        native.PointLight((0.1, 0, 1), 0.1, "sphere"),
        native.EnvironmentLight(image, np.eye(3)),
        native.MeshLight(corners + (0, 0, 0.5), faces, np.ones((2, 3), np.float32)),
    ]
    steep = [(light, (1, 0.5, 1), occluders) for light in lights[:3]]
    ones = np.ones((SIZE, SIZE, 3), np.float32)
    surface = native.Surface(grid, ones[..., 0].copy(), 0.0, ones, ones)
    medium = ([library] * 3, (0.9, 0.5, 0.1), (0.1, 0.1, 0.1))
    for light in lights:
        total, _ = native.gather_rays(grid, light, occluders, rays=8, even_rays=4, threads=THREADS)
        assert total.max() > 0
    arriving, flow = native.bake_arrival(surface, steep, rays=4, threads=THREADS)
    assert arriving.max() > 0 > flow[..., 2].min()
    for solver in ("fft", "direct", "adaptive"):
        for luminance in native.bake_luminance(
            [surface] * 2, [steep] * 2, *medium, solver, 1e-2, rays=2, threads=THREADS
        ):
            assert np.isfinite(luminance).all()
    kept = native.LightField((SIZE, SIZE), *medium, (pitch, pitch), 60.0, 0.1, True, threads=THREADS)
    assert np.isfinite(kept.luminance(surface, steep, rays=2, threads=THREADS)).all()
    computed = native.FieldLight(np.ones((1, 2, 2, 3), np.float32), np.ones(1, np.float32), position=(0.1, 0.1, 1))
    assert native.bake_arrival(surface, [(computed, (1, 1, 1), None)], threads=THREADS)[0].min() > 0.9


def solvers(library, sun, point, direction):
    from beamspread import convolve

    for solver in ("fft", "direct", "adaptive"):
        for irradiance, light in ((sun, (0.3, 0.0, -0.954)), (point, direction)):
            result = convolve(
                irradiance, light, library, (0.9, 0.5, 0.1), 0.1, 2 / SIZE, solver=solver, threads=THREADS
            )
            assert result.shape == (SIZE, SIZE, 3)
            assert np.isfinite(result).all()
    refused(ValueError, convolve, sun, (0, 0, 1), library, 0.5, 0.1, 2 / SIZE)


def images(folder):
    path = str(Path(folder) / "image.exr")
    pixels = np.linspace(-1, 7, 5 * 7 * 3, dtype=np.float32).reshape(5, 7, 3)
    native.write_exr(path, pixels, ["R", "G", "B"], {"beamspread:test": 1.5})
    again, channels, _ = native.read_exr(path)
    assert channels == ["R", "G", "B"]
    assert (again == pixels).all()


with tempfile.TemporaryDirectory() as folder:
    images(folder)
    library = libraries(folder)
    solvers(library, *beams())
    rays(library)
print("smoke: all fine")
