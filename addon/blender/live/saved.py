"""What an image was last saved as, whatever it shows meanwhile."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from pathlib import Path

from ...core.whole_file import whole_file
from ..images import files, icons


class Saved:
    """Bytes of an image's packed file, or a copy of its file."""

    def __init__(self, image) -> None:
        self._path = files.file_of(image)
        if self._path is None:
            self._packed = bytes(image.packed_file.data)
        else:
            folder = tempfile.mkdtemp(prefix="beamspread-")
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            self._copy, self._state = Path(folder) / self._path.name, _state(self._path)
            shutil.copyfile(self._path, self._copy)

    def is_current(self, image) -> bool:
        """Whether the image is still saved as that."""
        if files.file_of(image) != self._path:
            return False
        if self._path is None:
            return image.packed_file is not None and bytes(image.packed_file.data) == self._packed
        return self._path.is_file() and _state(self._path) == self._state

    def put_back(self, image) -> None:
        if self._path is None:
            image.pack(data=self._packed, data_len=len(self._packed))
        elif files.file_of(image) == self._path:
            with whole_file(self._path) as temporary:
                shutil.copyfile(self._copy, temporary)
            self._state = _state(self._path)
        reread(image)


def _state(path: Path) -> tuple[int, int]:
    found = path.stat()
    return found.st_mtime_ns, found.st_size


def reread(image) -> None:
    """Show what the image was last saved with."""
    if image.packed_file is None:
        icons.reload(image)
        return
    icons.stop_drawing()
    # Not `reload`: it would pack the image's file anew, where there is one.
    image.buffers_free()
    image.gl_free()
    image.update_tag()


def can_be_read_again(image) -> bool:
    """Whether what the image shows is what it was saved with."""
    path = files.file_of(image)
    is_kept = image.packed_file is not None if path is None else path.is_file()
    return is_kept and not image.is_dirty
