"""Options of the command line, with their help."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

PROGRAM = "beamspread"
MAX_MAPS = 6

UNITS = """\
units and words:
  lengths are in mean free paths (multiply by your material's), so that one simulation serves every scale
  g          anisotropy of scattering (Henyey-Greenstein): 0 even, towards 1 forward; milk 0.7, skin 0.9
  ior        index of refraction, inside over outside: water 1.33, marble 1.5; 1 has no surface reflection
  thickness  of the slab; inf is endlessly thick (a half-space)
  angle      of the beam, degrees from the surface normal; it travels towards +u
  albedo     fraction of the light that survives a scattering, below 1; bright materials have 0.99 and more
  LDF        light that leaves around the point O where a beam of unit power enters, per squared mean free path
"""

LDF_EXAMPLES = """\
examples:
  python3 -m beamspread ldf --g .8 --ior 1.4 --angle 45 --albedo .9 .99 .999 -o ldf.png
  python3 -m beamspread ldf --g .5 --thickness 4 --side transmitted --albedo .95 -o far_side.pdf
  python3 -m beamspread ldf --library slab.exr --angle 30 --albedo .9      (only the totals, as text)

A medium is simulated once, in about half a minute, and cached; --quality preview takes seconds.
"""

LIBRARY_EXAMPLES = """\
examples:
  python3 -m beamspread library --g .8 --thickness 10 -o slab.exr
  python3 -m beamspread library --g .8 --angles 0 30 60 --photons 2000000 -o precise.exr

In Python: beamspread.LdfLibrary.load("slab.exr").reflectance(45, 0.9) interpolates between the angles.
"""

ALBEDO_EXAMPLES = """\
examples:
  python3 -m beamspread albedo --color .8 .5 .3 --g 0 --ior 1.3
  python3 -m beamspread albedo --color .5 --g .8 --thickness 10

Colors are linear, not sRGB: 0.5 in a color picker is 0.21.
"""


class _Parser(argparse.ArgumentParser):
    """Parser that reports an error in one line, without the usage of all options."""

    def error(self, message: str):
        self.exit(2, f"{self.prog.removeprefix('python3 -m ')}: {message} (--help explains)\n")


def make_parser() -> argparse.ArgumentParser:
    """Make the parser; its result has `command` and the options of that command."""
    parser = _Parser(
        prog=f"python3 -m {PROGRAM}",
        description="Light inside translucent surfaces, depending on its direction: simulate, draw and look up.",
        epilog=f"{UNITS}\nEach command has its own --help with examples.\n"
        "Exit code: 0 done, 1 failed, 2 wrong use, 130 cancelled with Ctrl-C.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _add_ldf(_add_command(commands, "ldf", "draw maps of an LDF and print its totals", LDF_EXAMPLES))
    _add_library(_add_command(commands, "library", "simulate a medium and save the result", LIBRARY_EXAMPLES))
    _add_command(commands, "presets", "list the measured materials", "", units=False)
    _add_albedo(_add_command(commands, "albedo", "compute the albedo of a color", ALBEDO_EXAMPLES))
    return parser


def _add_command(commands, name: str, summary: str, examples: str, units: bool = True) -> argparse.ArgumentParser:
    return commands.add_parser(
        name,
        help=summary,
        description=f"{summary[0].upper()}{summary[1:]}.",
        epilog="\n".join(([UNITS] if units else []) + [examples]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )


def _add_ldf(parser: argparse.ArgumentParser) -> None:
    _add_medium(parser)
    parser.add_argument("--library", metavar="FILE", help="saved library to use instead of --g, --ior and --thickness")
    parser.add_argument("--angle", type=_angle, default=45.0, metavar="DEG", help="angle of the beam (default: 45)")
    parser.add_argument(
        "--albedo",
        type=_albedo,
        nargs="+",
        default=[0.9, 0.99, 0.999],
        metavar="A",
        help=f"one map for each, at most {MAX_MAPS} (default: .9 .99 .999)",
    )
    parser.add_argument(
        "--side",
        choices=("reflected", "transmitted"),
        default="reflected",
        help="surface to draw: the lit one, or the far side of a slab (default: reflected)",
    )
    parser.add_argument("--size", type=_size, default=241, metavar="N", help="texels along a side (default: 241)")
    parser.add_argument(
        "--pitch",
        type=_positive,
        metavar="L",
        help="side of a texel (default: the map spans 12 transport mean free paths, or thicknesses if less)",
    )
    _add_quality(parser)
    parser.add_argument("-o", "--output", metavar="FILE", help="plot to write: .png, .pdf or .svg; none: only totals")


def _add_library(parser: argparse.ArgumentParser) -> None:
    _add_medium(parser)
    parser.add_argument(
        "--angles", type=_angle, nargs="+", metavar="DEG", help="angles to simulate (default: those of bakes, 0 to 88)"
    )
    parser.add_argument("--photons", type=_count, metavar="N", help="photons per angle (default: by --quality)")
    parser.add_argument("--seed", type=_whole, default=1, metavar="N", help="seed of the random numbers (default: 1)")
    parser.add_argument("--threads", type=_whole, default=0, metavar="N", help="number of threads; 0: all")
    _add_quality(parser)
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="multi-part OpenEXR file")


def _add_albedo(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--color",
        type=_part,
        nargs="+",
        required=True,
        metavar="C",
        help="reflectance, one number or red green blue, 0 to 1",
    )
    _add_medium(parser)
    _add_quality(parser)


def _add_medium(parser: argparse.ArgumentParser) -> None:
    # Without defaults, so that a command can tell which options were given.
    parser.add_argument("--g", type=float, metavar="G", help="anisotropy, -1 to 1 (default: 0.8)")
    parser.add_argument("--ior", type=float, metavar="N", help="index of refraction, 1 or more (default: 1)")
    parser.add_argument("--thickness", type=float, metavar="L", help="mean free paths, or inf (default: inf)")


def _add_quality(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--quality", choices=("preview", "final"), default="final", help="quality of the simulation (default: final)"
    )


def _number(convert: Callable, allowed: str, holds: Callable[[float], bool]) -> Callable[[str], float]:
    def read(text: str):
        try:
            value = convert(text)
        except ValueError:
            value = math.nan
        if not holds(value):
            raise argparse.ArgumentTypeError(f"{text!r} is not {allowed}")
        return value

    return read


_angle = _number(float, "an angle from 0 to below 90 degrees", lambda value: 0 <= value < 90)
_albedo = _number(float, "an albedo: 0 or more and below 1", lambda value: 0 <= value < 1)
_part = _number(float, "a number from 0 to 1", lambda value: 0 <= value <= 1)
_positive = _number(float, "a length above 0", lambda value: 0 < value < math.inf)
_size = _number(int, "a whole number from 2 to 4096", lambda value: 2 <= value <= 4096)
_count = _number(int, "a whole number above 0", lambda value: value > 0)
_whole = _number(int, "a whole number, 0 or more", lambda value: value >= 0)
