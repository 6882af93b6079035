"""The public functions: their types, and `luminance` against `convolve`."""

import ast
import inspect
import typing
from dataclasses import replace
from pathlib import Path

import beamspread
import numpy as np
import pytest
from beamspread import Material, Medium, convolve, library, luminance, presets

STAGED = Path(beamspread.__file__).parent
SUNLIT = np.where(np.arange(24) < 9, 5.0, 0.0) * np.ones((16, 1))
DIRECTION = (0.8, 0.0, -0.6)
PITCH = 2e-4


def material(**properties):
    """A material of shipped media, with an anisotropy per channel."""
    values = {"albedo": (0.9, 0.8, 0.6), "mean_free_path": (4e-4, 5e-4, 6e-4), "anisotropy_rgb": (0.0, 0.8, 0.9)}
    return Material(**values | properties)


def test_luminance_uses_the_library_of_each_channel():
    marble = material()
    libraries = [library(Medium(g)) for g in marble.anisotropy_rgb]
    expected = convolve(SUNLIT, DIRECTION, libraries, marble.albedo, marble.mean_free_path, PITCH)
    assert np.array_equal(luminance(SUNLIT, DIRECTION, marble, PITCH), expected)
    one_anisotropy = luminance(SUNLIT, DIRECTION, replace(marble, anisotropy_rgb=None), PITCH)
    assert np.abs(one_anisotropy - expected).max() > 0.01 * expected.max()


def test_luminance_of_one_medium_and_other_arguments():
    marble = replace(presets()["marble"], anisotropy=0.8, ior=1.0)
    ldf = library(marble.medium(), "preview")
    media = ldf, marble.albedo, marble.mean_free_path, (PITCH, 2 * PITCH)
    expected = convolve(SUNLIT, DIRECTION, *media, solver="direct", threads=1)
    fractions = []
    result = luminance(
        SUNLIT, DIRECTION, marble, media[3], quality="preview", solver="direct", threads=1, progress=fractions.append
    )
    assert np.array_equal(result, expected)
    assert fractions == sorted(fractions)
    assert 0 < fractions[0] < fractions[-1] == 1


@pytest.mark.parametrize(
    ("properties", "arguments", "message"),
    [
        ({"albedo": (0.9, 1.0, 0.6)}, {}, "albedo's green is 1"),
        ({}, {"thickness": 0.0}, "argument 'thickness' is 0.0; allowed: metres above 0"),
        ({}, {"solver": "quick"}, "argument 'solver' is"),
        ({}, {"quality": "good"}, "argument 'quality' is 'good'"),
    ],
)
def test_bad_arguments_are_named(properties, arguments, message):
    with pytest.raises(ValueError, match=message):
        luminance(SUNLIT, DIRECTION, material(**properties), PITCH, **arguments)


def test_another_object_than_a_material_is_named():
    with pytest.raises(ValueError, match="argument 'material' is 'marble'; allowed: a Material"):
        luminance(SUNLIT, DIRECTION, "marble", PITCH)


def public_python_functions():
    """Public functions and methods that are written in Python."""
    members = [getattr(beamspread, name) for name in beamspread.__all__]
    members += [member for _, member in inspect.getmembers(Material, inspect.isfunction) if member.__name__[0] != "_"]
    return [member for member in members if inspect.isfunction(member)]


@pytest.mark.parametrize("function", public_python_functions(), ids=lambda function: function.__qualname__)
def test_every_public_function_has_types(function):
    signature, types = inspect.signature(function), typing.get_type_hints(function)
    parameters = set(signature.parameters) - {"self"}
    assert parameters | {"return"} <= set(types)
    assert typing.Any not in types.values()


def test_the_build_describes_the_native_module():
    tree = ast.parse((STAGED / "_native.pyi").read_text())
    defined = {node.name for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}
    public = {name for name in dir(beamspread._native) if name[0] != "_"}
    assert public <= defined
    methods = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    assert all(method.returns is not None for method in methods)
    assert (STAGED / "py.typed").exists()
