"""Polygons cut at lines: the truth for rasterized areas."""

import numpy as np


def area(polygon):
    """Signed area by the shoelace formula."""
    x, y = np.asarray(polygon).T if len(polygon) else np.zeros((2, 0))
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def clip(polygon, axis, bound, sign):
    """Sutherland and Hodgman: the part of a polygon where sign * (coordinate - bound) >= 0."""
    result = []
    for p, q in zip(polygon, polygon[1:] + polygon[:1]):
        a, b = sign * (p[axis] - bound), sign * (q[axis] - bound)
        if a >= 0:
            result.append(p)
        if (a > 0 > b) or (a < 0 < b):
            result.append(p + (q - p) * (a / (a - b)))
    return result
