"""Plots the cut through the shadow of `obstacle` along the light, beside Cycles' path tracing of the same medium:

    PYTHONPATH=build/stage build/venv/bin/python blend_examples/cut_plot.py BAKED.json cycles_edge.csv OUT.png

BAKED.json is the report of the batch that baked frames 1 (sun from the left) and 2 (from the right); the CSV is made
by cycles_slab.py. Prints how far light leaks into the shadow on either side.
"""

import csv
import json
import math
import sys
from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from beamspread import _native

# The scene, as make_scenes.py builds it; lengths in mean free paths.
PLATE_WIDTH, OBSTACLE_HEIGHT, ANGLE_DEG, SUN_STRENGTH = 100.0, 21.0, 55.0, 20.0
SHADOW_LENGTH = OBSTACLE_HEIGHT * math.tan(math.radians(ANGLE_DEG))
IRRADIANCE = SUN_STRENGTH * math.cos(math.radians(ANGLE_DEG))
# Rows that are averaged, around the middle of the obstacle, whose own ends are 20 away.
HALF_BAND = 4.0

CHANNELS = (("red, albedo 0.6", "tab:red"), ("green, albedo 0.9", "tab:green"), ("blue, albedo 0.3", "tab:blue"))
GREEN = 1


@dataclass
class Profile:
    """Luminance over irradiance (1/sr), (N, 3), against u in mean free paths, with its standard error if it has one."""

    u: np.ndarray
    value: np.ndarray
    error: np.ndarray | None = None

    def into_shadow(self, border, sign):
        """The profile over the depth of shadow behind a border: `sign` is +1 if the shadow lies at greater u."""
        depth = sign * (self.u - border)
        order = np.argsort(depth)
        return Profile(depth[order], self.value[order], None if self.error is None else self.error[order])


def read_cycles(path):
    """The profiles of cycles_slab.py: {"toward": Profile, "away": Profile}."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    result = {}
    for name in ("toward", "away"):
        chosen = [row for row in rows if row["direction"] == name]
        u, value, error = (
            [[float(row[key]) for key in keys] for row in chosen]
            for keys in (("u_mfp",), ("r", "g", "b"), ("r_se", "g_se", "b_se"))
        )
        result[name] = Profile(np.array(u)[:, 0], np.array(value), np.array(error))
    return result


def read_cut(path):
    """The baked luminance along the light, rows averaged, over the irradiance of lit places."""
    pixels, channels, _ = _native.read_exr(path)
    assert channels[:3] == ["R", "G", "B"], channels
    height, width = pixels.shape[:2]
    half_rows = round(HALF_BAND * width / PLATE_WIDTH)
    band = pixels[height // 2 - half_rows : height // 2 + half_rows, :, :3].astype(float)
    u = (np.arange(width) + 0.5) / width * PLATE_WIDTH - PLATE_WIDTH / 2
    return Profile(u, band.mean(axis=0) / IRRADIANCE)


def leak_depth(profile, fraction, channel=GREEN):
    """Depth of shadow at which luminance falls to a fraction of its value far out in the light."""
    lit = profile.value[(profile.u > -17.5) & (profile.u < -13), channel].mean()
    beyond = np.flatnonzero((profile.value[:, channel] < fraction * lit) & (profile.u > 0))
    if len(beyond) == 0:
        return math.nan
    last = beyond[0]
    (u0, u1), (y0, y1) = profile.u[last - 1 : last + 1], np.log(profile.value[last - 1 : last + 1, channel])
    return u0 + (math.log(fraction * lit) - y0) / (y1 - y0) * (u1 - u0)


def draw_cut(axis, baked, cycles, sign, title):
    """The whole cut; the sun's light travels towards `sign` u, and the obstacle stands at u = 0."""
    borders = (("toward", 0.0), ("away", sign * SHADOW_LENGTH))
    axis.axvspan(*sorted((0.0, sign * SHADOW_LENGTH)), color="0.93")
    for channel, (label, color) in enumerate(CHANNELS):
        axis.plot(baked.u, baked.value[:, channel], color=color, lw=1.6, label=label)
        for name, border in borders:
            truth = cycles[name]
            near = abs(truth.u) < 12
            u = (border + sign * truth.u)[near]
            value, error = truth.value[near, channel], truth.error[near, channel]
            axis.fill_between(u, value - 2 * error, value + 2 * error, color="k", alpha=0.25, lw=0)
            axis.plot(
                u,
                value,
                color="k",
                lw=0.8,
                ls="--",
                label="Cycles (2 standard errors)" if channel == 2 and name == "toward" else None,
            )
    axis.plot([0, 0], [0, 0.02], color="k", lw=3, solid_capstyle="butt")
    axis.annotate(
        "", (sign * -18, 0.085), (sign * -36, 0.085), arrowprops={"arrowstyle": "->", "color": "darkorange", "lw": 2}
    )
    axis.set(
        title=title,
        xlim=(-50, 50),
        ylim=(0, 0.095),
        xlabel="u (mean free paths); the obstacle stands at 0",
        ylabel="luminance / irradiance (1/sr)",
    )


