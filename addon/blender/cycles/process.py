"""Runs child.py on a copy of the scene, in any thread: this file never touches the data of this Blender."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import threading
import time
import uuid
from collections import deque
from pathlib import Path

import numpy as np

from ...core.errors import BakeError
from ...core.progress import Callback, Progress
from .scene_copy import SceneCopy

CHILD = Path(__file__).with_name("child.py")

# First word of the lines with the child's progress; Blender prints many other lines.
MARK = "BEAMSPREAD-PROGRESS"

# Progress in the lines that Cycles prints while it renders.
SAMPLES = re.compile(r"\bSample (\d+)/(\d+)")

POLL_SECONDS = 0.1

# Seconds without output after which the process counts as hung. Loading a scene of gigabytes takes minutes.
SILENT_SECONDS = 1800.0

LAST_LINES = 12


def run(
    copy: SceneCopy,
    task: str,
    request: dict,
    progress: Callback | None = None,
    doing: str = "Cycles works",
) -> dict[str, np.ndarray]:
    """Have a child process do a task of child.py on the copy.

    Parameters
    ----------
    request : input of the task, in types of JSON.
    progress : called with 0..1 several times a second; returns False to stop.
    doing : name of the stage for the progress.

    Returns
    -------
    Arrays by name.

    Raises
    ------
    BakeError
        The process failed; with the last lines that it printed.
    Cancelled
        `progress` returned False; the process is dead by then.
    """
    name = uuid.uuid4().hex
    output, file = copy.folder / f"{name}.npz", copy.folder / f"{name}.json"
    file.write_text(json.dumps({**copy.request, **request, "task": task, "output": str(output), "mark": MARK}))
    child, progress = _Child(_command(copy, file), counts_samples=task == "render"), Progress.of(progress)
    try:
        while child.is_running(POLL_SECONDS):
            progress.begin(doing if child.has_answered else f"{doing} (Cycles starts)")
            progress.check(child.fraction)
            if time.monotonic() - child.heard > SILENT_SECONDS:
                raise BakeError(f"Cycles gave no sign of life for {SILENT_SECONDS / 60:.0f} minutes.")
    finally:
        child.end()
    if child.code != 0 or not output.exists():
        lines = " | ".join(child.last_lines)
        raise BakeError(f"Cycles failed on a copy of the scene (exit code {child.code}). It said last: {lines}")
    with np.load(output) as arrays:
        return dict(arrays)


def _command(copy: SceneCopy, request: Path) -> list[str]:
    if not copy.binary:  # Blender as a module
        return [sys.executable, str(CHILD), "--", str(copy.file), str(request)]
    scripts = ["--enable-autoexec"] if copy.request["scripts"] else ["--disable-autoexec"]
    options = ["-b", "--factory-startup", *scripts, str(copy.file), "--python-exit-code", "3", "--python", str(CHILD)]
    return [copy.binary, *options, "--", str(copy.file), str(request)]


class _Child:
    """The child process, and its progress by its own lines or by the samples that Cycles counts."""

    def __init__(self, command: list[str], counts_samples: bool = False) -> None:
        self._counts_samples = counts_samples
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        # Windows would open a console.
        hidden = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        self._process = subprocess.Popen(command, encoding="utf-8", errors="replace", creationflags=hidden, **pipes)
        self.fraction, self.has_answered, self.heard = 0.0, False, time.monotonic()
        self.last_lines: deque[str] = deque(maxlen=LAST_LINES)
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    @property
    def code(self) -> int | None:
        return self._process.returncode

    def is_running(self, seconds: float) -> bool:
        """Wait for at most this time; True if the process still runs."""
        try:
            self._process.wait(seconds)
        except subprocess.TimeoutExpired:
            return True
        return False

    def end(self) -> None:
        """Kill the process if it still runs, and wait until all its output is read."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._listener.join()
        self._process.stdout.close()

    def _listen(self) -> None:
        for line in self._process.stdout:
            self.heard = time.monotonic()
            if line.startswith(MARK):
                self.fraction, self.has_answered = float(line.split()[1]), True
            elif self._counts_samples and (match := SAMPLES.search(line)):
                self.fraction = int(match[1]) / max(int(match[2]), 1)
            elif line.strip():
                self.last_lines.append(line.strip())
