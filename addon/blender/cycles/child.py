"""Program of the child process, in Blender or with Blender as a module: child.py -- MARK IDLE_SECONDS PARENT

Each line of its input is the path of a request (JSON), until the input ends. The process opens the copy of the scene
that the request names, does the task, which may change anything in memory, and writes the arrays that the task returns,
by name, to the file that the request names. Opening a copy resets all data, so requests don't depend on earlier ones.

The process ends at the first error, without requests for some time, and when its parent ends in any way. PARENT is the
parent's process number: one that ended before Python began here can't be asked for.
"""

import importlib
import json
import os
import queue
import shutil
import signal
import sys
import tempfile
import threading
import time
import traceback
import types
from contextlib import suppress
from pathlib import Path

import bpy
import numpy as np

CYCLES = Path(__file__).resolve().parent


def package(name: str, folder: Path) -> None:
    """Have relative imports find the files of a folder by this name, without the folder's own `__init__`."""
    module = types.ModuleType(name)
    module.__path__ = [str(folder)]
    sys.modules[name] = module


# The add-on is not loaded in this process: its parts read more than the process needs, and register classes.
package("beamspread_child", CYCLES.parent)
package("beamspread_child.cycles", CYCLES)
child_colors, child_fields, child_world = (
    importlib.import_module(f"beamspread_child.cycles.{name}")
    for name in ("child_colors", "child_fields", "child_world")
)
compat = importlib.import_module("beamspread_child.compat")

# Exit codes after an error, and after a time without requests.
FAILED, IDLE = 1, 4

# Seconds until a process whose parent was killed has another parent, at most.
ORPHANED_SECONDS = 2.0


class BeamspreadNode(bpy.types.ShaderNodeCustomGroup):
    """Node class that shows its inner tree: the add-on is not registered in this process."""

    bl_idname = "BeamspreadNode"
    bl_label = "Beamspread"


def render(request, scene, progress) -> dict:
    """Task `render`: one view layer at one frame into the multi-layer EXR file `picture`, by `engine`.

    The parent process does compositing and sequencing.
    """
    bpy.utils.register_class(BeamspreadNode)
    scene.render.engine = request["engine"]
    scene.frame_set(request["frame"], subframe=request["subframe"])
    scene.render.use_compositing = scene.render.use_sequencer = False
    # The image has the size of the render border if there is one.
    scene.render.use_crop_to_border = True
    scene.render.use_overwrite, scene.render.use_placeholder = True, False
    scene.render.filepath, scene.render.use_file_extension = request["picture"], False
    compat.save_as_multilayer_exr(scene)
    with child_world.counting_samples(progress):
        notes = _render_denoised(scene, {"write_still": True, "scene": scene.name, "layer": request["view_layer"]})
    return {"frame": np.array(scene.frame_current), "notes": np.array(notes, dtype=str)}


def _render_denoised(scene, options: dict) -> list[str]:
    """Render, without the denoiser where there is none or where it fails; sentences on that."""
    if not (scene.render.engine == "CYCLES" and scene.cycles.use_denoising):
        bpy.ops.render.render(**options)
        return []
    if compat.has_denoiser():
        try:
            bpy.ops.render.render(**options)
            return []
        except RuntimeError as error:
            if "denois" not in str(error).lower():
                raise
            note = f"Cycles could not denoise the picture, which came without: {sentence_of(error)}."
    else:
        note = "The picture was not denoised: this Blender has no denoiser."
    scene.cycles.use_denoising = False
    bpy.ops.render.render(**options)
    return [note]


TASKS = {
    "world": child_world.panorama,
    "fields": child_fields.fields,
    "colors": child_colors.colors,
    "render": render,
}


