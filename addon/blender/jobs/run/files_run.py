"""Bakes into files in the window, of many frames or of the present one, as batch.py makes them without it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy

from ....core.bake.bake_settings import COMBINED
from ....core.bake.forecast import seconds_of, steps_of_bakes
from ....core.bake.runner import CANCELLED, WRITTEN, Bake
from ....core.batch.batch_options import BatchOptions, parse
from ....core.errors import BakeError, ImageError
from ....core.messages import Level, warning
from ....core.progress import Progress
from ....core.target import Target
from ...images.facts import attributes_of, is_sequence, record_in, record_of_bake, size_of_frames
from ...images.files import EXTENSIONS, check_writable, size_of
from ...images.image_operators import find_frames, show_frames
from ...images.outputs import Outputs
from ...node.find import find_node, uses_tiles
from ...node.node import image_of_side
from ...read.digests import digest
from ..out_of_date import stale
from ..out_of_date.fingerprint import IMAGE, Parts
from ..state import state
from .bake_plan import read_scene
from .bake_run import BakeRun, BakeStep

RESOLUTION = "resolution"
"""Part of a frame's record, besides those of fingerprints: settings that chose the size of its texture."""

LAST_FRAMES = 3
"""Number of frames whose mean time is expected of the next ones. More: steadier, slower to follow a change."""

MAX_SKIPPED_SECONDS = 0.1
"""Seconds of looking for frames that are up to date after which the window may go on."""

_written: dict[str, str] = {}
"""Digest of the scene for each file of this session: formats other than EXR keep none."""


class FilesRun(BakeRun):
    """Bakes targets into files of the scene's folder, at each frame.

    A frame whose file was baked of the scene as it is now is skipped, so that a cancelled animation goes on where it
    was. A target that fails at a frame is left out of later ones.

    Parameters
    ----------
    frames : numbers of the frames; None for the present one alone, whose file has no number.
    """

    def __init__(
        self,
        report: Callable[[set[str], str], None],
        in_window: bool,
        targets: Sequence[Target],
        frames: Sequence[int] | None,
    ) -> None:
        super().__init__(report, in_window)
        scene = bpy.context.scene
        self._scene_name, self._former = scene.name, (scene.frame_current, scene.frame_subframe)
        self._is_animation, self._frames = frames is not None, list(frames or [scene.frame_current])
        self._targets, self._left = list(targets), list(targets)
        self._outputs, self._settings = Outputs(scene, _options(scene, frames)), scene.beamspread.for_bake()
        self._frame, self._seconds, self._estimate = self._frames[0], [], 0.0
        self._baked_frames: list[int] = []
        self._maps: dict[Target, str] = {}
        self._last_path = ""
        self.skipped = 0

    def check(self) -> None:
        """Raise ImageError if the files can't be written."""
        paths = (self._outputs.path(target, self._settings.layer, self._frames[0]) for target in self._targets)
        check_writable(list(paths))

    def bakes(self) -> Iterator[Bake | None]:
        shares = self._progress.split([1.0] * len(self._frames))
        for share in shares:
            share.expect(self._seconds_of_frame)
        looked = time.monotonic()
        for frame, share in zip(self._frames, shares):
            if self._progress.is_cancelled or not self._left:
                return
            began, self._frame = time.monotonic(), frame
            self._go_to(frame)
            left = self._due()
            self.skipped += len(self._left) - len(left)
            if left:
                yield from self._bakes_of(left, share)
                self._seconds.append(time.monotonic() - began)
            elif time.monotonic() - looked > MAX_SKIPPED_SECONDS and self._in_window:
                state.start(self._progress, self._left[0], self._position())
                yield None
                looked = time.monotonic()
            share(1.0)

    def _go_to(self, frame: int) -> None:
        scene = bpy.context.scene
        if scene.name != self._scene_name:
            raise BakeError("The window shows another scene.", "Go back to the former one, and bake again.")
        if self._is_animation:
            scene.frame_set(frame)

    def _bakes_of(self, targets: list[Target], share: Progress) -> Iterator[Bake]:
        """The bakes of one frame."""
        plans = read_scene(bpy.context, targets)
        self._parts = self._digests(targets)  # with the UV maps that the reader makes
        self._steps = [BakeStep(plan, self._settings) for plan in plans]
        expected = steps_of_bakes([(step.plan.forecast(), step.settings) for step in self._steps])
        self._shares = share.split(map(seconds_of, expected))
        for part, estimates in zip(self._shares, expected):
            part.expect(partial(seconds_of, estimates))
        forecasts = [plan.forecast() for plan in plans]
        self._estimate = sum(seconds_of(forecast.steps(self._settings)) for forecast in forecasts if forecast)
        for number, step in enumerate(self._steps, 1):
            self._number = number
            yield step.bake()
            if self._progress.is_cancelled:
                return

    def _seconds_of_frame(self) -> float:
        """Seconds of a frame that was not begun yet, without the simulation of media."""
        last = self._seconds[-LAST_FRAMES:]
        return sum(last) / len(last) if last else self._estimate

    def _position(self) -> str:
        if not self._is_animation:
            return super()._position()
        return f"frame {self._frame}, {self._frames.index(self._frame) + 1} of {len(self._frames)}"

    def _due(self) -> list[Target]:
        """Targets whose file of this frame is missing, or was baked of another state of the scene."""
        if not self._is_animation:
            return list(self._left)
        parts = self._digests(self._left)
        return [target for target in self._left if not self._is_done(target, parts.get(target))]

    def _is_done(self, target: Target, parts: Parts | None) -> bool:
        node = find_node(bpy.data.materials.get(target.material_name))
        if parts is None or node is None or uses_tiles(node, target.side):
            return False
        path, settings = self._outputs.path(target, self._settings.layer, self._frame), bpy.context.scene.beamspread
        if not path.is_file():
            return False
        size = _size_shown(image_of_side(node, target.side))
        if size is not None:  # the settings don't count
            parts = {name: part for name, part in parts.items() if name != RESOLUTION}
        if path.suffix == EXTENSIONS["EXR"]:
            record = record_in(path)
            is_same = record is not None and record.is_comparable() and bool(record.parts)
            is_same = is_same and not record.changed(parts)
        else:
            # Each run chooses one exposure for its files.
            is_same = not settings.use_exposure and _written.get(str(path)) == _text(parts, path)
        there = size_of(path) if is_same else None
        return there is not None and size in (None, there)

    def _digests(self, targets: list[Target]) -> dict[Target, Parts]:
        """Digests of all that bakes of the targets read. The size of the node's image is no part of a sequence."""
        parts_of, settings = stale.parts_of(bpy.context, targets), bpy.context.scene.beamspread
        size = digest(settings.use_size, settings.texel_density, settings.resolution)
        return {
            target: {name: part for name, part in parts.items() if name != IMAGE} | {RESOLUTION: size}
            for target, parts in parts_of.items()
        }

    def store(self, bake: Bake) -> str:
        parts = self._parts.get(bake.target, {})
        path = self._outputs.write(bake, self._frame, frame_attributes(bake, parts))
        if Path(path).is_file():
            _written[path] = _text(parts, Path(path))
        self._maps[bake.target] = bake.job.receiver.uv_map
        self._last_path = path
        return path

    def end(self, bake: Bake) -> None:
        if bake.status == CANCELLED:
            return  # `close` says it
        state.note(bake)
        if bake.status == WRITTEN:
            self.written.append(bake.target)
            self._baked_frames.append(self._frame)
            if bake.is_dark:
                self.problems.add(*bake.messages.of(Level.WARNING))
        else:
            where = f"Frame {self._frame}: " if self._is_animation and bake.target in self._left else ""
            self._left = [target for target in self._left if target != bake.target]
            for message in bake.messages.of(Level.ERROR):
                self.fail(replace(message, text=f"{where}{message.text}"))
        for message in bake.messages.of(Level.WARNING, Level.INFO):
            self.report(message)

    def close(self) -> None:
        """Go back to the frame before, and have the nodes show what is done."""
        scene = bpy.data.scenes.get(self._scene_name)
        if scene is not None and self._is_animation:
            scene.frame_set(self._former[0], subframe=self._former[1])
            if self._settings.layer == COMBINED:
                for target in self._targets:
                    self._show(scene, target)
        if self._progress.is_cancelled:
            kept = "Files that are done stay" if self.written or self.skipped else "There are no files yet"
            self.report(warning("", f"The bake was cancelled. {kept}; Bake Animation goes on with the other frames."))

    def _show(self, scene, target: Target) -> None:
        material = bpy.data.materials.get(target.material_name)
        node = find_node(material)
        if node is None or material.library is not None or uses_tiles(node, target.side):
            return
        with suppress(ImageError):  # `check` has said it
            numbers, path = find_frames(scene, target)
            if numbers:
                for message in show_frames(node, numbers, path, target.side, self._maps.get(target)):
                    self.report(message)

    def is_successful(self) -> bool:
        return bool(self.written or self.skipped)

    def summary(self) -> str:
        if not self._is_animation:
            folder = Path(self._last_path).parent
            return f"Baked {', '.join(map(str, dict.fromkeys(self.written)))} into {folder}"
        names = ", ".join(map(str, dict.fromkeys(self._targets)))
        count = len(set(self._baked_frames))
        text = f"Baked {count} frame{'' if count == 1 else 's'} of {names}"
        return f"{text}; {self.skipped} {'was' if self.skipped == 1 else 'were'} up to date" if self.skipped else text


