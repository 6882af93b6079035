"""Mirrors that gather the light that arrives at planes and bodies, by direction, when Cycles bakes them.

Part of the child process (child.py). A bake looks straight down on each of its points. A sharp mirror whose shading
normal lies halfway between that view and a direction w shows the radiance that arrives from w. Here w is drawn at
random for every sample, by the cosine, from one stratum of the hemisphere: the mean is the stratum's irradiance / pi
times the number of strata. Each stratum has a mirror of its own at the same place and a tile of its own in the image,
so one bake gathers all. Rays other than those of volumes don't see the mirrors, so they block nothing.
"""

import bpy
import numpy as np

from .. import compat

STRATUM, AXES = "stratum", ("x_axis", "y_axis", "z_axis")

# Corners of a square, counter-clockwise.
AROUND = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
AXES_OF_PLANE = "x_axis", "y_axis", "normal"

# Node that differs from round to round: the first sample of each bake is at the middle of its texel for any seed.
ROUND = "Round"


# Side of the mirrors at nodes of a mesh that bends, as fractions of their distance and of the largest coordinate.
# Larger ones cut into the mesh where it bends; smaller ones lose their shape to rounding.
SIDE_IN_SPACINGS, SIDE_IN_REACH = 1e-3, 1e-5


def add_ghost(charts, strata, is_diffuse=False):
    """Ghost object and its image; the tiles of each chart fill some rows of the image.

    Parameters
    ----------
    charts : dicts with nodes (columns, rows), and corner, x_axis, y_axis, normal, size (2) of a plane, or positions and
        normals (N, starts, 3) and spacing of the nodes of a mesh that bends.
    is_diffuse : True if white diffuse surfaces replace the mirrors.
    strata : (K, 4): begin and length of r^2, begin and length of the azimuth / 2 pi.
    """
    width = max(chart["nodes"][0] for chart in charts) * len(strata)
    height = sum(chart["nodes"][1] for chart in charts)
    parts, row = [], 0
    for chart in charts:
        quads_of = _quads_at_nodes if "positions" in chart else _quads_of_plane
        parts.append(quads_of(chart, np.array(strata, float), row))
        row += chart["nodes"][1]
    corners, uvs, values, axes = (np.concatenate(arrays) for arrays in zip(*parts))
    mesh = bpy.data.meshes.new("Beamspread ghost")
    mesh.from_pydata(corners.reshape(-1, 3).tolist(), [], np.arange(4 * len(corners)).reshape(-1, 4).tolist())
    uvs = uvs / (width, height)
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.ravel(uvs).astype(np.float32))
    values = np.repeat(values, 4, 0).astype(np.float32)
    mesh.attributes.new(STRATUM, "FLOAT_COLOR", "POINT").data.foreach_set("color", values.ravel())
    for name, filled in zip(AXES, np.repeat(axes, 4, 0).transpose(1, 0, 2)):
        mesh.attributes.new(name, "FLOAT_VECTOR", "POINT").data.foreach_set(
            "vector", np.ravel(filled).astype(np.float32)
        )
    image = bpy.data.images.new("Beamspread ghost", width, height, float_buffer=True, alpha=False)
    image.colorspace_settings.name = "Non-Color"
    mesh.materials.append(_diffuse(image) if is_diffuse else _mirror(image))
    obj = bpy.data.objects.new("Beamspread ghost", mesh)
    for kind in ("camera", "diffuse", "glossy", "transmission", "shadow"):
        setattr(obj, f"visible_{kind}", False)
    return obj, image


def _quads_of_plane(chart, strata, row):
    """A mirror over the whole plane for each stratum: corners (Q, 4, 3), texels (Q, 4, 2), strata (Q, 4), and axes
    (Q, 3, 3).
    """
    columns, rows = chart["nodes"]
    x_axis, y_axis, normal = (np.array(chart[name]) for name in AXES_OF_PLANE)
    # Counter-clockwise as seen from outside; a mirrored UV map makes the frame left-handed.
    around = AROUND if np.dot(np.cross(x_axis, y_axis), normal) > 0 else AROUND[::-1]
    corners = np.array(chart["corner"]) + around * chart["size"] @ np.stack([x_axis, y_axis])
    texels = around * (columns, rows) + (0, row) + np.arange(len(strata))[:, None, None] * (columns, 0)
    count = len(strata)
    axes = np.stack([x_axis, y_axis, normal])
    return np.broadcast_to(corners, (count, 4, 3)), texels, strata, np.broadcast_to(axes, (count, 3, 3))


