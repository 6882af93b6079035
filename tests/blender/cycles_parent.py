"""Has Cycles render a world for minutes, and says which process does: python or blender cycles_parent.py -- STAGE"""

import sys

import bpy

sys.path[:0] = [sys.argv[-1]]
import beamspread  # noqa: E402
from beamspread.blender.cycles import process  # noqa: E402
from beamspread.blender.cycles.scene_copy import SceneCopy  # noqa: E402

beamspread.register()
scene = bpy.context.scene
scene.world = bpy.data.worlds.new("World")
request = {"width": 2048, "height": 1024, "samples": 100_000, "fine_samples": 1}


def progress(_fraction):
    child = process._kept._child
    if child.has_answered:
        print("renders", child._process.pid, flush=True)


with SceneCopy(scene, bpy.context.view_layer) as copy:
    process.run(copy, "world", request, progress)
