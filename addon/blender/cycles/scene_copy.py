"""A copy of the scene on disk, for the processes that compute on it."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
import weakref
from pathlib import Path

import bpy
import numpy as np

from ...core.messages import Message, warning
from ..read.visibility import with_instanced

PREFIX = "beamspread-cycles-"
FILE, IMAGES = "scene.blend", "images.npz"

# Where a process can't be asked for by its number: after this long its folder is surely no longer in use.
STALE_SECONDS = 7 * 24 * 3600


class SceneCopy:
    """The scene as it is now, in a folder of its own; nothing of the host's is touched, undo and paths included.

    Make it in the main thread (it reads `bpy.data`), and use it anywhere. The folder goes when nobody needs it any
    more, at the latest when the process ends, or by `remove()`.

    Attributes
    ----------
    request : what every process on it needs to know, as plain data: scene, view layer, whether drivers may run Python.
    warnings : messages about images whose unsaved pixels the copy lacks.
    """

    def __init__(self, scene, view_layer) -> None:
        remove_stale()
        self.folder = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))
        self.remove = weakref.finalize(self, shutil.rmtree, self.folder, ignore_errors=True)
        self.warnings: list[Message] = []
        self.binary = bpy.app.binary_path
        self.request = {
            "scene": scene.name,
            "view_layer": view_layer.name,
            "scripts": bpy.context.preferences.filepaths.use_scripts_auto_execute,
        }
        try:
            for obj in with_instanced(scene.objects):
                if obj.mode == "EDIT":
                    obj.update_from_editmode()
            # Unlike saving the file this runs no handlers of other add-ons, packs nothing and makes no preview.
            bpy.data.libraries.write(str(self.file), {scene}, path_remap="ABSOLUTE", compress=False)
            self._keep_unsaved_images()
        except BaseException:
            self.remove()
            raise

    @property
    def file(self) -> Path:
        return self.folder / FILE

    def __enter__(self) -> SceneCopy:
        return self

    def __exit__(self, *_error) -> None:
        self.remove()

    def _keep_unsaved_images(self) -> None:
        """Pixels that are in memory alone: a file has them only if they are packed."""
        pixels = {}
        for image in bpy.data.images:
            if not image.is_dirty or image.library is not None or image.source not in {"GENERATED", "FILE"}:
                if image.is_dirty and image.source == "TILED":
                    text = f"The image '{image.name}' is not saved: Cycles reads its files."
                    self.warnings.append(warning(image.name, text))
                continue
            if not image.size[0] or not image.users:
                continue
            values = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(values)
            pixels[image.name] = values.reshape(image.size[1], image.size[0], image.channels)
        np.savez(self.folder / IMAGES, **pixels)


def remove_stale() -> None:
    """Folders that killed processes left behind."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        number = folder.name.removeprefix(PREFIX).split("-")[0]
        try:
            if number.isdigit() and not _may_run(int(number), folder):
                shutil.rmtree(folder, ignore_errors=True)
        except OSError:  # another user's, or gone meanwhile
            continue


def _may_run(process: int, folder: Path) -> bool:
    if os.name != "posix":  # there a signal of 0 is no question
        return time.time() - folder.stat().st_mtime < STALE_SECONDS
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
