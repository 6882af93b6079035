"""Nodes that depend on the angle of view, as their mean over even light: bounced light comes from all angles."""

from __future__ import annotations

import numpy as np

# Nodes of Gauss' rule for integrals over the cosine.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)
COSINES = (_POINTS + 1) / 2
# They weight a value by 2 c, whose integral over 0..1 is 1.
WEIGHTS = _WEIGHTS * COSINES

# By alpha: means over even light of G2 / G1 (Heitz 2014) of the lobe in native/scene/ggx.h; of this times (1 - c)^5,
# with the cosine c to the half vector; of it times (F - .04) / .96, with Fresnel's term F for an index of 1.5.
ALPHAS = 0.0, 0.1, 0.16, 0.25, 0.36, 0.444, 0.5, 0.64, 0.81, 1.0
ENERGIES = 1.0, 0.972, 0.941, 0.883, 0.803, 0.742, 0.701, 0.604, 0.503, 0.409
EDGES = 0.0476, 0.0339, 0.0265, 0.0186, 0.0126, 0.0100, 0.0084, 0.0058, 0.0040, 0.0028
DIELECTRIC_EDGES = 0.0540, 0.0407, 0.0332, 0.0248, 0.0179, 0.0145, 0.0126, 0.0091, 0.0064, 0.0046


def mean_fresnel(ior: np.ndarray) -> np.ndarray:
    """Mean reflectance, (..., 1), of dielectrics of these indices of refraction, (..., 1), from outside."""
    return _reflectance(np.maximum(ior, 1e-5)) @ WEIGHTS[:, None]


def mean_layer_weight(blend: np.ndarray, output: str) -> np.ndarray:
    """Mean of an output of the Layer Weight node, as in Cycles' `svm_node_layer_weight`."""
    if output == "Fresnel":
        return mean_fresnel(1 / np.maximum(1 - blend, 1e-5))
    blend = np.clip(blend, 0, 1 - 1e-5)
    exponent = np.where(blend < 0.5, 2 * blend, 0.5 / (1 - blend))
    return 1 - COSINES**exponent @ WEIGHTS[:, None]


def lobe_energy(roughness) -> np.ndarray:
    """Part of even light that a GGX lobe without a Fresnel term returns after one reflection; any shape."""
    return np.interp(np.square(roughness), ALPHAS, ENERGIES)


def lobe_edge(roughness) -> np.ndarray:
    """The same with Schlick's term (1 - c)^5: a lobe returns f0 (energy - edge) + edge."""
    return np.interp(np.square(roughness), ALPHAS, EDGES)


def dielectric_lobe(f0, roughness) -> np.ndarray:
    """Part of even light that a lobe of that f0 returns, whose Fresnel term has the shape of an index of 1.5."""
    edge = np.interp(np.square(roughness), ALPHAS, DIELECTRIC_EDGES)
    return f0 * (lobe_energy(roughness) - edge) + edge


def _reflectance(eta: np.ndarray) -> np.ndarray:
    """Fresnel's reflectance of unpolarized light at `COSINES`, (..., 16)."""
    g = eta**2 - 1 + COSINES**2
    root = np.sqrt(np.maximum(g, 0))
    a = (root - COSINES) / (root + COSINES)
    b = (COSINES * (root + COSINES) - 1) / (COSINES * (root - COSINES) + 1)
    return np.where(g > 0, 0.5 * a**2 * (1 + b**2), 1.0)
