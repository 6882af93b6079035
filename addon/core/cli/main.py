"""Runs one command; turns errors into an exit code and a message of one line."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from ..native import native
from .commands import COMMANDS, CommandError
from .options import PROGRAM, make_parser

DONE, FAILED, WRONG_USE, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit code: 0 done, 1 failed, 2 wrong use, 130 cancelled with Ctrl-C."""
    options = make_parser().parse_args(arguments)
    try:
        COMMANDS[options.command](options)
        sys.stdout.flush()
    except (KeyboardInterrupt, native.Cancelled):
        return _fail(options, "cancelled", INTERRUPTED)
    except BrokenPipeError:
        # The reader has closed the pipe, as `head` does. Python would report that again when it closes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except (CommandError, OSError) as error:
        return _fail(options, str(error), FAILED)
    except MemoryError:
        return _fail(options, "there is not enough memory", FAILED)
    except ValueError as error:
        return _fail(options, str(error), WRONG_USE)
    return DONE


def _fail(options, message: str, code: int) -> int:
    print(f"{PROGRAM} {options.command}: {message}", file=sys.stderr)
    return code
