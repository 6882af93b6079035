"""How all figures look."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

PICTURES = Path(__file__).resolve().parent.parent / "pictures"
COLORS = "magma"  # perceptually even, also in print and for colour-blind readers
ERRORS = "viridis"
OUTLINE = [withStroke(linewidth=1.6, foreground="black")]
DPI = 110

mpl.rcParams.update({
    "font.size": 9,
    "axes.titlesize": 10,
    "figure.titlesize": 11,
    "axes.titlepad": 6,
    "image.origin": "lower",
    "image.interpolation": "nearest",
    "savefig.dpi": DPI,
})  # fmt: skip


def figure(width, height, rows=1, columns=1, **options):
    """Figure and array of its axes; sizes in inches."""
    made = Figure(figsize=(width, height), layout="constrained")
    return made, made.subplots(rows, columns, squeeze=False, **options)


def save(made, name):
    PICTURES.mkdir(parents=True, exist_ok=True)
    made.savefig(PICTURES / f"{name}.png")


def srgb(luminance, exposure):
    """Linear light to values of a screen (IEC 61966-2-1); `exposure` x luminance = 1 is the brightest that it can."""
    x = np.clip(np.asarray(luminance, float) * exposure, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def extent(shape, unit=1.0):
    """Coordinates of an image whose centre is the origin."""
    height, width = shape[:2]
    return (-width / 2 * unit, width / 2 * unit, -height / 2 * unit, height / 2 * unit)


def bare(ax):
    ax.set_xticks([])
    ax.set_yticks([])


def mark(ax, x, y, name, offset, marker="o"):
    """A small ring or cross with a name."""
    ax.plot(x, y, marker, markersize=6, markerfacecolor="none", markeredgecolor="black", markeredgewidth=2.4)
    ax.plot(x, y, marker, markersize=6, markerfacecolor="none", markeredgecolor="white", markeredgewidth=1.1)
    ax.annotate(name, (x, y), offset, textcoords="offset points", color="white", path_effects=OUTLINE)


def scale_bar(ax, length, label, color="white"):
    """Along the lower border of an image."""
    left, right = ax.get_xlim()
    low, high = ax.get_ylim()
    x, y = left + 0.05 * (right - left), low + 0.06 * (high - low)
    ax.plot([x, x + length], [y, y], color=color, linewidth=2.5, solid_capstyle="butt", path_effects=OUTLINE)
    ax.annotate(label, (x + length / 2, y), (0, 4), textcoords="offset points", ha="center", color=color,
                path_effects=OUTLINE, fontsize=8)  # fmt: skip


def table(head, rows):
    """Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
