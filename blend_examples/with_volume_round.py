"""Renders freckled_arm with light that Cycles traces through the arm as a volume, all else being the same:

    blender -b --factory-startup blend_examples/freckled_arm.blend --python-exit-code 1 \\
        --python blend_examples/with_volume_round.py -- OUT.png OUT.csv SAMPLES BAKED.exr...

As with_volume.py, for a round arm: the texture goes straight toward the middle line. A ghost measures light where the
camera sees the arm between its sleeves.
"""

import math
import sys
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import beamspread  # noqa: E402
import cycles_slab  # noqa: E402
import freckled_arm as arm  # noqa: E402
import with_volume as flat  # noqa: E402

ROWS = slice(16, 112)  # of the texels that the ghost covers
COLUMNS = slice(24, 168)


def place(nodes, links):
    """Texture coordinates of a point in the arm."""
    at, apart, turn = (nodes.new(f"ShaderNode{kind}") for kind in ("NewGeometry", "SeparateXYZ", "Math"))
    height, u, v, joined = (nodes.new(f"ShaderNode{kind}") for kind in ("Math", "Math", "Math", "CombineXYZ"))
    links.new(at.outputs["Position"], apart.inputs[0])
    height.operation, height.inputs[1].default_value = "SUBTRACT", arm.RADIUS
    links.new(apart.outputs["Z"], height.inputs[0])
    turn.operation = "ARCTAN2"
    links.new(apart.outputs["Y"], turn.inputs[0])
    links.new(height.outputs[0], turn.inputs[1])
    for node, source, length in ((u, turn.outputs[0], 2 * math.pi), (v, apart.outputs["X"], arm.LENGTH)):
        node.operation = "MULTIPLY_ADD"
        node.inputs[1].default_value, node.inputs[2].default_value = 1 / length, 0.5
        links.new(source, node.inputs[0])
    links.new(u.outputs[0], joined.inputs["X"])
    links.new(v.outputs[0], joined.inputs["Y"])
    return joined.outputs[0]


def add_body(node):
    """The arm, longer than its mesh, with ends."""
    half = arm.LENGTH / 2 + flat.ENDS * max(node.mean_free_path)
    body = arm.tube("Body", arm.RADIUS, -half, half, flat.volume(node, place))
    corners = [vertex.co[:] for vertex in body.data.vertices]
    sides = [tuple(face.vertices) for face in body.data.polygons]
    ends = [tuple(range(arm.FACETS)), tuple(range(2 * arm.FACETS - 1, arm.FACETS - 1, -1))]
    body.data.clear_geometry()
    body.data.from_pydata(corners, [], sides + ends)
    bpy.context.view_layer.update()
    return body


def add_ghost(node):
    """A ghost with a face for each texel, and the image that its light is baked to."""
    columns, rows = (part.stop - part.start for part in (COLUMNS, ROWS))
    turn = 2 * np.pi * (COLUMNS.start + np.arange(columns + 1)) / arm.TEXELS[0]
    x = ((ROWS.start + np.arange(rows + 1)) / arm.TEXELS[1] - 0.5) * arm.LENGTH
    radius = arm.RADIUS + flat.HEIGHT * min(node.mean_free_path)
    turn, x = np.meshgrid(turn, x)
    corners = np.stack([x, -radius * np.sin(turn), arm.RADIUS - radius * np.cos(turn)], -1).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    # Normals look inward.
    faces = np.stack([first, first + 1, first + columns + 2, first + columns + 1], -1)
    uv = np.stack([faces % (columns + 1) / columns, faces // (columns + 1) / rows], -1)
    return cycles_slab.make_ghost(corners.tolist(), faces.tolist(), uv.reshape(-1, 2).tolist(), columns, rows)


def main():
    picture, table, samples, *files = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        skin = bpy.data.objects["Arm"]
        node = flat.beamspread_node(skin)
        skin.hide_render = True
        body = add_body(node)
        ghost, image = add_ghost(node)
        exitance = flat.measured(image, body, node, table, int(samples), files, np.s_[ROWS, COLUMNS])
        for obj in (body, ghost):
            bpy.data.objects.remove(obj)
        skin.hide_render = False
        whole = np.zeros((*arm.TEXELS[::-1], 3))
        whole[ROWS, COLUMNS] = exitance
        flat.render(node, whole, picture)
    finally:
        beamspread.unregister()


main()
