"""Has Cycles compute on copies of the scene, in a Blender of its own: child.py.

This file never touches the data of this Blender: its functions may be called in any thread. The child process stays for
later requests, so that only the first one waits for its start. It ends after some minutes without requests, when a
request is cancelled or fails, and when this process ends, even if that is killed.
"""

from __future__ import annotations

import json
import logging
import os
import re
import subprocess
import sys
import threading
import time
import uuid
import weakref
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from ...core.errors import BakeError
from ...core.progress import Callback, Progress
from .folders import Folder
from .scene_copy import SceneCopy

CHILD = Path(__file__).with_name("child.py")

# First word of the lines with the child's progress; Blender prints many other lines.
MARK = "BEAMSPREAD-PROGRESS"

# Progress in the lines that Cycles prints while it renders.
SAMPLES = re.compile(r"\bSample (\d+)/(\d+)")

POLL_SECONDS = 0.1

# Seconds without output after which the process counts as hung. Loading a scene of gigabytes takes minutes.
SILENT_SECONDS = 1800.0

# Seconds without requests after which the process ends. More keep its memory, about 150 MB, for longer.
IDLE_SECONDS = 180.0

# Exit code of a process that has ended for lack of requests.
IDLE = 4

# Last lines of its output that the log gets if the process fails. More: longer logs.
LAST_LINES = 40


def run(
    copy: SceneCopy,
    task: str,
    request: dict,
    progress: Callback | None = None,
    doing: str = "Cycles works",
    keeps: bool = True,
    worker: str = "Cycles",
) -> dict[str, np.ndarray]:
    """Have the child process do a task of child.py on the copy. Calls from several threads wait for each other.

    Parameters
    ----------
    request : input of the task, in types of JSON.
    progress : called with 0..1 several times a second; returns False to stop.
    doing : name of the stage for the progress.
    keeps : False for a process of its own, which ends with the task and whose progress is that of its samples.
    worker : engine that does the task, for errors.

    Returns
    -------
    Arrays by name.

    Raises
    ------
    BakeError
        The process failed; one sentence. The log has the last lines that it printed.
    Cancelled
        `progress` returned False; the process is dead by then.
    """
    name, progress = uuid.uuid4().hex, Progress.of(progress)
    output, file = copy.folder / f"{name}.npz", copy.folder / f"{name}.json"
    words = {"copy": str(copy.file), "task": task, "output": str(output)}
    file.write_text(json.dumps({**copy.request, **request, **words}))
    process = _kept if keeps else _Process(counts_samples=True)
    with process.taken(progress, keeps):
        child = process.child(copy.binary)
        if not _ask(child, file, progress, doing):
            child = process.child(copy.binary)  # the former one was about to end
            _ask(child, file, progress, doing)
        if not output.exists():
            raise _failure(child, worker)
        with np.load(output) as arrays:
            result = dict(arrays)
    for temporary in (output, file):
        temporary.unlink()
    return result


def _ask(child: _Child, file: Path, progress: Progress, doing: str) -> bool:
    """Have the child do one task; False if it ended before it took the request, for lack of earlier ones."""
    try:
        child.send(file)
        while not child.has_finished(POLL_SECONDS):
            progress.begin(doing if child.has_answered else f"{doing} (Cycles starts)")
            progress.check(child.fraction)
            if time.monotonic() - child.heard > SILENT_SECONDS:
                raise BakeError(f"Cycles gave no sign of life for {SILENT_SECONDS / 60:.0f} minutes.")
    except BaseException:
        child.end()
        raise
    return child.has_answered or child.code != IDLE


def _failure(child: _Child, worker: str) -> BakeError:
    """The error of a process that ended without a result; its last lines go to the log."""
    logging.getLogger(__name__).error("%s failed:\n%s", worker, "\n".join(child.last_lines))
    why = child.error or f"its process ended with exit code {child.code}"
    return BakeError(f"{worker} failed on a copy of the scene: {why}.", "The console has the details.")


def start(copy: SceneCopy) -> None:
    """Start the child process unless it runs, so that the first request waits less."""
    if _kept.lock.acquire(blocking=False):
        try:
            _kept.child(copy.binary)
        finally:
            _kept.lock.release()


