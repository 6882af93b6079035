"""Fig. 3 and 4: the angular space, and an LDF in both spaces."""

import beamspread as bs
import numpy as np
from matplotlib.patches import Arc

from . import fig7, paper, style

ANGLE = 45.0
ALBEDO = 0.999
HEIGHT = 100.0  # of Q, units
# (b) looks farther than the paper's window.
SIZE = 401  # units


def draw_angles():
    """Fig. 3 as a section and a plan; not to scale."""
    made, axes = style.figure(8.4, 3.4, 1, 2, width_ratios=[1.1, 1])
    side, top = axes[0]
    o, h, p, q = (-1.0, 0.0), (-0.3, 0.0), (1.5, 0.0), (-0.3, 1.8)
    side.axhspan(-0.5, 0, color="#ffe3b8")
    side.plot([-2.2, 2.4], [0, 0], color="black", linewidth=1)
    side.annotate(
        "", o, (-2.1, 1.1), arrowprops={"arrowstyle": "-|>", "color": "tab:red", "linewidth": 1.8, "shrinkB": 0}
    )
    side.text(-2.15, 1.2, "beam", color="tab:red")
    side.plot([h[0], q[0], p[0]], [h[1], q[1], p[1]], color="tab:blue", linewidth=1.2)
    side.add_patch(Arc(q, 0.9, 0.9, theta1=270, theta2=315, color="tab:blue"))
    side.text(q[0] + 0.12, q[1] - 0.72, "ψ", color="tab:blue", fontsize=12)
    side.text(h[0] - 0.42, 0.85, "height", color="tab:blue", rotation=90, va="center")
    for at, name, dx, dy in ((o, "O", -0.08, -0.3), (h, "H", -0.08, -0.3), (p, "P", -0.08, -0.3), (q, "Q", 0.12, 0.05)):
        side.plot(*at, "o", color="black", markersize=4, zorder=3)
        side.text(at[0] + dx, at[1] + dy, name, fontsize=11)
    side.set(xlim=(-2.3, 2.5), ylim=(-0.5, 2.2), aspect="equal", title="from the side")
    hh, pp = np.array([0.35, 0.0]), np.array([1.5, 1.0])
    for radius in (0.7, 1.1, 1.55):
        top.add_patch(Arc(hh, 2.4 * radius, 2 * radius, color="0.75"))
    top.annotate("", (2.4, 0), (-1.6, 0), arrowprops={"arrowstyle": "-|>", "color": "tab:red", "linewidth": 1})
    top.text(2.25, -0.28, "u", color="tab:red")
    top.plot([hh[0], pp[0]], [hh[1], pp[1]], color="tab:blue", linewidth=1.2)
    top.add_patch(Arc(hh, 1.1, 1.1, theta1=0, theta2=41, color="tab:blue"))
    top.text(hh[0] + 0.65, 0.16, "φ", color="tab:blue", fontsize=12)
    for at, name in (((-0.35, 0), "O"), (hh, "H"), (pp, "P")):
        top.plot(*at, "o", color="black", markersize=4, zorder=3)
        top.text(at[0] - 0.07, at[1] - 0.33 if name != "P" else at[1] + 0.12, name, fontsize=11)
    top.set(xlim=(-1.8, 2.6), ylim=(-1.7, 1.7), aspect="equal", title="from above")
    for ax in (side, top):
        ax.set_axis_off()
    style.save(made, "fig3")


def resampled(sample, space, phi, psi):
    """Exitance at directions of angular space, by the nearest texel; nan outside of the image."""
    u, v = space.to_planar(phi, psi)
    rows, columns = sample.image.shape
    column = np.floor(u / sample.pitch + columns / 2).astype(int)
    row = np.floor(v / sample.pitch + rows / 2).astype(int)
    seen = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    return np.where(seen, sample.image[row.clip(0, rows - 1), column.clip(0, columns - 1)], np.nan)


def make():
    draw_angles()
    # The same numbers as in Fig. 7.
    image = paper.laser_image(bs.library(fig7.SLAB), ANGLE, ALBEDO, SIZE, fig7.UNIT, fig7.DIAMETER)
    sample = bs.LdfSample(image * fig7.UNIT**2, 1.0, ANGLE, ALBEDO, fig7.DIAMETER)  # lengths in units
    space = bs.AngularSpace((0, 0), sample.brightest, HEIGHT)
    phi, psi = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.radians(np.linspace(0, 60, 241)))
    angular = resampled(sample, space, phi, psi)
    peak = sample.image.max()

    made, axes = style.figure(10, 3.9, 1, 2, width_ratios=[1, 1.35])
    plane, ax = axes[0]
    options = {"cmap": style.COLORS, "vmin": -3, "vmax": 0}
    half = SIZE / 2
    plane.imshow(np.log10(np.maximum(sample.image / peak, 1e-9)), extent=(-half, half, -half, half), **options)
    window = paper.WINDOW / 2
    plane.plot(
        [-window, window, window, -window, -window], [-window, -window, window, window, -window], "w--", linewidth=0.9
    )
    where = np.arange(SIZE) + 0.5 - half
    levels = [1e-2, 3e-2, 1e-1, 0.3, 0.7]
    plane.contour(where, where, sample.image / peak, levels=levels, colors="white", linewidths=0.7)
    style.mark(plane, 0, 0, "O", (-14, -13))
    style.mark(plane, *sample.brightest, "H", (7, 5), "+")
    plane.set(xlabel="u (units)", ylabel="v (units)", title="(a) the plane")

    drawn = ax.imshow(np.log10(np.maximum(angular / peak, 1e-9)), extent=(0, 2, 0, 60), aspect="auto", **options)
    ax.contour(phi / np.pi, np.degrees(psi), angular / peak, levels=levels, colors="white", linewidths=0.7)
    # The paper's window around O, as seen from Q.
    t = np.linspace(-window, window, 200)
    side = np.full_like(t, window)
    for u, v in ((t, side), (t, -side), (side, t), (-side, t)):
        at_phi, at_psi = space.to_angular(u, v)
        order = np.argsort(at_phi)
        gaps = np.where(np.diff(at_phi[order]) > 1, np.nan, 0)
        ax.plot(at_phi[order] / np.pi, np.degrees(at_psi[order]) + np.append(gaps, 0), "w--", linewidth=0.9)
    ax.set(xlabel="φ (π)", ylabel="ψ (degrees)", title=f"(b) angular space, Q {HEIGHT:g} units above H")
    bar = made.colorbar(drawn, ax=ax, label="exitance / peak", ticks=[-3, -2, -1, 0])
    bar.ax.set_yticklabels(["0.001", "0.01", "0.1", "1"])
    style.save(made, "fig4")
    return {}, []
