"""Facts about images with UDIM tiles. Each tile has a file, NAME.<UDIM>.exr."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ...core.errors import ImageError
from .facts import file_of

TOKEN = "<UDIM>"
"""Part of a path that stands for the number of the tile."""


def is_tiled(image) -> bool:
    """True if the image has UDIM tiles."""
    return image is not None and image.source == "TILED"


def file_of_tile(path: Path, number: int) -> Path:
    """File of a tile, by the path with the token."""
    return path.with_name(path.name.replace(TOKEN, str(number)))


def tiles_path(path: Path) -> Path:
    """Path with the token for the tiles of a result that has this path as one image."""
    return path.with_name(f"{path.stem}.{TOKEN}{path.suffix}")


def tile_sizes(image) -> dict[int, tuple[int, int]]:
    """Width and height of each tile that has pixels, by its number."""
    return {tile.number: tuple(tile.size) for tile in image.tiles if 0 not in tile.size}


def planned_sizes(image, numbers: Iterable[int] = ()) -> dict[int, tuple[int, int]]:
    """Sizes of the tiles of an image that was never saved, and of more tiles."""
    numbers = sorted({*numbers, *(tile.number for tile in image.tiles)})
    return dict.fromkeys(numbers, (image.generated_width, image.generated_height)) | tile_sizes(image)


def files_of(image) -> list[Path]:
    """Files of all tiles; none if the image was never saved."""
    path = file_of(image)
    return [] if path is None else [file_of_tile(path, tile.number) for tile in image.tiles]


def missing_files(image) -> list[Path]:
    """Files of tiles that have neither a file nor pixels."""
    path, sizes = file_of(image), tile_sizes(image)
    lost = [tile.number for tile in image.tiles if tile.number not in sizes]
    return [] if path is None else [file_of_tile(path, number) for number in lost]


def check_tiles(image) -> None:
    """Raise ImageError if no bake could be stored in the tiles of an image."""
    name, path = f"The image '{image.name}'", file_of(image)
    if image.packed_file is not None:
        raise ImageError(
            f"{name} has packed UDIM tiles, which cannot be baked.", "Unpack it (File > External Data > Unpack)."
        )
    if (path is None and image.is_dirty) or (path is not None and TOKEN not in path.name):
        raise ImageError(
            f"{name} has UDIM tiles that were never saved.", f"Save it with {TOKEN} in its name (Image > Save As)."
        )
    lost = missing_files(image)
    if lost:
        raise ImageError(f"{name} has lost its file {lost[0]}.", "Restore it, or remove the tile.")


def sizes_for(image, numbers: Iterable[int], name: str) -> dict[int, tuple[int, int]]:
    """Sizes of the tiles that an object uses; raises ImageError that names those which the image lacks.

    The bake makes files for a new image without any, and then missing tiles, too.
    """
    sizes = tile_sizes(image) if file_of(image) is not None else planned_sizes(image, numbers)
    missing = [str(number) for number in numbers if number not in sizes]
    if missing:
        tiles = f"tile{'s' if len(missing) > 1 else ''} {', '.join(missing)}"
        raise ImageError(
            f"The image '{image.name}' lacks the UDIM {tiles}, which the UV map of '{name}' uses.",
            "Add and save them in the Image Editor (UDIM Tiles > Add), or clear the image in the node and let the bake "
            "make one (New Images > UDIM Tiles).",
        )
    return {number: sizes[number] for number in numbers}
