"""Fig. 8 and 9: a round obstacle in slanting light, by equal beams and by beams as large as the lit squares."""

import time

import beamspread as bs
import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.colors import LogNorm
from matplotlib.patches import Circle, Rectangle

from . import paper, style

SIZE = 240  # units
ANGLE = 55.0
# A cylinder that stands in the middle. With its shadow it leaves the paper's 45600 texels lit.
RADIUS = 45.0
HEIGHT = 43.8
AZIMUTHS = {"left": 0.0, "right": 180.0}  # where light comes from, and where it travels
DEPTH = 10.0  # units
TOLERANCE = 1e-2


def lit(azimuth, size=SIZE):
    """The mask: 1 where the sun sees the centre of a texel."""
    scale = size / SIZE
    where = (np.arange(size) + 0.5 - size / 2) / scale
    x, y = np.meshgrid(where, where)
    along = x if azimuth == 0 else -x
    # The shadow is the base, swept along the light as far as the shadow of the upper end.
    nearest = np.clip(along, 0, HEIGHT * np.tan(np.radians(ANGLE)))
    return (np.hypot(along - nearest, y) > RADIUS).astype(np.float32)


def texels(mask):
    """One beam per lit texel, like adaptive_beams."""
    row, column = np.nonzero(mask)
    return np.rec.fromarrays([row, column, np.ones_like(row), mask[row, column]], names="row,column,size,power")


def exactly(ldf, mask, azimuth, albedos, **solver):
    return bs.convolve(mask, paper.travel(ANGLE, azimuth), ldf, albedos, 1 / paper.UNIT, 1.0, **solver)


def timed(job):
    """Result of a function, and its CPU seconds on all cores, the best of three."""
    seconds = []
    for _ in range(3):
        begin = time.process_time()
        result = job()
        seconds.append(time.process_time() - begin)
    return result, min(seconds)


def draw_obstacle(ax, azimuth, color="white"):
    ax.add_patch(Circle((0, 0), RADIUS, fill=False, color=color, linewidth=0.8, linestyle="--"))
    sign = 1 if azimuth == 0 else -1
    arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 1.4}
    ax.annotate("", (-sign * 60, 95), (-sign * 108, 95), arrowprops=arrow)


