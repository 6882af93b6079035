"""Command line of the batch: `-- [options]` after Blender's own arguments, or `batch.py scene.blend [options]`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

from ..bake.bake_settings import OUTPUTS
from ..display import AUTO

SOLVERS = ("fft", "direct", "adaptive")
FORMATS = ("EXR", "EXR_HALF", "PNG", "PNG16", "HDR")
PASSES = tuple(OUTPUTS)


@dataclass(frozen=True)
class BatchOptions:
    """Options of a batch run; None leaves the choice to the scene's settings."""

    scene: str | None
    objects: tuple[str, ...]
    frames: tuple[int, int] | None
    resolution: int | None
    solver: str | None
    output: str | None
    format: str | None
    exposure: float | str | None
    report: str | None
    pass_name: str | None
    indirect: bool | None
    allow_dark: bool
    verbose: bool
    resume: bool
    save: bool
    log: str | None


def arguments_for_script(argv: Sequence[str], inside_blender: bool) -> list[str]:
    """Arguments for the batch: those after `--` in Blender's program, all but the first one in Python."""
    if "--" in argv:
        return list(argv[argv.index("--") + 1 :])
    return [] if inside_blender else list(argv[1:])


def parse(arguments: Sequence[str]) -> BatchOptions:
    """Parse the command line; a mistake ends the program with exit code 2 and a line that names it."""
    parser = _parser()
    values = parser.parse_args(list(arguments))
    values.objects = tuple(dict.fromkeys(name for group in values.objects for name in group))
    return BatchOptions(**vars(values))


class _Help(argparse.HelpFormatter):
    """Help of a fixed width. To ask for the terminal's width, argparse imports many modules in every run."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=100)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="beamspread batch",
        description="Bake the light inside translucent surfaces of a scene into image files.",
        epilog="Exit code 0 only if every requested bake was written and light reached it; 2 for a wrong argument.",
        allow_abbrev=False,
        formatter_class=_Help,
    )
    parser.add_argument("scene", nargs="?", help="the .blend file, if Blender has not opened it already")
    parser.add_argument(
        "--object",
        dest="objects",
        action="append",
        nargs="+",
        default=[],
        metavar="NAME",
        help="object to bake, may be repeated (default: all whose material has a Beamspread node)",
    )
    parser.add_argument("--frames", type=_frames, metavar="A-B", help="first and last frame (default: the current one)")
    parser.add_argument("--resolution", type=_resolution, metavar="N", help="texels along the longer side")
    parser.add_argument("--solver", type=str.lower, choices=SOLVERS)
    parser.add_argument(
        "--pass",
        dest="pass_name",
        type=str.upper,
        choices=PASSES,
        help="light that leaves the surface, arrives on it, or its direction (default: the scene's setting)",
    )
    parser.add_argument(
        "--indirect",
        action=argparse.BooleanOptionalAction,
        help="with or without the light that other objects return (default: the scene's setting)",
    )
    parser.add_argument("--output", metavar="DIR", help="folder for the images (default: the scene's setting)")
    parser.add_argument("--format", type=str.upper, choices=FORMATS)
    parser.add_argument(
        "--exposure",
        type=_exposure,
        metavar="auto|FACTOR",
        help="multiply all values by this; auto: by the power of two that brings those of a PNG to 1 or below. The "
        "file and the report have the factor (default: the scene's setting)",
    )
    parser.add_argument("--report", metavar="FILE.json", help="write the result of each bake")
    parser.add_argument("--allow-dark", action="store_true", help="exit code 0 even if no light arrives")
    parser.add_argument("--verbose", action="store_true", help="print lights, triangles and the time of each stage")
    parser.add_argument(
        "--log", metavar="FILE", help="append versions, what --verbose prints, and the outcome of each bake to a file"
    )
    parser.add_argument("--resume", action="store_true", help="skip bakes that an earlier run has written")
    parser.add_argument(
        "--save", action="store_true", help="save the .blend file with the UV maps that the run has made"
    )
    return parser


def _frames(text: str) -> tuple[int, int]:
    first, separator, last = text.strip().partition("-") if not text.startswith("-") else ("", "", "")
    try:
        start = int(first)
        end = int(last) if separator else start
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a frame or a range such as 1-10") from None
    if end < start:
        raise argparse.ArgumentTypeError(f"{text!r} ends before it starts")
    return start, end


def _exposure(text: str) -> float | str:
    if text.strip().lower() == AUTO:
        return AUTO
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1e-6 <= value <= 1e6:
        raise argparse.ArgumentTypeError(f"{text!r} is neither auto nor a factor between 1e-6 and 1e6")
    return value


def _resolution(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        value = 0
    if not 1 <= value <= 65536:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of texels between 1 and 65536")
    return value
