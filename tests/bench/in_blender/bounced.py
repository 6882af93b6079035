"""Runs in Blender for bounced.py: SCENE [REFERENCE_SAMPLES]. Prints rows of a table.

The mirrors of the child process gather bounced light. Errors are those of the irradiance at the nodes, of texels
between them, and of means of 4 x 4 nodes. Two references with independent noise: the product of both differences has no
noise of its own.
"""

import math
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from beamspread.blender.cycles import child_fields
from beamspread.blender.cycles.child_filter import Grid, filter_map, insides
from beamspread.blender.cycles.child_ghost import add_ghost
from beamspread.core.bake.smoothing import SPLINE_VARIANCE
from beamspread.core.native import native
from beamspread.core.scene.lights import STRATA, WEIGHTS

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "blender"))
import scenes

NODES, LOOKS, TEXELS = 64, 3, 256
CHART = {
    "corner": [-1, -1, 1e-4],
    "x_axis": [1, 0, 0],
    "y_axis": [0, 1, 0],
    "normal": [0, 0, 1],
    "size": [2, 2],
    "nodes": [NODES, NODES],
}
REQUEST = {"charts": [CHART], "strata": STRATA.tolist()}


def quad(name, corners, color):
    add_mesh(name, corners, [(0, 1, 2, 3)], color)


def add_mesh(name, corners, faces, color):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    mesh.materials.append(scenes.diffuse_material(color, name))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def add_lamp(kind, energy, place=(0, 0, 0), turn=(0, 0, 0)):
    lamp = bpy.data.lights.new(kind, kind)
    lamp.energy = energy
    if kind == "AREA":
        lamp.size = 0.5
    obj = bpy.data.objects.new(kind, lamp)
    obj.location, obj.rotation_euler = place, turn
    bpy.context.scene.collection.objects.link(obj)


def add_scene(name):
    quad("Floor", [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], (0.5,) * 3)
    if name == "wall":
        quad("Wall", [(-0.8, 0.3, 0), (0.8, 0.3, 0), (0.8, 0.4, 0.9), (-0.8, 0.4, 0.9)], (0.9, 0.6, 0.3))
        add_lamp("SUN", 3.0, turn=(math.radians(40), 0, math.radians(60)))
        return
    quad("Back", [(-1, 1, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 2)], (0.8,) * 3)
    quad("Front", [(-1, -1, 0), (1, -1, 0), (1, -1, 2), (-1, -1, 2)], (0.8,) * 3)
    quad("Left", [(-1, -1, 0), (-1, 1, 0), (-1, 1, 2), (-1, -1, 2)], (0.8, 0.2, 0.2))
    quad("Right", [(1, -1, 0), (1, 1, 0), (1, 1, 2), (1, -1, 2)], (0.2, 0.7, 0.2))
    quad("Ceiling", [(-1, -1, 2), (1, -1, 2), (1, 1, 2), (-1, 1, 2)], (0.8,) * 3)
    foot = [(-0.3, -0.2), (0.2, -0.35), (0.35, 0.15), (-0.15, 0.3)]
    faces = [(4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    add_mesh("Box", [(x, y, z) for z in (0, 0.6) for x, y in foot], faces, (0.8,) * 3)
    add_lamp("AREA", 30.0, (0, 0.2, 1.9))


def irradiances(pixels):
    """Irradiance of both halves of the samples, (2, rows, columns, 3)."""
    (halves,) = child_fields.halves_of(REQUEST, np.nan_to_num(pixels))
    return np.pi * np.tensordot(halves, np.float32(WEIGHTS), (1, 0))


def between_nodes(values):
    """Values at texels, as irradiance of light whose radiance has these values at nodes."""
    axes = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    surface = native.Surface(native.ReceiverGrid((0, 0, 0), *axes, 1.0, 1.0, TEXELS, TEXELS))
    light = native.FieldLight(np.float32(values)[None], np.ones(1, np.float32), np.float32([[0, 0, -1]]))
    return native.bake_arrival(surface, [(light, (1, 1, 1), None)])[0]


def in_blocks(values):
    return values.reshape(NODES // 4, 4, NODES // 4, 4, 3).mean(axis=(1, 3))


def error(values, references, view):
    one, other = (view(values) - view(reference) for reference in references)
    return math.sqrt(max(float(np.mean(one * other)), 0.0)) / np.mean(references)


def main():
    name, samples = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 24
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_scene(name)
    scene = bpy.context.scene
    child_fields.set_up(scene, "INDIRECT")
    ghost, image = add_ghost(REQUEST["charts"], [*REQUEST["strata"]] * 2)
    scene.collection.objects.link(ghost)
    baker = child_fields.Baker(scene, ghost, image, "GLOSSY", "INDIRECT")
    references = [irradiances(baker.bake(samples)).mean(axis=0) for _ in range(2)]
    mean = np.mean(references)
    print(f"| {name}: samples | CPU time | at nodes, filtered | between, filtered, as estimated | of 4 x 4, filtered |")
    for count in (1, 2, 4, 8, 16):
        start = time.process_time()
        halves = [irradiances(baker.bake(count)) for _ in range(LOOKS)]
        seconds = (time.process_time() - start) / LOOKS
        clean = [
            filter_map(*pair, insides(np.ones((1, NODES, NODES, 3)), Grid()), SPLINE_VARIANCE, Grid())
            for pair in halves
        ]
        estimate = math.sqrt(np.mean([noise + blur for _, noise, blur in clean])) / mean
        pair, cells = ([one.mean(axis=0) for one in halves], [one for one, _, _ in clean]), []
        for view in (lambda values: values, between_nodes, in_blocks):
            found = [math.sqrt(np.mean([error(one, references, view) ** 2 for one in some])) for some in pair]
            cells.append(", ".join(f"{part:.2%}" for part in found))
        cells[1] += f", {estimate:.2%}"
        print(f"| {2 * count} | {seconds:.1f} s |", " | ".join(cells), "|")
    sys.stdout.flush()
    os._exit(0)


main()
