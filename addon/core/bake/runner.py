"""Runs bakes one after the other; the window, the engine and the batch are its hosts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np

from ..errors import message_of
from ..messages import Level, Message, Messages, warning
from ..native import native
from ..progress import Callback, Progress
from ..target import Target
from .job import BakeJob

WRITTEN, SKIPPED, FAILED, CANCELLED = "written", "skipped", "failed", "cancelled"


class Bake:
    """One target, from its job to its result.

    Attributes
    ----------
    job : None if there can be none; an error says why.
    status : one of the constants above; FAILED until `keep` has stored the result.
    messages : all messages for the artist; an error among them unless the status is WRITTEN.
    texture : result of the job, see `BakeJob`; None before it has run and once it is stored.
    lights : number of lights of the job; once it has run, with those that its steps have found.
    path : file that `keep` has written, if any.
    exposure : factor that the file's values were multiplied by.
    seconds : wall-clock time of `run` and `keep`.
    estimated_seconds : estimate of the seconds of `run`, made before it ran; 0 until then.
    is_dark : True if the job has run and no light arrived.
    """

    def __init__(self, target: Target, job: BakeJob | None = None, error: Exception | str = "") -> None:
        self.target, self.job = target, job
        self.status = FAILED
        self.messages = Messages(job.messages() if job else ())
        self.texture: np.ndarray | None = None
        self.lights = len(job.illumination.lights) if job else 0
        self.path, self.exposure = "", 1.0
        self.is_dark = False
        self.seconds = self.estimated_seconds = 0.0
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

    def run(self, progress: Callback | None = None) -> None:
        """Run the job. Touches no data of the host, so that it may run in any thread."""
        if self.job is None:
            return
        start, progress = time.monotonic(), Progress.of(progress)
        try:
            self.estimated_seconds = self.job.seconds()
            done = self.job.run(progress)
            self.texture, self.is_dark = done.texture, done.is_dark()
            self.messages.add(*done.messages(), *done.messages_after())
            self.lights = len(done.illumination.lights)
            # The lights that steps have found are large, and no longer needed.
            lights = self.job.illumination.lights
            self.job = replace(done, illumination=done.illumination.with_lights(lights), texture=None)
        except (KeyboardInterrupt, native.Cancelled):
            self.cancel()
        except Exception as error:  # noqa: BLE001 - the others are still to be baked
            self.fail(error)
        if progress.is_cancelled:
            self.cancel()  # even if it ended, or failed, just before it would have stopped
        self.seconds += time.monotonic() - start

    def cancel(self) -> None:
        """Drop the result, so that nothing is kept."""
        self.texture, self.status = None, CANCELLED
        self.messages = Messages(self.messages.of(Level.WARNING, Level.INFO))
        self.fail("The bake was cancelled.")

    def keep(self, store: Callable[[Bake], str]) -> None:
        """Have `store` put the texture where it belongs; it returns the path of the file written, if one was."""
        if self.texture is None:
            return
        start = time.monotonic()
        try:
            self.path = store(self)
            self.status = WRITTEN
        except Exception as error:  # noqa: BLE001 - e.g. the material was deleted meanwhile
            self.fail(error)
        finally:
            self.texture = None  # large
        self.seconds += time.monotonic() - start


class Sink:
    """Host of a run: runs the jobs where it likes, stores results and shows messages."""

    def run(self, bake: Bake) -> Iterator[None]:
        """Run the bake's job. A host with an event loop yields while the job runs in another thread."""
        bake.run()
        return iter(())

    def store(self, bake: Bake) -> str:
        """Put the texture of a bake where it belongs; the path of the file written, or ""."""
        raise NotImplementedError

    def end(self, bake: Bake) -> None:
        """Take note of a bake that has ended: written, failed or cancelled."""


def run_in_steps(bakes: Iterable[Bake | None], sink: Sink) -> Iterator[None]:
    """Run, store and note each bake. Yields whenever `sink.run` does, so that a host can go on in between.

    None among the bakes lets the host go on before the next one is prepared.
    """
    for bake in bakes:
        if bake is None:
            yield
            continue
        yield from sink.run(bake)
        bake.keep(sink.store)
        sink.end(bake)


def run_bakes(bakes: Iterable[Bake | None], sink: Sink) -> None:
    """Run, store and note each bake."""
    for _ in run_in_steps(bakes, sink):
        pass
