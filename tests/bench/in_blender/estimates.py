"""Runs inside the bpy module for estimates.py: bakes a scene, and prints a line of JSON for each bake.

python THIS SCENE RESOLUTION TIMES, where resolution 0 is the scene's own.
"""

import json
import os
import sys
import threading
import time
from pathlib import Path

import beamspread
import bpy
import numpy as np
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.jobs.state import state
from beamspread.blender.node.find import find_bakeable
from beamspread.core.bake.forecast import seconds_of
from beamspread.core.progress import Progress

# Seconds between two looks at a bake.
TICK = 0.1


def add_plane(scene):
    """A plane of marble low in the scene, and a sun if there is no lamp."""
    objects = [obj for obj in scene.objects if obj.type == "MESH"]
    corners = [obj.matrix_world @ type(obj.location)(corner) for obj in objects for corner in obj.bound_box]
    low, high = np.percentile(np.array(corners or [(-1, -1, 0), (1, 1, 1)]), (5, 95), axis=0)
    size = max(*(high - low)[:2], 1e-3)
    mesh = bpy.data.meshes.new("Marble plane")
    half = size / 4
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", [0, 0, 1, 0, 1, 1, 0, 1])
    obj = bpy.data.objects.new("Marble plane", mesh)
    obj.location = (*(low + high)[:2] / 2, low[2] + 0.02 * (high - low)[2] + 1e-3 * size)
    material = bpy.data.materials.new("Marble plane")
    material.use_nodes = True
    material.node_tree.nodes.new("BeamspreadNode").preset = "marble"
    mesh.materials.append(material)
    scene.collection.objects.link(obj)
    if not any(obj.type == "LIGHT" for obj in scene.objects):
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.data.energy, sun.rotation_euler = 3, (0.6, 0.3, 0)
        scene.collection.objects.link(sun)
    bpy.context.view_layer.update()


def cpu_seconds():
    """CPU seconds of this process and its children."""
    total = time.process_time()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == os.getpid():
            total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def measure(path, resolution, times):
    """Bake a scene; prints a line of JSON for each bake."""
    beamspread.register()
    bpy.ops.wm.open_mainfile(filepath=str(path))
    scene = bpy.context.scene
    resolution = scene.beamspread.resolution = resolution or scene.beamspread.resolution
    if not find_bakeable(bpy.context.view_layer):
        add_plane(scene)
    settings = scene.beamspread.for_bake()
    for _ in range(times):
        stale.refresh(bpy.context)
        for plan in read_scene(bpy.context, find_bakeable(bpy.context.view_layer), resolution):
            bake = plan.bake(settings)
            if bake.job is None:
                continue
            panel = state.announced.get(plan.target)
            result = {"scene": path.stem, "texels": list(bake.job.receiver.coverage.shape[::-1])}
            result["panel"] = seconds_of(panel.steps) if panel else 0.0
            result["planned"] = seconds_of(plan.forecast().steps(settings))
            result["steps"] = [(step.kind, step.seconds, step.corrected()) for step in bake.job.expected()]
            progress, looks, ended = Progress(), [], threading.Event()

            def watch(progress=progress, looks=looks, ended=ended):
                while not ended.wait(TICK):
                    look = progress.stage, progress.stage_fraction, progress.seconds_left(), progress.time_fraction()
                    looks.append((time.monotonic(), cpu_seconds(), *look))

            thread, began, cpu = threading.Thread(target=watch), time.monotonic(), cpu_seconds()
            thread.start()
            bake.run(progress)
            result["seconds"], result["cpu"] = time.monotonic() - began, cpu_seconds() - cpu
            ended.set()
            thread.join()
            result["looks"] = [(now - began, used - cpu, *look) for now, used, *look in looks]
            print("\n" + json.dumps(result), flush=True)
    os._exit(0)


if __name__ == "__main__":
    measure(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
