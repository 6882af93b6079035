"""What bakes of meshes that bend replace or leave out is said."""

from dataclasses import replace

import numpy as np
import pytest
from beamspread.core.bake.bent_limits import bent_messages
from beamspread.core.bake.surface import Surface
from beamspread.core.scene.flat_mesh import flatten
from beamspread.core.scene.polygons import Polygons

from bakes import MATERIAL, SETTINGS

REFRACTING = replace(MATERIAL, ior=1.4)


@pytest.mark.parametrize(
    ("surface", "changes", "beyond", "words"),
    [
        (Surface(MATERIAL), {}, 0.0, []),
        (Surface(MATERIAL), {}, 0.005, []),
        (Surface(MATERIAL), {}, 0.2, ["20% of the surface"]),
        (Surface(MATERIAL, 0.1), {}, 0.2, ["as in a flat one."]),
        (Surface(REFRACTING, 0.1), {}, 0.0, ["mirrors before it scatters"]),
        (Surface(MATERIAL), {"distributions": "angular"}, 0.0, ["know flat surfaces alone"]),
        (Surface(MATERIAL), {"margin": 4, "margin_type": "ADJACENT_FACES"}, 0.0, ["in place of adjacent faces"]),
        (Surface(MATERIAL), {"margin": 0, "margin_type": "ADJACENT_FACES"}, 0.0, []),
        (Surface(MATERIAL, 0.1), {"layer": "IRRADIANCE"}, 0.2, []),
    ],
)
def test_limits_of_bodies_are_named(surface, changes, beyond, words):
    messages = bent_messages("Cup", surface, replace(SETTINGS, **changes), beyond)
    assert len(messages) == len(words)
    for message, part in zip(messages, words):
        assert part in message.text
        assert "'Cup'" in message.text
        assert message.remedy


def two_tubes(gap):
    """Two open tubes of radius .5 beside each other, with a map each."""
    turns = np.linspace(0, 2 * np.pi, 25)
    corners, uvs = [], []
    for number in range(2):
        ring = np.stack([0.5 * np.cos(turns) + number * (1 + gap), 0.5 * np.sin(turns)], axis=1)
        for k in range(24):
            (a, b), u = (ring[k], ring[k + 1]), np.array([k, k + 1]) / 24
            corners += [[*a, 0], [*b, 0], [*b, 1], [*a, 1]]
            uvs += [[x, y] for x, y in ((u[0], 0), (u[1], 0), (u[1], 0.45), (u[0], 0.45))]
            uvs[-4:] = [[x, y + 0.5 * number] for x, y in uvs[-4:]]
    corners, uvs, starts = np.array(corners, float), np.array(uvs, float), 4 * np.arange(49)
    quads = corners.reshape(-1, 4, 3)
    normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
    return Polygons(corners, uvs, starts, normals / np.linalg.norm(normals, axis=1, keepdims=True))


@pytest.mark.parametrize(("gap", "is_named"), [(0.05, True), (0.5, False)])
def test_loose_parts_that_exchange_light_are_named(gap, is_named):
    texts = [message.text for message in flatten(two_tubes(gap), 0.01, "Tubes", spread=0.1).messages]
    assert ["2 loose parts of 'Tubes'" in text for text in texts] == [True] * is_named


def one_tube():
    tube = two_tubes(0.05)
    return replace(
        tube, corners=tube.corners[:96], uvs=tube.uvs[:96], starts=tube.starts[:25], normals=tube.normals[:24]
    )


def test_parts_that_touch_are_no_loose_parts():
    assert flatten(one_tube(), 0.01, "Tube", spread=0.1).messages == ()


def test_faces_without_an_area_are_no_loose_parts():
    """A bevel of no width leaves some at corners, each with all of its points in one place."""
    tube = one_tube()
    points, uvs = np.repeat(tube.corners[:2], 4, axis=0), np.repeat(tube.uvs[:2], 4, axis=0)
    bevelled = replace(
        tube,
        corners=np.concatenate([tube.corners, points]),
        uvs=np.concatenate([tube.uvs, uvs]),
        starts=4 * np.arange(27),
        normals=np.concatenate([tube.normals, np.zeros((2, 3))]),
    )
    assert flatten(bevelled, 0.01, "Tube", spread=0.1).messages == ()
