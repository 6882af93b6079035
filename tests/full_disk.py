"""A disk without room, for tests of files that are complete or unchanged."""

import resource
import signal
from contextlib import contextmanager


@contextmanager
def full_after(size):
    """Limit files of this process to `size` bytes: writing more fails as on a full disk."""
    before, limit = signal.signal(signal.SIGXFSZ, signal.SIG_IGN), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limit[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, before or signal.SIG_DFL)
