"""Renders targets for Live: quickly at few texels, and exactly as a bake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ..bake.bake_settings import COMBINED, BakeSettings
from ..bake.bent_limits import bent_messages
from ..bake.edges import with_edges
from ..bake.finish import finished_texture, with_seams
from ..bake.spread_light import has_back, spread, spread_on, spread_side
from ..bake.spreading import FINAL_EFFORT, QUICK_EFFORT, Reports, Spreading
from ..bake.surface import channel_media
from ..bake.textured_bake import corrected, noisy_note, with_factors
from ..errors import BakeError
from ..ldf.albedo import albedo_from_reflectance
from ..ldf.library import load_source
from ..material import Material
from ..messages import Message
from ..progress import Progress
from ..recent import keep_recent
from ..scene.flat_mesh import FlatMesh, flatten
from ..scene.grid import Grid
from ..scene.illumination import Illumination
from ..scene.lights import Light, WorldLight
from ..scene.receiver import build_receiver, texture_size
from ..scene.sampling import resized
from ..target import Target
from .bounced_layer import BOUNCED_SIDE, BouncedLayers, with_bounced, without_direct
from .framed_receiver import FramedReceiver
from .kernel_cache import MAX_FIELDS, KernelCache
from .library_service import LibraryService
from .live_target import LiveTarget
from .live_texture import is_scattered, texture_notes, textured

SIDES = 64, 128, 256, 512
"""Texels along the longer side of quick renderings."""

TRANSFORM_COST, SIZED_LIGHT_COST = 8, 20
"""CPU time for each texel of transforms, and of a light with a size, in that of a light without a size."""

MAX_QUICK_COST = 24 * 256**2
"""Budget of a quick rendering in texels times their costs, about .08 s of CPU time; more is finer and slower."""

SCATTERED_SIDE = 128
"""Most texels along the longer side of a quick rendering in whose texture light scatters; more is finer and slower."""

NEW_MEDIUM_SIDE = 128
"""The same for a medium that has just changed, so that its kernels are new; more is finer and slower."""

QUICK_RAYS = 4
"""Rays from each texel of a quick rendering to a light with a size; more has less noise and is slower."""

QUICK_SAMPLES = 2
"""Samples along each axis of a texel at borders of shadows in quick renderings; more is smoother and slower."""

MAX_WORLD_ROWS = 512
"""Rows of the world's image in quick renderings; more show finer suns and are slower."""

MAX_EXACT_SUNS = 4
"""Number of suns that a quick rendering spreads with exact kernels of their own, as a `LightField` does."""

MIN_EXACT_TEXELS = 384**2
"""Texels from which on exact kernels of suns cost less than the transforms of a field for all directions."""

MAX_GRIDS_APART = 32
"""Number of grids that a quick rendering solves apart; more: slower for objects of many planes, quicker for few."""

MAX_RECEIVERS = 32
"""Number of receivers in memory; more helps scenes with more targets."""


