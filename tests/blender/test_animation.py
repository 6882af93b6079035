"""Bake Animation and Bake to Files, batches by a button; and warnings where one bake meets moving light."""

import shlex

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender import compat
from beamspread.blender.images.facts import facts_of, is_sequence
from beamspread.blender.jobs import frozen
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run import files_run
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.read.motion import Motion, is_animated
from beamspread.core.bake import runner
from beamspread.core.native import native
from mathutils import Matrix
from nodes import Nodes
from panel_layout import panel


@pytest.fixture
def plane(tmp_path):
    """Under a sun that grows from 1 to 10 in frames 1 to 10, in a saved scene of the frames 3 to 5."""
    plane = scenes.add_plane(material=scenes.add_material())
    sun = scenes.add_sun(20)
    for frame in (1, 10):
        sun.data.energy = frame
        sun.data.keyframe_insert("energy", frame=frame)
    for curve in compat.curves_of(sun.data.animation_data):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 3, 5
    scenes.save_scene(tmp_path)
    scenes.select(plane)
    files_run._written.clear()
    return plane


def files(tmp_path):
    return sorted(path.name for path in (tmp_path / "beamspread").iterdir())


def mean(tmp_path, name):
    return native.read_exr(str(tmp_path / "beamspread" / name))[0].mean()


def times(tmp_path):
    return {path.name: path.stat().st_mtime_ns for path in (tmp_path / "beamspread").iterdir()}


NAMES = [f"Plane_Medium_{number:04d}.exr" for number in (3, 4, 5)]


