"""Fig. 1: a laser beam at 45 degrees on an acrylic plate. The paper shows a photograph, we a simulation."""

import beamspread as bs
import numpy as np

from . import paper, style

# A milky acrylic plate of 10 mm; refractive index of PMMA.
MEAN_FREE_PATH = 0.5  # mm
PLATE = bs.Medium(g=0.8, ior=1.49, thickness=20)
ALBEDO = 0.999
ANGLE = 45.0
BEAM = 0.5  # mm
TEXEL = 0.025  # mm
SIZE = 161
LEVELS = (0.5, 0.2, 0.1)
# More than a library has per angle: contours are sensitive to noise.
PHOTONS = 20_000_000


def ellipse(image, level):
    """Centre and half axes along u and v, in texels, of where the image is above `level` times its peak."""
    inside = image > level * image.max()
    v, u = np.nonzero(inside)
    # The variance along a half axis a of an ellipse is a^2 / 4.
    return u.mean() - (image.shape[1] - 1) / 2, 2 * u.std(), 2 * v.std()


def make():
    library = bs.simulate(PLATE, [ANGLE], PHOTONS)
    image = paper.laser_image(library, ANGLE, ALBEDO, SIZE, TEXEL / MEAN_FREE_PATH, BEAM / TEXEL)
    sample = bs.LdfSample(image, TEXEL, ANGLE, ALBEDO, BEAM)  # pitch in mm: only for its brightest point
    shift = sample.brightest[0]

    made, axes = style.figure(9.6, 4.3, 1, 2)
    half = SIZE * TEXEL / 2
    where = (np.arange(SIZE) + 0.5) * TEXEL - half
    for ax, shown, title, colors in (
        (axes[0, 0], style.srgb(image / image.max(), 1.0), "(a) as a camera sees it, in grey", "gray"),
        (axes[0, 1], np.log10(np.maximum(image / image.max(), 1e-3)), "(b) false colour, logarithmic", style.COLORS),
    ):
        drawn = ax.imshow(shown, extent=(-half, half, -half, half), cmap=colors)
        style.mark(ax, 0, 0, "O", (-13, -12))
        style.mark(ax, shift, 0, "H", (6, 5), "+")
        arrow = {"arrowstyle": "-|>", "color": "white", "linewidth": 1.3, "shrinkB": 6}
        ax.annotate("", (0, 0), (-0.6 * half, 0), arrowprops=arrow)
        ax.set_title(title)
        ax.set_xlabel("u (mm)")
        ax.set_ylabel("v (mm)")
    lines = ax.contour(where, where, image / image.max(), levels=sorted(LEVELS), colors="white", linewidths=0.8)
    ax.clabel(lines, [level for level in LEVELS if level < 0.5], fmt=lambda level: f"{100 * level:g} %", fontsize=8)
    bar = made.colorbar(drawn, ax=ax, label="exitance / peak", ticks=[-3, -2, -1, 0])
    bar.ax.set_yticklabels(["≤ 0.001", "0.01", "0.1", "1"])
    style.save(made, "fig1")

    rows = []
    for level in LEVELS:
        centre, a, b = (TEXEL * x for x in ellipse(image, level))
        rows.append([f"{100 * level:g} % of the peak", f"{centre:.2f} mm", f"{a:.2f} x {b:.2f} mm", f"{a / b:.2f}"])
    head = ["contour", "its centre from O, along the beam", "half axes along and across the beam", "ratio"]
    blocks = {"fig1": f"The brightest point H lies {shift:.2f} mm from O.\n\n" + style.table(head, rows)}
    measured = f"H {shift:.2f} mm along the beam; at {rows[1][0]} {rows[1][3]} times as long as wide"
    return blocks, [["Fig. 1: a slanting beam", "photograph: H moves along the beam, an ellipse", "", measured]]
