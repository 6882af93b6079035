"""Rays that Blender traces among the evaluated objects, before anything is read for a bake."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from mathutils import Vector

from ...core.bake.estimate import SKY, share_of_rays
from ...core.bake.surroundings import Surroundings, directions_of
from ...core.scene.lights import AreaLight, Light, SpotLight, SunLight, WorldLight

# Places on an object from which rays start, if there are few objects, the fewest, and their sum over all objects; and
# directions from each. More: surer, slower scans.
PLACES, FEWEST_PLACES, ALL_PLACES, DIRECTIONS = 16, 2, 128, 8

# Least number of places on each face of an object that has few, and part of an edge from one place to the next.
MANY_ON_FACE, GOLDEN = 5, 0.618034

# Lamps to which shadow rays go from a point; of more, so many are drawn. More: surer, slower scans.
MAX_LAMPS = 8

# Rays from a place to each light with a size, and places for each one from which other rays start. More: surer, slower
# scans.
LIGHT_RAYS, MORE_PLACES = 16, 3

# Part of the sky that is blocked where all these rays are, and other places see it.
MOST_BLOCKED = 1 - 0.5 / LIGHT_RAYS

# Length that keeps a ray off the surface from which it starts, relative to the size of the object, or to the length of
# the ray that has met it.
LIFT, LIFT_OF_HIT = 1e-3, 1e-4

# Most surfaces without a shadow that a ray crosses.
MAX_CROSSINGS = 16

# Length of a ray without an end; Blender takes single precision.
FAR = 1e9

# Part of the light that a surface returns which meets a surface again, where two bounces did, about.
STAYING = 0.66

# Part of an object's closures, and of a closure's light, from which on they count as glass.
CLEAR = 0.5


class Look(NamedTuple):
    """Look of an object's materials to rays, about.

    Attributes
    ----------
    reflectance : of even light.
    glow : irradiance of even light of their radiance, W/m^2.
    clear : part of them that is glass.
    """

    reflectance: float
    glow: float = 0.0
    clear: float = 0.0


class LampLight(NamedTuple):
    """Irradiance of lamps at a place, W/m^2.

    Attributes
    ----------
    arriving, open : light with shadows and without.
    through_glass : light through glass, which only paths that meet the lamp bring.
    spikes : mean square of the light on such paths.
    met : part of all paths that meet the lamp.
    """

    arriving: float
    open: float
    through_glass: float
    spikes: float
    met: float


class Tracer:
    """Traces light to objects by few rays.

    `look_of` : the `Look` of an evaluated object; `places`: on each object, from which rays start.
    """

    def __init__(
        self, depsgraph, lights: Sequence[Light], look_of: Callable[[object], Look], places: int = PLACES
    ) -> None:
        self._depsgraph, self._look_of, self._places = depsgraph, look_of, places
        self._lamps = [light for light in lights if hasattr(light, "direction") or hasattr(light, "position")]
        skies = [light for light in lights if isinstance(light, WorldLight)]
        self._sky = sum(math.pi * float(np.mean(light.radiance)) * float(light.rgb().mean()) for light in skies)
        self._looks: dict[str, Look] = {}
        self._random = np.random.default_rng(1)

    def around(self, obj, sides: Sequence[float], has_unknown_sky: bool) -> Surroundings:
        """Surroundings of the faces of an object; `sides`: 1 for the faces, -1 for their backs.

        `has_unknown_sky`: True if the sky gives light of a strength that is not known: it counts as much as the lamps.
        """
        evaluated = obj.evaluated_get(self._depsgraph)
        places, normals = self._places_on_sides(evaluated, sides, self._places)
        if not len(places):
            return Surroundings()
        more = self._places_on_sides(evaluated, sides, MORE_PLACES * self._places)
        arriving, open_light, through_glass, spikes, met = np.array([self._of_lamps(*at) for at in zip(*more)]).T
        sky = self._sky + has_unknown_sky * (float(open_light.mean()) or 1.0)
        count = len(places) * DIRECTIONS
        direct, bounced, spiky, meeting = float(arriving.mean()), [], float(spikes.mean()), float(met.mean())
        for turn, (place, normal) in enumerate(zip(places, normals)):
            for direction in directions_of(normal, DIRECTIONS, turn):
                hit, crossed = self._hit(place, direction)
                if hit is None and crossed:
                    bounced.append(sky)
                elif hit is None:
                    direct += sky / count
                else:
                    look = hit[2]
                    direct += look.glow / count
                    irradiance, spikes_there, met_there = self._irradiance(*hit[:2], sky)
                    bounced.append(look.reflectance * irradiance)
                    spiky += look.reflectance**2 * spikes_there / count
                    meeting += met_there / count
        bounced = _without_outlier(bounced)
        found = sum(bounced) / count + float(through_glass.mean())
        everything, square = direct + found, sum(value * value for value in bounced) / count
        scale = 1.0 / everything if everything > 0 else 0.0
        enclosed = len(bounced) / count
        lit = float(arriving.sum() / open_light.sum()) if open_light.any() else 1.0 - enclosed
        return Surroundings(enclosed, lit, (scale * found, scale * math.sqrt(square)), scale**2 * spiky, meeting)

    def shares(self, obj, side: float, has_unknown_sky: bool) -> dict[str, float]:
        """Share of the rays to each light of a size that a bake traces beyond the first ones, by the light's name.

        Nothing blocks the other rays, or everything. The sky has the name `SKY`. `side`, `has_unknown_sky`: as for
        `around`.
        """
        places, normals = self._places_on(obj.evaluated_get(self._depsgraph), side, MORE_PLACES * self._places)
        sky = [(SKY, None)] if self._sky or has_unknown_sky else []
        lamps = [lamp for lamp in self._lamps if lamp.has_size]
        if len(lamps) > MAX_LAMPS:
            lamps = [lamps[number] for number in np.linspace(0, len(lamps) - 1, MAX_LAMPS).astype(int)]
        found = {}
        for name, lamp in [*sky, *((lamp.name, lamp) for lamp in lamps)]:
            if lamp is not None and not lamp.cast_shadow:
                found[name] = 0.0
            elif len(places):
                parts = [self._blocked(lamp, *at, number) for number, at in enumerate(zip(places, normals))]
                if lamp is None and min(parts) < 1:  # of which something is above each place
                    # In a room these rays miss windows that those of a bake find.
                    parts = [min(part, MOST_BLOCKED) for part in parts]
                found[name] = float(np.mean([share_of_rays(part) for part in parts]))
        return found

    def _blocked(self, lamp: Light | None, place: np.ndarray, normal: np.ndarray, turn: float) -> float | None:
        """Part of a lamp's light, or of an even sky's, that is blocked on its way to a place; None if it is behind."""
        start, arriving, blocked = Vector(place), 0.0, 0.0
        for ray, distance in _towards(lamp, place, normal, turn):
            cosine = float(ray @ normal)
            if cosine > 0:
                # Rays to an even sky follow the cosine.
                weight = 1.0 if lamp is None else cosine
                arriving += weight
                blocked += weight * self._is_blocked(start, ray, distance)
        return blocked / arriving if arriving else None

    def _irradiance(self, point: np.ndarray, normal: np.ndarray, sky: float) -> tuple[float, float, float]:
        """Irradiance of a surface that a ray has met, of lamps and from one direction of the hemisphere.

        And `spikes` and `met` of its `LampLight`.
        """
        turn, number = self._random.uniform(0, 2 * math.pi), self._random.integers(DIRECTIONS)
        hit, _ = self._hit(point, directions_of(normal, DIRECTIONS, turn)[number])
        lamps = self._of_lamps(point, normal)
        direct = lamps.arriving + lamps.through_glass
        if hit is None:
            return direct + sky, lamps.spikes, lamps.met
        there, facing, look = hit
        later = look.reflectance / (1.0 - STAYING * min(look.reflectance, 1.0))
        return direct + look.glow + later * self._of_lamps(there, facing).arriving, lamps.spikes, lamps.met

    def _of_lamps(self, point: np.ndarray, normal: np.ndarray) -> LampLight:
        """Irradiance of lamps at a place."""
        lamps, factor = self._lamps, 1.0
        if len(lamps) > MAX_LAMPS:
            numbers = self._random.choice(len(lamps), MAX_LAMPS, replace=False)
            lamps, factor = [lamps[number] for number in numbers], len(lamps) / MAX_LAMPS
        total = np.zeros(5)
        for lamp in lamps:
            irradiance, direction, distance = _from_lamp(lamp, point, normal)
            if irradiance <= 0:
                continue
            blocker = self._blocker(point, direction, distance, _casts_no_shadow) if lamp.cast_shadow else None
            through_glass = spikes = seen = 0.0
            if blocker is not None and self._is_glass(blocker):
                met = _part_that_meets(lamp, direction, distance, normal)
                if met > 0 and self._blocker(point, direction, distance, self._lets_through) is None:
                    through_glass, spikes, seen = irradiance, irradiance**2 / met, met
            total += irradiance * (blocker is None), irradiance, through_glass, spikes, seen
        return LampLight(*(factor * total).tolist())

    def _hit(self, start: np.ndarray, direction: np.ndarray) -> tuple[tuple[np.ndarray, np.ndarray, Look] | None, bool]:
        """The surface that a ray meets behind glass: a point slightly above it, its normal towards the start, its look.

        And whether the ray has crossed glass.
        """
        origin, crossed = start, False
        for _ in range(MAX_CROSSINGS):
            is_hit, point, normal, _, obj, _ = self._cast(origin, direction)
            if not is_hit:
                return None, crossed
            point, normal = np.array(point), np.array(normal)
            lift = LIFT_OF_HIT * float(np.linalg.norm(point - start))
            if not self._is_glass(obj):
                normal = -normal if normal @ direction > 0 else normal
                return (point + lift * normal, normal, self._look(obj)), crossed
            origin, crossed = point + lift * direction, True
        return None, crossed

    def _look(self, obj) -> Look:
        if obj.name not in self._looks:
            self._looks[obj.name] = self._look_of(obj)
        return self._looks[obj.name]

    def _is_glass(self, obj) -> bool:
        return self._look(obj).clear > CLEAR

    def _lets_through(self, obj) -> bool:
        return _casts_no_shadow(obj) or self._is_glass(obj)

    def _is_blocked(self, start, direction, distance: float) -> bool:
        """True if an object that casts shadows stands in the way."""
        return self._blocker(start, direction, distance, _casts_no_shadow) is not None

    def _blocker(self, start, direction, distance: float, passes: Callable[[object], bool]):
        """The first object in the way that lets no light through; None if there is none."""
        for _ in range(MAX_CROSSINGS):
            is_hit, point, _, _, obj, _ = self._cast(start, direction, distance)
            if not is_hit:
                return None
            if not passes(obj):
                return obj
            passed = (1 + LIFT_OF_HIT) * (point - Vector(start)).length
            start, distance = Vector(start) + passed * Vector(direction), distance - passed
            if distance <= 0:
                return None
        return obj

    def _cast(self, start, direction, distance: float = FAR) -> tuple:
        scene = self._depsgraph.scene
        return scene.ray_cast(self._depsgraph, Vector(start), Vector(direction), distance=distance)

    def _places_on_sides(self, obj, sides: Sequence[float], count: int) -> tuple[np.ndarray, np.ndarray]:
        """`_places_on` for each of the sides, which share the number of places."""
        found = [self._places_on(obj, side, max(count // len(sides), 1)) for side in sides]
        places, normals = zip(*found)
        return np.concatenate(places), np.concatenate(normals)

    def _places_on(self, obj, side: float, count: int) -> tuple[np.ndarray, np.ndarray]:
        """About `count` places (N, 3) a little above some faces of an evaluated object, and the normals there.

        Each of few faces has several places.
        """
        mesh = obj.to_mesh()  # curves and text have no faces themselves
        try:
            return self._places_on_mesh(obj, mesh, side, count)
        finally:
            obj.to_mesh_clear()

    def _places_on_mesh(self, obj, mesh, side: float, few: int) -> tuple[np.ndarray, np.ndarray]:
        matrix = np.array(obj.matrix_world)
        if mesh is None or not len(mesh.polygons):
            return np.zeros((0, 3)), np.zeros((0, 3))
        turn = side * np.linalg.pinv(matrix[:3, :3]).T
        lift = LIFT * max(obj.dimensions)
        places, normals = [], []
        for number in np.unique(np.linspace(0, len(mesh.polygons) - 1, few).astype(int)).tolist():
            face = mesh.polygons[number]
            normal = turn @ np.array(face.normal)
            if not normal.any():  # the face has no area
                continue
            normal /= np.linalg.norm(normal)
            center = np.array(face.center)
            corners = np.array([mesh.vertices[index].co for index in face.vertices])
            count = 1 if len(mesh.polygons) >= few else max(few // len(mesh.polygons), MANY_ON_FACE)
            for point in [center] if count == 1 else _spread_over(corners, center, count):
                places.append(matrix[:3, :3] @ point + matrix[:3, 3] + lift * normal)
                normals.append(normal)
        return np.reshape(places, (-1, 3)), np.reshape(normals, (-1, 3))


def _without_outlier(values: list[float]) -> list[float]:
    """Values whose largest is no larger than the second: by few rays, one of them may tell more than all others."""
    second = sorted(values)[-2] if len(values) > 1 else 0.0
    return [min(value, second) for value in values]


def _casts_no_shadow(obj) -> bool:
    return not obj.visible_shadow


def _spread_over(corners: np.ndarray, center: np.ndarray, count: int) -> np.ndarray:
    """Points (count, 3) spread evenly over the triangles between a face's center and its edges."""
    number = np.arange(count)
    outwards, along = np.sqrt((number + 0.5) / count), number * GOLDEN % 1.0
    first = corners[number % len(corners)]
    on_edge = first + along[:, None] * (corners[(number + 1) % len(corners)] - first)
    return center + outwards[:, None] * (on_edge - center)