def frame_attributes(bake: Bake, parts: Parts) -> dict[str, str]:
    """Attributes of a frame's EXR file, by which panels and later runs know the scene that was baked."""
    if not parts:
        return {}
    return attributes_of(replace(record_of_bake(bake, parts), notes=(), ratios={}))


def frames_of(scene) -> tuple[int, int]:
    """First and last frame of an animation: those of the settings, else of the preview range, else of the scene."""
    settings = scene.beamspread
    if settings.use_frame_range:
        return settings.frame_first, settings.frame_last
    if scene.use_preview_range:
        return scene.frame_preview_start, scene.frame_preview_end
    return scene.frame_start, scene.frame_end


def check_frames(first: int, last: int) -> None:
    """Raise BakeError if there are no such frames."""
    if first < 0:
        raise BakeError(f"The frame {first} has no file name that Blender shows.", "Begin at 0 or later.")
    if last < first:
        raise BakeError(f"The frames {first} to {last} end before they begin.", "Choose a later last frame.")


def _options(scene, frames: Sequence[int] | None) -> BatchOptions:
    """Options of a batch that writes the same files."""
    plain = parse([])
    if frames is None:
        return replace(plain, output=scene.beamspread.output_dir)
    return replace(plain, frames=(frames[0], frames[-1]))


def _size_shown(image) -> tuple[int, int] | None:
    """Size of a node's image, which bakes keep; None if it has none."""
    if image is None:
        return None
    return size_of_frames(image) if is_sequence(image) else tuple(image.size)


def _text(parts: Parts, path: Path) -> str:
    """Digest of a file's bake, and of the file's time."""
    known = sorted((name, part) for name, part in parts.items() if name != RESOLUTION)
    return digest(known, path.stat().st_mtime_ns)