@dataclass(frozen=True, eq=False)
class Rendering:
    """The light of a target in its image.

    Attributes
    ----------
    texture : float32 (height, width, 3), luminance; None where `error` says why.
    framed : texels of the target and of its margin.
    is_exact : True if the values are those of a bake.
    messages : for the artist: faces that are left out, and noise of an exact rendering.
    """

    target: Target
    texture: np.ndarray | None = None
    framed: FramedReceiver | None = None
    is_exact: bool = False
    error: Message | None = None
    messages: tuple[Message, ...] = ()


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
        self._meshes: dict = {}
        self._direct: dict[Target, np.ndarray] = {}  # last quick luminance, at its few texels
        self._media: dict[Target, tuple] = {}  # of the last quick rendering
        self._bounced = BouncedLayers()

    def size_of(self, target: LiveTarget) -> tuple[int, int]:
        """Width and height of the target's image in texels."""
        return target.size or texture_size(self._mesh(target), target.resolution)

    def quick_side(self, target: LiveTarget) -> int:
        """Texels along the longer side of a quick rendering of the target; few where that takes longer."""
        is_slow = self._mesh(target).is_bent or has_back(target.surface.thickness, target.settings)
        side = SIDES[0] if is_slow else quick_side(target.illumination.lights)
        if self._media.get(target.target) != self._medium(target):
            side = min(side, NEW_MEDIUM_SIDE)
        return min(side, SCATTERED_SIDE) if is_scattered(target) else side

    def quick(self, target: LiveTarget, side: int, progress: Progress | None = None) -> Rendering:
        """Render at most `side` texels along the longer side, interpolated to the size of the image.

        Light that bounces is the last known one.
        """
        framed = self._coarse_receiver(target, side)
        settings = replace(target.settings, samples=min(QUICK_SAMPLES, target.settings.samples))
        direct = self._quick_texture(target, _coarse(target.illumination), framed, settings, progress)
        keep_recent(self._direct, target.target, direct, MAX_RECEIVERS)
        keep_recent(self._media, target.target, self._medium(target), MAX_RECEIVERS)
        return self._together(target)

    def quick_bounced(self, target: LiveTarget, progress: Progress | None = None) -> Rendering:
        """Find light that bounces, coarsely, and add it to the last quick rendering."""
        framed = self._coarse_receiver(target, BOUNCED_SIDE)
        coarse = replace(target, illumination=_coarse(target.illumination))
        bounced = without_direct(with_bounced(coarse, framed.receiver, progress, is_quick=True), target)
        if bounced is not None:
            bounced = self._quick_texture(target, bounced, framed, target.settings, progress)
        self._bounced.put(target.target, bounced)
        return self._together(target)

    def exact(self, target: LiveTarget, progress: Progress | None = None) -> Rendering:
        """Render as a bake does, with the libraries at hand."""
        framed = self._receiver(target, self.size_of(target))
        material, sources = self._material(target)
        illumination = with_bounced(target, framed.receiver, progress)
        grids, edges = with_edges(
            [chart.grid for chart in framed.receiver.charts], target.surface, target.target.object_name
        )
        name, bends, noises = target.target.object_name, [0.0], [0.0]
        is_slab = has_back(target.surface.thickness, target.settings)
        spreading = Spreading(
            illumination,
            material,
            sources,
            target.settings,
            is_slab,
            reports=Reports(bend=bends.append, texture=noises.append),
        )
        values = spread(grids, spreading, progress)
        is_bent = self._mesh(target).is_bent
        limits = bent_messages(name, target.surface, target.settings, max(bends)) if is_bent else ()
        texture = finished_texture(framed.receiver, values, material, target.settings)
        news = [message for message in illumination.messages if message not in target.illumination.messages]
        if max(noises) > FINAL_EFFORT.noise:
            news.append(noisy_note(name, max(noises)))
        notes = texture_notes(target)
        messages = (*self._mesh(target).messages, *edges, *limits, *notes, *news)
        return Rendering(target.target, texture, framed, is_exact=True, messages=messages)

    def missing(self, target: LiveTarget) -> list:
        """Media of the target that have no library yet, each with True if the library needs curved surfaces."""
        if target.settings.distributions != "library" and target.surface.base_color is None:
            return []
        try:
            wanted = dict.fromkeys((medium, self._mesh(target).is_bent) for medium in _media(target))
        except (ValueError, BakeError):
            return []  # rendering raises the same error and says why
        return [(medium, curved) for medium, curved in wanted if self._libraries.serve(medium, curved) is None]

    def has_libraries(self, target: LiveTarget) -> bool:
        """True if the target can be rendered: with its own libraries, or with those that it had before."""
        missing = self.missing(target)
        # A surface that bends shows the medium of a plane until that of curves is simulated.
        is_plane_known = all(curved and self._libraries.serve(medium) is not None for medium, curved in missing)
        return target.target in self._last_libraries or is_plane_known

    def _material(self, target: LiveTarget) -> tuple[Material, list]:
        """The material with its albedo, and the source of each channel's distributions."""
        surface, settings = target.surface, target.settings
        surface.check()
        former = self._last_libraries.get(target.target, [None] * 3)
        is_bent, serve = self._mesh(target).is_bent, self._libraries.serve
        sources = [
            serve(medium, is_bent) or (is_bent and serve(medium)) or before
            for medium, before in zip(_media(target), former)
        ]
        if None not in sources:
            self._last_libraries[target.target] = sources
        material = surface.material
        if surface.base_color is not None:
            pairs = zip(surface.base_color, sources)
            albedo = tuple(_albedo(color, source) for color, source in pairs)
            material = replace(material, albedo=albedo)
        if settings.distributions != "library":
            sources = [load_source(settings.sample_folder, settings.distributions)] * 3
        return material, sources

    def _medium(self, target: LiveTarget) -> tuple:
        """Material and distributions, which the kernels of the target follow."""
        material, sources = self._material(target)
        return material, *sources

    def _coarse_receiver(self, target: LiveTarget, side: int) -> FramedReceiver:
        """The receiver with at most `side` texels along the longer side."""
        size = self.size_of(target)
        shrink = min(1.0, side / max(size))
        return self._receiver(target, tuple(max(1, round(length * shrink)) for length in size))

    def _quick_texture(
        self, target: LiveTarget, illumination: Illumination, framed: FramedReceiver, settings: BakeSettings, progress
    ) -> np.ndarray:
        """Luminance below the surface, float32 (height, width, 3), continued around the charts."""
        material, sources = self._material(target)
        is_slab = has_back(target.surface.thickness, settings)
        grids, material = with_factors([chart.grid for chart in framed.receiver.charts], material, sources)
        grids = [replace(grid, color_out=None) for grid in grids]
        sizes = {(grid.width, grid.height, grid.pitch_x, grid.pitch_y) for grid in grids}
        # The cache has kernels of few sizes, and of planes with light on one face.
        if len(grids) > MAX_GRIDS_APART or len(sizes) > MAX_FIELDS or framed.receiver.is_bent or is_slab:
            rays = QUICK_RAYS * max(len(illumination.lights), 1)
            spreading = Spreading(illumination, material, sources, settings, is_slab, rays=rays, effort=QUICK_EFFORT)
            values = spread_on(grids, spreading, progress)
        else:
            spreading = Spreading(illumination, material, sources, settings, effort=QUICK_EFFORT)
            values = [self._quick_luminance(grid, spreading, progress) for grid in grids]
            values = [
                value if grid.albedo is None else corrected("reflected", grid, value, spreading, Progress.of(progress))
                for grid, value in zip(grids, values)
            ]
        return framed.continued(framed.receiver.to_texture(values))

    def _together(self, target: LiveTarget) -> Rendering:
        """Direct and bounced light as they are known, at the size of the image."""
        texture, bounced = self._direct[target.target], self._bounced.of(target)
        if bounced is not None:
            texture = texture + resized(bounced, *texture.shape[:2])
        size = self.size_of(target)
        whole = self._receiver(target, size)
        resized_texture = resized(texture, size[1], size[0])
        if whole.color_out is not None:
            # At all texels, so that the texture keeps its detail.
            resized_texture = resized_texture * whole.color_out
        messages = *self._mesh(target).messages, *texture_notes(target)
        return Rendering(target.target, resized_texture, whole, messages=messages)

    def _quick_luminance(self, grid: Grid, spreading: Spreading, progress) -> np.ndarray:
        """Luminance of the convention for textures."""
        illumination, material, settings = spreading.illumination, spreading.material, spreading.settings
        lights = [light for light in illumination.lights if not light.is_behind(grid)]
        if not lights:
            return np.zeros((grid.height, grid.width, 3), np.float32)
        if _are_few_suns(lights, grid) or settings.distributions != "library":
            return spread_side("reflected", [grid], spreading, Progress.of(progress))[0]
        medium = {
            "ldf": spreading.sources,
            "albedo": material.albedo,
            "mean_free_path": material.mean_free_path,
            "threads": settings.threads,
        }
        color = _common_color(grid, illumination)
        field = self.kernels.field(grid, medium, is_colored=color is None)
        arriving = illumination.native_lights(grid)
        if color is not None:
            arriving = [(light, [max(rgb)] * 3, caster) for light, rgb, caster in arriving]
        luminance = field.luminance(
            grid.surface(), arriving, settings.samples, QUICK_RAYS, 0, settings.threads, progress
        )
        return luminance if color is None else luminance * color

    def _mesh(self, target: LiveTarget) -> FlatMesh:
        path, polygons = min(target.surface.material.mean_free_path), target.polygons
        key = id(polygons), path, target.spread, target.surface.thickness > 0
        if key not in self._meshes:
            mesh = flatten(polygons, path, target.target.object_name, *key[2:])
            # The entry holds the polygons, so that no others get their identity.
            keep_recent(self._meshes, key, (polygons, mesh), MAX_RECEIVERS)
        return self._meshes[key][1]

    def _receiver(self, target: LiveTarget, size: tuple[int, int]) -> FramedReceiver:
        mesh = self._mesh(target)
        side, settings = target.target.side, target.settings
        key = id(mesh), id(target.texture), side, size, settings.margin, settings.margin_type
        if is_scattered(target):  # factors depend on the medium
            key = *key, settings.distributions, *map(id, self._material(target)[1])
        if key not in self._receivers:
            receiver = build_receiver(mesh, *size, target.target.object_name)
            receiver = with_seams(receiver, mesh, settings).seen_from(side)
            if target.texture is not None:
                receiver = textured(target, receiver, *self._material(target))
            framed = FramedReceiver(receiver, settings.margin)
            keep_recent(self._receivers, key, (framed, mesh, target.texture), MAX_RECEIVERS)
        return self._receivers[key][0]


@lru_cache(maxsize=32)
def _albedo(color: float, source) -> float:
    """Albedo of a color, which takes longer to find than a quick rendering may."""
    return albedo_from_reflectance(color, source.diffuse_reflectance)


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


def _coarse(illumination: Illumination) -> Illumination:
    """The illumination with a world of few texels: a fine one takes .3 s for each plane."""
    return illumination.with_lights(
        [light.coarse(MAX_WORLD_ROWS) if isinstance(light, WorldLight) else light for light in illumination.lights]
    )


def for_live(settings: BakeSettings) -> BakeSettings:
    """The settings of a scene as Live uses them: luminance by the FFT solver."""
    return replace(settings, solver="fft", layer=COMBINED)
