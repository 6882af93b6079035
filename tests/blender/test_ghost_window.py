"""Live in EEVEE's Rendered view, see ghost_window.py."""

from scenario_player import results_of


def test_a_view_shows_nothing_of_the_former_light(tmp_path):
    """EEVEE's picture is the mean of 8 frames. Some had the former shadow: they showed as a ghost of it.

    Means of blocks of two pictures of the same scene differ by the noise of 8 frames along an edge, less than .03. A
    ghost of one frame makes a difference of an eighth of the shadow, .06 and more.
    """
    seen = results_of("ghost_window", tmp_path, size=(640, 480))
    assert min(seen["changes"]) > 0.3
    assert max(seen["differences"]) < 0.04, seen
