"""Plot of an LDF: false-color maps with contours, a cut along u with its error band, and the totals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator

from ..disk import whole_file
from .commands import describe

# Perceptually uniform, in print and for color-blind readers too.
COLORS = "magma"
UNIT = r"$1/\mathrm{mfp}^2$"
# Decades of a map below its brightest texel. More: more noise shows.
MAX_DECADES = 6
# Distance of the error band from the curve, in standard errors: 95 % of normally distributed values.
BAND = 2.0
# Layout, in inches.
MAP, GAP, MARGIN, BAR_MARGIN, TOP, AXIS_LABELS = 3.0, 0.45, 0.8, 1.05, 0.75, 0.85
CUT_WIDTH, CUT_HEIGHT, TABLE_WIDTH = 5.3, 2.5, 3.3
DPI = 150


@dataclass(frozen=True, eq=False)
class Maps:
    """Image and standard error of each albedo, float32 (size, size), 1/mfp^2, rows along v.

    `pitch` is the side of a texel in mean free paths, `title` names medium, beam and side.
    """

    title: str
    oblique: bool
    pitch: float
    albedos: tuple[float, ...]
    images: tuple[np.ndarray, ...]
    errors: tuple[np.ndarray, ...]

    @property
    def half_width(self) -> float:
        """Distance from O to the border, mean free paths."""
        return self.images[0].shape[0] * self.pitch / 2

    @property
    def positions(self) -> np.ndarray:
        """Centres of the texels along either axis, mean free paths."""
        size = self.images[0].shape[0]
        return (np.arange(size) + 0.5 - size / 2) * self.pitch


def default_pitch(medium, size: int) -> float:
    """Texel side for a map that spans 12 transport mean free paths, or 12 thicknesses if those are less."""
    return 12 * min(1 / (1 - medium.g), medium.thickness) / size


def read_maps(library, angle_deg: float, albedos: Sequence[float], size: int, pitch: float, side: str) -> Maps:
    """Evaluate a library's images and standard errors."""
    traveling = ", traveling towards +u" if angle_deg else ""
    return Maps(
        title=f"LDF, {side} light: {describe(library.medium)}; beam at {angle_deg:g}°{traveling}",
        oblique=angle_deg > 0,
        pitch=pitch,
        albedos=tuple(albedos),
        images=tuple(library.image(angle_deg, albedo, size, pitch, side=side) for albedo in albedos),
        errors=tuple(library.image_standard_error(angle_deg, albedo, size, pitch, side=side) for albedo in albedos),
    )


