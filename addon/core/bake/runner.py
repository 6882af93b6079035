"""Runs jobs and notes what became of each; the window, the engine and the batch all bake through this."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..errors import message_of
from ..messages import Level, Message, Messages, warning
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
    status : one of the constants above; FAILED until `keep` has stored the result.
    messages : all messages for the artist; an error among them unless the status is WRITTEN.
    layers : results of the job, see `BakeJob.run`; empty before it has run and once they are stored.
    path : file that `keep` has written, if any.
    seconds : wall-clock time of `run` and `keep`.
    is_dark : True if the job has run and no light arrived.
    """

    def __init__(self, target: Target, job: BakeJob | None = None, error: Exception | str = "") -> None:
        self.target, self.job = target, job
        self.status = FAILED
        self.messages = Messages(job.messages() if job else ())
        self.layers: dict[str, np.ndarray] = {}
        self.path = ""
        self.is_dark = False
        self.seconds = 0.0
        if error:
            self.fail(error)

    @property
    def error(self) -> str:
        """Why there is no result; "" if there is no error."""
        return " ".join(map(str, self.messages.of(Level.ERROR)))

    def fail(self, error: Exception | str) -> None:
        """Note why there is no result."""
        if isinstance(error, str):
            self.messages.add(Message(Level.ERROR, str(self.target), error))
        else:
            self.messages.add(message_of(error, str(self.target)))

    def warn(self, subject: str, text: str, remedy: str = "") -> None:
        self.messages.add(warning(subject, text, remedy))

    def run(self, progress: Progress | None = None) -> None:
        """Make the layers. Touches nothing of the host's, so that it may run in any thread."""
        if self.job is None:
            return
        start = time.monotonic()
        try:
            self.job, rest = self.job.colored(progress)
            job, rest = self.job.lit(rest)  # not kept: what was found is large
            self.messages.add(*job.messages())
            self.layers = job.run(rest)
            self.is_dark = job.is_dark(self.layers)
            self.messages.add(*job.messages_after(self.layers))
        except (KeyboardInterrupt, native.Cancelled):
            self.cancel()
        except Exception as error:  # noqa: BLE001 - the others are still to be baked
            self.fail(error)
        self.seconds += time.monotonic() - start

    def cancel(self) -> None:
        """Drop the result, so that nothing is kept."""
        self.layers, self.status = {}, CANCELLED
        self.messages = Messages(self.messages.of(Level.WARNING, Level.INFO))
        self.fail("The bake was cancelled.")

    def keep(self, store: Callable[[Bake], str]) -> None:
        """Have `store` put the layers where they belong; it returns the path of the file written, if one was."""
        if not self.layers:
            return
        start = time.monotonic()
        try:
            self.path = store(self)
            self.status = WRITTEN
        except Exception as error:  # noqa: BLE001 - e.g. the material was deleted meanwhile
            self.fail(error)
        finally:
            self.layers = {}  # large
        self.seconds += time.monotonic() - start
