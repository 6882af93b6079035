"""The result of each bake: the JSON report of a batch, an earlier run's report, and the lines of `--verbose`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path

from ..bake.runner import FAILED, SKIPPED, WRITTEN, Bake
from ..disk import whole_file
from ..messages import Level
from ..scene.illumination import Illumination
from ..target import FRONT, Target


@dataclass
class BakeRecord:
    """One bake of one material of one object at one frame.

    Attributes
    ----------
    path : the file that was written; of UDIM tiles that with <UDIM> in place of their numbers.
    width, height : texels; of UDIM tiles those of the largest.
    files : files of UDIM tiles; the report has this key for them alone.
    exposure : factor that the file's values were multiplied by; radiance is a value divided by it.
    side : the face of a slab that was baked, FRONT or BACK.
    seconds : wall-clock time.
    estimated_seconds : the same, as estimated before the bake.
    output : the requested pass, LUMINANCE, IRRADIANCE or DIRECTION.
    lights : number of lights that were baked, those that steps of the job found among them.
    left_out : messages about light that is missing.
    indirect : True if light that other objects return was requested.
    dark : True if no light arrived; the file is written all the same.
    """

    object: str
    material: str = ""
    frame: int = 0
    path: str = ""
    width: int = 0
    height: int = 0
    seconds: float = 0.0
    status: str = FAILED
    message: str = ""
    output: str = ""
    lights: int = 0
    left_out: list[str] = field(default_factory=list)
    indirect: bool = False
    dark: bool = False
    estimated_seconds: float = 0.0
    files: list[str] = field(default_factory=list)
    exposure: float = 1.0
    side: str = FRONT

    @classmethod
    def of(cls, bake: Bake, frame: int) -> BakeRecord:
        """The record of a bake at a frame."""
        job, subject = bake.job, (bake.target.object_name, bake.target.material_name, frame, bake.path)
        outcome = round(bake.seconds, 3), bake.status, " ".join(map(str, bake.messages))
        if job is None:
            return cls(*subject, 0, 0, *outcome, side=bake.target.side)
        lights = (
            bake.lights,
            [str(message) for message in job.left_out() if message.level is not Level.INFO],
            job.settings.indirect,
        )
        size, tiles = (job.receiver.width, job.receiver.height), {}
        if job.receiver.tiling is not None:
            tiles = job.receiver.tiling.sizes if bake.path else {}
            size = max(job.receiver.tiling.sizes.values())
        files = [bake.path.replace("<UDIM>", str(number)) for number in tiles]
        rest = bake.is_dark, round(bake.estimated_seconds, 3), files, bake.exposure
        return cls(*subject, *size, *outcome, job.settings.output, *lights, *rest, side=bake.target.side)

    def entry(self) -> dict:
        """Entry of the report."""
        entry = asdict(self)
        return entry if self.files else {key: value for key, value in entry.items() if key != "files"}

    def __str__(self) -> str:
        subject = Target(self.object, self.material, self.side)
        text = f"{subject}, frame {self.frame}: {self.status}"
        if self.path and self.status == WRITTEN:
            text += f" {self.path} ({self.width} x {self.height}, {self.seconds:.1f} s)"
        return f"{text}: {self.message}" if self.message else text


@dataclass
class Report:
    """All bakes of a run, in order."""

    bakes: list[BakeRecord] = field(default_factory=list)

    def all_written(self) -> bool:
        """True if there were bakes and all were written, by this run or an earlier one."""
        return bool(self.bakes) and all(bake.status in (WRITTEN, SKIPPED) for bake in self.bakes)

    def dark(self) -> list[BakeRecord]:
        """Bakes that no light reached."""
        return [bake for bake in self.bakes if bake.dark]

    def save(self, path: str) -> None:
        """Write {"bakes": [...]} as JSON, completely or not at all."""
        import json

        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"bakes": [bake.entry() for bake in self.bakes]}, indent=2, ensure_ascii=False)
        with whole_file(target) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")


KEPT = "An earlier run wrote it, after the scene was last saved."


class PreviousReport:
    """Records in the report of an earlier run; none if there is no report or it is damaged.

    Parameters
    ----------
    report : path of the report, or None.
    since : time when the scene was saved, as files have it. Older files belong to another state of the scene.
    """

    def __init__(self, report: str | None, since: float) -> None:
        self._since = since
        self._records: dict[tuple, BakeRecord] = {}
        known = {field.name for field in fields(BakeRecord)}
        for entry in _entries(report):
            record = BakeRecord(**{key: value for key, value in entry.items() if key in known})
            self._records[_key(record)] = record

    def skipped(self, wanted: BakeRecord, needs_record: bool = False) -> BakeRecord | None:
        """The record of a bake that can be skipped, or None.

        The file of `wanted` must be newer than the scene. If the report has the bake, the bake must have been written
        to that file, with the same size, output and indirect light. The caller checks that the file is complete.

        Parameters
        ----------
        needs_record : True if the report must have the bake, because the file may be the artist's.
        """
        path = Path(wanted.path)
        if not path.is_file() or path.stat().st_mtime <= self._since:
            return None
        record = self._records.get(_key(wanted))
        if record is None:
            return None if needs_record else replace(wanted, status=SKIPPED, message=KEPT)
        same = all(getattr(record, name) == getattr(wanted, name) for name in ("output", "indirect", "width", "height"))
        if not same or record.status not in (WRITTEN, SKIPPED) or Path(record.path) != path:
            return None
        return replace(record, status=SKIPPED, message=record.message or KEPT)

    def skipped_tiles(self, wanted: BakeRecord, resolution: int | None) -> BakeRecord | None:
        """The record of a bake of UDIM tiles that can be skipped, or None: the report must have it, and its files.

        The caller checks that the files are complete. `resolution`: texels along the longer side, None for any.
        """
        record = self._records.get(_key(wanted))
        if record is None or not record.files or record.status not in (WRITTEN, SKIPPED):
            return None
        paths = [Path(file) for file in record.files]
        is_new = all(path.is_file() and path.stat().st_mtime > self._since for path in paths)
        same = all(getattr(record, name) == getattr(wanted, name) for name in ("path", "output", "indirect"))
        if not (is_new and same) or resolution not in (None, max(record.width, record.height)):
            return None
        return replace(record, status=SKIPPED, message=record.message or KEPT)


def _key(record: BakeRecord) -> tuple:
    return record.object, record.material, record.side, record.frame


def _entries(report: str | None) -> list[dict]:
    if report is None:
        return []
    try:
        entries = json.loads(Path(report).read_text(encoding="utf-8"))["bakes"]
        return [entry for entry in entries if isinstance(entry, dict) and "object" in entry]
    except (OSError, ValueError, KeyError, TypeError):
        return []


class Inventory:
    """Lines of all bakes of a run. Bakes that share a light show its line once."""

    def __init__(self) -> None:
        self._shown: set[str] = set()

    def lines(self, bake: Bake) -> Iterator[str]:
        """New lines about the light of this bake, and a line about the bake."""
        job = bake.job
        if job is None:
            return
        for line in _light(job.illumination):
            if line not in self._shown:
                self._shown.add(line)
                yield line
        receiver, grids = job.receiver, [chart.grid for chart in job.receiver.charts]
        sizes = [f"{grid.width * grid.pitch_x:.4g} x {grid.height * grid.pitch_y:.4g}" for grid in grids]
        extent = f"{grids[0].area:.4g} square" if receiver.is_bent else ", ".join(sizes)
        yield f"'{job.name}': {receiver.width} x {receiver.height} texels, {extent} scene units"
        if job.spread is not None:
            yield f"'{job.name}': light spreads over {job.spread.texels:.3g} texels"
        yield f"'{job.name}': takes about {job.seconds():.1f} s"


def _light(illumination: Illumination) -> Iterator[str]:
    yield f"{len(illumination.lights)} lights; {illumination.triangle_count} triangles in the light's way"
    yield from (light.line() for light in illumination.lights)
    yield from map(str, illumination.messages)
