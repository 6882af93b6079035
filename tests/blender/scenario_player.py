"""Plays the steps of a test in a Blender with a window, between the window's events."""

import json
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy


def play(
    steps: Iterator[Callable[[], bool]], results: dict, patience: float, pause: float = 0.05, first: float = 0.1
) -> None:
    """Resume the scenario as soon as its condition holds; at its end write `results` and quit.

    Parameters
    ----------
    steps : yields the conditions that it waits for.
    results : "complete" or "error" joins them; they go to the file that the command line names last, as JSON.
    patience, pause, first : seconds that one step may take, between two checks, and until the first.
    """
    waiting = {"for": lambda: True, "since": time.monotonic()}

    def step():
        try:
            if not waiting["for"]():
                if time.monotonic() - waiting["since"] < patience:
                    return pause
                raise TimeoutError(f"line {steps.gi_frame.f_lineno} waited in vain")
            waiting.update({"for": next(steps), "since": time.monotonic()})
            return pause
        except StopIteration:
            results["complete"] = True
        except BaseException:  # noqa: BLE001 - the test shows it
            results["error"] = traceback.format_exc()
        Path(sys.argv[-1]).write_text(json.dumps(results))
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(step, first_interval=first, persistent=True)