def into_shadow(picture):
    """Green light DEPTH inside the shadow where light travels into it and out of it, of the brightest."""
    row = picture[SIZE // 2, :, 1]
    end = SIZE / 2 + HEIGHT * np.tan(np.radians(ANGLE)) + RADIUS
    into, out = row[int(SIZE / 2 - RADIUS + DEPTH)], row[int(end - DEPTH)]
    return f"{100 * into / row.max():.1f} %, {100 * out / row.max():.1f} %"


def draw_pictures(library):
    """Fig. 8; returns the light in the shadow of (a), too, by the paper's method and exactly."""
    masks = {side: lit(azimuth) for side, azimuth in AZIMUTHS.items()}
    cases = [(side, albedos) for albedos in (paper.ALBEDO_RGB, paper.ALBEDO_RGB_SWAPPED) for side in AZIMUTHS]
    methods = {
        "the paper's method": lambda mask, *rest: paper.convolve(library, texels(mask), ANGLE, *rest, mask.shape),
        "exact": lambda mask, *rest: exactly(library, mask, *rest),
    }
    made, axes = style.figure(12.6, 5.6, 2, 5)
    for ax, side in zip(axes[:, 0], AZIMUTHS):
        ax.imshow(masks[side], extent=style.extent(masks[side].shape), cmap="gray")
        draw_obstacle(ax, AZIMUTHS[side], "tab:red")
        ax.set_title(f"mask, light from the {side}")
        style.bare(ax)
    leaks = []
    for row, (name, method) in zip(axes[:, 1:], methods.items()):
        exposure = leak = None
        for ax, letter, (side, albedos) in zip(row, "abcd", cases):
            picture = method(masks[side], AZIMUTHS[side], albedos)
            exposure = exposure or 0.9 / picture.max()
            leak = leak or into_shadow(picture)
            ax.imshow(style.srgb(picture, exposure), extent=style.extent(picture.shape))
            draw_obstacle(ax, AZIMUTHS[side])
            ax.set_title(f"({letter}) {name}")
            style.bare(ax)
        row[0].set_ylabel(f"exposure {exposure:.3g}")
        leaks.append(leak)
    style.scale_bar(axes[0, 1], 50, "50 units")
    style.save(made, "fig8")
    return leaks


def compare(library, mask):
    """Picture (a) and its seconds by equal and adaptive beams, by the paper's method and exactly (there by FFT too).

    Returns {"paper": [...], "samples": [...], "exact": [...]} and the squares. "paper" adds up a window per beam, and
    its LDFs, which are cached, don't count; "samples" gives them to our solvers.
    """
    azimuth, albedos = AZIMUTHS["left"], paper.ALBEDO_RGB
    squares = bs.adaptive_beams(mask, paper.travel(ANGLE, azimuth), tolerance=TOLERANCE)

    samples = paper.square_samples(library, 1)

    def by_paper(beams):
        return timed(lambda: paper.convolve(library, beams, ANGLE, azimuth, albedos, mask.shape))

    def by(solver, ldf):
        return timed(lambda: exactly(ldf, mask, azimuth, albedos, solver=solver, tolerance=TOLERANCE))

    found = {
        "paper": [by_paper(texels(mask)), by_paper(squares)],
        "samples": [by("direct", samples), by("adaptive", samples)],
        "exact": [by("direct", library), by("adaptive", library), by("fft", library)],
    }
    return found, squares


def difference(pair):
    """Sum of absolute differences over the sum, and the worst texel over the brightest."""
    (equal, _), (adaptive, _) = pair[:2]
    error = np.abs(adaptive - equal)
    return error.sum() / equal.sum(), error.max() / equal.max()


def draw_squares(ax, squares):
    patches = [Rectangle((c - SIZE / 2, r - SIZE / 2), s, s) for r, c, s, _ in squares.tolist()]
    drawn = PatchCollection(patches, edgecolor="black", linewidth=0.3, cmap="YlGnBu_r", norm=LogNorm(0.8, 90))
    drawn.set_array(squares["size"])
    ax.add_collection(drawn)
    ax.set(xlim=(-SIZE / 2, SIZE / 2), ylim=(-SIZE / 2, SIZE / 2), aspect="equal", facecolor="black")
    style.bare(ax)


def make():
    library = bs.library(paper.SLAB)
    leaks = draw_pictures(library)
    mask = lit(0.0)
    found, squares = compare(library, mask)
    made, axes = style.figure(11.2, 7.2, 2, 3)
    for ax in axes[:, 0]:
        draw_squares(ax, squares)
    axes[0, 0].set_title(f"{len(squares)} squares instead of {int(mask.sum())}")
    axes[1, 0].set_title("their border")
    axes[1, 0].set(xlim=(70, 115), ylim=(15, 60))
    for row, (name, title) in enumerate((("paper", "the paper's method"), ("exact", "exact"))):
        (equal, _), (adaptive, _) = found[name][:2]
        exposure = 0.9 / equal.max()
        axes[row, 1].imshow(style.srgb(adaptive, exposure), extent=style.extent(mask.shape))
        axes[row, 1].set_title(f"{title}; exposure {exposure:.3g}")
        error = 100 * np.abs(adaptive - equal).max(axis=2) / equal.max()
        shown = axes[row, 2].imshow(error, extent=style.extent(mask.shape), cmap=style.ERRORS)
        axes[row, 2].set_title("difference from equal beams")
        made.colorbar(shown, ax=axes[row, 2], label="% of the brightest texel")
        for ax in axes[row, 1:]:
            style.bare(ax)
    style.save(made, "fig9")

    counts, rows, brief = (int(mask.sum()), len(squares)), [], []
    for name, label in (
        ("paper", "ours by its method"),
        ("samples", "its samples in our solvers"),
        ("exact", "ours exact"),
    ):
        pair = found[name]
        seconds = [spent for _, spent in pair]
        total, worst = difference(pair)
        ratio = f"{seconds[0] / seconds[1]:.0f}"
        rows.append([label, *counts, f"{seconds[0]:.2g} s", f"{seconds[1]:.2g} s", ratio,
                     f"{100 * total:.2g} %, {100 * worst:.2g} %"])  # fmt: skip
        if name != "samples":
            brief.append(f"{counts[0]} in {rows[-1][3]}, {counts[1]} in {rows[-1][4]}: {ratio} times")
    published = ["paper", 45600, 4107, "387.607 s", "55.875 s", "6.9", "almost the same"]
    head = ["", "equal", "adaptive", "time, equal", "time, adaptive", "ratio", "difference: sum, worst texel"]
    summary = [
        [f"Fig. 8 (a): green {DEPTH:g} units inside the shadow, light travelling in and out", "", *leaks],
        ["Fig. 9: equal and adaptive beams", "45600 in 387.607 s, 4107 in 55.875 s: 6.9 times", *brief],
    ]
    fft = f"`fft`, which knows no beams, takes {found['exact'][2][1]:.2g} s."
    return {"fig9": style.table(head, [published, *rows]) + "\n\n" + fft}, summary
