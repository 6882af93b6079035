"""What finds the light that reaches a grid: the place, what stands in the way, and how closely to look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..progress import Progress
from .grid import Grid

# Of the rays of a texel, where nothing stands in their way or everything does: there only their directions matter.
EVEN_PART, FEWEST_EVEN, MOST_EVEN = 8, 4, 16


@dataclass(frozen=True, eq=False)
class Reach:
    """Of one light on one grid.

    Attributes
    ----------
    caster : native `Occluders` that throw its shadows, or None.
    samples : along each side of a texel, for light without size.
    rays : from each texel, for light of a size.
    seed : of these rays.
    threads : 0: all.
    """

    grid: Grid
    caster: object | None
    samples: int
    rays: int
    seed: int = 0
    threads: int = 0
    progress: Progress | None = None

    @property
    def is_colored(self) -> bool:
        """Whether what is in the way colors light."""
        return self.caster is not None and self.caster.is_colored

    def beam_options(self, directions: bool = True) -> dict:
        """What native `gather_beams` takes."""
        return {"samples": self.samples, "directions": directions, **self._options()}

    def ray_options(self) -> dict:
        """What native `ray_layers` takes."""
        return {"rays": self.rays, "seed": self.seed, **self._options()}

    def even_ray_options(self) -> dict:
        """What native `gather_rays` and `LightField.add_rays` take."""
        return self.ray_options() | {"even_rays": min(max(self.rays // EVEN_PART, FEWEST_EVEN), MOST_EVEN)}

    def _options(self) -> dict:
        return {"threads": self.threads, "progress": self.progress, "clearance": self.grid.clearance}

    def in_plane(self, direction) -> np.ndarray:
        """Of (3,) in the world, in the plane's frame."""
        return np.array([np.dot(direction, axis) for axis in (self.grid.x_axis, self.grid.y_axis, self.grid.normal)])

    def received(self, irradiance: np.ndarray) -> np.ndarray:
        """Of (H, W) or (H, W, 3), what the covered part of each texel lets in by its color; may change the array."""
        covered, color = self.covered(irradiance), self.grid.color_in
        if color is None:
            return covered
        return covered[..., None] * color if covered.ndim == 2 else covered * color

    def covered(self, values: np.ndarray) -> np.ndarray:
        """Of (H, W) or (H, W, 3), the covered part of each texel, in the array given."""
        values *= self.grid.coverage if values.ndim == 2 else self.grid.coverage[..., None]
        return values

    def channels_received(self, rgb: np.ndarray) -> list[tuple[list[float], np.ndarray]]:
        """Colors of light, and the part (H, W) of it that each texel receives; together they are all."""
        color, coverage = self.grid.color_in, self.grid.coverage
        if color is None:
            return [(rgb.tolist(), coverage)]
        if (color[..., :1] == color).all():
            return [(rgb.tolist(), coverage * color[..., 0])]
        return [((rgb * np.eye(3)[i]).tolist(), np.ascontiguousarray(coverage * color[..., i])) for i in range(3)]
