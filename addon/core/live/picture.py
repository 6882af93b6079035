"""Luminance at few texels by what is kept, and at all of them as a bake has it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..bake.bake_settings import COMBINED, BakeSettings
from ..bake.gather import Gatherer
from ..bake.luminance import spread
from ..bake.margin import WHOLE, extend_margin
from ..bake.surface import channel_media
from ..ldf.albedo import albedo_from_reflectance
from ..ldf.samples import load_source
from ..material import Material
from ..progress import Progress
from ..recent import keep_recent
from ..scene.grid import Grid
from ..scene.lights import Light
from ..scene.receiver import Receiver, build_receiver, texture_size
from ..scene.sampling import resized
from ..scene.uv_map import fit_uv_maps
from .fields import Fields
from .media import Media
from .subject import Subject

# Of each texel, of a quick picture: rays to a light of a size, and samples along each axis where shadows are.
FEW_RAYS, FEW_SAMPLES = 4, 2

# Suns that have kernels of their own, as in a `LightField`.
MOST_SUNS = 4

# Texels from which on their transforms cost more than kernels of suns.
MANY_TEXELS = 384**2

# Receivers that are kept, those used last.
MOST_RECEIVERS = 32


@dataclass(frozen=True, eq=False)
class Picture:
    """A painted subject.

    Attributes
    ----------
    texture : float32 (height, width, 3), luminance; None where `error` says why.
    region : bool (height, width), what of it belongs to the subject, margin included.
    is_exact : whether it is as a bake, but for what live leaves out.
    """

    subject: Subject
    texture: np.ndarray | None = None
    region: np.ndarray | None = None
    is_exact: bool = False
    error: str = ""


class Studio:
    """Paints subjects, and keeps what does not depend on what changed from one to the next."""

    def __init__(self, media: Media) -> None:
        self.media, self.fields = media, Fields()
        self._receivers: dict = {}
        self._maps: dict = {}

    def size_of(self, subject: Subject) -> tuple[int, int]:
        return subject.size or texture_size(self._uv_maps(subject), subject.resolution)

    def quick(self, subject: Subject, side: int, progress: Progress | None = None) -> Picture:
        """With at most `side` texels along the longer side, enlarged to the image."""
        size = self.size_of(subject)
        shrink = min(1.0, side / max(size))
        receiver = self._receiver(subject, tuple(max(1, round(length * shrink)) for length in size))
        settings = replace(subject.settings, samples=min(FEW_SAMPLES, subject.settings.samples))
        material, sources = self._material(subject)
        values = [
            self._quick_luminance(replace(chart.grid, color_out=None), subject, material, sources, settings, progress)
            for chart in receiver.receiver.charts
        ]
        texture, whole = receiver.continued(receiver.receiver.to_texture(values)), self._receiver(subject, size)
        texture = resized(texture, size[1], size[0])
        if whole.color_out is not None:
            texture *= whole.color_out  # which keeps all detail
        return Picture(subject, texture, whole.region)

    def exact(self, subject: Subject, progress: Progress | None = None) -> Picture:
        """As a bake, with the libraries at hand."""
        receiver = self._receiver(subject, self.size_of(subject))
        material, sources = self._material(subject)
        rest = material, sources, subject.settings, progress
        values = [spread(chart.grid, subject.illumination, *rest) for chart in receiver.receiver.charts]
        texture = receiver.receiver.to_texture(values)
        texture = extend_margin(texture, receiver.receiver.coverage, subject.settings.margin)
        return Picture(subject, texture, receiver.region, is_exact=True)

    def missing(self, subject: Subject) -> list:
        """Media whose libraries are not at hand."""
        if subject.settings.distributions != "library":
            return []
        return [medium for medium in dict.fromkeys(_media(subject)) if not self.media.serve(medium)[1]]

    def _material(self, subject: Subject) -> tuple[Material, list]:
        """With its albedo, and the source of each channel."""
        surface, settings = subject.surface, subject.settings
        surface.check()
        served = [self.media.serve(medium)[0] for medium in _media(subject)]
        material = surface.material
        if surface.base_color is not None:
            pairs = zip(surface.base_color, served)
            albedo = tuple(albedo_from_reflectance(color, one.diffuse_reflectance) for color, one in pairs)
            material = replace(material, albedo=albedo)
        if settings.distributions != "library":
            served = [load_source(settings.sample_folder, settings.distributions)] * 3
        return material, served

    def _quick_luminance(
        self, grid: Grid, subject: Subject, material: Material, sources: list, settings: BakeSettings, progress
    ) -> np.ndarray:
        lights = [light for light in subject.illumination.lights if not light.is_behind(grid)]
        if not lights:
            return np.zeros((grid.height, grid.width, 3), np.float32)
        if _have_kernels_of_their_own(lights, grid) or settings.distributions != "library":
            return spread(grid, subject.illumination, material, sources, settings, progress)
        medium = {
            "ldf": sources,
            "albedo": material.albedo,
            "mean_free_path": material.mean_free_path,
            "threads": settings.threads,
        }
        gatherer = Gatherer(grid, subject.illumination, settings, FEW_RAYS)
        color = _common_color(gatherer, lights)
        field = self.fields.empty(grid, medium, is_colored=color is None)
        for light in lights:
            if color is not None:
                light = replace(light, color=(1.0, 1.0, 1.0), strength=float(light.rgb().max()))
            gatherer.add_to(field, light, FEW_RAYS, progress)
        luminance = field.solve(progress)
        return luminance if color is None else luminance * color

    def _uv_maps(self, subject: Subject) -> list:
        key = id(subject.polygons)
        if key not in self._maps:
            # With the polygons, so that no others get their number.
            keep_recent(self._maps, key, (subject.polygons, fit_uv_maps(subject.polygons)), MOST_RECEIVERS)
        return self._maps[key][1]

    def _receiver(self, subject: Subject, size: tuple[int, int]) -> FramedReceiver:
        key = id(subject.polygons), id(subject.texture), size, subject.settings.margin
        if key not in self._receivers:
            receiver = build_receiver(self._uv_maps(subject), *size)
            if subject.texture is not None:
                receiver = subject.texture.on(receiver)
            framed = FramedReceiver(receiver, subject.settings.margin)
            keep_recent(self._receivers, key, (framed, subject.polygons, subject.texture), MOST_RECEIVERS)
        return self._receivers[key][0]


class FramedReceiver:
    """A receiver, and what the texels around its charts show."""

    def __init__(self, receiver: Receiver, margin: int) -> None:
        self.receiver = receiver
        baked = receiver.inside()
        whole = receiver.coverage > WHOLE
        source = _nearest_texels(whole if whole.any() else baked, margin + 2)
        self._source = None if whole.all() else source
        self.region = baked | _reached(baked, margin)

    @cached_property
    def color_out(self) -> np.ndarray | None:
        """Float32 (height, width, 3): factors of light that leaves, those of the charts continued; or None."""
        factors = [chart.grid.color_out for chart in self.receiver.charts]
        return None if factors[0] is None else self.continued(self.receiver.to_texture(factors))

    def continued(self, texture: np.ndarray) -> np.ndarray:
        """With the values of texels wholly inside for those around."""
        if self._source is None:
            return texture
        return texture.reshape(-1, 3)[self._source].reshape(texture.shape)


def _nearest_texels(known: np.ndarray, rings: int) -> np.ndarray:
    """Int (H, W): for texels around the known ones the number of one nearby, for all others their own."""
    numbers = np.arange(known.size).reshape(known.shape)
    source = np.where(known, numbers, -1)
    for _ in range(rings):
        if (source >= 0).all():
            break
        padded = np.pad(source, 1, constant_values=-1)
        height, width = known.shape
        for dy in (0, 1, 2):
            for dx in (0, 1, 2):
                neighbour = padded[dy : dy + height, dx : dx + width]
                np.copyto(source, neighbour, where=(source < 0) & (neighbour >= 0))
    return np.where(source < 0, numbers, source)


def _reached(known: np.ndarray, rings: int) -> np.ndarray:
    for _ in range(rings):
        if known.all():
            break
        padded = np.pad(known, 1)
        up_down = padded[:-2] | padded[1:-1] | padded[2:]
        known = up_down[:, :-2] | up_down[:, 1:-1] | up_down[:, 2:]
    return known


def _media(subject: Subject) -> list:
    """Of each channel."""
    return channel_media(subject.surface.material, subject.surface.thickness)


def _have_kernels_of_their_own(lights: Sequence[Light], grid: Grid) -> bool:
    """Whether the lights are few suns, and exact kernels for these cost no more than a field."""
    if len(lights) > MOST_SUNS or not all(light.is_parallel and not light.has_size for light in lights):
        return False
    return grid.width * grid.height >= MANY_TEXELS


def _common_color(gatherer: Gatherer, lights: Sequence[Light]) -> np.ndarray | None:
    """Float32 (3,), 1 at most: the color of all lights, or None where they differ."""
    colors = np.array([light.rgb() / max(light.rgb().max(), 1e-30) for light in lights], np.float32)
    differ = np.abs(colors - colors[0]).max() > 1e-6
    return None if differ or any(map(gatherer.is_colored, lights)) else colors[0]


def for_live(settings: BakeSettings) -> BakeSettings:
    """What of a scene's settings counts."""
    return replace(settings, solver="fft", indirect=False, layers=(COMBINED,))