class TestBakeAnimation:
    def test_bakes_each_frame_of_the_scene_and_shows_the_sequence(self, plane, tmp_path):
        scenes.bake(plane)
        own = scenes.image_of(plane)
        bpy.context.scene.frame_set(7)
        assert bpy.ops.beamspread.bake_animation() == {"FINISHED"}
        assert bpy.context.scene.frame_current == 7
        assert files(tmp_path) == NAMES
        # The light is linear in the sun's strength; files have 24 bits of mantissa.
        assert np.array([mean(tmp_path, name) for name in NAMES]) / mean(tmp_path, NAMES[0]) == pytest.approx(
            [1, 4 / 3, 5 / 3], rel=1e-5
        )
        image = scenes.image_of(plane)
        assert is_sequence(image)
        assert facts_of(image).former == own
        assert facts_of(image).frames[:2] == (3, 5)
        for frame in (3, 4, 5):
            bpy.context.scene.frame_set(frame)
            stale.refresh(bpy.context)
            (row,) = state.rows.values()
            assert (row.status, str(row.messages[0])) == (Status.BAKED, "Shows the frames 3 to 5.")

    def test_is_what_a_batch_writes(self, plane, tmp_path):
        bpy.ops.beamspread.bake_animation()
        ours = {name: native.read_exr(str(tmp_path / "beamspread" / name))[0] for name in NAMES}
        assert scenes.run_batch("--frames", "3-5").all_written()
        for name in NAMES:
            assert np.array_equal(ours[name], native.read_exr(str(tmp_path / "beamspread" / name))[0])

    @pytest.mark.parametrize("file_format", ["EXR", "EXR_HALF", "PNG"])
    def test_again_bakes_only_what_has_changed(self, plane, tmp_path, capfd, file_format):
        bpy.context.scene.beamspread.format = file_format
        bpy.ops.beamspread.bake_animation()
        before, sequence = times(tmp_path), scenes.image_of(plane)
        capfd.readouterr()
        assert bpy.ops.beamspread.bake_animation() == {"FINISHED"}
        assert times(tmp_path) == before
        assert "Baked 0 frames of Plane / Medium; 3 were up to date" in capfd.readouterr().out
        assert scenes.image_of(plane) == sequence  # and no copy of it
        light = bpy.data.lights["Sun"]
        for frame, energy in ((3, 3), (4, 7), (5, 5)):
            light.energy = energy
            light.keyframe_insert("energy", frame=frame)
        bpy.ops.beamspread.bake_animation()
        after = times(tmp_path)
        ending = files(tmp_path)[0].partition(".")[2]
        assert [name for name in after if after[name] != before[name]] == [f"Plane_Medium_0004.{ending}"]
        assert bpy.ops.beamspread.bake_animation() == {"FINISHED"}
        assert times(tmp_path) == after

    def test_another_range_keeps_frames_that_are_done(self, plane, tmp_path):
        bpy.ops.beamspread.bake_animation()
        before = times(tmp_path)
        settings = bpy.context.scene.beamspread
        settings.use_frame_range, settings.frame_first, settings.frame_last = True, 4, 7
        bpy.ops.beamspread.bake_animation()
        after = times(tmp_path)
        assert {name: after[name] for name in before} == before
        assert sorted(set(after) - set(before)) == [f"Plane_Medium_{number:04d}.exr" for number in (6, 7)]
        assert facts_of(scenes.image_of(plane)).frames[:2] == (3, 7)

    def test_a_damaged_file_or_one_of_another_size_is_baked_again(self, plane, tmp_path):
        bpy.ops.beamspread.bake_animation()
        folder, before = tmp_path / "beamspread", times(tmp_path)
        (folder / NAMES[0]).write_bytes((folder / NAMES[0]).read_bytes()[:-100])
        bpy.ops.beamspread.bake_animation()
        assert times(tmp_path)[NAMES[1]] == before[NAMES[1]]
        assert native.read_exr(str(folder / NAMES[0]))[0].shape[:2] == (32, 32)
        bpy.ops.beamspread.show_single()
        bpy.context.scene.beamspread.resolution = 16
        bpy.ops.beamspread.bake_animation()
        assert {native.read_exr(str(folder / name))[0].shape[:2] for name in NAMES} == {(16, 16)}

    def test_a_cancelled_one_keeps_its_frames_and_goes_on(self, plane, tmp_path, monkeypatch, capfd):
        run, calls = runner.Bake.run, []

        def cancelling(bake, progress):
            calls.append(1)
            if len(calls) == 2:
                progress.cancel()
            run(bake, progress)

        monkeypatch.setattr(runner.Bake, "run", cancelling)
        assert bpy.ops.beamspread.bake_animation() == {"FINISHED"}  # of one frame
        assert files(tmp_path) == NAMES[:1]
        assert "Files that are done stay" in capfd.readouterr().out
        assert facts_of(scenes.image_of(plane)).frames[:2] == (3, 3)
        before = times(tmp_path)
        assert bpy.ops.beamspread.bake_animation() == {"FINISHED"}
        assert files(tmp_path) == NAMES
        assert times(tmp_path)[NAMES[0]] == before[NAMES[0]]
        assert len(calls) == 4
        assert facts_of(scenes.image_of(plane)).frames[:2] == (3, 5)

    def test_one_that_fails_leaves_the_others_and_says_at_which_frame(self, plane, tmp_path):
        other = scenes.add_plane("Other", matrix=Matrix.Translation((5, 0, 0)), material=scenes.add_material("Second"))
        node = scenes.node_of(other.data.materials[0])
        for frame, value in ((3, 0.5), (4, 1.0)):
            node.albedo = (value,) * 3
            node.keyframe_insert("albedo", frame=frame)
        scenes.select(plane, other)
        said = scenes.messages_of(bpy.ops.beamspread.bake_animation)
        assert "Frame 4: The albedo's red is 1" in said
        assert files(tmp_path) == ["Other_Second_0003.exr", *NAMES]

    def test_an_own_uv_map_shows_the_sequence(self, tmp_path):
        scenes.add_sun(20)
        obj = scenes.add_plane(material=scenes.add_material(), uvs=None)
        scenes.save_scene(tmp_path)
        bpy.context.scene.frame_end = 1
        scenes.select(obj)
        bpy.ops.beamspread.bake_animation()
        tree = scenes.node_of(obj.data.materials[0]).node_tree
        shown = tree.nodes["UV Map"]
        assert "Beamspread" in (getattr(shown, "uv_map", ""), getattr(shown, "attribute_name", ""))

    def test_what_it_can_not_do_is_said_before_it_begins(self, plane, monkeypatch):
        monkeypatch.setattr(files_run, "read_scene", lambda *_: pytest.fail("the scene was read"))
        settings = bpy.context.scene.beamspread
        settings.use_frame_range, settings.frame_first, settings.frame_last = True, 5, 3
        assert "end before they begin" in scenes.messages_of(bpy.ops.beamspread.bake_animation)
        settings.use_frame_range, bpy.context.scene.frame_start = False, -2
        bpy.context.scene.use_preview_range = True
        bpy.context.scene.frame_preview_start = -2
        assert "Begin at 0" in scenes.messages_of(bpy.ops.beamspread.bake_animation)
        bpy.context.scene.use_preview_range, bpy.context.scene.frame_start = False, 3
        settings.output, settings.format = "DIRECTION", "PNG"
        assert "can't hold directions" in scenes.messages_of(bpy.ops.beamspread.bake_animation)

    def test_a_scene_that_was_never_saved_has_no_folder(self):
        scenes.add_sun()
        scenes.select(scenes.add_plane(material=scenes.add_material()))
        assert "Save it, or choose another folder" in scenes.messages_of(bpy.ops.beamspread.bake_animation)

    def test_the_frames_are_those_of_the_preview_range_if_it_is_on(self, plane):
        scene = bpy.context.scene
        assert files_run.frames_of(scene) == (3, 5)
        scene.use_preview_range, scene.frame_preview_start, scene.frame_preview_end = True, 4, 4
        assert files_run.frames_of(scene) == (4, 4)


