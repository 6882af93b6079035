"""The result of each bake, and the JSON report of a batch."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

from ..bake.runner import FAILED, SKIPPED, WRITTEN, Bake
from ..whole_file import whole_file


@dataclass
class BakeRecord:
    """One bake of one material of one object at one frame.

    Attributes
    ----------
    path : the file that was written.
    seconds : wall-clock time.
    output : the requested pass, LUMINANCE, IRRADIANCE or DIRECTION.
    lights : number of lights that were baked.
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

    @classmethod
    def of(cls, bake: Bake, frame: int) -> BakeRecord:
        """The record of a bake at a frame."""
        job, subject = bake.job, (bake.target.object_name, bake.target.material_name, frame, bake.path)
        outcome = round(bake.seconds, 3), bake.status, " ".join(map(str, bake.messages))
        if job is None:
            return cls(*subject, 0, 0, *outcome)
        lights = len(job.illumination.lights), [str(message) for message in job.left_out()], job.settings.indirect
        size = job.receiver.width, job.receiver.height
        return cls(*subject, *size, *outcome, job.settings.output, *lights, bake.is_dark)

    def __str__(self) -> str:
        subject = f"{self.object} / {self.material}" if self.material else self.object
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
        text = json.dumps({"bakes": [asdict(bake) for bake in self.bakes]}, indent=2, ensure_ascii=False)
        with whole_file(target) as temporary:
            temporary.write_text(text + "\n", encoding="utf-8")
