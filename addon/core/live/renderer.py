"""Renders targets for Live: quickly at few texels, and exactly as a bake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..bake.bake_settings import COMBINED, BakeSettings
from ..bake.layers import spread
from ..bake.margin import WHOLE, extend_margin
from ..bake.surface import channel_media
from ..ldf.albedo import albedo_from_reflectance
from ..ldf.library import load_source
from ..material import Material
from ..progress import Progress
from ..recent import keep_recent
from ..scene.illumination import Illumination
from ..scene.lights import Light
from ..scene.receiver import Grid, Receiver, build_receiver, texture_size
from ..scene.sampling import resized
from ..scene.uv_map import fit_uv_maps
from ..target import Target
from .kernel_cache import KernelCache
from .library_service import LibraryService
from .live_target import LiveTarget

SIDES = 64, 128, 256, 512
"""Texels along the longer side of quick renderings."""

TRANSFORM_COST, SIZED_LIGHT_COST = 8, 20
"""CPU time for each texel of transforms, and of a light with a size, in that of a light without a size."""

MAX_QUICK_COST = 24 * 256**2
"""Budget of a quick rendering in texels times their costs, about .08 s of CPU time; more is finer and slower."""

QUICK_RAYS = 4
"""Rays from each texel of a quick rendering to a light with a size; more has less noise and is slower."""

QUICK_SAMPLES = 2
"""Samples along each axis of a texel at borders of shadows in quick renderings; more is smoother and slower."""

MAX_EXACT_SUNS = 4
"""Number of suns that a quick rendering spreads with exact kernels of their own, as a `LightField` does."""

MIN_EXACT_TEXELS = 384**2
"""Texels from which on exact kernels of suns cost less than the transforms of a field for all directions."""

MAX_RECEIVERS = 32
"""Number of receivers in memory; more helps scenes with more targets."""


@dataclass(frozen=True, eq=False)
class Rendering:
    """The light of a target in its image.

    Attributes
    ----------
    texture : float32 (height, width, 3), luminance; None where `error` says why.
    region : bool (height, width), texels of the target, margin included.
    is_exact : True if the values are those of a bake without indirect light.
    """

    target: Target
    texture: np.ndarray | None = None
    region: np.ndarray | None = None
    is_exact: bool = False
    error: str = ""


def quick_side(lights: Sequence[Light]) -> int:
    """Texels along the longer side of a quick rendering under these lights, within `MAX_QUICK_COST`."""
    cost = TRANSFORM_COST + sum(SIZED_LIGHT_COST if light.has_size else 1 for light in lights)
    return max((side for side in SIDES if side**2 * cost <= MAX_QUICK_COST), default=SIDES[0])


class LiveRenderer:
    """Renders targets, and caches everything that does not depend on the change between two renderings."""

    def __init__(self, libraries: LibraryService) -> None:
        self.kernels = KernelCache()
        self._libraries = libraries
        self._last_libraries: dict[Target, list] = {}  # of each channel
        self._receivers: dict = {}
        self._maps: dict = {}

    def size_of(self, target: LiveTarget) -> tuple[int, int]:
        """Width and height of the target's image in texels."""
        return target.size or texture_size(self._uv_maps(target), target.resolution)

    def quick(self, target: LiveTarget, side: int, progress: Progress | None = None) -> Rendering:
        """Render at most `side` texels along the longer side, interpolated to the size of the image."""
        size = self.size_of(target)
        shrink = min(1.0, side / max(size))
        framed = self._receiver(target, tuple(max(1, round(length * shrink)) for length in size))
        settings = replace(target.settings, samples=min(QUICK_SAMPLES, target.settings.samples))
        material, sources = self._material(target)
        values = [
            self._quick_luminance(replace(chart.grid, color_out=None), target, material, sources, settings, progress)
            for chart in framed.receiver.charts
        ]
        texture, whole = framed.continued(framed.receiver.to_texture(values)), self._receiver(target, size)
        texture = resized(texture, size[1], size[0])
        if whole.color_out is not None:
            texture *= whole.color_out  # at all texels, so that the texture keeps its detail
        return Rendering(target.target, texture, whole.region)

    def exact(self, target: LiveTarget, progress: Progress | None = None) -> Rendering:
        """Render as a bake does, with the libraries at hand."""
        framed = self._receiver(target, self.size_of(target))
        material, sources = self._material(target)
        rest = material, sources, target.settings, progress
        values = [spread(chart.grid, target.illumination, *rest) for chart in framed.receiver.charts]
        texture = framed.receiver.to_texture(values)
        texture = extend_margin(texture, framed.receiver.coverage, target.settings.margin)
        return Rendering(target.target, texture, framed.region, is_exact=True)

    def missing(self, target: LiveTarget) -> list:
        """Media of the target that have no library yet."""
        if target.settings.distributions != "library" and target.surface.base_color is None:
            return []
        try:
            return [medium for medium in dict.fromkeys(_media(target)) if self._libraries.serve(medium) is None]
        except ValueError:
            return []  # rendering raises the same error and says why

    def has_libraries(self, target: LiveTarget) -> bool:
        """True if the target can be rendered: with its own libraries, or with those that it had before."""
        return target.target in self._last_libraries or not self.missing(target)

    def _material(self, target: LiveTarget) -> tuple[Material, list]:
        """The material with its albedo, and the source of each channel's distributions."""
        surface, settings = target.surface, target.settings
        surface.check()
        former = self._last_libraries.get(target.target, [None] * 3)
        sources = [self._libraries.serve(medium) or before for medium, before in zip(_media(target), former)]
        if None not in sources:
            self._last_libraries[target.target] = sources
        material = surface.material
        if surface.base_color is not None:
            pairs = zip(surface.base_color, sources)
            albedo = tuple(albedo_from_reflectance(color, source.diffuse_reflectance) for color, source in pairs)
            material = replace(material, albedo=albedo)
        if settings.distributions != "library":
            sources = [load_source(settings.sample_folder, settings.distributions)] * 3
        return material, sources

    def _quick_luminance(
        self, grid: Grid, target: LiveTarget, material: Material, sources: list, settings: BakeSettings, progress
    ) -> np.ndarray:
        lights = [light for light in target.illumination.lights if not light.is_behind(grid)]
        if not lights:
            return np.zeros((grid.height, grid.width, 3), np.float32)
        if _are_few_suns(lights, grid) or settings.distributions != "library":
            return spread(grid, target.illumination, material, sources, settings, progress)
        medium = {
            "ldf": sources,
            "albedo": material.albedo,
            "mean_free_path": material.mean_free_path,
            "threads": settings.threads,
        }
        color = _common_color(grid, target.illumination)
        field = self.kernels.field(grid, medium, is_colored=color is None)
        arriving = target.illumination.native_lights(grid)
        if color is not None:
            arriving = [(light, [max(rgb)] * 3, caster) for light, rgb, caster in arriving]
        luminance = field.luminance(
            grid.surface(), arriving, settings.samples, QUICK_RAYS, 0, settings.threads, progress
        )
        return luminance if color is None else luminance * color

    def _uv_maps(self, target: LiveTarget) -> list:
        key = id(target.polygons)
        if key not in self._maps:
            # The entry holds the polygons, so that no others get their identity.
            keep_recent(self._maps, key, (target.polygons, fit_uv_maps(target.polygons)), MAX_RECEIVERS)
        return self._maps[key][1]

    def _receiver(self, target: LiveTarget, size: tuple[int, int]) -> FramedReceiver:
        key = id(target.polygons), id(target.texture), size, target.settings.margin
        if key not in self._receivers:
            receiver = build_receiver(self._uv_maps(target), *size, target.target.object_name)
            if target.texture is not None:
                receiver = target.texture.on(receiver)
            framed = FramedReceiver(receiver, target.settings.margin)
            keep_recent(self._receivers, key, (framed, target.polygons, target.texture), MAX_RECEIVERS)
        return self._receivers[key][0]


