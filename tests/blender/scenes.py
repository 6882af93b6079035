"""Small scenes for the tests, and the exact numbers to compare with."""

from __future__ import annotations

import csv
import math
import sys
from pathlib import Path

import beamspread
import bpy
import numpy as np
from beamspread.blender.jobs.run.batch_run import bake_all
from beamspread.core.batch import batch_options
from beamspread.core.native import native
from mathutils import Matrix
from nodes import Nodes, add_sockets

REFERENCE = Path(__file__).resolve().parent.parent / "reference" / "adding_doubling.csv"
BATCH = Path(beamspread.__file__).parent / "batch.py"
SQUARE_UVS = ((0, 0), (1, 0), (1, 1), (0, 1))


def add_mesh(name, vertices, faces, matrix=None, uvs=None):
    """A mesh object; `uvs` has one pair per face corner."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    if uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap")
        layer.data.foreach_set("uv", np.asarray(uvs, np.float32).ravel())
    obj = bpy.data.objects.new(name, mesh)
    obj.matrix_world = matrix or Matrix()
    bpy.context.collection.objects.link(obj)
    return obj


def add_plane(name="Plane", size=(2.0, 2.0), matrix=None, uvs=SQUARE_UVS, material=None):
    """A rectangle around the origin in xy, normal +z; `uvs` for its corners from (-x, -y) counter-clockwise."""
    x, y = size[0] / 2, size[1] / 2
    obj = add_mesh(name, [(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)], [(0, 1, 2, 3)], matrix, uvs)
    if material is not None:
        obj.data.materials.append(material)
    return obj


def add_material(name="Medium", image=None, linked=False, shader=False, **properties):
    """A material with a Beamspread node; it shows nothing, or with `shader` the Principled BSDF of new materials."""
    material = bpy.data.materials.new(name)
    tree = Nodes(material).tree
    for link in () if shader else list(tree.links):
        tree.links.remove(link)
    node = tree.nodes.new("BeamspreadNode")
    values = {"albedo": (0.9, 0.8, 0.6), "mean_free_path": (0.05,) * 3, "ior": 1.0}
    for key, value in (values | properties).items():
        setattr(node, key, value)
    node.image = image
    if linked:
        tree.links.new(tree.get_output_node("ALL").inputs["Surface"], node.outputs["BSDF"])
    return material


def diffuse_material(color, name="Diffuse"):
    nodes = Nodes(bpy.data.materials.new(name), clear=True)
    return nodes.finish(nodes.add("BsdfDiffuse", {"Color": (*color, 1)}))


def glowing_material(strength=3.0, color=(1, 1, 1, 1), name="Glow"):
    """A material with an emission alone; the color may be a socket."""
    nodes = Nodes(bpy.data.materials.new(name), clear=True)
    return nodes.finish(nodes.add("Emission", {"Color": color, "Strength": strength}))


def add_world(color=(1, 1, 1, 1), strength=1.0, name="World"):
    """A world for the scene, whose background has a color; its nodes and the background."""
    world = bpy.context.scene.world = bpy.data.worlds.new(name)
    nodes = Nodes(world)
    background = nodes.of_type("BACKGROUND")
    nodes.set(background.inputs["Color"], color)
    background.inputs["Strength"].default_value = strength
    return nodes, background


def add_group_material():
    """A material whose Beamspread node sits in a group within a group."""
    groups = [bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Outer", "Inner")]
    material = bpy.data.materials.new("Grouped")
    for tree, group in zip((Nodes(material).tree, groups[0]), groups):
        tree.nodes.new("ShaderNodeGroup").node_tree = group
    groups[1].nodes.new("BeamspreadNode")
    return material


def node_of(material):
    """Its Beamspread node."""
    return next(node for node in material.node_tree.nodes if node.bl_idname == "BeamspreadNode")


def image_of(obj):
    return node_of(obj.material_slots[0].material).image


def sun_matrix(angle_deg, azimuth_deg=0.0):
    """Orientation of a sun whose light arrives `angle_deg` off -z and travels towards the azimuth (0: +x)."""
    return Matrix.Rotation(math.radians(azimuth_deg), 4, "Z") @ Matrix.Rotation(math.radians(-angle_deg), 4, "Y")


def add_sun(angle_deg=0.0, azimuth_deg=0.0, strength=1.0, color=(1, 1, 1), matrix=None):
    """A sun without penumbra."""
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.color, data.angle = strength, color, 0.0
    obj = bpy.data.objects.new("Sun", data)
    obj.matrix_world = (matrix or Matrix()) @ sun_matrix(angle_deg, azimuth_deg)
    bpy.context.collection.objects.link(obj)
    return obj


def add_lamp(location=None, power=100.0, kind="POINT", name="Lamp", matrix=None, radius=0.0, **properties):
    """A lamp, watts, with a light radius; None is Blender's own."""
    data = bpy.data.lights.new(name, kind)
    data.energy = power
    if kind in ("POINT", "SPOT") and radius is not None:
        data.shadow_soft_size = radius
    for key, value in properties.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = matrix or Matrix.Translation(location)
    bpy.context.collection.objects.link(obj)
    return obj


