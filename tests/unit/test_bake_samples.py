"""Bakes from a folder of samples."""

import math
from dataclasses import replace

import numpy as np
import pytest
from beamspread import LdfSample, Medium, simulate
from beamspread.core.bake.bake_settings import BakeSettings
from beamspread.core.errors import BakeError
from beamspread.core.ldf.library import load_source
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import SunLight

from bakes import MATERIAL, bake, square

SUN = SunLight("Sun", 2.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))
SQUARE = square()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("samples")
    library = simulate(Medium(0.0), [0, 30, 60], 20_000)
    for angle in (0, 30, 60):
        for albedo in (0.8, 0.9):
            LdfSample.from_library(library, angle, albedo, 81, 0.5).save(path / f"{angle}_{albedo}.exr")
    return path


def settings(folder, method="angular"):
    return BakeSettings(samples=2, margin=0, distributions=method, sample_folder=str(folder))


@pytest.mark.parametrize("method", ["angular", "adaptive", "planar"])
def test_interior_under_a_sun(folder, method):
    """Far from the border exitance is the power of the sample."""
    sample = LdfSample.load(folder / "30_0.9.exr")
    sun = replace(SUN, direction=(math.sin(math.radians(30)), 0.0, -math.cos(math.radians(30))))
    luminance = bake(SQUARE, Illumination([sun]), MATERIAL, 0.0, settings(folder, method))
    irradiance = 2 * math.cos(math.radians(30))
    assert luminance[12, 12] == pytest.approx(sample.power * irradiance / math.pi, rel=1e-3)


def test_the_messages_for_the_artist(folder, tmp_path):
    def baked(where, sun=SUN, material=MATERIAL):
        return bake(SQUARE, Illumination([sun]), material, 0.0, settings(where))

    with pytest.raises(BakeError, match="no folder of LDF samples at ''"):
        baked("")
    with pytest.raises(BakeError, match="no folder of LDF samples"):
        baked(tmp_path / "missing")
    with pytest.raises(BakeError, match="holds no EXR file"):
        baked(tmp_path)
    low = replace(SUN, direction=(math.sin(1.3), 0.0, -math.cos(1.3)))
    with pytest.raises(BakeError, match=r"don't reach this far: .*0 <= angle <= 60"):
        baked(folder, sun=low)
    with pytest.raises(BakeError, match=r"don't reach this far: .*0.8 <= albedo <= 0.9"):
        baked(folder, material=replace(MATERIAL, albedo=(0.9, 0.9, 0.95)))
    LdfSample(np.ones((3, 3)), 0.2, 0, 0.5).save(tmp_path / "a.exr")
    LdfSample(np.ones((4, 4)), 0.2, 0, 0.6).save(tmp_path / "b.exr")
    with pytest.raises(BakeError, match=r"can't be interpolated: .*3 x 3 and of 4 x 4"):
        baked(tmp_path)
    (tmp_path / "b.exr").write_text("no image")
    with pytest.raises(BakeError, match=r"b\.exr"):
        load_source(str(tmp_path), "angular")


def test_samples_are_read_again_only_when_they_changed(tmp_path):
    def write(name, albedo):
        LdfSample(np.ones((3, 3)), 0.2, 0, albedo).save(tmp_path / name)

    write("a.exr", 0.5)
    first = load_source(str(tmp_path), "angular")
    assert load_source(str(tmp_path), "angular") is first
    write("b.exr", 0.6)
    second = load_source(str(tmp_path), "angular")
    assert second is not first
    write("b.exr", 0.7)
    assert load_source(str(tmp_path), "angular") is not second
    assert load_source(str(tmp_path), "planar") is not load_source(str(tmp_path), "angular")
