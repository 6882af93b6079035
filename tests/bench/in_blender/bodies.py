"""Runs inside the bpy module: whole bakes of bodies that are large against marble, beside those of a plane.

PYTHONPATH=build/bpy-4.5:build/stage build/venv/bin/python tests/bench/in_blender/bodies.py [SIDE [RUNS]]

CPU seconds of all threads, the least of some runs: to read the scene and the mesh, and to bake. Ratios are those to a
plane of as many texels.
"""

import os
import sys
import time

import beamspread
import bpy
import numpy as np
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.node.find import find_bakeable
from beamspread.core.progress import Progress

HILLS = 200
"""Faces along a side of the hills."""


def hills():
    x, y = np.meshgrid(*[np.linspace(-1, 1, HILLS + 1)] * 2)
    points = np.stack([x, y, 0.1 * np.sin(6 * x) + 0.1 * np.cos(6 * y)], -1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(x.shape)
    faces = np.stack([numbers[:-1, :-1], numbers[:-1, 1:], numbers[1:, 1:], numbers[1:, :-1]], -1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Hills")
    mesh.from_pydata(points.tolist(), [], faces.tolist())
    uvs = (points[faces.ravel(), :2] + 1) / 2
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", uvs.astype(np.float32).ravel())
    obj = bpy.data.objects.new("Hills", mesh)
    bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.objects.active = obj


def head():
    bpy.ops.mesh.primitive_monkey_add()
    bpy.context.object.modifiers.new("Fine", "SUBSURF").render_levels = 3


BODIES = {
    "plane": lambda: bpy.ops.mesh.primitive_plane_add(size=2),
    "ball": lambda: bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48),
    "hills": hills,
    "head": head,
}


def add_scene(body, light):
    """A body of marble below a lamp or a sun without a size."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    BODIES[body]()
    obj = bpy.context.view_layer.objects.active
    obj.data.polygons.foreach_set("use_smooth", [True] * len(obj.data.polygons))
    material = bpy.data.materials.new("Marble")
    material.use_nodes = True
    material.node_tree.nodes.new("BeamspreadNode").preset = "marble"
    obj.data.materials.append(material)
    data = bpy.data.lights.new("Lamp", light)
    data.energy = 3 if light == "SUN" else 300
    if light == "SUN":
        data.angle = 0
    else:
        data.shadow_soft_size = 0
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location, lamp.rotation_euler = (0.7, 0.4, 3), (0.5, 0.3, 0)
    bpy.context.collection.objects.link(lamp)
    bpy.context.scene.beamspread.use_indirect = False


def measured(body, light, side, runs):
    """Covered texels; CPU seconds to read, to bake first, and to bake again."""
    add_scene(body, light)
    settings, reading, baking = bpy.context.scene.beamspread.for_bake(), [], []
    for _ in range(runs):
        start = time.process_time()
        (plan,) = read_scene(bpy.context, find_bakeable(bpy.context.view_layer), side)
        bake = plan.bake(settings)
        read = time.process_time()
        bake.run(Progress())
        reading.append(read - start)
        baking.append(time.process_time() - read)
    return int(bake.job.receiver.inside().sum()), min(reading), baking[0], min(baking[1:])


def main(side=512, runs=5):
    beamspread.register()
    for light in ("POINT", "SUN"):
        plane = None
        for body in BODIES:
            texels, reading, first, again = measured(body, light, side, runs)
            of_plane = plane = plane or (texels, reading, again)
            ratio = again / of_plane[2] * of_plane[0] / texels
            whole = (reading + again) / sum(of_plane[1:]) * of_plane[0] / texels
            print(
                f"{light:5} {body:6} {texels:8d} texels: read {reading:.3f}, bake {first:.3f}, {again:.3f} s; "
                f"{ratio:.1f} times a plane, {whole:.1f} with reading",
                flush=True,
            )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
    os._exit(0)