def _quads_at_nodes(chart, strata, row):
    """A small mirror for each node and stratum, as of `_quads_of_plane`; strata start from different places."""
    positions, normals = (np.array(chart[name]) for name in ("positions", "normals"))
    nodes, starts = positions.shape[:2]
    number, node = (values.ravel() for values in np.meshgrid(np.arange(len(strata)), np.arange(nodes), indexing="ij"))
    # The places of both halves of a stratum differ, so that their difference shows how light changes in a node.
    half, stratum = np.divmod(number, max(len(strata) // 2, 1))
    start = (3 * stratum + half * (starts // 2) + node) % starts
    centers, axes = positions[node, start], frames(normals[node, start])
    side = SIDE_IN_SPACINGS * chart["spacing"] + SIDE_IN_REACH * np.abs(positions).max()
    corners = centers[:, None] + (AROUND - 0.5) * side @ axes[:, :2]
    columns = chart["nodes"][0]
    first = np.stack([number * columns + node % columns, row + node // columns], 1)
    return corners, first[:, None] + AROUND, strata[number], axes


def frames(normals):
    """Axes x, y, z (..., 3, 3) around unit normals (..., 3), as of `beamspread._native.BentNodes`."""
    x, y, z = np.moveaxis(normals, -1, 0)
    a = 1 / np.maximum(1 + z, 1e-12)
    b = -x * y * a
    return np.stack([np.stack([1 - x * x * a, b, -x], -1), np.stack([b, 1 - y * y * a, -y], -1), normals], -2)


def draw_anew(ghost, number: int) -> None:
    """Draw directions that differ from those of rounds with other numbers."""
    node = ghost.data.materials[0].node_tree.nodes.get(ROUND)
    if node is not None:
        node.inputs[1].default_value = (0, 0, number)


def _mirror(image):
    """Material of the mirrors; attributes of the mesh decide the direction that a ray sees."""
    material = _new_material()
    tree = material.node_tree
    link = tree.links.new

    def attribute(name):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        return node

    def math(operation, *inputs):
        return _operate(tree, "ShaderNodeMath", operation, inputs)

    def vector(operation, *inputs):
        return _operate(tree, "ShaderNodeVectorMath", operation, inputs)

    def scaled(axis, factor):
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "SCALE"
        link(node.inputs[0], attribute(axis).outputs["Vector"])
        link(node.inputs["Scale"], factor)
        return node.outputs[0]

    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = "UVMap"
    noise = tree.nodes.new("ShaderNodeTexWhiteNoise")
    noise.noise_dimensions = "3D"
    link(noise.inputs["Vector"], vector("ADD", uv.outputs[0], (0, 0, 0)))
    noise.inputs["Vector"].links[0].from_node.name = ROUND
    random = tree.nodes.new("ShaderNodeSeparateXYZ")
    link(random.inputs[0], noise.outputs["Color"])
    stratum = attribute(STRATUM)
    part = tree.nodes.new("ShaderNodeSeparateXYZ")
    link(part.inputs[0], stratum.outputs["Color"])
    # A point in the unit disk, below a direction of cosine-weighted density (Malley's method).
    squared = math("MULTIPLY_ADD", random.outputs[0], part.outputs[1], part.outputs[0])
    turn = math("MULTIPLY_ADD", random.outputs[1], stratum.outputs["Alpha"], part.outputs[2])
    azimuth, radius = math("MULTIPLY", turn, 2 * np.pi), math("SQRT", squared)
    height = math("SQRT", math("SUBTRACT", 1.0, squared))
    x = scaled(AXES[0], math("MULTIPLY", radius, math("COSINE", azimuth)))
    y = scaled(AXES[1], math("MULTIPLY", radius, math("SINE", azimuth)))
    direction = vector("ADD", vector("ADD", x, y), scaled(AXES[2], height))
    view = tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"]
    halfway = vector("NORMALIZE", vector("ADD", direction, view))

    glossy = tree.nodes.new("ShaderNodeBsdfGlossy")
    glossy.inputs["Roughness"].default_value = 0
    if "SHARP" in {item.identifier for item in glossy.bl_rna.properties["distribution"].enum_items}:
        glossy.distribution = "SHARP"
    link(glossy.inputs["Normal"], halfway)
    finish(tree, glossy, image)
    return material


def _diffuse(image):
    material = _new_material()
    finish(material.node_tree, material.node_tree.nodes.new("ShaderNodeBsdfDiffuse"), image)
    return material


def _new_material():
    material = bpy.data.materials.new("Beamspread ghost")
    compat.use_nodes(material)
    material.node_tree.nodes.clear()
    return material


def finish(tree, surface, image) -> None:
    """Link a white shader to the output, and add the image to bake to."""
    surface.inputs["Color"].default_value = (1, 1, 1, 1)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(output.inputs["Surface"], surface.outputs[0])
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    tree.nodes.active = target


def _operate(tree, kind, operation, inputs):
    node = tree.nodes.new(kind)
    node.operation = operation
    for socket, value in zip(node.inputs, inputs):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(socket, value)
        else:
            socket.default_value = value
    return node.outputs[0]
