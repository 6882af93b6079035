"""Bakes of a whole scene, or of what options choose, into files; `batch.py` in the package's folder runs it."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import bpy

from ...core.bake.runner import CANCELLED, WRITTEN, Bake, Target
from ...core.bake.settings import COMBINED, DIRECTION
from ...core.batch.inventory import inventory
from ...core.batch.options import BatchOptions
from ...core.batch.report import BakeRecord, Report, file_name
from ...core.errors import ImageError
from ...core.progress import timed
from ..images import files
from ..node.find import NOTHING_FOUND, find_misplaced, find_node, find_targets
from .prepare import prepare_scene


def bake_all(options: BatchOptions) -> Report:
    """Bake every frame asked for and print what becomes of each bake; goes on when one fails."""
    if options.verbose:
        _show_log()
    scene = bpy.context.scene
    first, last = options.frames or (scene.frame_current, scene.frame_current)
    report, output = Report(), _Output(options)
    for frame in range(first, last + 1):
        if options.frames:
            scene.frame_set(frame)
        for bake in _bakes(options):
            bake.run(_Printer(bake.target))
            bake.keep(lambda bake, frame=frame: output.write(bake, frame))
            record = BakeRecord.of(bake, frame)
            report.bakes.append(record)
            print(f"Beamspread: {record}", file=sys.stdout if bake.status == WRITTEN else sys.stderr, flush=True)
            if bake.status == CANCELLED:
                return report
    if not report.bakes:
        print(f"Beamspread: {NOTHING_FOUND}", file=sys.stderr)
    if report.dark() and not options.allow_dark:
        names = ", ".join(dict.fromkeys(f"'{one.object}'" for one in report.dark()))
        print(f"Beamspread: No light reaches {names}: an error, unless --allow-dark is given.", file=sys.stderr)
    return report


def _show_log() -> None:
    """Print what the package logs: what it reads, and how long each stage takes."""
    log = logging.getLogger(__package__.rpartition(".blender.")[0])
    if not log.handlers:
        printer = logging.StreamHandler(sys.stdout)
        printer.setFormatter(logging.Formatter("Beamspread: %(message)s"))
        log.addHandler(printer)
    log.setLevel(logging.INFO)


def _bakes(options: BatchOptions) -> Iterator[Bake]:
    """What to bake at the current frame, and what can't be."""
    scene, targets = bpy.context.scene, []
    for name in options.objects or [obj.name for obj in scene.objects]:
        obj = scene.objects.get(name)
        found, misplaced = (find_targets([obj]), find_misplaced([obj])) if obj else ([], [])
        if options.objects and not found and not misplaced:
            missing = "has no material with a Beamspread node" if obj else "is not in the scene"
            yield Bake(Target(name), error=f"The object '{name}' {missing}.")
        yield from misplaced
        targets += found
    settings = scene.beamspread.for_bake(options.solver, options.pass_name, options.indirect)
    with timed("scene"):
        bakes = prepare_scene(bpy.context, targets, settings, options.resolution)
    if options.verbose:
        bakes = list(bakes)
        for line in inventory(bakes):
            logging.getLogger(__name__).info(line)
    yield from bakes


class _Output:
    """Writes bakes to --output, else to the file of the node's image, else to the scene's folder."""

    def __init__(self, options: BatchOptions) -> None:
        self._options = options
        self._taken: set[str] = set()

    def write(self, bake: Bake, frame: int) -> str:
        """Write all layers; the path of the first."""
        paths = [self._write_layer(bake, frame, layer, texture) for layer, texture in bake.layers.items()]
        return paths[0]

    def _write_layer(self, bake: Bake, frame: int, layer: str, texture) -> str:
        options, settings = self._options, bpy.context.scene.beamspread
        if options.output is None and layer == COMBINED:
            image = find_node(bpy.data.materials[bake.target.material_name]).image
            if image is not None and self._belongs_in(image, bake):
                return self._note_clipping(files.fill_image(image, texture), bake, texture)
        file_format = options.format or settings.format
        folder = options.output or settings.output_dir
        if folder.startswith("//") and not bpy.data.filepath:
            raise ImageError("The scene was never saved, so there is no folder to write to: give one with --output.")
        parts = [bake.target.object_name, bake.target.material_name, *([] if layer == COMBINED else [layer])]
        if layer == DIRECTION and file_format == "PNG":
            raise ImageError("A PNG can't hold directions, which have negative parts: choose EXR.")
        name = file_name(parts, frame if options.frames else None, files.EXTENSIONS[file_format], self._taken)
        path = Path(bpy.path.abspath(folder)).absolute() / name
        files.write_file(path, texture, file_format)
        return self._note_clipping(str(path), bake, texture)

    def _belongs_in(self, image, bake: Bake) -> bool:
        """Whether a bake can go to the file that its image already has: one frame, same size and format."""
        path, receiver, file_format = files.file_of(image), bake.job.receiver, self._options.format
        size = receiver.width, receiver.height
        if path is None or self._options.frames is not None or tuple(image.size) != size:
            return False
        return file_format is None or path.suffix.lower() == files.EXTENSIONS[file_format]

    @staticmethod
    def _note_clipping(path: str, bake: Bake, texture) -> str:
        if path.lower().endswith(".png") and texture.max() > 1:
            bake.warnings.append("Values above 1 were clipped: EXR keeps them.")
        return path


class _Printer:
    """Progress in lines of ten percent."""

    def __init__(self, subject: Target) -> None:
        self._subject = subject
        self._shown = 0

    def __call__(self, fraction: float) -> bool:
        tenth = int(10 * fraction)
        if tenth > self._shown:
            self._shown = tenth
            print(f"Beamspread: {self._subject}: {10 * tenth} %", flush=True)
        return True