def draw_leak(axis, sides, channel):
    """Both borders over the depth of shadow, logarithmic: `sides` is [(label, style, baked, cycles)]."""
    for label, style, baked, truth in sides:
        color = CHANNELS[channel][1]
        axis.semilogy(baked.u, baked.value[:, channel], color=color, ls=style, lw=1.8, label=label)
        value, error = truth.value[:, channel], truth.error[:, channel]
        low = np.maximum(value - 2 * error, 1e-7)
        axis.fill_between(truth.u, low, value + 2 * error, color="k", alpha=0.25, lw=0)
        axis.plot(
            truth.u, value, color="k", lw=0.8, ls="--", label="Cycles (2 standard errors)" if style == "-" else None
        )
    axis.axvline(0, color="0.6", lw=0.8)
    axis.set(
        xlim=(-8, 14),
        xlabel="depth into the shadow (mean free paths)",
        ylabel="luminance / irradiance (1/sr)",
        title=CHANNELS[channel][0],
    )
    axis.set_ylim(max(sides[0][2].value[:, channel].max() * 2e-3, 1e-6), sides[0][2].value[:, channel].max() * 1.6)
    axis.grid(which="both", alpha=0.2)
    axis.legend(fontsize=8, loc="lower left")


def report(sides):
    print("depth of shadow, in mean free paths, where luminance falls to a part of the lit level: baked (Cycles)")
    for channel, (name, _) in enumerate(CHANNELS):
        for label, _, baked, truth in sides:
            depths = (
                f"{part:.0%} {leak_depth(baked, part, channel):.2f} ({leak_depth(truth, part, channel):.2f})"
                for part in (0.05, 0.01)
            )
            print(f"{name}, {label}: {', '.join(depths)}")


def main():
    baked_json, cycles_csv, picture = sys.argv[1:]
    with open(baked_json, encoding="utf-8") as file:
        paths = {bake["frame"]: bake["path"] for bake in json.load(file)["bakes"]}
    cycles = read_cycles(cycles_csv)
    left, right = read_cut(paths[1]), read_cut(paths[2])
    sides = [
        ("light travels towards the shadow", "-", left.into_shadow(0.0, 1), cycles["toward"].into_shadow(0.0, 1)),
        ("light travels away from it", ":", left.into_shadow(SHADOW_LENGTH, -1), cycles["away"].into_shadow(0.0, -1)),
    ]
    figure, axes = plt.subplots(2, 2, figsize=(12, 8), layout="constrained")
    draw_cut(axes[0, 0], left, cycles, 1, "Sun at 55 degrees from the left")
    draw_cut(axes[0, 1], right, cycles, -1, "From the right")
    axes[0, 0].legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.02, 0.3))
    draw_leak(axes[1, 0], sides, GREEN)
    draw_leak(axes[1, 1], sides, 0)
    depths = [leak_depth(side[2], 0.05) for side in sides]
    figure.suptitle(
        f"Obstacle, cut along the light. Albedo 0.9 falls to 5 % of the lit level {depths[0]:.1f} mean free paths\n"
        f"into the shadow where light travels towards it, {depths[1]:.1f} where it travels away.",
        fontsize=11,
    )
    figure.savefig(picture, dpi=100)
    report(sides)


main()
