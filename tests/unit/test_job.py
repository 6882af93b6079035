"""Jobs and their steps, and bakes that record how a job ended."""

from dataclasses import dataclass, replace

import beamspread
import numpy as np
import pytest
from beamspread.core.bake.job import Step
from beamspread.core.bake.runner import Bake, Sink, run_bakes
from beamspread.core.bake.surface import Surface
from beamspread.core.messages import warning
from beamspread.core.scene.illumination import Illumination
from beamspread.core.scene.lights import SunLight
from beamspread.core.target import Target

from bakes import MATERIAL, bake_job

SUN = SunLight("Sun", 2.0, (1.0, 1.0, 1.0), True, (0.0, 0.0, -1.0))


@dataclass(frozen=True)
class Ends(Step):
    """Ends a job with a texture or an exception."""

    outcome: object

    name = "Ending"

    def run(self, job, progress):
        if isinstance(self.outcome, BaseException):
            raise self.outcome
        return replace(job, texture=self.outcome)


TEXTURE = np.ones((2, 2, 3), np.float32)


def ending_job(outcome):
    illumination = Illumination([SUN], messages=[warning("", "Careful.")])
    return replace(bake_job([SUN]), illumination=illumination, steps=(Ends(outcome),))


@pytest.mark.parametrize(
    ("outcome", "status", "error"),
    [
        (TEXTURE, "written", ""),
        (ValueError("No."), "failed", "No."),
        (MemoryError(), "failed", "There is not enough memory. Lower the resolution."),
        (KeyboardInterrupt(), "cancelled", "The bake was cancelled."),
        (beamspread.Cancelled(), "cancelled", "The bake was cancelled."),
    ],
)
def test_a_bake_records_its_result(outcome, status, error):
    stored = []
    one = Bake(Target("Plane", "Stone"), ending_job(outcome))
    one.run()
    one.keep(lambda done: stored.append(done.texture) or "plane.exr")
    assert (one.status, one.error) == (status, error)
    assert [texture is TEXTURE for texture in stored] == ([True] if status == "written" else [])
    assert one.path == ("plane.exr" if status == "written" else "")
    assert [*map(str, one.messages)] == [*([error] if error else []), "Careful."]
    assert one.texture is None


def test_a_bake_that_cannot_be_stored_has_failed():
    def full_disk(_bake):
        raise OSError("no space left")

    one = Bake(Target("Plane"), ending_job(TEXTURE))
    one.run()
    one.keep(full_disk)
    assert (one.status, one.error, one.texture) == ("failed", "no space left", None)


def test_a_job_runs_its_steps_in_order():
    """A step may change the surface and add messages; each has its part of the progress."""
    before = bake_job([SUN], surface=Surface(MATERIAL, base_color=(0.5,) * 3))
    fractions, colored = [], Surface(MATERIAL, base_color=(0.3,) * 3)

    class Color(Step):
        name = "Coloring"

        def seconds(self, _job):
            return 1e6

        def run(self, job, progress):
            progress(0.0)
            progress(1.0)
            illumination = job.illumination.with_messages(warning("", "Paler than it looks."))
            return replace(job, surface=colored, illumination=illumination)

    bake = Bake(Target("Plane"), replace(before, steps=(Color(), *before.steps)))
    assert not bake.messages
    bake.run(fractions.append)
    assert [*map(str, bake.messages)] == ["Paler than it looks."]
    assert bake.texture == pytest.approx(replace(before, surface=colored).run().texture)
    assert fractions[0] == 0
    assert 0.999 < fractions[1] <= fractions[2]
    assert fractions == sorted(fractions)


def test_no_step_runs_in_the_dark():
    class Unwanted(Step):
        def run(self, job, progress):
            pytest.fail("nothing shows it")

    dark = replace(bake_job([]), steps=(Unwanted(), Unwanted()))
    assert not dark.run().texture.any()


def test_a_run_stores_and_notes_each_bake():
    class Host(Sink):
        def __init__(self):
            self.said = []

        def store(self, bake):
            self.said.append(("store", str(bake.target)))
            return "a.exr"

        def end(self, bake):
            self.said.append((bake.status, str(bake.target)))

    host = Host()
    jobs = {"First": ending_job(TEXTURE), "Second": ending_job(ValueError("No.")), "Third": None}
    run_bakes((Bake(Target(name), one, "" if one else "Gone.") for name, one in jobs.items()), host)
    assert host.said == [("store", "First"), ("written", "First"), ("failed", "Second"), ("failed", "Third")]


def test_a_bake_that_ended_before_it_was_cancelled_keeps_nothing():
    one = Bake(Target("Plane"), ending_job(TEXTURE))
    one.run()
    one.cancel()
    one.keep(lambda _bake: pytest.fail("stored"))
    assert one.status == "cancelled"
