"""Frames of a batch as a sequence in the node, which follows the frame by itself."""

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.images.facts import ATTRIBUTE, is_sequence
from beamspread.blender.images.files import write_exr
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.native import native


@pytest.fixture
def plane(tmp_path):
    """Baked once, and at the frames 3 to 5 under a sun that grows stronger."""
    plane = scenes.add_plane(material=scenes.add_material())
    sun = scenes.add_sun(20)
    for frame in (1, 10):
        sun.data.energy = frame
        sun.data.keyframe_insert("energy", frame=frame)
    scenes.save_scene(tmp_path)
    scenes.bake(plane)
    assert scenes.run_batch("--frames", "3-5").all_written()
    return plane


def file_shown(tree, frame):
    """Number of the file that the inner tree's texture shows at a frame, as Blender counts."""
    user = tree.nodes["Image"].image_user
    assert user.use_auto_refresh
    return min(max(frame - user.frame_start + 1, 1), user.frame_duration) + user.frame_offset


def row_at(frame):
    bpy.context.scene.frame_set(frame)
    stale.refresh(bpy.context)
    (row,) = state.rows.values()
    return row


def test_the_row_names_changes_since_the_frame_that_is_shown(plane, tmp_path):
    bpy.ops.beamspread.show_frames()
    shown = "Shows the frames 3 to 5"
    for frame in (3, 4, 5):
        row = row_at(frame)
        assert (row.status, *map(str, row.messages)) == (Status.BAKED, f"{shown}.")
    assert [*map(str, row_at(9).messages)] == [f"{shown}. Changes since then are not known."]
    light = bpy.data.lights["Sun"]
    bpy.context.scene.frame_set(4)
    light.keyframe_insert("energy", frame=4)
    light.energy = 7
    light.keyframe_insert("energy", frame=3)
    assert [row_at(frame).status for frame in (3, 4)] == [Status.STALE, Status.BAKED]
    row = row_at(3)
    assert [*map(str, row.messages)] == [f"{shown}. Changed since this frame was baked: lights."]
    assert not row.is_stale  # for a bake of this image
    assert scenes.run_batch("--frames", "3-3").all_written()
    assert row_at(3).status == Status.BAKED
    # Older files and PNG files have no record.
    write_exr(tmp_path / "beamspread" / "Plane_Medium_0003.exr", np.ones((32, 32, 3), np.float32), {ATTRIBUTE: ""})
    assert [*map(str, row_at(3).messages)] == [f"{shown}. Changes since then are not known."]


def test_the_node_follows_the_frame(plane, tmp_path):
    node = scenes.node_of(plane.data.materials[0])
    own = node.image
    assert bpy.ops.beamspread.show_frames() == {"FINISHED"}
    assert is_sequence(node.image)
    assert [*map(str, row_at(5).messages)] == ["Shows the frames 3 to 5."]
    assert [file_shown(node.node_tree, frame) for frame in (1, 3, 4, 5, 9)] == [3, 3, 4, 5, 5]
    rendered = [render_brightness(plane, frame, tmp_path) for frame in (3, 4, 5)]
    written = [native.read_exr(str(path))[0].mean() for path in sorted((tmp_path / "beamspread").iterdir())]
    assert written[0] < written[1] < written[2]
    assert np.divide(rendered, rendered[0]) == pytest.approx(np.divide(written, written[0]), rel=0.02)
    # After the file is opened again, with the former image, which nothing else shows.
    name = own.name
    scenes.reopen(tmp_path)
    node = scenes.node_of(bpy.data.materials["Medium"])
    assert is_sequence(node.image)
    assert bpy.ops.beamspread.show_single() == {"FINISHED"}
    assert node.image.name == name
    assert scenes.pixels(node.image).any()


def render_brightness(plane, frame, folder):
    """Mean of a picture of the plane from above by Cycles, linear."""
    if bpy.context.scene.camera is None:
        scenes.add_camera()
        scenes.node_of(plane.data.materials[0]).ior = 1.0
    bpy.context.scene.frame_set(frame)
    return scenes.render(folder / f"picture{frame}.exr").mean()


def test_a_sequence_is_not_baked_into_and_a_batch_writes_its_frames_again(plane, tmp_path):
    bpy.ops.beamspread.show_frames()
    before = {path: path.read_bytes() for path in (tmp_path / "beamspread").iterdir()}
    scenes.select(plane)
    assert "Show Single Images" in scenes.messages_of(bpy.ops.beamspread.bake)
    bpy.data.lights["Sun"].animation_data_clear()
    bpy.data.lights["Sun"].energy = 20
    report = scenes.run_batch()
    assert [one.path for one in report.bakes] == [str(tmp_path / "beamspread" / "Plane_Medium.exr")]
    assert before == {path: path.read_bytes() for path in before}
    assert scenes.run_batch("--frames", "3-5").all_written()
    assert all(path.read_bytes() != content for path, content in before.items())


def test_gaps_and_missing_frames_are_reported(plane, tmp_path, capfd):
    (tmp_path / "beamspread" / "Plane_Medium_0004.exr").unlink()
    bpy.ops.beamspread.show_frames()
    assert "1 of the frames 3 to 5 of 'Plane / Medium' are missing" in capfd.readouterr().out
    for path in (tmp_path / "beamspread").iterdir():
        path.unlink()
    bpy.ops.beamspread.show_single()
    assert f"no frames in {tmp_path / 'beamspread'}: Bake Animation makes them" in scenes.messages_of(
        bpy.ops.beamspread.show_frames
    )
