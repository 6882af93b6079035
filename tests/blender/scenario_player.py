"""Plays the steps of a test in a Blender with a window, between the window's events.

    blender --factory-startup --python THIS -- SCENARIO RESULTS.json

SCENARIO names a module with `scenario()`, which yields the conditions that it waits for, `results`, which become the
file. The add-on is registered once the module is imported.
"""

import faulthandler
import importlib
import json
import os
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

FOLDER = Path(__file__).resolve().parent
PAUSE_SECONDS = 0.02

PATIENCE_SECONDS = 60
"""CPU time that a step of a scenario may take. Other processes take none of it, however many there are."""

HANG_SECONDS = 6 * PATIENCE_SECONDS
"""By the clock: a Blender that no longer calls timers says where it stands, and ends."""

LOCKED_CODE = 75
"""Exit code of a Blender that no longer lets timers write or call operators.

Blender has one flag for all threads, which forbids panels to write while they are drawn. A call of an engine in the
thread of F12 saves the flag and restores it; if it starts while a panel is drawn, the flag stays set.
"""


def results_of(scenario: str, folder: Path, *, size: tuple[int, int] = (1600, 1000)) -> dict:
    """Results of a scenario that a new Blender with a window and an empty cache plays, again if Blender locks itself.

    A Blender that locks itself twice fails.
    """
    results, done = _played(scenario, folder, size)
    if done.returncode == LOCKED_CODE:
        results, done = _played(scenario, folder / "again", size)
    assert "error" not in results, results["error"]
    assert results["complete"]
    assert done.returncode == 0, done.stderr
    said = done.stdout + done.stderr
    assert "Traceback" not in said, said
    return results


def _played(scenario: str, folder: Path, size: tuple[int, int]) -> tuple[dict, subprocess.CompletedProcess]:
    """Results of a Blender, and the process that ended."""
    import pytest  # which the new Blender lacks, as it does the folder of the next

    from virtual_screen import virtual_screen

    if not bpy.app.binary_path:
        pytest.skip("the bpy module opens no window")
    folder.mkdir(exist_ok=True)
    path = folder / "results.json"
    options = ["--factory-startup", "--enable-event-simulate", "--window-geometry", "0", "0", *map(str, size)]
    script = ["--python-exit-code", "1", "--python", __file__, "--", scenario, str(path)]
    command = [bpy.app.binary_path, *options, *script]
    with virtual_screen() as environment:
        environment["BEAMSPREAD_CACHE"] = str(folder / "cache")
        done = subprocess.run(command, capture_output=True, text=True, timeout=550, env=environment)
    assert path.exists(), done.stdout + done.stderr
    return json.loads(path.read_text()), done


def in_window(operator, *arguments, **options):
    """Call an operator as the window does; its result."""
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
        return operator(*arguments, **options)


def clocks() -> tuple[float, float]:
    """Seconds of CPU time and by the clock."""
    return time.process_time(), time.monotonic()


def is_over(seconds: float):
    """Condition that so many seconds have passed."""
    end = time.monotonic() + seconds
    return lambda: time.monotonic() > end


def _quit() -> None:
    """Quit as an artist does; at once, with LOCKED_CODE, where Blender has locked itself."""
    try:
        bpy.ops.wm.quit_blender()
    except RuntimeError:
        os._exit(LOCKED_CODE)


def play(steps: Iterator, results: dict, path: Path) -> None:
    """Resume the scenario as soon as its condition holds; at its end write `results` and quit."""
    waiting = {"for": lambda: True, "since": clocks()}

    def step():
        try:
            if not waiting["for"]():
                computed, passed = np.subtract(clocks(), waiting["since"])
                # By the clock, too: a process that only waits computes nothing.
                if computed < PATIENCE_SECONDS and passed < 5 * PATIENCE_SECONDS:
                    return PAUSE_SECONDS
                stacks = "".join(
                    line for frame in sys._current_frames().values() for line in traceback.format_stack(frame)
                )
                spent = f"{computed:.0f} s of CPU time, {passed:.0f} s by the clock"
                raise TimeoutError(f"line {steps.gi_frame.f_lineno} waited in vain ({spent}); threads:\n{stacks}")
            faulthandler.dump_traceback_later(HANG_SECONDS, exit=True)
            waiting.update({"for": next(steps), "since": clocks()})
            return PAUSE_SECONDS
        except StopIteration:
            results["complete"] = True
        except BaseException:  # noqa: BLE001 - the test shows it
            results["error"] = traceback.format_exc()
        path.write_text(json.dumps(results))
        _quit()
        return None

    bpy.app.timers.register(step, first_interval=1.0, persistent=True)


def main() -> None:
    module = importlib.import_module(sys.argv[-2])
    importlib.import_module("beamspread").register()
    play(module.scenario(), module.results, Path(sys.argv[-1]))


if __name__ == "__main__":
    sys.path[:0] = [str(FOLDER), str(FOLDER.parent.parent / "build" / "stage")]
    main()
