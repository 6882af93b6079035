"""Array arguments, converted without loss."""

from __future__ import annotations

import numpy as np


def float_array(name: str, values, dtype=np.float32, allowed="real numbers, none of them masked") -> np.ndarray:
    """Real numbers as a C-contiguous array of `dtype`.

    Raises
    ------
    ValueError
        The argument is no array of real numbers (ragged, text, complex or masked). Names the argument.
    """
    if np.ma.is_masked(values):
        raise ValueError(f"argument {name!r} is an array with masked values; allowed: {allowed}")
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biufO":
            return np.ascontiguousarray(array, dtype=dtype).reshape(array.shape)
    except (TypeError, ValueError):
        raise ValueError(f"argument {name!r} is {values!r}; allowed: {allowed}") from None
    given = repr(values) if array.ndim == 0 else f"{array.dtype} of shape {array.shape}"
    raise ValueError(f"argument {name!r} is {given}; allowed: {allowed}")
