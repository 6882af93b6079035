"""The bodies of body_tables.py as samples of their surface, with irradiance in closed form; a mean free path is 1 m."""

from dataclasses import dataclass

import numpy as np

from plain_bodies import Ball, Block, Cylinder, Field, Hollow, Shell, Torus

# Samples of endless bodies reach as far as this beyond the middle, where exitance is compared: light of albedo .97 is a
# thousandth there. The middle is as long as MIDDLE either way.
REACH, MIDDLE = 48.0, 6.0


@dataclass
class BodySamples:
    position: np.ndarray  # float32 (n, 3)
    normal: np.ndarray
    tangent: np.ndarray
    area: np.ndarray  # float32 (n,)
    irradiance: np.ndarray  # float32 (n,), W/m^2 under a beam of 1 W/m^2
    travel: np.ndarray  # float32 (n, 3), directions of the light in the sample's frame
    bin: np.ndarray  # int (n,); -1 for samples that are not compared
    steps: np.ndarray  # float32 (n, 6), to the neighbors along rows and across them

    def exitance(self, luminance, count):
        """Mean exitance of each bin from luminance (n,)."""
        compared = self.bin >= 0
        column, area = self.bin[compared], self.area[compared]
        power = np.bincount(column, np.pi * luminance[compared] * area, count)
        return power / np.bincount(column, area, count)


