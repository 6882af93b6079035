"""Has Cycles render a world for minutes, and says which process does: python or blender cycles_parent.py -- STAGE

With "leave" after STAGE the script ends as soon as Cycles renders.
"""

import sys
import threading

import bpy

stage, *rest = sys.argv[sys.argv.index("--") + 1 :]
sys.path[:0] = [stage]
import beamspread  # noqa: E402
from beamspread.blender.cycles import process  # noqa: E402
from beamspread.blender.cycles.scene_copy import SceneCopy  # noqa: E402

beamspread.register()
scene = bpy.context.scene
scene.world = bpy.data.worlds.new("World")
request = {"width": 2048, "height": 1024, "samples": 100_000, "fine_samples": 1}


renders = threading.Event()


def progress(_fraction):
    child = process._kept._child
    if child.has_answered:
        print("renders", child._process.pid, flush=True)
        renders.set()


copy = SceneCopy(scene, bpy.context.view_layer)
if rest:
    threading.Thread(target=process.run, args=(copy, "world", request, progress), daemon=True).start()
    renders.wait()
    sys.exit()
with copy:
    process.run(copy, "world", request, progress)
