"""How far a medium spreads light, in texels of an image, and the side of new images that shows it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..ldf.reflectance_table import exact_table
from ..material import MAX_ALBEDO
from ..messages import Message, note
from ..scene.flat_mesh import FlatMesh
from ..scene.islands import MAX_LOST, NO_UV_AREA
from ..scene.polygons import Polygons
from .surface import MIRROR, Surface, channel_media

# Texels along the longer side of new images: the fewest, the most by texel density, and the most by the medium.
MIN_SIDE, MAX_BY_DENSITY, MAX_SIDE = 512, 2048, 4096

# Least texels along the longer side of new images for textured surfaces, whose detail the medium does not blur.
TEXTURED_SIDE = 1024

# Texels in the diffuse mean free path, of the middle channel. More: finer new images, longer bakes.
TEXELS_PER_PATH = 2.0

# Texels in the transport mean free path of meshes that bend, from which on density asks for no more, since light is
# smooth over that length. More: finer new images, whose bakes take longer in proportion to their texels.
TEXELS_PER_TRANSPORT = 3.0

# Texels along the longer side, at most, that are offered where a medium spreads light less than a texel.
MAX_OFFERED = 8192

# Texels below which panels name no number. Less: more digits that tell nothing.
LEAST_NAMED = 0.01

# Part of an image that a new UV map fills, about. Larger: coarser new images.
FILLED = 0.6


def spread_lengths(surface: Surface) -> list[float]:
    """Diffuse mean free path of each channel, scene units: far from where it entered, light falls to 1 / e in it.

    From diffusion theory: 1 / sqrt(3 sigma_a sigma_t') (Jensen et al. 2001, doi:10.1145/383259.383319); in a slab that
    of its slowest mode, which is 0 at 2/3 of a transport mean free path outside.
    """
    material, lengths = surface.material, []
    for path, albedo, transport in zip(material.mean_free_path, _albedo(surface), transport_paths(surface)):
        rate = 3 * (1 - albedo) / (path * transport)
        if surface.thickness:
            rate += (math.pi / (surface.thickness + 4 / 3 * transport)) ** 2
        lengths.append(1 / math.sqrt(rate))
    return lengths


def _albedo(surface: Surface) -> list[float]:
    """Albedo of each channel; that of a base color by exact totals, without the library that a bake needs."""
    if surface.base_color is None:
        return [min(albedo, MAX_ALBEDO) for albedo in surface.material.albedo]
    media = channel_media(surface.material, surface.thickness)
    return [float(exact_table(medium).albedo(color)) for color, medium in zip(surface.base_color, media)]


def spread_over_edges(surface: Surface) -> float:
    """How far light spreads over the edges at which planes meet, scene units; 0 if it crosses none.

    It is rounded to a power of sqrt(2), since it decides what stays the same while a color changes.
    """
    # Mirrors return light at edges, and slabs have none.
    if surface.edges == MIRROR or surface.thickness > 0:
        return 0.0
    return 2 ** (round(2 * math.log2(max(spread_lengths(surface)))) / 2)


def image_length(meshes: Iterable[Polygons]) -> float:
    """Length that the side of a square image has on the surface, scene units, by the areas of faces and of their UVs.

    A map that does not fit into one image, or has faces without an area, will be replaced by one that fills `FILLED`
    of the image.
    """
    area = uv_area = lost = 0.0
    images: set[int] = set()
    for polygons in meshes:
        area += float(polygons.areas.sum())
        if polygons.uvs is not None:
            uv_area += float(polygons.uv_areas.sum())
            lost += float(polygons.areas[polygons.uv_areas <= NO_UV_AREA].sum())
        images |= {0} if polygons.tiles is None else set(np.unique(polygons.tiles).tolist())
    is_kept = 0 < uv_area <= len(images) and lost <= MAX_LOST * area
    return math.sqrt(area / (uv_area if is_kept else FILLED))


def length_of(mesh: FlatMesh) -> float:
    """`image_length` of a mesh with flat parts."""
    return image_length(island.polygons for island in mesh.islands)


def lengths_of_tiles(mesh: FlatMesh) -> dict[int, float]:
    """`image_length` of each UDIM tile, by its number."""
    numbers = sorted({island.tile for island in mesh.islands})
    return {
        number: image_length(island.polygons for island in mesh.islands if island.tile == number) for number in numbers
    }


def mean_size(mesh: FlatMesh, size: tuple[int, int]) -> tuple[int, int]:
    """Width and height of the image, or of the mean UDIM tile, in a texture of this size."""
    if mesh.tiling is None:
        return size
    weights = [float(island.polygons.uv_areas.sum()) for island in mesh.islands]
    sizes = [mesh.tiling.sizes[island.tile] for island in mesh.islands]
    width, height = np.rint(np.average(sizes, axis=0, weights=weights)).astype(int).tolist()
    return width, height


def transport_paths(surface: Surface) -> list[float]:
    """Transport mean free path of each channel, scene units: light forgets its direction in it."""
    material, albedos = surface.material, _albedo(surface)
    return [
        path / (1 - albedo * forward)
        for path, albedo, forward in zip(material.mean_free_path, albedos, material.channel_anisotropy)
    ]


def side_for(length: float, surface: Surface, density: float, is_textured: bool = False, is_bent: bool = False) -> int:
    """Texels along the longer side of a new image: a power of two that shows the surface and its medium.

    Parameters
    ----------
    length : see `image_length`.
    density : texels per scene unit that a surface should have.
    is_bent : True for a mesh that bends, each texel of which takes long. Slabs let light through that never scattered,
        with sharp shadows: they keep their density.
    """
    lengths = spread_lengths(surface)
    if is_bent and not is_textured and not surface.thickness:
        density = min(density, TEXELS_PER_TRANSPORT / min(transport_paths(surface)))
    side = min(max(density * length, TEXTURED_SIDE if is_textured else MIN_SIDE), MAX_BY_DENSITY)
    if max(lengths) * MAX_SIDE >= length:  # else no image shows it
        side = max(side, min(TEXELS_PER_PATH * length / sorted(lengths)[1], MAX_SIDE))
    return _power_of_two(side)


def _power_of_two(side: float) -> int:
    return 2 ** math.ceil(math.log2(side) - 1e-3)


@dataclass(frozen=True)
class Spread:
    """Spread of light in an image.

    Attributes
    ----------
    texels : diffuse mean free path, of the channel that spreads most, in texels.
    side : texels along the longer side of the image.
    """

    texels: float
    side: int

    @classmethod
    def of(cls, length: float, surface: Surface, size: tuple[int, int]) -> Spread:
        """The spread on a surface of this `image_length` in an image of this size."""
        width, height = size
        return cls(max(spread_lengths(surface)) * math.sqrt(width * height) / length, max(size))

    @property
    def is_diffuse(self) -> bool:
        """True if light spreads less than a texel."""
        return self.texels < 1

    @property
    def is_wide(self) -> bool:
        """True if light spreads as far as the image is long."""
        return self.texels >= self.side

    @property
    def better_side(self) -> int | None:
        """Texels along the longer side of an image that shows the spread, if there can be one."""
        wanted = self.side * TEXELS_PER_PATH / self.texels
        return _power_of_two(wanted) if self.is_diffuse and wanted <= MAX_OFFERED else None

    def messages(self, name: str) -> list[Message]:
        """The note about the object `name` whose bake is a diffuse one."""
        return diffuse_notes(name, [self])


def extent(spreads: Iterable[Spread]) -> str:
    """Least to most texels over which light spreads, by two digits: "0.12 to 3.4 texels"."""
    texels = sorted(spread.texels for spread in spreads)
    # Two digits, without exponent.
    least, most = (f"{float(f'{value:.2g}'):,.10g}" for value in (texels[0], texels[-1]))
    if texels[0] < LEAST_NAMED:
        return f"at most {most} texels" if texels[-1] >= LEAST_NAMED else f"less than {LEAST_NAMED} texels"
    return f"{least if least == most else f'{least} to {most}'} texels"


def diffuse_notes(name: str, spreads: Iterable[Spread]) -> list[Message]:
    """The note about images of the object `name` in which light spreads less than a texel; none if there are none."""
    diffuse = [spread for spread in spreads if spread.is_diffuse]
    if not diffuse:
        return []
    text = f"The light inside '{name}' spreads over {extent(diffuse)}, so this is a diffuse bake."
    sides = [spread.better_side for spread in diffuse if spread.better_side is not None]
    if not sides:
        return [note(name, text, f"Even {MAX_OFFERED} texels along the longer side would hardly show more.")]
    return [note(name, text, f"Choose a Resolution of {max(sides)}, and Resize the image if there is one.")]
