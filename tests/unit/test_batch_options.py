"""Command line of the batch."""

import pytest
from beamspread.core.batch.batch_options import arguments_for_script, parse


def test_nothing_asked_leaves_all_to_the_scene():
    options = parse([])
    assert options.objects == ()
    assert {options.scene, options.frames, options.resolution, options.solver, options.output} == {None}
    assert {options.format, options.report, options.log, options.pass_name, options.indirect} == {None}
    assert {options.allow_dark, options.verbose} == {False}


def test_every_option():
    options = parse(
        ["room.blend", "--object", "Floor", "--object", "Wall", "--frames", "2-5", "--resolution", "512"]
        + ["--solver", "direct", "--output", "out", "--format", "png", "--report", "report.json"]
        + ["--pass", "Irradiance", "--no-indirect", "--allow-dark", "--verbose", "--log", "bakes.log"]
    )
    assert options.scene == "room.blend"
    assert options.objects == ("Floor", "Wall")
    assert (options.frames, options.resolution, options.solver) == ((2, 5), 512, "direct")
    assert (options.output, options.format, options.report) == ("out", "PNG", "report.json")
    assert (options.pass_name, options.indirect, options.log) == ("IRRADIANCE", False, "bakes.log")
    assert options.allow_dark
    assert options.verbose


@pytest.mark.parametrize("name", ["LUMINANCE", "irradiance", "Direction"])
def test_passes_in_any_case(name):
    assert parse(["--pass", name]).pass_name == name.upper()


def test_indirect_light_may_be_asked_for():
    assert parse(["--indirect"]).indirect is True
    assert parse(["--indirect", "--no-indirect"]).indirect is False


def test_objects_in_one_option_and_twice():
    assert parse(["--object", "A", "B b", "--object", "A"]).objects == ("A", "B b")


def test_a_single_frame():
    assert parse(["--frames", "7"]).frames == (7, 7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--frames", "5-2"], "ends before it starts"),
        (["--frames", "a-b"], "not a frame"),
        (["--frames", "-"], "--frames"),
        (["--resolution", "0"], "between 1 and 65536"),
        (["--resolution", "big"], "between 1 and 65536"),
        (["--solver", "magic"], "invalid choice"),
        (["--pass", "normal"], "'LUMINANCE', 'IRRADIANCE', 'DIRECTION'"),
        (["--pass"], "--pass"),
        (["--format", "JPG"], "invalid choice"),
        (["--sovler", "fft"], "--sovler"),
        (["--object"], "--object"),
    ],
)
def test_mistakes_end_with_code_2_and_a_reason(arguments, words, capsys):
    with pytest.raises(SystemExit) as caught:
        parse(arguments)
    assert caught.value.code == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("argv", "inside_blender", "expected"),
    [
        (["blender", "-b", "x.blend", "--python", "batch.py", "--", "--object", "A"], True, ["--object", "A"]),
        (["blender", "-b", "x.blend", "--python", "batch.py"], True, []),
        (["batch.py", "x.blend", "--object", "A"], False, ["x.blend", "--object", "A"]),
        (["batch.py", "--", "x.blend"], False, ["x.blend"]),
    ],
)
def test_own_arguments_are_found(argv, inside_blender, expected):
    assert arguments_for_script(argv, inside_blender) == expected