def save(figure: Figure, path: str) -> None:
    """Write the plot. If that fails, an existing file stays."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, dpi=DPI)


def draw(maps: Maps, totals: Sequence[tuple[str, ...]], notes: Sequence[str]) -> Figure:
    """Draw the plot.

    Parameters
    ----------
    totals : rows of a table, the first its head.
    notes : lines above the table.
    """
    columns = min(3, len(maps.albedos))
    lines = -(-len(maps.albedos) // columns)
    block = columns * MAP + (columns - 1) * GAP
    width = max(block, CUT_WIDTH + GAP + TABLE_WIDTH) + MARGIN + BAR_MARGIN
    height = TOP + lines * (MAP + AXIS_LABELS) + CUT_HEIGHT + AXIS_LABELS
    figure = Figure(figsize=(width, height))
    figure.text(0.5, 1 - 0.2 / height, maps.title, fontsize=12, ha="center", va="center")

    def add_axes(left: float, top: float, across: float, down: float):
        """Add axes; positions from the upper left corner and sizes in inches."""
        return figure.add_axes((left / width, 1 - (top + down) / height, across / width, down / height))

    first = MARGIN + (width - MARGIN - BAR_MARGIN - block) / 2
    norm = _shared_norm(maps.images)
    for number in range(len(maps.albedos)):
        line, column = divmod(number, columns)
        ax = add_axes(first + column * (MAP + GAP), TOP + line * (MAP + AXIS_LABELS), MAP, MAP)
        map_image = _draw_map(ax, maps, number, norm)
        ax.set_xlabel("u (mean free paths)")
        if column == 0:
            ax.set_ylabel("v (mean free paths)")
    bar = add_axes(first + block + 0.15, TOP, 0.15, lines * (MAP + AXIS_LABELS) - AXIS_LABELS)
    figure.colorbar(map_image, cax=bar, label=f"exitance per unit power ({UNIT})", extend="min")
    below = TOP + lines * (MAP + AXIS_LABELS)
    _draw_cut(add_axes(MARGIN, below, CUT_WIDTH, CUT_HEIGHT), maps, norm)
    rest = width - MARGIN - CUT_WIDTH - GAP - 0.1
    _draw_table(add_axes(MARGIN + CUT_WIDTH + GAP, below + 0.4, rest, CUT_HEIGHT - 0.4), totals, notes)
    return figure


def _shared_norm(images: Sequence[np.ndarray]) -> LogNorm:
    """Color scale from the first percentile of the texels, at most `MAX_DECADES` down, to the brightest texel."""
    brightest = max(float(image.max()) for image in images)
    if not brightest > 0:
        # No light leaves this side.
        return LogNorm(1e-6, 1.0)
    faintest = min(float(np.percentile(image[image > 0], 1)) for image in images if (image > 0).any())
    lowest = np.clip(faintest, brightest * 10.0**-MAX_DECADES, brightest / 10)
    return LogNorm(float(lowest), brightest)


def _draw_map(ax, maps: Maps, number: int, norm: LogNorm):
    image, edge = maps.images[number], maps.half_width
    # Zeros, which have no logarithm, get the color of the lowest value.
    map_image = ax.imshow(
        np.maximum(image, norm.vmin), norm=norm, cmap=COLORS, extent=(-edge, edge, -edge, edge), origin="lower"
    )
    decades = [level for level in LogLocator().tick_values(norm.vmin, norm.vmax) if norm.vmin < level < image.max()]
    if decades:
        lines = ax.contour(maps.positions, maps.positions, image, levels=decades, colors="white", linewidths=0.7)
        ax.clabel(lines, fmt=lambda level: f"$10^{{{round(np.log10(level))}}}$", fontsize=7)
    ax.plot(0, 0, "o", markersize=5, markerfacecolor="none", markeredgecolor="white", markeredgewidth=2)
    ax.plot(0, 0, "o", markersize=5, markerfacecolor="none", markeredgecolor="black", markeredgewidth=0.8)
    outline = [withStroke(linewidth=1.4, foreground="black")]
    ax.annotate("O", (0, 0), (-13, 5), textcoords="offset points", color="white", fontsize=10, path_effects=outline)
    if maps.oblique:
        arrow = {"arrowstyle": "-|>", "color": "white", "linewidth": 1.2, "shrinkB": 5}
        ax.annotate("", (0, 0), (-0.45 * edge, 0), arrowprops=arrow)
    ax.set_title(f"albedo {maps.albedos[number]:g}", fontsize=10)
    return map_image


def _draw_cut(ax, maps: Maps, norm: LogNorm) -> None:
    """Draw values and errors along v = 0: the middle row, or the mean of the two middle rows."""
    size = maps.images[0].shape[0]
    middle = slice((size - 1) // 2, size // 2 + 1)
    for number, (albedo, image, error) in enumerate(zip(maps.albedos, maps.images, maps.errors)):
        shade = f"C{number}"
        value, spread = image[middle].mean(axis=0), BAND * error[middle].mean(axis=0)
        floor = norm.vmin / 10
        ax.plot(
            maps.positions, np.where(value > 0, value, np.nan), color=shade, linewidth=1.1, label=f"albedo {albedo:g}"
        )
        low, high = np.maximum(value - spread, floor), np.maximum(value + spread, floor)
        ax.fill_between(maps.positions, low, high, color=shade, alpha=0.3, linewidth=0)
    ax.set_yscale("log")
    ax.set_ylim(norm.vmin / 3, norm.vmax * 2)
    ax.set_xlim(-maps.half_width, maps.half_width)
    ax.axvline(0, color="0.6", linewidth=0.7, linestyle=":")
    ax.set_xlabel("u (mean free paths)")
    ax.set_ylabel(f"exitance ({UNIT})")
    ax.set_title(f"Cut along u through O; bands: ± {BAND:g} standard errors", fontsize=10)
    ax.grid(alpha=0.25)
    ax.legend(fontsize=8, framealpha=0.8)


def _draw_table(ax, totals: Sequence[tuple[str, ...]], notes: Sequence[str]) -> None:
    ax.set_axis_off()
    ax.set_title("\n".join(["Totals, per unit power that arrives", *notes]), fontsize=9.5, linespacing=1.4)
    head = [cell.replace("+-", "±") for cell in totals[0]]
    table = ax.table(cellText=totals[1:], colLabels=head, loc="upper center", cellLoc="right", edges="horizontal")
    table.auto_set_font_size(False)
    table.set_fontsize(8.5)
    table.auto_set_column_width(range(len(head)))
    table.scale(1, 1.5)
