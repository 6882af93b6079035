"""Monte Carlo of light in bodies with closed formulas, sharing no code with the engine.

The medium is index-matched with a Henyey-Greenstein phase function; lengths are in mean free paths. A parallel beam of
irradiance 1 W/m^2 across its direction enters where it first meets the body. All photons of a batch scatter at once, so
that their weight is the albedo to the power of the order: one walk serves all albedos. At each scattering a photon
counts with its probability to leave without another. Light that leaves unscattered is not counted.
"""

import math

import numpy as np

# Scattering order at each multiple of which half of the photons end; the rest then count double. Larger: slower, less
# noise of high albedos.
ROULETTE_ORDER = 32
# Photons end at the order where the weight of the largest albedo falls below this. Smaller: less bias.
LEAST_WEIGHT = 1e-7
BATCH = 1 << 16


def quadratic(a, b, c):
    """Both roots of a t^2 + 2 b t + c, ascending if a > 0; NaN if there are none."""
    root = np.sqrt(b * b - a * c)
    return (-b - root) / a, (-b + root) / a


class Ball:
    """Bins: the angle at the centre from the point nearest to the lamp; `angle_deg`."""

    def __init__(self, radius, bins=36):
        self.radius, self.count = radius, bins
        self.edges = np.linspace(0, 180, bins + 1)
        self.areas = -2 * math.pi * radius**2 * np.diff(np.cos(np.radians(self.edges)))
        self.beam_area = math.pi * radius**2

    def enter(self, rng, count):
        r, phi = self.radius * np.sqrt(rng.random(count)), 2 * math.pi * rng.random(count)
        z = np.sqrt(np.maximum(self.radius**2 - r * r, 0))
        return (r * np.cos(phi), r * np.sin(phi), z), (0.0, 0.0, -1.0)

    def leave(self, x, y, z, wx, wy, wz):
        return np.maximum(quadratic(1.0, x * wx + y * wy + z * wz, x * x + y * y + z * z - self.radius**2)[1], 0)

    def bin(self, x, y, z):
        return np.degrees(np.arccos(np.clip(z / self.radius, -1, 1))) * (self.count / 180)


class Cylinder:
    """The axis is z, `slant_deg` the beam's angle to it; bins: the angle around it, both ways, from the lamp's side."""

    def __init__(self, radius, bins=36, slant_deg=90.0):
        self.radius, self.count = radius, bins
        self.edges = np.linspace(0, 180, bins + 1)
        self.areas = np.full(bins, 2 * radius * math.pi / bins)
        self.beam = -math.sin(math.radians(slant_deg)), 0.0, -math.cos(math.radians(slant_deg))
        self.beam_area = -2 * radius * self.beam[0]

    def enter(self, rng, count):
        y = self.radius * (2 * rng.random(count) - 1)
        return (np.sqrt(self.radius**2 - y * y), y, np.zeros(count)), self.beam

    def roots(self, x, y, wx, wy):
        a = np.maximum(wx * wx + wy * wy, 1e-12)
        return quadratic(a, x * wx + y * wy, x * x + y * y - self.radius**2)

    def leave(self, x, y, z, wx, wy, wz):
        return np.maximum(self.roots(x, y, wx, wy)[1], 0)

    def bin(self, x, y, z):
        return np.degrees(np.abs(np.arctan2(y, x))) * (self.count / 180)


class Hollow(Cylinder):
    """The medium around a cylinder without one, lit from inside: bins start at the middle of the lit half.

    `is_followed`: light that crosses the hollow enters again.
    """

    def __init__(self, radius, bins=36, is_followed=False):
        super().__init__(radius, bins)
        self.beam, self.is_followed = (1.0, 0.0, 0.0), is_followed

    def leave(self, x, y, z, wx, wy, wz):
        near = self.roots(x, y, wx, wy)[0]
        return np.where((x * wx + y * wy < 0) & (near == near), np.maximum(near, 0), np.inf)

    def hollow(self, x, y, z, wx, wy, wz):
        near, far = self.roots(x, y, wx, wy)
        return far - np.maximum(near, 0)


