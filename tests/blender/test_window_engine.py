"""The engine in a window: F12 beside the window's own thread, viewports; and the node by copy, paste and undo."""

import pytest
from beamspread.blender import compat
from scenario_player import results_of


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of window_engine.py."""
    return results_of("window_engine", tmp_path_factory.mktemp("window"), size=(640, 480))


def test_f12_shows_the_baked_image(seen):
    assert seen["f12"] == ["complete"]
    assert seen["picture"] == pytest.approx([0.25, 0.5, 0.75], abs=2e-3)


def test_f12_without_a_denoiser_says_that_the_picture_came_without(seen):
    """Debian's Blender has none."""
    note = ["Beamspread: the picture", ["The picture was not denoised: this Blender has no denoiser."]]
    assert seen["popups of f12"] == [note] * (not compat.has_denoiser())


def test_f12_that_fails_says_why(seen):
    assert seen["popups of a failure"] == [["Beamspread: there is no picture", ["No space left on device"]]]


@pytest.mark.parametrize("clear", [True, False])
def test_blender_s_own_bake_leaves_a_texture_of_the_node_as_it_was(seen, clear):
    assert seen[f"texture, {clear}"] == [0.5]
    ((title, (why, kept)),) = seen[f"popups of the texture, {clear}"]
    assert title == "Beamspread: nothing was baked"
    assert "'Texture', a texture of the Beamspread node" in why
    assert kept == "The image has its pixels again."


def test_rendered_viewports_show_the_scene_by_eevee(seen):
    assert seen["scene light"]


def test_blender_s_own_bake_has_bounced_light(seen):
    """A white wall to the sky's half of some texels returns a tenth of the sun at least."""
    without, bounced = (sum(seen[f"own bake, {name}"]) for name in ("plain", "bounced"))
    assert without > 0
    assert bounced > 1.05 * without


def test_blender_s_own_bake_has_lamps_that_only_cycles_knows(seen):
    """A red one, which would be white without its nodes."""
    red, *others = seen["own bake, lamp"]
    plain, *other_plain = seen["own bake, plain"]
    assert red > 1.05 * plain
    assert others == pytest.approx(other_plain, rel=1e-6)


def test_a_pasted_node_parts_from_the_first_and_outlives_undo(seen):
    assert seen["pasted"] == [1.0, 1.7]
    assert seen["after undo and redo"] == [1.0, 1.7]
