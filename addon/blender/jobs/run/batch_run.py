"""Bakes of a whole scene, or of chosen objects, into files; `batch.py` in the package's folder runs it."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import bpy

from ....core.bake.bake_settings import COMBINED
from ....core.bake.runner import CANCELLED, SKIPPED, WRITTEN, Bake, Sink, run_bakes
from ....core.batch.batch_options import BatchOptions
from ....core.batch.report import BakeRecord, Inventory, PreviousReport, Report
from ....core.batch.stop import Stop
from ....core.errors import BakeError
from ....core.progress import Progress, log, timed
from ....core.target import Target
from ...images.files import file_of, size_of
from ...images.outputs import Outputs
from ...images.udim import tiles_path
from ...node.find import NOTHING_FOUND, find_bakeable, find_misplaced, node_of, uses_tiles
from ...node.tree import keep_map
from ...node.uv_maps import objects_with_maps
from ...read.geometry import OWN_MAP
from ...read.visibility import by_name
from ..out_of_date import stale
from ..out_of_date.fingerprint import IMAGE, SETTINGS, Parts, settings_part
from .bake_plan import prepare_scene
from .files_run import frame_attributes


def bake_all(options: BatchOptions, stop: Stop | None = None) -> Report:
    """Bake every requested frame and print the outcome of each bake; goes on when one fails.

    Once asked to stop, it notes all further bakes as cancelled.
    """
    if options.verbose:
        _show_log()
    batch = _Batch(options, Stop() if stop is None else stop)
    batch.run_frames()
    report = batch.report
    left = sum(record.status == CANCELLED for record in report.bakes)
    if left:
        print(f"Beamspread: stopped, {left} of {len(report.bakes)} bakes are left.", file=sys.stderr)
    if not report.bakes:
        print(f"Beamspread: {NOTHING_FOUND}", file=sys.stderr)
    if report.dark() and not options.allow_dark:
        names = ", ".join(dict.fromkeys(f"'{record.object}'" for record in report.dark()))
        print(f"Beamspread: No light reaches {names}: an error, unless --allow-dark is given.", file=sys.stderr)
    return report


def _show_log() -> None:
    """Print the log of the package: the lights and occluders that it reads, and the seconds of each stage."""
    log = logging.getLogger(__package__.rpartition(".blender.")[0])
    if not any(type(handler) is logging.StreamHandler for handler in log.handlers):
        printer = logging.StreamHandler(sys.stdout)
        printer.setFormatter(logging.Formatter("Beamspread: %(message)s"))
        printer.setLevel(logging.INFO)  # outcomes are printed without it
        log.addHandler(printer)
    log.setLevel(min(log.level or logging.INFO, logging.INFO))


class _Batch(Sink):
    """The bakes of all frames; `report` grows with each."""

    def __init__(self, options: BatchOptions, stop: Stop) -> None:
        self.report = Report()
        self._options, self._stop, self._scene = options, stop, bpy.context.scene
        self._frame = self._scene.frame_current
        self._parts: dict[Target, Parts] = {}
        self._settings = self._scene.beamspread.for_bake(options.solver, options.pass_name, options.indirect)
        self._outputs = Outputs(self._scene, options, is_command=True)
        self._with_maps = objects_with_maps()
        self._earlier = PreviousReport(options.report, _saved()) if options.resume else None

    def run_frames(self) -> None:
        """Bake frame by frame."""
        current = self._frame
        first, last = self._options.frames or (current, current)
        for self._frame in range(first, last + 1):
            if self._options.frames and not self._stop:
                self._scene.frame_set(self._frame)
            self._bake_frame()
        if self._options.save and self._scene.frame_current != current:
            self._scene.frame_set(current)

    def _bake_frame(self) -> None:
        targets, impossible = self._find()
        images = {target: self._outputs.own_image(target, self._settings.layer) for target in targets}
        for bake in impossible:
            self.end(bake)
        left = []
        for target in targets:
            record = self._skipped(target, images[target])
            if record is None:
                left.append(target)
            else:
                self._note(record)
        recorded = [target for target in left if self._options.frames or images[target]]
        run_bakes(self._prepared(left, recorded), self)

    def run(self, bake: Bake) -> Iterator[None]:
        bake.run(Progress(_Printer(bake.target, self._stop)))
        if bake.job is not None:
            log(f"'{bake.target}': {bake.seconds:.1f} s, estimated {bake.estimated_seconds:.1f} s")
        if self._stop and bake.job is not None and bake.texture is None:
            bake.cancel()  # even if it failed: a terminal's Ctrl-C also ends the Blender that Cycles runs in
        return iter(())

    def store(self, bake: Bake) -> str:
        # The size of the image is no part of a sequence.
        parts = {name: digest for name, digest in self._parts.get(bake.target, {}).items() if name != IMAGE}
        attributes = frame_attributes(bake, parts)
        node = node_of(bake.target)
        if self._options.save and self._settings.layer == COMBINED and node is not None and node.node_tree is not None:
            keep_map(node.node_tree, bake.job.receiver.uv_map)
        return self._outputs.write(bake, self._frame, attributes)

    def end(self, bake: Bake) -> None:
        self._remember(bake)
        name = bake.target.object_name
        if bake.status == WRITTEN and bake.job.spread is not None:  # panels say it before the bake
            bake.messages.add(*bake.job.spread.messages(name))
        if bake.status == WRITTEN and not self._options.save and name in objects_with_maps() - self._with_maps:
            text = f"The .blend file lacks the new UV map '{OWN_MAP}' of '{name}', which shows the image."
            bake.warn(name, text, "Run the batch with --save.")
        self._note(BakeRecord.of(bake, self._frame))

    def _note(self, record: BakeRecord) -> None:
        self.report.bakes.append(record)
        if record.status != CANCELLED:
            stream = sys.stdout if record.status in (WRITTEN, SKIPPED) else sys.stderr
            print(f"Beamspread: {record}", file=stream, flush=True)
        logging.getLogger(__name__).debug("%s", record)

    def _find(self) -> tuple[list[Target], list[Bake]]:
        """Targets to bake, and failed bakes of objects that can't be baked."""
        view_layer = bpy.context.view_layer
        if not self._options.objects:
            return find_bakeable(view_layer), find_misplaced(self._scene.objects)
        targets, impossible, objects = [], [], by_name(self._scene)
        for name in self._options.objects:
            obj = objects.get(name)
            bakeable, misplaced = (find_bakeable(view_layer, [obj]), find_misplaced([obj])) if obj else ([], [])
            if not bakeable and not misplaced:
                missing = "has no material with a Beamspread node" if obj else "is not in the scene"
                impossible.append(Bake(Target(name), error=f"The object '{name}' {missing}."))
            impossible += misplaced
            targets += bakeable
        return list(dict.fromkeys(targets)), impossible

    def _skipped(self, target: Target, image) -> BakeRecord | None:
        """The record of a file that an earlier run has written; `image` is the node's if its file is the target."""
        node = node_of(target)
        if self._earlier is None or self._stop:
            return None
        settings, resolution = self._settings, self._options.resolution
        try:
            path = self._outputs.path(target, settings.layer, self._frame) if image is None else file_of(image)
        except BakeError:
            return None  # the preparation names the error
        if node is not None and uses_tiles(node, target.side):
            path = path if image is not None else tiles_path(path)
            wanted = BakeRecord(target.object_name, target.material_name, self._frame, str(path), side=target.side)
            wanted.output, wanted.indirect = settings.output, settings.indirect
            record = self._earlier.skipped_tiles(wanted, resolution)
            return record if record is not None and all(size_of(Path(file)) for file in record.files) else None
        size = size_of(path)
        if size is None or (resolution is not None and max(size) != resolution):
            return None
        wanted = BakeRecord(target.object_name, target.material_name, self._frame, str(path), *size, side=target.side)
        wanted.output, wanted.indirect = settings.output, settings.indirect
        return self._earlier.skipped(wanted, needs_record=image is not None)

    def _parts_of(self, targets: list[Target]) -> dict[Target, Parts]:
        """Digests for bakes whose results go to images that nodes show, or to frames."""
        if not targets or self._stop:
            return {}
        settings = settings_part(self._scene, self._options.solver, self._options.indirect)
        parts_of = stale.parts_of(bpy.context, targets)
        return {target: parts | {SETTINGS: settings} for target, parts in parts_of.items()}

    def _remember(self, bake: Bake) -> None:
        """Record the digests of the bake in the node's image, for a scene that is saved afterwards."""
        image = self._outputs.own_image(bake.target, self._settings.layer) if bake.status == WRITTEN else None
        if image is not None and bake.path == str(file_of(image)):
            stale.keep(bake, self._parts.get(bake.target))

    def _prepared(self, targets: list[Target], recorded: list[Target]) -> Iterator[Bake]:
        """A bake for each target, prepared when its turn comes; cancelled bakes once the batch is asked to stop.

        Images of the `recorded` targets remember the state of the scene.
        """
        if not targets:
            return
        prepared, inventory = iter(()), Inventory()
        if not self._stop:
            with timed("scene"):
                check = partial(Progress(lambda _: not self._stop).check, 0.0)
                prepared = prepare_scene(bpy.context, targets, self._settings, self._options.resolution, check)
            self._parts = self._parts_of(recorded)  # with the UV maps that the reader makes
        for target in targets:
            bake = _cancelled(target) if self._stop else next(prepared)
            if self._options.verbose or self._options.log:
                for line in inventory.lines(bake):
                    logging.getLogger(__name__).info(line)
            yield bake


def _cancelled(target: Target) -> Bake:
    bake = Bake(target)
    bake.cancel()
    return bake


def _saved() -> float:
    """When the scene was saved, as files' times are."""
    return Path(bpy.data.filepath).stat().st_mtime if bpy.data.filepath else 0.0


class _Printer:
    """Prints the progress of one bake in lines of ten percent, until the batch is asked to stop."""

    def __init__(self, subject: Target, stop: Stop) -> None:
        self._subject, self._stop = subject, stop
        self._shown = 0

    def __call__(self, fraction: float) -> bool:
        tenth = int(10 * fraction)
        if tenth > self._shown:
            self._shown = tenth
            print(f"Beamspread: {self._subject}: {10 * tenth} %", flush=True)
        return not self._stop