class TestBakeToFiles:
    def test_the_present_frame_goes_to_the_folder_and_nodes_keep_their_images(self, plane, tmp_path):
        scenes.bake(plane)
        own = scenes.image_of(plane)
        before = scenes.pixels(own)
        bpy.context.scene.frame_set(10)
        assert bpy.ops.beamspread.bake_files() == {"FINISHED"}
        assert files(tmp_path) == ["Plane_Medium.exr"]
        assert mean(tmp_path, "Plane_Medium.exr") > 5 * before.mean()
        assert scenes.image_of(plane) == own
        assert np.array_equal(scenes.pixels(own), before)

    def test_the_command_is_that_of_a_batch(self, plane, tmp_path, capfd):
        assert bpy.ops.beamspread.copy_command() == {"FINISHED"}
        words = shlex.split(capfd.readouterr().out.partition("Copied: ")[2].splitlines()[0])
        assert words[1:4] == ["-b", str(tmp_path / "scene.blend"), "--python"]
        assert words[4].endswith("beamspread/batch.py")
        assert words[5:] == ["--", "--frames", "3-5", "--resume"]


class TestFrozenBakes:
    @pytest.fixture
    def baked(self, plane):
        """Shows one bake."""
        scenes.bake(plane)
        return plane

    def warnings(self):
        stale.refresh(bpy.context)
        return [str(message) for message in state.frozen]

    def test_a_changing_lamp_is_said_until_each_frame_has_its_bake(self, baked):
        text = "'Sun' changes with time, but 'Plane' shows one bake in all frames."
        assert self.warnings() == [f"{text} {frozen.REMEDY}"]
        assert text in panel()
        bpy.ops.beamspread.bake_animation()
        assert self.warnings() == []

    def test_tiles_have_no_sequence_to_show(self, plane, tmp_path):
        bpy.context.scene.beamspread.use_udim = True
        scenes.bake(plane)
        bpy.ops.beamspread.bake_animation()
        assert len(list(tmp_path.rglob("Plane_Medium_000[345].1001.exr"))) == 3
        text = "'Sun' changes with time, but 'Plane' shows one bake in all frames."
        assert self.warnings() == [f"{text} {frozen.OF_TILES}"]
        assert frozen.OF_TILES in panel()

    def test_nothing_is_said_without_a_bake_or_motion(self, plane):
        assert self.warnings() == []
        scenes.bake(plane)
        bpy.data.lights["Sun"].animation_data_clear()
        assert self.warnings() == []
        camera = scenes.add_camera()
        camera.keyframe_insert("location", frame=1)
        camera.location.x = 3
        camera.keyframe_insert("location", frame=9)
        assert self.warnings() == []

    @pytest.mark.parametrize("ends_at", [3, 5])
    def test_rendering_an_animation_says_it_once(self, baked, tmp_path, caplog, ends_at):
        scenes.add_camera()
        scene = bpy.context.scene
        scene.frame_end, scene.render.filepath = ends_at, str(tmp_path / "frame")
        scene.cycles.samples, scene.cycles.use_denoising = 1, False
        scene.render.resolution_x = scene.render.resolution_y = 4
        bpy.ops.render.render(animation=True)
        assert caplog.text.count("shows one bake in all frames") == (ends_at > 3)


