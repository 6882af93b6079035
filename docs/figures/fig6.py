"""Fig. 6: LDFs between samples at 0 and 30 degrees, and how far from the truth they are."""

import beamspread as bs
import numpy as np

from . import paper, style

ALBEDO = 0.999
ENDS = (0.0, 30.0)
SHOWN = (0.0, 6.0, 12.0, 18.0, 24.0, 30.0)
BETWEEN = 15.0
METHODS = ("planar", "angular", "adaptive")
ZOOM = 12.0  # units around O
SCALE = 2.0  # % of the peak, the paper's

# Values that the paper does not state: length of a unit in mean free paths, diameter of the beam in units, its profile.
VARIANTS = (
    (1.0, 40, "Gaussian"),
    (1.0, 24, "Gaussian"),
    (1.0, 12, "Gaussian"),
    (0.5, 40, "Gaussian"),
    (0.2, 40, "Gaussian"),
    (0.1, 40, "Gaussian"),
    (2.0, 40, "disk"),
    (1.0, 40, "disk"),
    (1.0, 20, "disk"),
    (0.5, 20, "disk"),
    (0.2, 20, "disk"),
    (1.0, 1, "disk"),
    (0.2, 1, "disk"),
)


def sample(library, angle, unit, diameter, profile, size=paper.WINDOW):
    if profile == "Gaussian":
        return paper.laser_sample(library, angle, ALBEDO, size, unit, diameter)
    return bs.LdfSample.from_library(library, angle, ALBEDO, size, unit, diameter * unit)


def errors(library, unit=paper.UNIT, diameter=paper.LASER_DIAMETER, profile="Gaussian", size=paper.WINDOW):
    """At 15 degrees, per method: the interpolated image's difference from the exact one, in % of the peak.

    Also returns the exact sample and that at 30 degrees.
    """
    ends = [sample(library, angle, unit, diameter, profile, size) for angle in ENDS]
    exact = sample(library, BETWEEN, unit, diameter, profile, size)
    found = {}
    for method in METHODS:
        image = bs.interpolate(ends, BETWEEN, ALBEDO, method=method).image
        found[method] = 100 * (image - exact.image) / exact.image.max()
    return found, exact, ends[1]


def draw_row(library):
    """(a): six angles, the inner four from samples at both ends; below, the middle."""
    ends = [paper.laser_sample(library, angle, ALBEDO) for angle in ENDS]
    made, axes = style.figure(11, 4.1, 2, len(SHOWN))
    half = paper.WINDOW / 2
    where = np.arange(paper.WINDOW) + 0.5 - half
    for (ax, near), angle in zip(axes.T, SHOWN):
        between = bs.interpolate(ends, angle, ALBEDO, method="angular")
        relative = between.image / between.image.max()
        options = {"extent": style.extent(relative.shape), "cmap": style.COLORS}
        drawn = ax.imshow(np.log10(relative), vmin=-3, vmax=0, **options)
        ax.contour(where, where, relative, levels=[0.01, 0.1, 0.5], colors="white", linewidths=0.6)
        ax.set_title(f"{angle:g}°" + (" (sample)" if angle in ENDS else ""))
        linear = near.imshow(relative, vmin=0.6, vmax=1, **options)
        near.contour(where, where, relative, levels=[0.7, 0.8, 0.9, 0.97], colors="black", linewidths=0.6)
        style.mark(near, 0, 0, "O", (-14, 4))
        if angle:
            style.mark(near, between.brightest[0] / paper.UNIT, 0, "H", (6, 4), "+")
        near.set(xlim=(-ZOOM, ZOOM), ylim=(-ZOOM, ZOOM))
        style.bare(ax)
        style.bare(near)
    style.scale_bar(axes[0, 0], 50, "50 units")
    style.scale_bar(axes[1, 0], 5, "5 units")
    bar = made.colorbar(drawn, ax=axes[0, -1], label="exitance / peak", ticks=[-3, -2, -1, 0])
    bar.ax.set_yticklabels(["0.001", "0.01", "0.1", "1"])
    made.colorbar(linear, ax=axes[1, -1], label="exitance / peak", extend="min")
    style.save(made, "fig6a")


