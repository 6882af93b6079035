"""Reflectance of a medium for whole maps of albedos, and the reverse."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..material import MAX_ALBEDO
from ..native import native

NODES = 32
"""Albedos at which the library is asked. Fewer: larger errors where hardly any light returns."""

STEPS = 2048
"""Points of the table, between which it is linear in the root of 1 - albedo. More: smaller errors."""

DIGITS = 10
"""Digits of the reflectances that count. More: last bits that differ from process to process."""


class ReflectanceTable:
    """Reflectance under uniform diffuse light for each albedo from 0 to `MAX_ALBEDO`.

    The reflectance is smooth in sqrt(1 - albedo), van de Hulst's similarity parameter: a polynomial through a few nodes
    is it within 3e-5 (Chebyshev's nodes).
    """

    def __init__(self, reflectances: Callable[[NDArray[np.float64]], ArrayLike]) -> None:
        """`reflectances`: those of albedos (N,)."""
        ends = [(1 - MAX_ALBEDO) ** 0.5, 1.0]
        known = np.polynomial.Chebyshev.interpolate(lambda roots: reflectances(1 - roots**2), NODES - 1, domain=ends)
        self._roots = np.linspace(*ends, STEPS)
        # The last bits of the polynomial depend on the process, by the BLAS that it has loaded; results should not. And
        # rounding may leave the darkest end below 0.
        values = np.round(known(self._roots), DIGITS)
        self._reflectances = np.maximum(np.minimum.accumulate(values), 0.0)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest reflectance."""
        return float(self._reflectances[-1]), float(self._reflectances[0])

    def reflectance(self, albedo: ArrayLike) -> NDArray[np.float64]:
        """Reflectance of albedos, any shape."""
        return np.interp(np.sqrt(1 - np.asarray(albedo, float)), self._roots, self._reflectances)

    def albedo(self, reflectance: ArrayLike) -> NDArray[np.float64]:
        """Albedos of reflectances, any shape; 0 and `MAX_ALBEDO` where no albedo has them."""
        roots = np.interp(-np.asarray(reflectance, float), -self._reflectances, self._roots)
        return 1 - roots**2


@lru_cache(maxsize=4)
def reflectance_table(library: native.LdfLibrary) -> ReflectanceTable:
    """The table of a library; those used last are kept."""
    return ReflectanceTable(np.vectorize(library.diffuse_reflectance))


@lru_cache(maxsize=64)
def exact_table(medium: native.Medium) -> ReflectanceTable:
    """The table of a medium without a simulation, by adding-doubling."""
    return ReflectanceTable(lambda albedos: exact_reflectances(medium, albedos))


def exact_reflectances(medium: native.Medium, albedos: ArrayLike) -> NDArray[np.float64]:
    """Reflectance under uniform diffuse light for albedos (N,), by adding-doubling and Gauss's quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    cosines = (nodes + 1) / 2
    angles = np.degrees(np.arccos(cosines)).tolist()
    return (weights * cosines) @ native.exact_totals(medium, angles, np.asarray(albedos, float).tolist())[0]