def end() -> None:
    """End the child process."""
    _kept.end()


def register() -> None:
    """Nothing: the first request starts the process."""


unregister = end


class _Process:
    """The child process, as long as it runs; `lock` is held by the thread that uses it."""

    def __init__(self, counts_samples: bool = False) -> None:
        self.lock, self._counts_samples = threading.Lock(), counts_samples
        self._child: _Child | None = None

    @contextmanager
    def taken(self, progress: Progress, keeps: bool) -> Iterator[None]:
        """Wait until no other thread uses the process; raises Cancelled."""
        while not self.lock.acquire(timeout=POLL_SECONDS):
            progress.check(0.0)
        try:
            yield
        finally:
            if not keeps:
                self.end()
            self.lock.release()

    def child(self, binary: str) -> _Child:
        """The process, started if it does not run."""
        if self._child is None or not self._child.is_running():
            self.end()
            self._child = _Child(_command(binary), self._counts_samples)
        return self._child

    def end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            child.end()


def _command(binary: str) -> list[str]:
    words = [str(CHILD), "--", MARK, str(IDLE_SECONDS), str(os.getpid())]
    if not binary:  # Blender as a module
        return [sys.executable, *words]
    return [binary, "-b", "--factory-startup", "--python-exit-code", "3", "--python", *words]


class _Child:
    """A child process, and its progress by its own lines or by the samples that Cycles counts."""

    def __init__(self, command: list[str], counts_samples: bool) -> None:
        self._folder, self._counts_samples = Folder(), counts_samples
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        # Blender leaves a folder behind when it is killed.
        places = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(self._folder.path))
        # Windows would open a console.
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        self._process = subprocess.Popen(
            command, env=os.environ | places, encoding="utf-8", errors="replace", creationflags=hidden, **pipes
        )
        # Python may end without `end`. The process is killed before its folder goes: it would still write there.
        self._killer = weakref.finalize(self, _kill, self._process)
        self._finished = threading.Event()
        self._begin()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _begin(self) -> None:
        self.fraction, self.has_answered, self.heard = 0.0, False, time.monotonic()
        self.error, self._span = "", (0.0, 1.0) if self._counts_samples else None
        self.last_lines: deque[str] = deque(maxlen=LAST_LINES)
        self._finished.clear()

    @property
    def code(self) -> int | None:
        """Exit code; None while the process runs."""
        return self._process.poll()

    def is_running(self) -> bool:
        return self.code is None

    def send(self, request: Path) -> None:
        """Ask for the task of a file."""
        self._begin()
        with suppress(OSError):  # it has ended, as the listener finds out
            self._process.stdin.write(f"{request}\n")
            self._process.stdin.flush()
        if not self._listener.is_alive():
            self._finished.set()

    def has_finished(self, seconds: float) -> bool:
        """Wait for at most this time; True if the task is done or the process has ended."""
        return self._finished.wait(seconds)

    def end(self) -> None:
        """Kill the process if it still runs, and wait until all its output is read."""
        self._killer()
        self._listener.join()
        with suppress(OSError):
            self._process.stdin.close()
        self._process.stdout.close()

    def _listen(self) -> None:
        for line in self._process.stdout:
            self.heard = time.monotonic()
            if line.startswith(MARK):
                word, _, rest = line.removeprefix(MARK).strip().partition(" ")
                if word == "done":
                    self._finished.set()
                elif word == "error":
                    self.error = rest
                elif word == "span":
                    self._span = tuple(map(float, rest.split()))
                else:
                    self.fraction, self.has_answered = float(word), True
            elif self._span is not None and (match := SAMPLES.search(line)):
                start, end = self._span
                # The tiles that follow a panorama are rendered with their own samples.
                self.fraction = max(self.fraction, start + (end - start) * int(match[1]) / max(int(match[2]), 1))
            elif line.strip():
                self.last_lines.append(line.strip())
        self._process.wait()
        self._folder.remove()
        self._finished.set()


def _kill(process: subprocess.Popen) -> None:
    if process.poll() is None:
        process.kill()
    process.wait()


_kept = _Process()