def add_lamp_and_sky(side):
    """Soft light from all around and from one side; bakes have `side` texels along a side, and no bounces."""
    settings = bpy.context.scene.beamspread
    settings.use_indirect, settings.resolution, settings.margin = False, side, 4
    add_lamp((0.4, -0.6, 2.0), power=200)
    add_world((0.3, 0.3, 0.3, 1))


def add_instancer(collection, matrix=None, name="Holder", within=None):
    """An instance of a collection."""
    holder = bpy.data.objects.new(name, None)
    holder.instance_type, holder.instance_collection = "COLLECTION", collection
    holder.matrix_world = matrix or Matrix()
    (within or bpy.context.scene.collection).objects.link(holder)
    return holder


def new_collection(name, *objects):
    """A collection of these objects, which leave the scene's own collection; no part of the scene."""
    collection = bpy.data.collections.new(name)
    for obj in objects:
        collection.objects.link(obj)
        if obj.name in bpy.context.scene.collection.objects:
            bpy.context.scene.collection.objects.unlink(obj)
    return collection


def add_blocker(height, matrix=None):
    """An upright wall in the plane x = 0.2 over y from -0.3 to 0.1, standing on the ground."""
    vertices = [(0.2, -0.3, 0), (0.2, 0.1, 0), (0.2, 0.1, height), (0.2, -0.3, height)]
    return add_mesh("Wall", vertices, [(0, 1, 2, 3)], matrix)


def add_camera(width=1.0, height=2.0):
    """The scene's camera, which looks down on a square of the xy plane."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", width, height
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    return camera


def render(path, size=8, samples=1):
    """Linear pixels of the scene's render."""
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.image_settings.file_format, scene.render.filepath = "OPEN_EXR", str(path)
    bpy.ops.render.render(write_still=True)
    return pixels(bpy.data.images.load(str(path)))


def known_image(color=(0.25, 0.5, 0.75), name="Known"):
    """An image of linear values in memory."""
    image = bpy.data.images.new(name, 4, 4, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set([*color, 1] * 16)
    return image


def load_data(path, link=False, **names):
    """Append or link data-blocks of a file, given by kind: materials=["Medium"]; those of all kinds in a list."""
    with bpy.data.libraries.load(str(path), link=link) as (_, wanted):
        for kind, chosen in names.items():
            setattr(wanted, kind, chosen)
    return [block for kind in names for block in getattr(wanted, kind)]


def pixels(image):
    """Float32 (height, width, 3), row 0 at the bottom."""
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], image.channels)[..., :3]


def select(*objects):
    """Select these objects alone; the first one becomes active."""
    for obj in bpy.context.scene.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def bake(*objects):
    """Run the operator on the objects; the node's image of each one's first material, as pixels."""
    select(*objects)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    return [pixels(node_of(obj.data.materials[0]).image) for obj in objects]


def save_scene(folder):
    """Save the current scene; its path."""
    bpy.context.scene.beamspread.resolution = 32
    path = folder / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


def reopen(folder, name="scene.blend"):
    """Save the scene and open the file."""
    path = str(folder / name)
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)


