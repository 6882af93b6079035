"""Cycles works on a copy of the scene: the scene stays unchanged, and no file or process is left behind."""

import os
import subprocess
import tempfile
from pathlib import Path

import bpy
import pytest
import scenes
from beamspread.blender.cycles import cycles_light, process
from beamspread.blender.cycles.folders import PREFIX, remove_leftovers
from beamspread.blender.cycles.scene_copy import SceneCopy
from beamspread.core.bake.runner import CANCELLED, FAILED
from beamspread.core.native import native
from indirect_scenes import add_scene, jobs_of

pytestmark = pytest.mark.usefixtures("few_nodes")


def state():
    """All that an artist could notice of the scene."""
    scene, view_layer = bpy.context.scene, bpy.context.view_layer
    view_layer.update()
    data = {
        kind: [(one.name, one.users, one.is_evaluated) for one in getattr(bpy.data, kind)]
        for kind in ("scenes", "objects", "meshes", "materials", "images", "worlds", "lights", "cameras", "node_groups")
    }
    objects = [
        (
            *(obj.name, obj.hide_render, obj.hide_viewport, obj.visible_glossy, obj.visible_diffuse, obj.mode),
            *(obj.select_get(), obj.hide_get(), [slot.material and slot.material.name for slot in obj.material_slots]),
            [tuple(row) for row in obj.matrix_world],
        )
        for obj in scene.objects
    ]
    trees = [
        (one.name, [(node.name, node.bl_idname) for node in one.node_tree.nodes], len(one.node_tree.links))
        for one in [*bpy.data.materials, *bpy.data.worlds]
        if one.node_tree
    ]
    images = [(one.name, one.is_dirty, one.filepath, one.source, tuple(one.size)) for one in bpy.data.images]
    names = "samples", "seed", "glossy_bounces", "diffuse_bounces", "use_denoising", "sample_clamp_indirect"
    cycles = [getattr(scene.cycles, name) for name in names]
    active = view_layer.objects.active and view_layer.objects.active.name
    frame = scene.frame_current, scene.frame_subframe, scene.render.engine, scene.render.filepath
    return data, objects, trees, images, cycles, active, frame, bpy.data.filepath, bpy.data.is_dirty


def folders():
    return set(Path(tempfile.gettempdir()).glob(f"{PREFIX}{os.getpid()}-*"))


def test_the_scene_stays_as_it_is(monkeypatch, tmp_path, caplog):
    floor = add_scene()
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 8)
    dirty = bpy.data.images.new("In memory", 8, 8)
    dirty.pixels[0] = 0.5
    bpy.context.scene.frame_set(7)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    saved = []
    handler = lambda *_: saved.append(1)  # noqa: E731
    bpy.app.handlers.save_pre.append(handler)
    try:
        before, there = state(), folders()
        (bake,) = jobs_of(floor)
        bake.run()
        assert bake.texture is not None
        assert state() == before

        (bake,) = jobs_of(floor)
        broken = tmp_path / "broken.py"
        broken.write_text("import os\nprint('what went wrong', flush=True)\nos._exit(5)\n")
        monkeypatch.setattr(process, "CHILD", broken)
        process.end()
        bake.run()
        assert bake.status == FAILED
        assert "exit code 5" in bake.error
        assert "what went wrong" in caplog.text
        assert state() == before
        assert not saved
    finally:
        bpy.app.handlers.save_pre.remove(handler)
    del bake
    assert folders() <= there


def test_cancelling_kills_the_process(monkeypatch):
    floor = add_scene()
    monkeypatch.setattr(cycles_light, "NOISE", 1e-5)
    monkeypatch.setattr(cycles_light, "MAX_SAMPLES", 300)
    children = []

    class Popen(subprocess.Popen):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            children.append(self)

    process.end()
    monkeypatch.setattr(process.subprocess, "Popen", Popen)
    before, there = state(), folders()
    (bake,) = jobs_of(floor)
    assert not folders() <= there
    fractions = []

    def progress(fraction):
        fractions.append(fraction)
        return fraction < 0.2

    bake.run(progress)
    assert bake.status == CANCELLED
    (child,) = children
    assert child.returncode is not None
    assert child.returncode != 0
    assert 0.2 <= fractions[-1] < 0.5  # it had begun, and had not ended
    assert state() == before
    del bake
    assert folders() <= there


def test_folders_of_killed_processes_go(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    leftover = tmp_path / f"{PREFIX}abc"
    leftover.mkdir()
    ours = SceneCopy(bpy.context.scene, bpy.context.view_layer)
    for folder in (leftover, ours.folder):
        os.utime(folder, (0, 0))
    remove_leftovers()
    assert not leftover.exists()
    assert ours.folder.exists()


def test_a_process_that_is_cancelled_at_once():
    scenes.add_sun()
    with SceneCopy(bpy.context.scene, bpy.context.view_layer) as copy, pytest.raises(native.Cancelled):
        process.run(copy, "world", {}, lambda _fraction: False)
