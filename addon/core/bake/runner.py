"""Runs jobs and notes what became of each; the window, the engine and the batch all bake through this."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..errors import sentence
from ..native import native
from ..progress import Progress
from ..target import Target
from .job import BakeJob

WRITTEN, SKIPPED, FAILED, CANCELLED = "written", "skipped", "failed", "cancelled"


class Bake:
    """One target, from its job to what became of it.

    Attributes
    ----------
    job : None where there can be none; `error` says why.
    layers : once it has run; see `BakeJob.run`.
    path : the file that `keep` has written, if it has.
    seconds : that run and keep took.
    error : one sentence unless `status` is "written".
    warnings : sentences that hold whatever the status.
    notes : sentences on what it has changed as planned.
    is_dark : once it has run, whether no light arrived.
    """

    def __init__(self, target: Target, job: BakeJob | None = None, error: str = "") -> None:
        self.target, self.job, self.error = target, job, error
        self.status = FAILED
        self.layers: dict[str, np.ndarray] = {}
        self.path = ""
        self.is_dark = False
        self.seconds = 0.0
        self.warnings = job.warnings() if job else []
        self.notes: list[str] = []

    def run(self, progress: Progress | None = None) -> None:
        """Make the layers. Touches nothing of the host's, so that it may run in any thread."""
        if self.job is None:
            return
        start = time.monotonic()
        try:
            self.job, rest = self.job.colored(progress)
            job, rest = self.job.lit(rest)  # not kept: what was found is large
            self._warn(job.warnings())
            self.layers = job.run(rest)
            self.is_dark = job.is_dark(self.layers)
            self._warn(job.warnings_after(self.layers))
        except (KeyboardInterrupt, native.Cancelled):
            self.cancel()
        except Exception as error:  # noqa: BLE001 - the others are still to be baked
            self.error = sentence(error)
        self.seconds += time.monotonic() - start

    def _warn(self, sentences: list[str]) -> None:
        self.warnings += [one for one in sentences if one not in self.warnings]

    def cancel(self) -> None:
        """Drop what it has made, so that nothing is kept."""
        self.layers, self.status, self.error = {}, CANCELLED, "The bake was cancelled."

    def keep(self, store: Callable[[Bake], str]) -> None:
        """Have `store` put the layers where they belong; it returns the path of the file written, if one was."""
        if not self.layers:
            return
        start = time.monotonic()
        try:
            self.path = store(self)
            self.status, self.error = WRITTEN, ""
        except Exception as error:  # noqa: BLE001 - e.g. the material was deleted meanwhile
            self.error = sentence(error)
        finally:
            self.layers = {}  # large
        self.seconds += time.monotonic() - start

    def messages(self) -> list[str]:
        """The error, if there is one, the warnings and the notes."""
        return [*filter(None, [self.error]), *self.warnings, *self.notes]