class Shell(Cylinder):
    """A cylinder with a hollow inside, lit from outside. Bins: those of the outer face, then those of the inner one.

    Light that leaves into the hollow is not followed.
    """

    def __init__(self, radius, thickness, bins=36):
        super().__init__(radius, bins)
        self.inner, self.faces, self.count = radius - thickness, bins, 2 * bins
        self.areas = np.concatenate([self.areas, self.areas * (self.inner / radius)])

    def leave(self, x, y, z, wx, wy, wz):
        a, b, c = np.maximum(wx * wx + wy * wy, 1e-12), x * wx + y * wy, x * x + y * y
        near = quadratic(a, b, c - self.inner**2)[0]
        outer = np.maximum(quadratic(a, b, c - self.radius**2)[1], 0)
        return np.where((b < 0) & (near == near), np.maximum(near, 0), outer)

    def bin(self, x, y, z):
        column = np.minimum(super().bin(x, y, z) * (self.faces / self.count), self.faces - 1e-3)
        middle = (self.radius + self.inner) / 2
        return column + np.where(x * x + y * y < middle**2, self.faces, 0)


class Block:
    """A bar of square section without ends; the beam meets the face +x at `angle_deg`, and +y with the rest of 90.

    Bins: `bins` across each of the faces +x, +y, -x, -y, counterclockwise.
    """

    def __init__(self, width, bins=24, angle_deg=30.0):
        self.half, self.bins, self.count = width / 2, bins, 4 * bins
        self.areas = np.full(4 * bins, width / bins)
        self.beam = -math.cos(math.radians(angle_deg)), -math.sin(math.radians(angle_deg)), 0.0
        self.beam_area = -width * (self.beam[0] + self.beam[1])

    def enter(self, rng, count):
        across = self.half * (2 * rng.random(count) - 1)
        on_x = rng.random(count) < self.beam[0] / (self.beam[0] + self.beam[1])
        return (np.where(on_x, self.half, across), np.where(on_x, across, self.half), np.zeros(count)), self.beam

    def leave(self, x, y, z, wx, wy, wz):
        with np.errstate(divide="ignore", invalid="ignore"):
            tx = (self.half - np.copysign(x, x * wx)) / np.abs(wx)
            ty = (self.half - np.copysign(y, y * wy)) / np.abs(wy)
        return np.maximum(np.fmin(tx, ty), 0)

    def bin(self, x, y, z):
        on_x = np.abs(x) >= np.abs(y)
        face = np.where(on_x, np.where(x > 0, 0, 2), np.where(y > 0, 1, 3))
        across = np.choose(face, (y, -x, -y, x))
        column = np.clip((across / (2 * self.half) + 0.5) * self.bins, 0, self.bins - 1e-3)
        return face * self.bins + column


