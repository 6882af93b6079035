"""The colour of a glowing body."""

from __future__ import annotations

import numpy as np

# Polynomials of 1000 K / temperature for linear red, green and blue at a luminance of 1, lowest power first: a fit to
# what Cycles shows, which agrees with Blenders 3.4 and 4.5 to 0.3 % of the strongest channel.
COEFFICIENTS = np.array(
    [
        (0.63575, 1.63766, 8.10316, -10.26485, 5.87697, -1.38757),
        (0.95478, 0.88502, -5.48236, 6.76964, -4.15069, 1.06245),
        (2.43557, -12.0266, 20.99363, -13.1999, 0.0, 0.0),
    ]
)
# Cycles' colours stay the same beyond.
COLDEST, HOTTEST = 800.0, 12000.0


def color(kelvin: np.ndarray) -> np.ndarray:
    """Linear RGB (..., 3) of a temperature (..., 1)."""
    powers = (1000.0 / np.clip(kelvin, COLDEST, HOTTEST)) ** np.arange(COEFFICIENTS.shape[1])
    return np.maximum(powers @ COEFFICIENTS.T, 0.0)