def file_image(path, width=16, height=16, value=0.0, **options):
    """An image whose EXR file has this value everywhere."""
    native.write_exr(str(path), np.full((height, width, 3), value, np.float32), ["R", "G", "B"], **options)
    return bpy.data.images.load(str(path))


def tile_file(folder, number, name="Tiles"):
    return folder / f"{name}.{number}.exr"


def tiled_image(folder, sizes, name="Tiles", value=0.0):
    """An image of UDIM tiles, whose sizes are given by number, in EXR files of this value."""
    for number, (width, height) in sizes.items():
        texels = np.full((height, width, 3), value, np.float32)
        native.write_exr(str(tile_file(folder, number, name)), texels, ["R", "G", "B"])
    image = bpy.data.images.load(str(tile_file(folder, min(sizes), name)))
    image.source = "TILED"
    return image


def run_batch(*arguments):
    """Report of a batch of the open file, in this process."""
    return bake_all(batch_options.parse([*map(str, arguments)]))


def batch_command(scene, *arguments, program=()):
    """The command line of a batch, in this Blender; `program` are options of Blender itself."""
    start = [sys.executable, BATCH, scene]
    if bpy.app.binary_path:
        start = [bpy.app.binary_path, "-b", "--factory-startup", scene, *program, "--python", BATCH, "--"]
    return [*map(str, start), *map(str, arguments)]


def messages_of(callable_):
    """Error message of an operator: Blender raises it in Python."""
    try:
        callable_()
    except RuntimeError as error:
        return str(error)
    return ""


def diffuse_reflectance(ior, g, albedo, angle_deg):
    """Exact reflectance of a half-space without its specular part, from the checked-in table."""
    with REFERENCE.open(newline="") as file:
        for row in csv.DictReader(file):
            key = float(row["ior"]), float(row["g"]), float(row["albedo"]), float(row["angle_deg"])
            if row["thickness_mfp"] == "inf" and key == (ior, g, albedo, angle_deg):
                return float(row["reflectance_total"]) - fresnel(ior, angle_deg)
    raise LookupError((ior, g, albedo, angle_deg))


def fresnel(ior, angle_deg):
    """Unpolarised Fresnel reflectance from outside."""
    cos_i = math.cos(math.radians(angle_deg))
    cos_t = math.sqrt(1 - (1 - cos_i**2) / ior**2)
    parallel = (ior * cos_i - cos_t) / (ior * cos_i + cos_t)
    perpendicular = (cos_i - ior * cos_t) / (cos_i + ior * cos_t)
    return (parallel**2 + perpendicular**2) / 2


def scatter_group(obj):
    """Instances of an object on the vertices of a mesh, moved."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    add_sockets(tree, "NodeSocketGeometry", "Geometry", "Geometry")
    names = ("NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeTranslateInstances", "NodeGroupOutput")
    given, points, move, result = (tree.nodes.new(name) for name in names)
    info = tree.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = obj, True
    move.name = "Move"
    tree.links.new(points.inputs["Points"], given.outputs[0])
    tree.links.new(points.inputs["Instance"], info.outputs["Geometry"])
    tree.links.new(move.inputs[0], points.outputs[0])
    tree.links.new(result.inputs[0], move.outputs[0])
    return tree


def add_gobo(kind):
    """A lamp whose nodes only Cycles understands: a checker of directions."""
    lamp = add_lamp((0.2, 0.1, 1.2), 60.0, kind, "Gobo")
    nodes = Nodes(lamp.data)
    normal = nodes.add("NewGeometry").outputs["Normal"]
    colors = {"Color1": (1, 0.2, 0.1, 1), "Color2": (0, 0.5, 1, 1), "Scale": 4.0}
    checker = nodes.add("TexChecker", {**colors, "Vector": normal})
    nodes.set(nodes.of_type("EMISSION").inputs["Color"], checker.outputs["Color"])


def blender_command(script, *arguments, scene=None):
    """Command line of a fresh Blender, or of Python where Blender is a module."""
    if bpy.app.binary_path:
        opened = [str(scene)] if scene else []
        return [bpy.app.binary_path, "-b", "--factory-startup", *opened, "--python", str(script), "--", *arguments]
    return [sys.executable, str(script), *([str(scene)] if scene else []), *arguments]
