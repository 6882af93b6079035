"""Monte Carlo of light in textured bodies with closed formulas (plain_bodies.py), sharing no code with the engine.

The albedo at a point is that of the texel of the surface straight above it: away from the axis of a cylinder, or from
the center of a ball. The medium is index-matched; lengths are in mean free paths, and light that never scattered does
not count.
"""

import math

import numpy as np

from plain_bodies import BATCH, Ball, Cylinder, turn

FAINT = 0.05


class Texels:
    """Texels (rows, columns) around the axis z: of a ball from the north on, of a cylinder along a period."""

    def __init__(self, body, shape, period=0.0):
        self.body, self.period, (self.rows, self.columns) = body, period, shape
        around = 2 * math.pi * body.radius / self.columns
        if isinstance(body, Ball):
            heights = np.cos(np.linspace(0, math.pi, self.rows + 1))
            self.areas = np.repeat(around * body.radius * (heights[:-1] - heights[1:])[:, None], self.columns, 1)
        else:
            self.areas = np.full(shape, around * period / self.rows)

    def at(self, x, y, z):
        column = np.floor(np.arctan2(y, x) * (self.columns / (2 * math.pi))).astype(int) % self.columns
        if isinstance(self.body, Ball):
            angle = np.arccos(np.clip(z / np.maximum(np.sqrt(x * x + y * y + z * z), 1e-6), -1, 1))
            row = np.minimum((angle * (self.rows / math.pi)).astype(int), self.rows - 1)
        else:
            row = np.floor(z * (self.rows / self.period)).astype(int) % self.rows
        return row * self.columns + column

    def enter(self, rng, count):
        """The body's beam; on a cylinder anywhere along the period."""
        (x, y, z), way = self.body.enter(rng, count)
        return (x, y, z + self.period * rng.random(count)) if isinstance(self.body, Cylinder) else (x, y, z), way

    @property
    def beam_area(self):
        return self.body.beam_area * (self.period or 1.0)


def batch(texels, albedo, g, rng):
    """Exitance (rows, columns) by one batch of photons, for a beam of irradiance 1."""
    p, w = texels.enter(rng, BATCH)
    p = tuple(np.asarray(value, np.float32) for value in p)
    w = tuple(np.full(BATCH, value, np.float32) for value in w)
    power, result = np.ones(BATCH), np.zeros(albedo.size)
    is_scattered = False
    while len(power):
        leave = texels.body.leave(*p, *w)
        if is_scattered:
            near = np.flatnonzero(leave < 20)
            exits = texels.at(*(p[i][near] + leave[near] * w[i][near] for i in range(3)))
            result += np.bincount(exits, power[near] * np.exp(-leave[near]), albedo.size)
        flight = rng.standard_exponential(len(power), np.float32)
        stays = np.flatnonzero(flight < leave)
        w = tuple(value[stays] for value in w)
        p = tuple(p[i][stays] + flight[stays] * w[i] for i in range(3))
        power, is_scattered = power[stays] * albedo.ravel()[texels.at(*p)], True
        survives = np.flatnonzero((power >= FAINT) | (rng.random(len(power)) < power / FAINT))
        power = np.maximum(power[survives], FAINT)
        p, w = (tuple(value[survives] for value in vector) for vector in (p, w))
        w = turn(w, g, rng)
    return result.reshape(albedo.shape) * texels.beam_area / BATCH / texels.areas


def exitance(texels, albedo, g, photons, seed):
    """Exitance (rows, columns) of two halves of the photons, for a beam of irradiance 1 as of the body."""
    halves = []
    for half in range(2):
        batches = max(1, round(photons / BATCH / 2))
        rngs = [np.random.Generator(np.random.SFC64([seed, half, number])) for number in range(batches)]
        with np.errstate(invalid="ignore"):
            halves.append(np.mean([batch(texels, albedo, g, rng) for rng in rngs], axis=0))
    return halves