class Torus:
    """The axis is z, and the beam comes along it; bins: the angle around the tube from its outer side, by the top."""

    def __init__(self, tube_radius, ring_radius, bins=36):
        self.tube, self.ring, self.count = tube_radius, ring_radius, bins
        self.edges = np.linspace(0, 360, bins + 1)
        angle = np.radians(self.edges)
        self.areas = 2 * math.pi * tube_radius * (ring_radius * np.diff(angle) + tube_radius * np.diff(np.sin(angle)))
        self.beam_area = 4 * math.pi * tube_radius * ring_radius

    def enter(self, rng, count):
        square = (self.ring - self.tube) ** 2 + 4 * self.ring * self.tube * rng.random(count)
        r, phi = np.sqrt(square), 2 * math.pi * rng.random(count)
        z = np.sqrt(np.maximum(self.tube**2 - (r - self.ring) ** 2, 0))
        return (r * np.cos(phi), r * np.sin(phi), z), (0.0, 0.0, -1.0)

    def depth(self, x, y, z):
        return self.tube - np.sqrt((np.sqrt(x * x + y * y) - self.ring) ** 2 + z * z)

    def leave(self, x, y, z, wx, wy, wz):
        """Steps of the depth below the surface, as far as 14 mean free paths: next to no light goes farther."""
        distance, active = np.full_like(x, np.inf), np.arange(len(x))
        t, depth = np.zeros_like(x), np.maximum(self.depth(x, y, z), 0)
        while len(active):
            # The last step is this long, and a line through its ends finds the surface.
            step = np.maximum(depth, np.float32(0.01))
            t = t + step
            behind, depth = depth, self.depth(x + t * wx, y + t * wy, z + t * wz)
            ends = depth < 0
            distance[active[ends]] = (t + step * depth / np.maximum(behind - depth, 1e-12))[ends]
            keep = ~ends & (t < 14)
            active, t, depth, x, y, z, wx, wy, wz = (v[keep] for v in (active, t, depth, x, y, z, wx, wy, wz))
        return distance

    def bin(self, x, y, z):
        angle = np.degrees(np.arctan2(z, np.sqrt(x * x + y * y) - self.ring))
        return np.where(angle < 0, angle + 360, angle) * (self.count / 360)


class Field:
    """The medium below a surface z(x, y), lit from above where |x| and |y| are below `half`.

    "saddle": z = (x^2 - y^2) / (2 radius), "bowl": z = (x^2 + y^2) / (2 radius), "dome": the bowl upside down, "plane":
    z = 0. The beam comes at `angle_deg`, on planes alone, where it lights everything. Bins: `bins` along |x| up to
    `half`, times as many along |y|; light that leaves farther outside is not counted.
    """

    SIGNS = {"saddle": (1.0, -1.0), "bowl": (1.0, 1.0), "dome": (-1.0, -1.0), "plane": (0.0, 0.0)}

    def __init__(self, kind, radius, half, bins=12, angle_deg=0.0):
        self.half, self.kind = half, kind
        self.bins, self.count = bins, bins * bins if kind != "plane" else 1
        self.a, self.b = (sign / (2 * radius) for sign in self.SIGNS[kind])
        self.beam = math.sin(math.radians(angle_deg)), 0.0, -math.cos(math.radians(angle_deg))
        fine = (np.arange(16 * bins) + 0.5) * (half / (16 * bins))
        x, y = np.meshgrid(fine, fine, indexing="ij")
        slope = np.sqrt(1 + 4 * (self.a * x) ** 2 + 4 * (self.b * y) ** 2)
        self.areas = 4 * (slope.reshape(bins, 16, bins, 16).sum((1, 3)) * (half / (16 * bins)) ** 2).ravel()
        self.beam_area = 4 * half**2 * -self.beam[2]
        if kind == "plane":
            self.areas = np.array([4 * half**2])

    def height(self, x, y):
        return self.a * x * x + self.b * y * y

    def enter(self, rng, count):
        x, y = (self.half * (2 * rng.random(count) - 1) for _ in range(2))
        return (x, y, self.height(x, y)), self.beam

    def leave(self, x, y, z, wx, wy, wz):
        if self.kind == "plane":
            return np.where(wz > 0, np.maximum(-z, 0) / np.maximum(wz, 1e-12), np.inf)
        # height - z along the flight: positive inside.
        a = self.a * wx * wx + self.b * wy * wy
        b = self.a * x * wx + self.b * y * wy - wz / 2
        c = np.maximum(self.height(x, y) - z, 0)
        # The first root after 0 of a t^2 + 2 b t + c, by the form that does not cancel.
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * c)
            t = np.where(b < 0, c / (root - b), -(root + b) / a)
        return np.where((t == t) & (t >= 0) & ((b < 0) | (a < 0)), t, np.inf)

    def bin(self, x, y, z):
        if self.kind == "plane":
            return np.zeros_like(x)
        column, row = (np.floor(np.abs(value) * (self.bins / self.half)) for value in (x, y))
        return np.where((column < self.bins) & (row < self.bins), column * self.bins + row, self.count)


