"""Target: the unit of baking."""

from __future__ import annotations

from dataclasses import dataclass

FRONT, BACK = "FRONT", "BACK"
"""Faces of a slab: the one that the mesh's normals point out of, and the other one."""


@dataclass(frozen=True, order=True)
class Target:
    """One material of one object, by name, because the host's data may move while a bake runs.

    `side`: the face of a slab that its image shows; `FRONT` for other surfaces.
    """

    object_name: str
    material_name: str = ""
    side: str = FRONT

    @property
    def names(self) -> tuple[str, ...]:
        """Object, material and the side if it is the back: parts of the names of files and images."""
        return (self.object_name, self.material_name, *([BACK.title()] if self.side == BACK else []))

    @property
    def image_key(self) -> tuple[str, str]:
        """Material and side: targets that are equal in both have one image."""
        return self.material_name, self.side

    def __str__(self) -> str:
        name = f"{self.object_name} / {self.material_name}" if self.material_name else self.object_name
        return f"{name}, back" if self.side == BACK else name
