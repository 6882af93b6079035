"""Terms and kernels of a medium on a grid, cached for any light."""

from __future__ import annotations

from ..native import native
from ..recent import keep_recent
from ..scene.grid import Grid

# (Largest angle of incidence in degrees, error of the kernels), tried in order until a field has few terms. Refracted
# light needs 17 terms for the first. Without refraction kernels change much toward grazing.
EXACTNESS = ((88.0, 0.02), (84.0, 0.1), (80.0, 0.3), (70.0, 4.0))
MAX_TERMS = 64

# Thickness in mean free paths below which slabs begin with the last entry: counting terms for the others takes seconds.
THIN = 1.0

# Fields in the cache, those used last.
MAX_FIELDS = 8


class KernelCache:
    """Native `LightField`s, by medium and grid.

    Attributes
    ----------
    made : number of fields made so far.
    """

    def __init__(self) -> None:
        self._fields: dict = {}
        self._exactness: dict = {}  # by media: index of the entry that has few terms
        self.made = 0

    def field(self, grid: Grid, medium: dict, is_colored: bool):
        """The field of a medium on a grid.

        Parameters
        ----------
        medium : arguments ldf, albedo and mean_free_path of `convolve`, and threads.
        is_colored : True if lights may differ in color.
        """
        pitch, shape = (grid.pitch_x, grid.pitch_y), (grid.height, grid.width)
        values = tuple(map(float, (*medium["albedo"], *medium["mean_free_path"], *pitch)))
        key = (*map(id, medium["ldf"]), *values, *shape, is_colored)
        if key in self._fields:
            field, _ = self._fields[key]
        else:
            field = self._make(shape, medium | {"pitch": pitch}, is_colored)
            self.made += 1
        # The entry holds the libraries, so that no other library gets the same id.
        return keep_recent(self._fields, key, (field, medium["ldf"]), MAX_FIELDS)[0]

    def _make(self, shape: tuple[int, int], medium: dict, is_colored: bool):
        media = tuple((ldf.medium.g, ldf.medium.ior, ldf.medium.thickness) for ldf in medium["ldf"])
        is_thin = any(thickness < THIN and ior > 1 for _, ior, thickness in media)
        first = len(EXACTNESS) - 1 if is_thin else 0
        for choice in range(self._exactness.get(media, first), len(EXACTNESS)):
            max_angle, tolerance = EXACTNESS[choice]
            field = native.LightField(shape, **medium, max_angle=max_angle, tolerance=tolerance, is_colored=is_colored)
            if field.terms <= MAX_TERMS * (3 if is_colored else 1):
                break
        self._exactness[media] = choice
        return field
