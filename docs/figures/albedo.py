"""Effect of weights that are linear in the albedo: samples at .2 and .999, everything between them interpolated."""

import beamspread as bs
import numpy as np

from . import paper, style

ALBEDO = 0.6  # of the red channel of Fig. 7
METHODS = ("angular", "adaptive")
PITCH = 1.0  # mean free paths
SIZE = 151


def ends(library):
    return [bs.LdfSample.from_library(library, 0.0, albedo, SIZE, PITCH) for albedo in paper.ALBEDOS]


def make():
    library = bs.library(paper.SLAB)
    samples = ends(library)
    low, high = paper.ALBEDOS
    albedos = np.unique(np.concatenate([np.linspace(low, 0.9, 36), 1 - np.geomspace(0.1, 1 - high, 12), [ALBEDO]]))
    exact = [bs.LdfSample.from_library(library, 0.0, a, SIZE, PITCH) for a in albedos]
    made, (axes,) = style.figure(10, 3.7, 1, 2)
    looks = {"exact": ("black", "-"), "angular": ("tab:red", "--"), "adaptive": ("tab:blue", "-.")}
    where = (np.arange(SIZE) - SIZE // 2) * PITCH
    powers = {"exact": np.array([sample.power for sample in exact])}
    rows = {"exact": bs.LdfSample.from_library(library, 0.0, ALBEDO, SIZE, PITCH).image[SIZE // 2]}
    for method in METHODS:
        powers[method] = np.array([bs.interpolate(samples, 0.0, a, method=method).power for a in albedos])
        rows[method] = bs.interpolate(samples, 0.0, ALBEDO, method=method).image[SIZE // 2]
    for name, (color, line) in looks.items():
        axes[0].plot(albedos, powers[name], line, color=color, label=name)
        axes[1].plot(where, np.where(rows[name] > 0, rows[name], np.nan), line, color=color, label=name)
    axes[0].plot((low, high), powers["exact"][[0, -1]], "ko", markersize=5, label="samples")
    axes[0].set(yscale="log", xlabel="albedo", ylabel="light that comes back", title="reflectance at 0°")
    axes[1].set(yscale="log", xlim=(-20, 20), ylim=(1e-8, 0.05), xlabel="u (mean free paths)",
                ylabel="exitance (1/mfp²)", title=f"an LDF at albedo {ALBEDO:g}, 0°")  # fmt: skip
    for ax in axes:
        ax.grid(alpha=0.25)
    axes[0].legend()
    style.save(made, "albedo")

    i = int(np.argmin(np.abs(albedos - ALBEDO)))
    values = [f"{powers[name][i]:.4f}" for name in looks]
    head = ["", "exact", "its method", "`adaptive`"]
    row = ["Reflectance at 0°, albedo 0.6 from .2 and .999", "", values[1], f"{values[0]}; `adaptive`: {values[2]}"]
    return {"albedo": style.table(head, [["reflectance", *values]])}, [row]