class TestMotion:
    def moving(self):
        motion = Motion(bpy.context.scene)
        return [*motion.lamps()], [*motion.objects()]

    def key(self, block, path, values):
        for frame, value in enumerate(values, 1):
            setattr(block, path, value)
            block.keyframe_insert(path, frame=frame)

    def test_lamps_by_their_place_data_nodes_and_what_they_follow(self):
        names = ("still", "constant", "moved", "brighter", "nodes", "child", "follower", "driven", "hidden")
        lamps = {name: scenes.add_lamp((0, 0, 1), name=name) for name in names}
        self.key(lamps["constant"], "location", [(0, 0, 1), (0, 0, 1)])
        self.key(lamps["moved"], "location", [(0, 0, 1), (0, 0, 2)])
        self.key(lamps["hidden"], "location", [(0, 0, 1), (0, 0, 2)])
        lamps["hidden"].hide_render = True
        self.key(lamps["brighter"].data, "energy", [1, 2])
        emission = Nodes(lamps["nodes"].data).of_type("EMISSION").inputs["Strength"]
        self.key(emission, "default_value", [1, 2])
        lamps["child"].parent = lamps["moved"]
        lamps["follower"].constraints.new("COPY_LOCATION").target = lamps["moved"]
        lamps["driven"].driver_add("location", 2).driver.expression = "frame / 10"
        lamps, objects = self.moving()
        assert sorted(lamps) == ["brighter", "child", "driven", "follower", "moved", "nodes"]
        assert not objects

    def test_the_world(self):
        _nodes, background = scenes.add_world()
        assert self.moving() == ([], [])
        self.key(background.inputs["Strength"], "default_value", [1, 2])
        assert self.moving() == (["World"], [])

    def test_objects_by_their_shape_materials_and_modifiers(self):
        planes = {name: scenes.add_plane(name) for name in ("still", "moved", "shaped", "glowing", "cloth")}
        self.key(planes["moved"], "location", [(0, 0, 1), (0, 0, 2)])
        planes["shaped"].shape_key_add(name="Basis")
        self.key(planes["shaped"].shape_key_add(name="Bent"), "value", [0, 1])
        material = scenes.glowing_material()
        planes["glowing"].data.materials.append(material)
        emission = next(node for node in material.node_tree.nodes if node.type == "EMISSION")
        self.key(emission.inputs["Strength"], "default_value", [1, 2])
        planes["cloth"].modifiers.new("Cloth", "CLOTH")
        lamps, objects = self.moving()
        assert sorted(objects) == ["cloth", "glowing", "moved", "shaped"]
        assert not lamps

    def test_objects_that_follow_each_other_in_a_circle_end(self):
        first, second = scenes.add_plane("A"), scenes.add_plane("B")
        first.constraints.new("TRACK_TO").target = second
        second.constraints.new("TRACK_TO").target = first
        assert self.moving() == ([], [])

    def test_strips_count(self):
        lamp = scenes.add_lamp((0, 0, 1))
        self.key(lamp, "location", [(0, 0, 1), (0, 0, 2)])
        action, lamp.animation_data.action = lamp.animation_data.action, None
        assert not is_animated(lamp)
        lamp.animation_data.nla_tracks.new().strips.new("Strip", 1, action)
        assert is_animated(lamp)
