"""The commands, their texts in the terminal, and the function that runs one and turns its errors into an exit code."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from ..ldf.albedo import albedo_from_color
from ..ldf.library import angles_for, library, photons_for
from ..material import presets
from ..native import native
from .options import MAX_MAPS, PROGRAM, make_parser

PLOT_ENDINGS = (".png", ".pdf", ".svg")


class CommandError(Exception):
    """A reason why a command cannot produce its result."""


def ldf(options) -> None:
    """Print the totals of an LDF and draw its maps."""
    if len(options.albedo) > MAX_MAPS:
        raise ValueError(f"--albedo has {len(options.albedo)} values; allowed: 1 to {MAX_MAPS}")
    if options.library and (options.g, options.ior, options.thickness) != (None, None, None):
        raise ValueError("--library has a medium of its own: leave out --g, --ior and --thickness")
    loaded = native.LdfLibrary.load(options.library) if options.library else None
    medium = loaded.medium if loaded else _medium(options)
    if options.side == "transmitted" and math.isinf(medium.thickness):
        raise ValueError("--side is transmitted; a half-space has no far side: give --thickness")
    if options.output:
        # Check before the simulation, which takes long.
        _check_target(options.output, PLOT_ENDINGS)
        plot = _plot_module()
    source = loaded or _simulated(medium, options.quality)
    rows = totals_table(source, options.angle, options.albedo)
    specular_note = f"{100 * specular(medium, options.angle):.1f} % is reflected before it enters"
    photons_note = f"{source.photons} photons per angle"
    print(f"{describe(medium)}; beam at {options.angle:g} degrees, of which {specular_note}; {photons_note}")
    print(text_table(rows), flush=True)
    if options.output:
        pitch = options.pitch or plot.default_pitch(medium, options.size)
        maps = plot.read_maps(source, options.angle, options.albedo, options.size, pitch, options.side)
        plot.save(plot.draw(maps, rows, [specular_note, photons_note]), options.output)


def simulate(options) -> None:
    """Simulate a medium and save its library."""
    medium = _medium(options)
    _check_target(options.output, (".exr",))
    angles = options.angles or angles_for(medium)
    photons = options.photons or photons_for(medium, options.quality)
    start = time.monotonic()
    with ProgressBar("simulating") as progress:
        raw = native.simulate(medium, angles, photons, seed=options.seed, threads=options.threads, progress=progress)
        result = raw.calibrated(options.threads)
    seconds = time.monotonic() - start
    result.save(options.output)
    size = Path(options.output).stat().st_size / 1e6
    print(f"{options.output}: {describe(medium)}; {size:.1f} MB")
    print(f"{len(result.angles)} angles, {result.photons} photons each, seed {result.seed}, {seconds:.1f} s")
    print(f"light from {result.angles[0]:g} degrees:")
    print(text_table(totals_table(result, result.angles[0], [0.9, 0.99, 0.999])))


def list_presets(_options) -> None:
    """Print the measured materials."""
    materials = presets()
    sources = list(dict.fromkeys(material.source for material in materials.values()))
    rows = [("material", "albedo r g b", "mean free path r g b / mm", "anisotropy r g b", "ior", "source")]
    for name, material in sorted(materials.items()):
        columns = (
            [f"{value:.5f}" for value in material.albedo],
            [f"{1e3 * length:8.4g}" for length in material.mean_free_path],
            [f"{value:.3f}" for value in material.channel_anisotropy],
        )
        number = f"[{sources.index(material.source) + 1}]"
        rows.append((name, *map(" ".join, columns), f"{material.ior:g}", number))
    print(text_table(rows))
    for number, source in enumerate(sources, start=1):
        print(f"[{number}] {source}")


def albedo(options) -> None:
    """Print the albedo that gives a color."""
    if len(options.color) not in (1, 3):
        raise ValueError(f"--color has {len(options.color)} values; allowed: one, or red green blue")
    medium = _medium(options)
    source = _simulated(medium, options.quality)
    color = options.color if len(options.color) == 3 else options.color * 3
    values = albedo_from_color(color, medium, quality=options.quality)
    rows = [("channel", "color", "albedo", "reflects")]
    for channel, target, value in zip(("red", "green", "blue"), color, values):
        rows.append((channel, f"{target:g}", f"{value:.6f}", f"{source.diffuse_reflectance(value):.4f}"))
    print(f"{describe(medium)}, under uniform diffuse light")
    print(text_table(rows))


COMMANDS = {"ldf": ldf, "library": simulate, "presets": list_presets, "albedo": albedo}


def _medium(options):
    given = {name: getattr(options, name) for name in ("g", "ior", "thickness")}
    return native.Medium(**{name: value for name, value in given.items() if value is not None})


def _simulated(medium, quality: str):
    with ProgressBar("simulating") as progress:
        return library(medium, quality=quality, progress=progress)


def _check_target(path: str, endings: tuple[str, ...]) -> None:
    target = Path(path)
    if target.suffix.lower() not in endings:
        raise ValueError(f"--output is {path}; allowed: a name that ends in {', '.join(endings)}")
    if not target.parent.is_dir():
        raise CommandError(f"the folder {target.parent} for {target.name} does not exist")
    if target.is_dir():
        raise CommandError(f"{path} is a folder; name a file")


def _plot_module():
    try:
        from . import plot
    except ImportError as error:
        raise CommandError(
            "drawing needs matplotlib, which this Python does not have "
            f"(apt install python3-matplotlib, or pip install matplotlib): {error}"
        ) from error
    return plot


WIDTH = 30


def describe(medium) -> str:
    """Description of a medium in a few words."""
    depth = "half-space" if math.isinf(medium.thickness) else f"slab of {medium.thickness:g} mean free paths"
    return f"g {medium.g:g}, ior {medium.ior:g}, {depth}"


def specular(medium, angle_deg: float) -> float:
    """Fraction of the light that is reflected before it enters."""
    return float(native.fresnel(math.cos(math.radians(angle_deg)), medium.ior))


def totals_table(library, angle_deg: float, albedos: Sequence[float]) -> list[tuple[str, ...]]:
    """Table of reflectance, and transmittance of a slab, with standard errors: the head, then a row per albedo."""
    is_slab = math.isfinite(library.medium.thickness)
    rows = [("albedo", "reflectance", "+-", *(("transmittance", "+-") if is_slab else ()))]
    for albedo in albedos:
        row = (f"{albedo:g}", *_value(library.reflectance, library, angle_deg, albedo, "reflected"))
        if is_slab:
            row += _value(library.transmittance, library, angle_deg, albedo, "transmitted")
        rows.append(row)
    return rows


def _value(total, library, angle_deg: float, albedo: float, side: str) -> tuple[str, str]:
    error = library.standard_error(angle_deg, albedo, side=side)
    return f"{total(angle_deg, albedo):.5f}", f"{error:.1g}"


def text_table(rows: Sequence[tuple[str, ...]]) -> str:
    """The rows as aligned columns: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = [
        "  ".join(
            cell.rjust(width) if column else cell.ljust(width) for column, (cell, width) in enumerate(zip(row, widths))
        )
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


class ProgressBar:
    """Progress callback and context manager that draws a bar on a terminal and erases it at the end.

    Parameters
    ----------
    title : name of the job.
    stream : stream to draw on, if it is a terminal. Default: stderr, so that results can be piped.
    """

    def __init__(self, title: str, stream=None) -> None:
        self._title = title
        self._stream = sys.stderr if stream is None else stream
        self._visible = self._stream.isatty()
        self._drawn = ""
        self._start = time.monotonic()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_exception) -> None:
        if self._drawn:
            self._stream.write("\r" + " " * len(self._drawn) + "\r")
            self._stream.flush()

    def __call__(self, fraction: float) -> bool:
        if self._visible:
            seconds = int(time.monotonic() - self._start)
            filled = int(WIDTH * fraction)
            bar = "#" * filled + "." * (WIDTH - filled)
            line = f"{self._title} [{bar}] {int(100 * fraction):3d} %  {seconds // 60}:{seconds % 60:02d}"
            if line != self._drawn:
                self._stream.write("\r" + line)
                self._stream.flush()
                self._drawn = line
        return True


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
