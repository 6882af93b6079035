"""Facts about a bake that remain when names change, and when a bake with a file is undone."""

import bpy
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state


def make_baked():
    bpy.context.scene.beamspread.resolution = 32
    plane = scenes.add_plane(material=scenes.add_material())
    scenes.add_sun(0)
    scenes.bake(plane)
    return plane


def standings():
    stale.refresh(bpy.context)
    return [row.status for row in state.rows.values()]


@pytest.mark.parametrize("rename", ["objects", "materials", "images"])
def test_a_bake_is_known_under_a_new_name(rename):
    plane = make_baked()
    for block in getattr(bpy.data, rename):
        block.name = f"New {rename}"
    assert standings() == [Status.BAKED]
    plane.location.z = 1
    bpy.context.view_layer.update()
    assert standings() == [Status.STALE]
    scenes.bake(plane)
    assert standings() == [Status.BAKED]


def test_a_copy_is_not_taken_for_the_renamed_original():
    plane = make_baked()
    copy = plane.copy()
    bpy.context.collection.objects.link(copy)
    plane.name = "Renamed"
    copy.name = "Copy"
    bpy.context.view_layer.update()
    assert Status.BAKED not in standings()


def test_an_original_that_is_renamed_and_copied_at_once_keeps_its_bake():
    """No scan has seen the new name alone; the copy is far away, and light does not bounce."""
    bpy.context.scene.beamspread.use_indirect = False
    plane = make_baked()
    plane.name = "Renamed"
    copy = plane.copy()
    copy.location.x = 50
    bpy.context.collection.objects.link(copy)
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    rows = {target.object_name: row for target, row in state.rows.items()}
    assert set(rows) == {"Renamed", copy.name}
    assert rows["Renamed"].messages[0].text == f"Changed since its bake: '{copy.name}'."
    assert rows[copy.name].status == Status.NEVER
    bpy.data.objects.remove(copy)
    assert standings() == [Status.BAKED]


def test_a_renamed_original_names_the_copy_beside_it():
    """The copy takes light away; a further one that is removed again leaves nothing to say."""
    plane = make_baked()
    plane.name = "Renamed"
    assert standings() == [Status.BAKED]
    copies = [plane.copy() for _ in range(5)]
    for number, copy in enumerate(copies):
        copy.name, copy.location = f"Copy {number}", (0, 0, 3 + number)
        bpy.context.collection.objects.link(copy)
        bpy.context.view_layer.update()
        stale.refresh(bpy.context)
        (row,) = [row for target, row in state.rows.items() if target.object_name == "Renamed"]
        names = [f"'Copy {n}'" for n in range(number + 1)]
        words = ", ".join(names[:3]) + ["", "", "", " and 1 more object", " and 2 more objects"][number]
        assert (row.status, row.messages[0].text) == (Status.STALE, f"Changed since its bake: {words}.")
    for copy in copies:
        bpy.data.objects.remove(copy)
    assert standings() == [Status.BAKED]


def test_undo_leaves_a_file_and_its_facts(tmp_path):
    bpy.context.scene.beamspread.image_storage = "FILES"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    plane = make_baked()
    bpy.ops.ed.undo_push(message="first")
    bpy.data.objects["Sun"].data.energy = 3
    bpy.ops.ed.undo_push(message="brighter")
    second = scenes.bake(plane)[0].copy()
    bpy.ops.ed.undo_push(message="second")
    bpy.ops.ed.undo()
    image = scenes.node_of(bpy.data.materials["Medium"]).image
    assert scenes.pixels(image).mean() == pytest.approx(second.mean())
    assert standings() == [Status.WARNED]  # the light is that of the file, which undo has not brought back
    bpy.ops.ed.undo()
    assert standings() == [Status.STALE]
    bpy.ops.ed.redo()
    assert standings() == [Status.WARNED]
    bpy.ops.ed.redo()
    assert standings() == [Status.BAKED]


def test_a_file_that_is_gone_is_said(tmp_path):
    bpy.context.scene.beamspread.image_storage = "FILES"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    make_baked()
    bpy.ops.wm.save_mainfile()
    next((tmp_path / "textures").iterdir()).unlink()
    assert standings() == [Status.STALE]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert standings() == [Status.STALE]
    assert [row.messages[0].text for row in state.rows.values()] == ["Changed since its bake: image file (missing)."]