class FramedReceiver:
    """A receiver with the texels around its charts, which continue the charts' values.

    Attributes
    ----------
    region : bool (height, width), texels of the charts and of their margin.
    """

    def __init__(self, receiver: Receiver, margin: int) -> None:
        self.receiver = receiver
        inside = receiver.inside()
        whole = receiver.coverage > WHOLE
        source = _nearest_texels(whole if whole.any() else inside, margin + 2)
        self._source = None if whole.all() else source
        self.region = _dilated(inside, margin)

    @cached_property
    def color_out(self) -> np.ndarray | None:
        """Float32 (height, width, 3): factors of light that leaves, continued around the charts; None without any."""
        factors = [chart.grid.color_out for chart in self.receiver.charts]
        return None if factors[0] is None else self.continued(self.receiver.to_texture(factors))

    def continued(self, texture: np.ndarray) -> np.ndarray:
        """The texture with the values of texels wholly inside a chart at the texels around them."""
        if self._source is None:
            return texture
        return texture.reshape(-1, 3)[self._source].reshape(texture.shape)


def _nearest_texels(known: np.ndarray, rings: int) -> np.ndarray:
    """Int (H, W): the index of a known texel near each texel of the next `rings`, its own index for all others."""
    indices = np.arange(known.size).reshape(known.shape)
    source = np.where(known, indices, -1)
    for _ in range(rings):
        if (source >= 0).all():
            break
        padded = np.pad(source, 1, constant_values=-1)
        height, width = known.shape
        for dy in (0, 1, 2):
            for dx in (0, 1, 2):
                neighbor = padded[dy : dy + height, dx : dx + width]
                np.copyto(source, neighbor, where=(source < 0) & (neighbor >= 0))
    return np.where(source < 0, indices, source)


def _dilated(mask: np.ndarray, rings: int) -> np.ndarray:
    """Bool (H, W): texels of the mask and of `rings` around it."""
    for _ in range(rings):
        if mask.all():
            break
        padded = np.pad(mask, 1)
        up_down = padded[:-2] | padded[1:-1] | padded[2:]
        mask = up_down[:, :-2] | up_down[:, 1:-1] | up_down[:, 2:]
    return mask


def _media(target: LiveTarget) -> list:
    """The medium of each channel."""
    return channel_media(target.surface.material, target.surface.thickness)


def _are_few_suns(lights: Sequence[Light], grid: Grid) -> bool:
    """True if all lights are suns, and exact kernels for these cost no more than a field for all directions."""
    if len(lights) > MAX_EXACT_SUNS or not all(light.is_parallel and not light.has_size for light in lights):
        return False
    return grid.width * grid.height >= MIN_EXACT_TEXELS


def _common_color(grid: Grid, illumination: Illumination) -> np.ndarray | None:
    """Float32 (3,), 1 at most: the color of all lights, or None where they differ."""
    lights = [light for light in illumination.lights if not light.is_behind(grid)]
    casters = [illumination.caster(grid, light) for light in lights if light.cast_shadow]
    is_colored = [light.is_colored for light in lights] + [caster.is_colored for caster in casters if caster]
    colors = np.array([light.rgb() / max(light.rgb().max(), 1e-30) for light in lights], np.float32)
    differ = np.abs(colors - colors[0]).max() > 1e-6
    return None if differ or any(is_colored) or grid.color_in is not None else colors[0]


def for_live(settings: BakeSettings) -> BakeSettings:
    """The settings of a scene as Live uses them: the FFT solver, without indirect light."""
    return replace(settings, solver="fft", indirect=False, layer=COMBINED)
