"""Target: the unit of baking."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class Target:
    """One material of one object, by name, because the host's data may move while a bake runs."""

    object_name: str
    material_name: str = ""

    def __str__(self) -> str:
        return f"{self.object_name} / {self.material_name}" if self.material_name else self.object_name