def draw_errors(library):
    """(b): 15 degrees by every method, and the error of each."""
    found, exact, _ = errors(library)
    peak = exact.image.max()
    where = np.arange(paper.WINDOW) + 0.5 - paper.WINDOW / 2
    made, axes = style.figure(10, 5.2, 2, 4)
    for column, name in enumerate(("exact", *METHODS)):
        error = found.get(name, 0 * exact.image)
        relative = exact.image / peak + error / 100
        ax = axes[0, column]
        drawn = ax.imshow(np.log10(relative), extent=style.extent(relative.shape), cmap=style.COLORS, vmin=-3, vmax=0)
        ax.contour(where, where, relative, levels=[0.01, 0.1, 0.5, 0.9], colors="white", linewidths=0.6)
        ax.set_title(name)
        style.bare(ax)
        below = axes[1, column]
        if name == "exact":
            below.set_axis_off()
            text = f"difference from the exact LDF,\n% of its peak, on the\npaper's scale of 0 to {SCALE:g} %"
            below.text(1, 0.5, text, transform=below.transAxes, ha="right", va="center")
            continue
        shown = below.imshow(np.abs(error), extent=style.extent(error.shape), cmap=style.ERRORS, vmin=0, vmax=SCALE)
        below.set_title(f"worst {np.abs(error).max():.2f} %, mean {np.abs(error).mean():.2f} %")
        style.bare(below)
    style.scale_bar(axes[0, 0], 50, "50 units")
    bar = made.colorbar(drawn, ax=axes[0, -1], label="exitance / peak", ticks=[-3, -2, -1, 0])
    bar.ax.set_yticklabels(["0.001", "0.01", "0.1", "1"])
    made.colorbar(shown, ax=axes[1, -1], label="% of the peak", extend="max")
    style.save(made, "fig6b")
    return {method: np.abs(error) for method, error in found.items()}


def dependence():
    """The same for other lengths of a unit and other beams."""
    rows = []
    for unit, diameter, profile in VARIANTS:
        library = bs.library(bs.Medium(g=0.8, ior=1.0, thickness=750 * unit))
        found, exact, farthest = errors(library, unit, diameter, profile)
        middle = exact.image[exact.image.shape[0] // 2]
        rows.append([
            f"{1 / unit:g}",
            f"{profile}, {diameter}",
            f"{farthest.brightest[0] / unit:.1f}",
            f"{100 * middle[-1] / exact.image.max():.2g} %",
            *(f"{np.abs(found[m]).max():.2f} ({(np.abs(found[m]) <= SCALE).mean() * 100:.1f})" for m in METHODS),
        ])  # fmt: skip
    head = ["mean free path (units)", "beam, diameter (units)", "H at 30° (units)", "border / peak", *METHODS]
    return style.table(head, rows)


def make():
    library = bs.library(paper.SLAB)
    draw_row(library)
    found = draw_errors(library)
    rows = [[m, f"{e.max():.2f} %", f"{np.quantile(e, 0.99):.2f} %", f"{e.mean():.2f} %"] for m, e in found.items()]
    head = ["at 15°, of the peak", "worst texel", "99 of 100 texels below", "mean"]
    worst = {method: f"{error.max():.2f} %" for method, error in found.items()}
    summary = [
        "Fig. 6: 15° from 0° and 30°, worst texel, of the peak",
        f"on a scale of 0 to {SCALE:g} %",
        f"{worst['angular']} (`planar`: {worst['planar']})",
        f"the library is the truth; `adaptive`: {worst['adaptive']}",
    ]
    return {"fig6": style.table(head, rows), "fig6-dependence": dependence()}, [summary]
