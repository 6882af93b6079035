"""Light and medium of a bake, and the effort for it, as plain data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..material import Material
from ..scene.illumination import Illumination
from .bake_settings import BakeSettings
from .directions import MAX_OWN

SMALL_TEXELS = 128**2
"""Texels of a plane below which more walks take little time. Larger: less noise in small planes, longer."""

Report = Callable[[float, float, float], None]
"""Takes an area, the mean irradiance there, W/m^2, and the mean variance of it that is left in the result."""


@dataclass(frozen=True)
class Effort:
    """Effort for light in a texture's albedos.

    Attributes
    ----------
    noise : wanted root mean square error of texels, relative to that of the light. Smaller: longer.
    max_walks : largest number of walks for each texel. More: less noise, longer.
    texels : along a side at which light is gathered for paths. More: sharper shadows in the correction, longer.
    rays : from each of these texels to a light of a size.
    max_own : largest number of lights with a direction of their own.
    is_split : True if the light of all others is split between directions; else it has its mean one.
    spare : multiple of the walks that planes of few texels take.
    """

    noise: float
    max_walks: int
    texels: int
    rays: int
    max_own: int = MAX_OWN
    is_split: bool = True
    spare: float = 1.0

    def of_plane(self, texels: int) -> Effort:
        """The effort for a plane: less noise where it has few texels."""
        more = min(max(SMALL_TEXELS / texels, 1.0), self.spare)
        return replace(self, noise=self.noise / more**0.5, max_walks=round(self.max_walks * more))


QUICK_EFFORT = Effort(0.1, 32, 128, 4, max_own=1, is_split=False)
"""Effort of Live while the scene changes."""

FINAL_EFFORT = Effort(0.02, 2048, 512, 8, spare=4.0)
"""Effort of bakes."""


@dataclass(frozen=True, eq=False)
class Reports:
    """Functions that take facts about a result; None: nobody asks.

    Attributes
    ----------
    noise : takes the noise of the light, averaged over the area in which the medium spreads it.
    bend : takes the fraction of a surface that bends more than the libraries know.
    texture : takes the noise of a texture's light, relative to its root mean square.
    """

    noise: Report | None = None
    bend: Callable[[float], None] | None = None
    texture: Callable[[float], None] | None = None


@dataclass(frozen=True, eq=False)
class Spreading:
    """Light and medium of a bake.

    Attributes
    ----------
    material : checked; its mean free path is in the units of the grids.
    sources : LDF of each channel.
    settings : their `quality` does not count.
    is_slab : True if light on the face behind counts, see `has_back`.
    bytes_for_light : largest memory, bytes, of the moments that the fft solver makes of light; 0: any.
    rays : from each texel to all lights of a size together; 0: by the medium, see `rays_per_texel`.
    effort : of light in a texture's albedos.
    """

    illumination: Illumination
    material: Material
    sources: Sequence
    settings: BakeSettings
    is_slab: bool = False
    bytes_for_light: int = 0
    seed: int = 0
    rays: int = 0
    reports: Reports = Reports()
    effort: Effort = FINAL_EFFORT
