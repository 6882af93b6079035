"""Fig. 7: seven coloured beams, by samples at 0 and 60 degrees and albedos .2 and .999, and exactly."""

from itertools import product

import beamspread as bs
import numpy as np

from . import paper, style

# A mean free path of 5 units and narrow beams: so their shift can be seen.
UNIT = 0.2  # mean free paths
SLAB = bs.Medium(g=0.8, ior=1.0, thickness=750 * UNIT)
DIAMETER = 20.0  # of the beams, units
SIZE = 420  # of the picture, units
RADIUS = 120  # of the ring of beams, units
WIDE_WINDOW = 900
CENTRE = ("white", (1, 1, 1), 0.0)
# Anticlockwise from the right, each travelling away from the centre; the paper says which colours and angles there are.
RING = (
    ("red", (1, 0, 0), 45.0),
    ("magenta", (1, 0, 1), 55.0),
    ("blue", (0, 0, 1), 45.0),
    ("cyan", (0, 1, 1), 55.0),
    ("green", (0, 1, 0), 45.0),
    ("yellow", (1, 1, 0), 55.0),
)


def beams():
    """(colour, angle, azimuth, x, y) of each; lengths from the middle of the picture."""
    yield CENTRE[1], CENTRE[2], 0.0, 0.0, 0.0
    for i, (_, color, angle) in enumerate(RING):
        azimuth = 60.0 * i
        beta = np.radians(azimuth)
        yield color, angle, azimuth, round(RADIUS * np.cos(beta)), round(RADIUS * np.sin(beta))


def by_samples(library, window, blind=False):
    """Luminance under beams of power 1 per channel; `blind`: every beam spreads as if it came from above."""
    samples = [paper.laser_sample(library, *at, window, UNIT, DIAMETER) for at in product(paper.ANGLES, paper.ALBEDOS)]
    luminance = np.zeros((SIZE, SIZE, 3), np.float32)
    for color, angle, azimuth, x, y in beams():
        for channel, albedo in enumerate(paper.ALBEDO_RGB):
            if color[channel]:
                image = bs.interpolate(samples, 0.0 if blind else angle, albedo, method="angular").image
                image = paper.turned(image, 0.0 if blind else azimuth)
                paper.stamp(luminance[..., channel], image, SIZE / 2 + y, SIZE / 2 + x, UNIT**2)
    return luminance


def exactly(library):
    where = np.arange(SIZE) + 0.5 - SIZE / 2
    x, y = np.meshgrid(where, where)
    luminance = np.zeros((SIZE, SIZE, 3), np.float32)
    for color, angle, azimuth, at_x, at_y in beams():
        light = np.exp(-8 * ((x - at_x) ** 2 + (y - at_y) ** 2) / DIAMETER**2)
        light = light[..., None] / light.sum() * color
        luminance += bs.convolve(light, paper.travel(angle, azimuth), library, paper.ALBEDO_RGB, 1 / UNIT, 1.0)
    return luminance


def draw(ax, picture, exposure, title):
    ax.imshow(style.srgb(picture, exposure), extent=style.extent(picture.shape))
    for *_, x, y in beams():
        ax.plot(x, y, "+", color="black", markersize=5, markeredgewidth=0.8)
    ax.set_title(f"{title}; exposure {exposure:.2g}")
    style.bare(ax)


def make():
    library = bs.library(SLAB)
    blind = by_samples(library, paper.WINDOW, blind=True)
    published = by_samples(library, paper.WINDOW)
    wide = by_samples(library, WIDE_WINDOW)
    exact = exactly(library)
    made, axes = style.figure(9.2, 9.6, 2, 2)
    # The brightest texel is four times as bright as the screen, to show light that scatters far.
    exposure = 4 / blind.max()
    draw(axes[0, 0], blind, exposure, "(a) blind to direction")
    draw(axes[0, 1], published, exposure, "(b) the paper's method")
    draw(axes[1, 0], wide, exposure, f"(b) with a window of {WIDE_WINDOW} units")
    draw(axes[1, 1], exact, 4 / exact.max(), "exact")
    for _, angle, azimuth, x, y in beams():
        if angle:
            beta = np.radians(azimuth)
            arrow = {"arrowstyle": "-|>", "color": "0.75", "linewidth": 1}
            tail, head = (np.array([np.cos(beta), np.sin(beta)]) * r for r in (38, 58))
            axes[1, 1].annotate("", (x + head[0], y + head[1]), (x + tail[0], y + tail[1]), arrowprops=arrow)
            axes[1, 1].text(
                x + 1.28 * head[0], y + 1.28 * head[1], f"{angle:g}°", color="0.75", ha="center", va="center"
            )
    style.scale_bar(axes[0, 0], 100, "100 units")
    style.save(made, "fig7")
    border = [
        f"{100 * picture[SIZE // 2 + 74, SIZE // 2].max() / picture.max():.1f} %" for picture in (published, exact)
    ]
    row = ["Fig. 7 (b): white beam at the window's border, of the peak", "visible", *border]
    return {}, [row]
