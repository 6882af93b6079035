"""Light on bodies by the solver `surface` against the tables of reference/bodies.csv, which share no code with it."""

import functools

import numpy as np
import pytest
from beamspread import Medium, library
from beamspread.core.bake.spread_light import TOLERANCE

from body_samples import samples
from body_tables import ALBEDOS, BODIES, body_table

# Mean free paths between samples, and the largest errors of totals and L1 distances, per cent, at albedo .6 and from
# .9 to .97, at the tolerance of bakes. On the block the error is the method's: pairs across an edge see no ball.
BOUNDS = {
    "ball_4": (1.0, (1.0, 0.8), (1.5, 1.0)),
    "ball_6": (1.0, (1.0, 0.8), (1.2, 1.0)),
    "ball_20": (2.0, (1.0, 1.0), (1.0, 1.0)),
    "cylinder_6": (1.0, (1.0, 1.0), (1.0, 1.2)),
    "cylinder_20": (2.0, (1.0, 0.6), (1.0, 0.6)),
    "cylinder_slant_6": (1.0, (1.2, 1.2), (1.2, 1.2)),
    "cylinder_isotropic_6": (0.5, (1.2, 1.2), (1.5, 2.5)),
    "hollow_6": (1.0, (1.0, 1.0), (1.0, 1.0)),
    "hollow_20": (2.0, (1.0, 0.8), (1.0, 0.8)),
    "block_12": (1.0, (5.0, 4.5), (6.5, 6.0)),
    "torus_6": (1.5, (1.0, 0.8), (1.0, 1.0)),
    "saddle_6": (1.0, (1.0, 0.5), (1.0, 0.5)),
    "saddle_20": (2.0, (1.0, 0.5), (1.0, 0.5)),
    "bowl_20": (2.0, (1.2, 0.6), (1.0, 0.6)),
    "dome_6": (1.0, (1.0, 1.0), (1.0, 1.0)),
}


def rows_of(body):
    """Samples as the solver takes them: position, normal, tangent and area."""
    return np.concatenate([body.position, body.normal, body.tangent, body.area[:, None]], 1)


@functools.cache
def luminance(name, texel, albedos):
    """Samples of a body and their luminance (n, albedo)."""
    from _native_test import SurfaceField

    body, g = BODIES[name]
    lit = samples(body, texel)
    media = [library_of(g)] * len(albedos), list(albedos), [1.0] * len(albedos)
    field = SurfaceField(rows_of(lit), *media, steps=lit.steps, tolerance=TOLERANCE)
    field.add(lit.travel, np.repeat(lit.irradiance[:, None], 3, 1), [1.0] * len(albedos))
    return lit, field.solve()


@functools.cache
def library_of(g):
    return library(Medium(g=g, ior=1.0), "final", curved=True)


def errors(name, albedo_index, texel):
    """Error of the total, and the L1 distance of the bins less its part by noise of the table; both relative."""
    albedos = ALBEDOS[:3] if albedo_index < 3 else ALBEDOS[3:]
    lit, values = luminance(name, texel, albedos)
    body, _ = BODIES[name]
    exact, noise = body_table(name)[ALBEDOS[albedo_index]]
    count = lit.bin.max() + 1
    exact, noise, areas = exact[:count], noise[:count], body.areas[:count]
    bins = lit.exitance(values[:, albedo_index % 3], count)
    power = (exact * areas).sum()
    # The mean of the absolute value of a normal deviate is sqrt(2 / pi).
    of_noise = (noise * areas).sum() * np.sqrt(2 / np.pi)
    return ((bins - exact) * areas).sum() / power, (np.abs(bins - exact) * areas).sum() / power - of_noise / power


@pytest.mark.parametrize("name", BOUNDS)
def test_exitance_agrees_with_the_tables(name):
    texel, *bounds = BOUNDS[name]
    measured = 100 * np.array([errors(name, index, texel) for index in range(len(ALBEDOS))]).T
    print(f"{name:22}", *(f"{value:6.2f}" for row in measured for value in row))
    for values, (low_albedo, high_albedo) in zip(measured, bounds):
        assert abs(values[0]) < low_albedo
        assert (np.abs(values[1:]) < high_albedo).all()


# Sides of a shell, its bins in the table, and the largest errors of totals, per cent, at albedo .6 and above.
@pytest.mark.parametrize(("side", "face", "bounds"), [("reflected", 0, (11, 12.5)), ("transmitted", 1, (19, 12.5))])
def test_a_shell_as_a_flat_slab(side, face, bounds):
    """Slabs have no LDFs of shells: what bends cost at a radius of 6 and a thickness of 1 transport mean free path."""
    from _native_test import SurfaceField

    body, g = BODIES["shell_6"]
    ldf, lit = library(Medium(g=g, ior=1.0, thickness=body.radius - body.inner), "preview"), samples(body, 1.0)
    areas = body.areas.reshape(2, body.faces)
    for albedos in (ALBEDOS[:3], ALBEDOS[3:]):
        media = [ldf] * len(albedos), list(albedos), [1.0] * len(albedos)
        field = SurfaceField(rows_of(lit), *media, steps=lit.steps, tolerance=TOLERANCE, side=side)
        field.add(lit.travel, np.repeat(lit.irradiance[:, None], 3, 1), [1.0] * len(albedos))
        for albedo, values in zip(albedos, field.solve().T):
            exact = body_table("shell_6")[albedo][0].reshape(2, body.faces)[face]
            returned = (lit.exitance(values, body.faces) * areas[0]).sum()  # samples lie on the outer face
            error = 100 * (returned / (exact * areas[face]).sum() - 1)
            assert abs(error) < bounds[albedo > 0.6], error