def sentence_of(error: BaseException) -> str:
    """First line of an error's text, without Blender's prefix and the period at its end."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    text = (lines or [type(error).__name__])[0].removeprefix("Error: ").rstrip(".")
    return text if isinstance(error, RuntimeError) else f"{type(error).__name__}: {text}"


def restore_images(file: Path) -> None:
    """Restore pixels that images had in memory only."""
    with np.load(file) as pixels:
        for name in pixels.files:
            old, values = bpy.data.images.get(name), pixels[name]
            if old is None:
                continue
            height, width, channels = values.shape
            image = bpy.data.images.new(name, width, height, alpha=channels == 4, float_buffer=old.is_float)
            image.colorspace_settings.name = old.colorspace_settings.name
            image.alpha_mode = old.alpha_mode
            full = np.ones((height, width, 4), np.float32)
            full[..., :channels] = values if channels > 1 else np.broadcast_to(values, (height, width, 1))
            image.pixels.foreach_set(full.ravel())
            old.user_remap(image)


class Requests(threading.Thread):
    """Reads paths of requests, also while Cycles renders, and ends the process with the input."""

    def __init__(self, parent: int) -> None:
        super().__init__(daemon=True)
        self.paths, self._parent = queue.SimpleQueue(), parent
        _wake_at_input()
        self.start()

    def run(self) -> None:
        for line in sys.stdin:
            self.paths.put(Path(line.strip()))
        began = time.monotonic()
        while time.monotonic() - began < ORPHANED_SECONDS and os.name == "posix":
            if os.getppid() != self._parent:  # it was killed, and has left its folders
                for folder in Path(tempfile.gettempdir()).parent.glob(f"beamspread-cycles-{self._parent}-*"):
                    shutil.rmtree(folder, ignore_errors=True)
                break
            time.sleep(0.05)
        leave(0)


def leave(code: int) -> None:
    """End the process at once: some versions hang while they clean up.

    Blender's own folder goes first: it lies among all temporary files if the parent had ended before Blender began.
    """
    if bpy.app.tempdir:
        shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(code)


def _wake_at_input() -> None:
    """Have Linux continue this process, if it is stopped, at each request and when the parent ends."""
    with suppress(ImportError, AttributeError):
        import fcntl

        fcntl.fcntl(0, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(0, fcntl.F_SETSIG, signal.SIGCONT)
        fcntl.fcntl(0, fcntl.F_SETFL, fcntl.fcntl(0, fcntl.F_GETFL) | os.O_ASYNC)


def scene_of_world(request: dict):
    """An empty scene with the world of a copy that has no scene."""
    scene = bpy.data.scenes.new("Scene")
    scene.world = bpy.data.worlds[request["world"]]
    scene.frame_set(request["frame"], subframe=request["subframe"])
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    return scene


def answer(request: dict, say) -> None:
    """Do the task of a request."""
    blend = Path(request["copy"])
    bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False, use_scripts=request["scripts"])
    restore_images(blend.with_name("images.npz"))
    scene = bpy.data.scenes[request["scene"]] if request["scene"] else scene_of_world(request)
    window = bpy.context.window
    if window is not None and request["scene"]:
        window.scene = scene
        window.view_layer = scene.view_layers[request["view_layer"]]

    say(0.0)
    arrays = TASKS[request["task"]](request, scene, say)
    np.savez(request["output"], **arrays)


def main() -> int:
    """Answer requests; the exit code."""
    mark, idle_seconds, parent = sys.argv[sys.argv.index("--") + 1 :]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent

    def say(news) -> None:
        sys.stdout.write(f"\n{mark} {news}\n")
        sys.stdout.flush()

    requests = Requests(int(parent))
    if not bpy.app.binary_path:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    while True:
        try:
            path = requests.paths.get(timeout=float(idle_seconds))
        except queue.Empty:
            return IDLE
        try:
            answer(json.loads(path.read_text()), say)
        except BaseException as error:  # noqa: BLE001 - the parent shows every error
            traceback.print_exc()
            say(f"error {sentence_of(error)}")
            return FAILED
        say("done")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)  # frees the scene


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    leave(code)