def turn(w, g, rng):
    """New directions after one scattering; w is a tuple of three arrays."""
    wx, wy, wz = w
    count = len(wx)
    u, phi = rng.random(count, np.float32), rng.random(count, np.float32) * np.float32(2 * math.pi)
    cos_d = 1 - 2 * u if g == 0 else (1 + g * g - ((1 - g * g) / (1 - g + 2 * g * u)) ** 2) / (2 * g)
    sin_d = np.sqrt(np.maximum(0, 1 - cos_d * cos_d))
    c, s = sin_d * np.cos(phi), sin_d * np.sin(phi)
    # Duff et al. 2017, Building an Orthonormal Basis, Revisited.
    sign = np.copysign(np.float32(1), wz)
    a = -1 / (sign + wz)
    b = wx * wy * a
    x = cos_d * wx + c * (1 + sign * wx * wx * a) + s * b
    y = cos_d * wy + c * (sign * b) + s * (sign + wy * wy * a)
    z = cos_d * wz - c * (sign * wx) - s * wy
    length = 1.5 - 0.5 * (x * x + y * y + z * z)
    return x * length, y * length, z * length


def walk_batch(body, g, albedos, rng):
    """Exitance (albedo, bin) by one batch of photons, for a beam of irradiance 1."""
    p, w = body.enter(rng, BATCH)
    p = tuple(np.asarray(value, np.float32) for value in p)
    w = tuple(np.full(BATCH, value, np.float32) for value in w)
    albedos = np.asarray(albedos)
    result, factor, order = np.zeros((len(albedos), body.count)), 1.0 / BATCH, 0
    while len(p[0]) and albedos.max() ** order > LEAST_WEIGHT:
        leave = body.leave(*p, *w)
        if order:
            exits = np.flatnonzero(leave < 20)
            there = [p[i][exits] + leave[exits] * w[i][exits] for i in range(3)]
            # Rounding may reach the end of the last bin.
            column = body.bin(*there).astype(int)
            score = np.bincount(column, np.exp(-leave[exits]), body.count + 1)[: body.count]
            result += factor * albedos[:, None] ** order * score
        flight = rng.standard_exponential(len(p[0]), np.float32)
        meets = flight >= leave
        if getattr(body, "is_followed", False):
            crossing = np.flatnonzero(meets)
            flight[crossing] += body.hollow(*(value[crossing] for value in p + w))
            stays = np.arange(len(flight))
        else:
            stays = np.flatnonzero(~meets)
        order += 1
        if order % ROULETTE_ORDER == 0 and len(stays) > 1:
            kept = stays[::2]
            factor *= len(stays) / len(kept)
            stays = kept
        w = tuple(value[stays] for value in w)
        p = tuple(p[i][stays] + flight[stays] * w[i] for i in range(3))
        w = turn(w, g, rng)
    return result * body.beam_area / body.areas


def walk(body, g, albedos, photons, seed):
    """Mean and standard error of the exitance, two arrays (albedo, bin), and of its total over the incident power."""
    batches = max(2, round(photons / BATCH))
    values = []
    for batch in range(batches):
        rng = np.random.Generator(np.random.SFC64([seed, batch]))
        with np.errstate(invalid="ignore"):
            values.append(walk_batch(body, g, albedos, rng))
    values = np.array(values)
    totals = (values * body.areas).sum(2) / body.beam_area
    error = 1 / math.sqrt(batches)
    return (
        (values.mean(0), values.std(0, ddof=1) * error),
        (totals.mean(0), totals.std(0, ddof=1) * error),
    )
