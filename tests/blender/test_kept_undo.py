"""Undo in a window: picture and packed data go back and forth together, and a running bake keeps its result.

Files are not undone, which the results say, also without a window.
"""

import bpy
import pytest
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from scenario_player import results_of
from scenes import add_material, add_plane, add_sun, bake, file_image, node_of, pixels


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Results of kept_window.py: brightness of the pixels on display and of the packed pixels."""
    return results_of("kept_window", tmp_path_factory.mktemp("window"))


def test_picture_and_packed_data_are_undone_together(seen):
    first, second = seen["baked 1"], seen["baked 3"]
    assert first[0] == first[1] > 0
    assert second == pytest.approx([3 * first[0]] * 2, rel=1e-3)
    assert seen["undone"] == seen["undone light"] == first
    assert seen["undone all"] == [-1, -1]  # no image
    assert seen["redone"] == seen["redone light"] == first
    assert seen["redone all"] == second


def test_a_running_bake_survives_undo_and_keeps_its_result(seen):
    assert seen["runs"]
    assert seen["still runs"]
    # This bake has more texels, which sample the border a little differently.
    assert seen["baked across undo"] == pytest.approx([7 * seen["baked 1"][0]] * 2, rel=0.05)
    # Undo takes the size back, too. Blender may keep the larger pixels all the same, or free them, as for a redraw:
    # then the bake says that it made the image larger again.
    assert all("was resized during the bake" in line for line in seen["said"])
    assert seen["undone at last"] == seen["baked 3"]


def row():
    """Status of the one target, and whether its messages speak of undo."""
    stale.refresh(bpy.context)
    (found,) = state.rows.values()
    texts = map(str, found.messages)
    said = [text for text in texts if "Undo does not restore files: 'Plane_Medium.exr'" in text]
    return found.status, len(said)


@pytest.mark.parametrize("is_own", [False, True])
def test_a_file_is_not_undone_and_the_results_say_so(is_own, tmp_path):
    """The file of an image that the bake has made, or of one that was there before."""
    image, settings = None, bpy.context.scene.beamspread
    settings.image_dir, settings.resolution, path = str(tmp_path), 16, tmp_path / "Plane_Medium.exr"
    if is_own:
        image = file_image(path, 16, 16)
    plane, sun = add_plane(material=add_material(image=image)), add_sun(0)
    for strength in (1.0, 3.0):
        sun.data.energy = strength
        bpy.ops.ed.undo_push(message="light")
        bake(plane)
        bpy.ops.ed.undo_push(message="bake")
    baked, undo, redo = path.read_bytes(), bpy.ops.ed.undo, bpy.ops.ed.redo
    brightness = pixels(bpy.data.images[-1]).mean()
    assert row() == (Status.BAKED, 0)
    later, unlike = (Status.WARNED, 1), (Status.STALE, 1)
    before = unlike if is_own else (Status.NEVER, 0)  # its image is not there
    steps = [(undo, later), (undo, unlike), (undo, before), (redo, unlike), (redo, later), (redo, (Status.BAKED, 0))]
    for step, expected in steps:
        step()
        assert row() == expected
        if expected != (Status.NEVER, 0):
            assert pixels(node_of(bpy.data.materials["Medium"]).image).mean() == brightness
    assert path.read_bytes() == baked
    undo()
    undo()
    bake(bpy.data.objects["Plane"])
    assert row() == (Status.BAKED, 0)
    assert path.read_bytes() != baked
