"""A screen in memory for a Blender with a window."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def virtual_screen(size: tuple[int, int] = (1600, 1000)) -> Iterator[dict[str, str]]:
    """Start an X server and stop it at the end: the environment of a program that draws there.

    The server itself chooses a free display and says which. The script xvfb-run chooses before it starts one, so two
    at once may choose the same; and it waits for a signal, forever if the signal comes before it waits.
    """
    reader, writer = os.pipe()
    options = ["-screen", "0", f"{size[0]}x{size[1]}x24", "+extension", "GLX", "-nolisten", "tcp"]
    with os.fdopen(reader) as chosen:
        server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(writer), *options],
            pass_fds=[writer],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(writer)
        try:
            display = chosen.readline().strip()
            if not display:
                raise RuntimeError(f"Xvfb opened no screen; its exit status is {server.wait()}")
            yield os.environ | {"DISPLAY": f":{display}"}
        finally:
            server.terminate()
            server.wait()