def places_for(objects: int) -> int:
    """Places on each of so many objects from which rays start."""
    return min(max(ALL_PLACES // max(objects, 1), FEWEST_PLACES), PLACES)


def _towards(lamp: Light | None, place: np.ndarray, normal: np.ndarray, turn: float) -> list[tuple[np.ndarray, float]]:
    """Directions of rays from a place to points all over a lamp, or to an even sky, and their lengths."""
    if lamp is None:
        return [(direction, FAR) for direction in directions_of(normal, LIGHT_RAYS, turn)]
    across, up = _disk(turn)
    if isinstance(lamp, SunLight):
        x_axis, y_axis, z_axis = _frame(-np.array(lamp.direction))
        radius = math.tan(0.5 * min(lamp.angle, math.pi / 2))
        rays = z_axis + radius * (np.outer(across, x_axis) + np.outer(up, y_axis))
        return [(ray, FAR) for ray in rays / np.linalg.norm(rays, axis=1)[:, None]]
    if isinstance(lamp, AreaLight):
        x_axis, y_axis = (0.5 * size * np.array(axis) for size, axis in zip((lamp.size_x, lamp.size_y), lamp.frame))
        if not lamp.is_round:
            number = np.arange(LIGHT_RAYS)
            across, up = 2 * ((number + 0.5) / LIGHT_RAYS) - 1, 2 * ((number * GOLDEN + turn) % 1.0) - 1
    else:
        x_axis, y_axis = (lamp.radius * axis for axis in _frame(np.array(lamp.position) - place)[:2])
    ways = np.array(lamp.position) + np.outer(across, x_axis) + np.outer(up, y_axis) - place
    lengths = np.maximum(np.linalg.norm(ways, axis=1), 1e-9)
    if isinstance(lamp, AreaLight):
        # None arrives behind the lamp.
        is_before = ways @ np.array(lamp.frame[2]) < 0
        ways, lengths = ways[~is_before], lengths[~is_before]
    return list(zip(ways / lengths[:, None], lengths.tolist()))


def _disk(turn: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (LIGHT_RAYS,) spread evenly over a disk of radius 1."""
    number = np.arange(LIGHT_RAYS)
    radius, angle = np.sqrt((number + 0.5) / LIGHT_RAYS), number * math.pi * (3 - math.sqrt(5)) + turn
    return radius * np.cos(angle), radius * np.sin(angle)


def _frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors at right angles, the last along an axis."""
    z_axis = axis / (float(np.linalg.norm(axis)) or 1.0)
    x_axis = np.cross(z_axis, np.eye(3)[np.argmin(np.abs(z_axis))])
    x_axis /= np.linalg.norm(x_axis)
    return x_axis, np.cross(z_axis, x_axis), z_axis


def _from_lamp(lamp: Light, point: np.ndarray, normal: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Irradiance of a lamp without obstacles, W/m^2, and direction and distance of its center."""
    strength = float(lamp.rgb().mean())
    if hasattr(lamp, "direction"):
        direction = -np.array(lamp.direction)
        return strength * max(float(direction @ normal), 0.0), direction, FAR
    way = np.array(lamp.position) - point
    distance = float(np.linalg.norm(way)) or 1e-9
    direction = way / distance
    falloff = max(float(direction @ normal), 0.0) / distance**2
    if isinstance(lamp, AreaLight):
        # Seen from afar, a lamp of that strength has the radiance strength / (4 area).
        axis = np.array(lamp.frame[2])
        facing = max(float(direction @ axis) / (float(np.linalg.norm(axis)) or 1.0), 0.0)
        return 0.25 * strength * facing * falloff, direction, distance
    if isinstance(lamp, SpotLight):
        axis = np.array(lamp.frame[2])
        is_inside = direction @ axis >= math.cos(0.5 * lamp.spot_size) * (float(np.linalg.norm(axis)) or 1.0)
        falloff *= bool(is_inside)
    return strength / (4 * math.pi) * falloff, direction, distance


def _part_that_meets(lamp: Light, direction: np.ndarray, distance: float, normal: np.ndarray) -> float:
    """Part of the paths from a diffuse surface that meet a lamp: the form factor, about."""
    if hasattr(lamp, "direction"):
        square = math.tan(0.5 * min(lamp.angle, math.pi / 2)) ** 2
    elif isinstance(lamp, AreaLight):
        axis = np.array(lamp.frame[2])
        facing = abs(float(direction @ axis)) / (float(np.linalg.norm(axis)) or 1.0)
        square = facing * lamp.size_x * lamp.size_y * (0.25 if lamp.is_round else 1 / math.pi) / distance**2
    else:
        square = (lamp.radius / distance) ** 2
    return min(square * max(float(direction @ normal), 0.0), 1.0)