def samples_of(position, normal, area, column, beam, along, across=None):
    """Samples with the steps along rows and across them; without these, rows are at right angles."""
    helper = np.where(np.abs(normal[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    tangent = np.cross(helper, normal)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], 1)
    travel = frame @ np.asarray(beam, float)
    irradiance = np.maximum(-travel[:, 2], 0)
    # The dark side needs a direction, too.
    travel[irradiance == 0] = (0, 0, -1)
    if across is None:
        across = np.cross(normal, along) * (area / (along**2).sum(axis=1))[:, None]
    steps = np.concatenate([along, across], 1)
    values = (np.asarray(value, np.float32) for value in (position, normal, tangent, area, irradiance, travel))
    return BodySamples(*values, np.asarray(column, int), steps.astype(np.float32))


def times_of(length, texel, multiple=1):
    """Number of texels along a length: a multiple."""
    return multiple * max(1, round(length / (texel * multiple)))


def aligned(length, texel):
    """Number of texels along a ring. Rings of about the same length have the same, as in a texture: a lattice."""
    rings_per_octave = 3
    return max(6, round(2 ** (round(rings_per_octave * np.log2(length / texel)) / rings_per_octave)))


def ball(body, texel):
    rings = times_of(np.pi * body.radius, texel, body.count)
    edges = np.linspace(0, np.pi, rings + 1)
    parts = []
    for ring in range(rings):
        middle = (edges[ring] + edges[ring + 1]) / 2
        count = aligned(2 * np.pi * body.radius * np.sin(middle), texel)
        phi = np.arange(count) * (2 * np.pi / count)
        around = np.stack([np.cos(phi), np.sin(phi), np.zeros(count)], 1)
        normal = np.sin(middle) * around + [0, 0, np.cos(middle)]
        area = 2 * np.pi * body.radius**2 * (np.cos(edges[ring]) - np.cos(edges[ring + 1])) / count
        along = np.cross([0, 0, 1], normal) * (2 * np.pi * body.radius / count)
        parts.append((normal, np.full(count, area), np.full(count, ring * body.count // rings), along))
    normal, area, column, along = (np.concatenate(values) for values in zip(*parts))
    return samples_of(body.radius * normal, normal, area, column, (0, 0, -1), along)


def along_axis(texel):
    count = times_of(2 * (REACH + MIDDLE), texel)
    z = ((np.arange(count) + 0.5) / count - 0.5) * 2 * (REACH + MIDDLE)
    return z, z[1] - z[0]


def tube(radius, texel, bins, sign, beam, first_bin=0):
    """Samples of a cylinder's face; sign -1: its normals point to the axis."""
    count = times_of(2 * np.pi * radius, texel, 2 * bins)
    angle = (np.arange(count) + 0.5) * (2 * np.pi / count)
    z, step = along_axis(texel)
    angle, z = (value.ravel() for value in np.meshgrid(angle, z))
    outward = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], 1)
    folded = np.minimum(angle, 2 * np.pi - angle)
    column = np.where(np.abs(z) < MIDDLE, first_bin + (folded * (bins / np.pi)).astype(int), -1)
    area = np.full(len(z), 2 * np.pi * radius / count * step)
    along = np.cross([0, 0, 1], outward) * (2 * np.pi * radius / count)
    return samples_of(radius * outward + z[:, None] * [0, 0, 1], sign * outward, area, column, beam, along)


def block(body, texel):
    count = times_of(2 * body.half, texel, body.bins)
    across = ((np.arange(count) + 0.5) / count - 0.5) * 2 * body.half
    z, step = along_axis(texel)
    across, z = (value.ravel() for value in np.meshgrid(across, z))
    inner = np.where(np.abs(z) < MIDDLE, 0, -1)
    parts = []
    for face, (x, y) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
        normal = np.tile([float(x), float(y), 0.0], (len(z), 1))
        position = body.half * normal + across[:, None] * [-y, x, 0] + z[:, None] * [0, 0, 1]
        column = face * body.bins + ((across / (2 * body.half) + 0.5) * body.bins).astype(int)
        along = np.tile([-y * 2 * body.half / count, x * 2 * body.half / count, 0.0], (len(z), 1))
        parts.append((position, normal, np.where(inner < 0, -1, column), along))
    position, normal, column, along = (np.concatenate(values) for values in zip(*parts))
    area = np.full(len(normal), 2 * body.half / count * step)
    return samples_of(position, normal, area, column, body.beam, along)


def torus(body, texel):
    rows = times_of(2 * np.pi * body.tube, texel, body.count)
    edges = np.linspace(0, 2 * np.pi, rows + 1)
    parts = []
    for row in range(rows):
        middle = (edges[row] + edges[row + 1]) / 2
        length = 2 * np.pi * (body.ring + body.tube * np.cos(middle))
        count = aligned(length, texel)
        phi = np.arange(count) * (2 * np.pi / count)
        ring = np.stack([np.cos(phi), np.sin(phi), np.zeros(count)], 1)
        normal = np.cos(middle) * ring + [0, 0, np.sin(middle)]
        strip = body.ring * (edges[1] - edges[0]) + body.tube * (np.sin(edges[row + 1]) - np.sin(edges[row]))
        area = np.full(count, 2 * np.pi * body.tube * strip / count)
        along = np.cross([0, 0, 1], ring) * (length / count)
        position, row_bin = body.ring * ring + body.tube * normal, np.full(count, row * body.count // rows)
        parts.append((position, normal, area, row_bin, along))
    position, normal, area, column, along = (np.concatenate(values) for values in zip(*parts))
    return samples_of(position, normal, area, column, (0, 0, -1), along)


def field(body, texel):
    count = times_of(body.half, texel, body.bins)
    line = (np.arange(-count, count) + 0.5) * (body.half / count)
    x, y = (value.ravel() for value in np.meshgrid(line, line, indexing="ij"))
    normal = np.stack([-2 * body.a * x, -2 * body.b * y, np.ones_like(x)], 1)
    slope = np.linalg.norm(normal, axis=1)
    column, row = ((np.abs(value) * (body.bins / body.half)).astype(int) for value in (x, y))
    position = np.stack([x, y, body.height(x, y)], 1)
    area = (body.half / count) ** 2 * slope
    step, none = np.full_like(x, body.half / count), np.zeros_like(x)
    along = np.stack([step, none, 2 * body.a * x * step], 1)
    across = np.stack([none, step, 2 * body.b * y * step], 1)
    return samples_of(position, normal / slope[:, None], area, column * body.bins + row, body.beam, along, across)


def samples(body, texel):
    """BodySamples of one of body_tables.BODIES about `texel` apart; of shells the outer face."""
    if isinstance(body, Ball):
        return ball(body, texel)
    if isinstance(body, Block):
        return block(body, texel)
    if isinstance(body, Torus):
        return torus(body, texel)
    if isinstance(body, Field):
        return field(body, texel)
    assert isinstance(body, Cylinder)
    bins = body.faces if isinstance(body, Shell) else body.count
    return tube(body.radius, texel, bins, -1 if isinstance(body, Hollow) else 1, body.beam)
