"""Parts of the example scenes: planes of a medium, plain objects, lamps, cameras."""

import math

import bpy
import numpy as np
from mathutils import Matrix, Vector
from ready import save_ready

BEAMSPREAD_NODE = "BeamspreadNode"
LATHE_STEPS = 48
POLISHED = 0.1  # roughness of the coat


def empty_scene(name, width, height, samples=64, view_transform="Standard", exposure=0.0):
    """Start from nothing, set up for Cycles with a black world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = name
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    scene.view_settings.view_transform = view_transform
    scene.view_settings.exposure = exposure
    return scene


def save(path):
    """Write a compressed .blend without a backup beside it, which opens ready to bake."""
    for _ in range(3):
        bpy.data.orphans_purge()
    save_ready(path)


def link(name, data):
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def mesh_object(name, corners, faces, material):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(corner) for corner in corners], [], faces)
    mesh.materials.append(material)
    return link(name, mesh)


# Materials


def empty_material(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (600, 0)
    return material, output


def medium_material(name, **properties):
    """A material whose light is baked; `properties` are those of the add-on's node."""
    material, output = empty_material(name)
    node = material.node_tree.nodes.new(BEAMSPREAD_NODE)
    node.name = node.label = "Beamspread"
    for key, value in properties.items():
        setattr(node, key, value)
    node.inputs["Roughness"].default_value = POLISHED
    material.node_tree.links.new(node.outputs["BSDF"], output.inputs["Surface"])
    return material, node


def paint(material, node, name, color):
    """Link an image of colors, linear RGB (rows upward, columns, 3), to the base color of a material's node."""
    encoded = np.where(color < 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)  # sRGB
    image = bpy.data.images.new(name, *color.shape[1::-1])
    image.pixels.foreach_set(np.dstack([encoded, np.ones(color.shape[:2])]).astype(np.float32).ravel())
    image.pack()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.location = image, (-320, 0)
    material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])


def plain_material(name, color, roughness=0.5, metallic=0.0, specular=0.5):
    material, output = empty_material(name)
    bsdf = material.node_tree.nodes.new("ShaderNodeBsdfPrincipled")
    bsdf.location = (300, 0)
    bsdf.inputs["Base Color"].default_value = (*color, 1.0)
    bsdf.inputs["Roughness"].default_value = roughness
    bsdf.inputs["Metallic"].default_value = metallic
    bsdf.inputs["Specular"].default_value = specular
    material.node_tree.links.new(bsdf.outputs["BSDF"], output.inputs["Surface"])
    return material


def glowing_material(name, color, glow, strength):
    """For small things that shine by themselves; lamps light the scene, so Cycles need not look for these."""
    material = plain_material(name, color, roughness=0.4)
    bsdf = material.node_tree.nodes["Principled BSDF"]
    bsdf.inputs["Emission"].default_value = (*glow, 1.0)
    bsdf.inputs["Emission Strength"].default_value = strength
    material.cycles.sample_as_light = False
    return material


def card_material(name, color, alpha):
    """Material of flat pictures; `alpha` is an array (rows upward, columns) of their coverage, 0..1."""
    material = plain_material(name, color, roughness=1.0, specular=0.0)
    height, width = alpha.shape
    image = bpy.data.images.new(name, width, height, alpha=True)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., 3] = alpha
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.location = image, (0, 0)
    material.node_tree.links.new(texture.outputs["Alpha"], material.node_tree.nodes["Principled BSDF"].inputs["Alpha"])
    material.blend_method = material.shadow_method = "HASHED"
    return material


def clouds(size, thin, thick, seed=1):
    """Alpha of clouds between two values, which fade out towards the border of a square."""
    generator, total = np.random.default_rng(seed), np.zeros((size, size))
    waves = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size))) * size
    for octave in range(2, 7):
        noise = np.fft.fft2(generator.standard_normal((size, size)))
        layer = np.fft.ifft2(noise * np.exp(-((waves / 2**octave - 1) ** 2) * 4)).real
        total += layer / layer.std() * 0.6**octave
    share = np.clip(0.5 + 0.45 * total / total.std(), 0, 1)
    x = (np.arange(size) + 0.5) / size * 2 - 1
    fade = np.clip(3 * (1 - np.hypot(x[:, None], x)), 0, 1)
    return fade * (thin + (thick - thin) * share)


def slats(size, count):
    """Alpha of opaque stripes and gaps of the same width."""
    stripes = (np.arange(size) * 2 * count // size) % 2
    return np.repeat(stripes[None].astype(float), size, axis=0)


# Objects


def plane(name, width, depth, material, center=(0.0, 0.0)):
    """A horizontal rectangle whose UV map runs over the whole texture, u along x and v along y."""
    (x, y), half_x, half_y = center, width / 2, depth / 2
    corners = [
        (x - half_x, y - half_y, 0),
        (x + half_x, y - half_y, 0),
        (x + half_x, y + half_y, 0),
        (x - half_x, y + half_y, 0),
    ]
    obj = mesh_object(name, corners, [(0, 1, 2, 3)], material)
    layer = obj.data.uv_layers.new(name="UVMap")
    for loop, uv in zip(layer.data, [(0, 0), (1, 0), (1, 1), (0, 1)]):
        loop.uv = uv
    return obj


def upright_card(name, width, height, material):
    """A rectangle around the origin, its front where lamps and cameras look: along -z."""
    obj = plane(name, width, height, material)
    obj.data.flip_normals()
    return obj


def box(name, low, high, material):
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = [(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh_object(name, corners, faces, material)


def table_around(width, depth, material):
    """A table into which a slab of this size around the origin is let, flush with its top."""
    x, y, far = width / 2, depth / 2, 1.0
    for name, low, high in (
        ("left", (-far, -far), (-x, far)),
        ("right", (x, -far), (far, far)),
        ("front", (-x, -far), (x, -y)),
        ("back", (-x, y), (x, far)),
    ):
        box(f"Table {name}", (*low, -0.01), (*high, 0), material)


def prism(name, outline, y0, y1, material):
    """A polygon (x, z) in the plane of a wall, given counter-clockwise seen from -y, thick from y0 to y1."""
    count = len(outline)
    corners = [(x, y, z) for y in (y0, y1) for x, z in outline]
    faces = [tuple(range(count)), tuple(range(2 * count - 1, count - 1, -1))]
    for first in range(count):
        second = (first + 1) % count
        faces.append((second, first, first + count, second + count))
    return mesh_object(name, corners, faces, material)


def lathe(name, profile, material, location, scale=1.0):
    """A turned object: `profile` is a list of (radius, height), rounded between its points by a Screw modifier's
    smooth shading; two equal points make an edge."""
    mesh = bpy.data.meshes.new(name)
    corners = [(radius * scale, 0.0, height * scale) for radius, height in profile]
    mesh.from_pydata(corners, [(i, i + 1) for i in range(len(corners) - 1)], [])
    mesh.materials.append(material)
    obj = link(name, mesh)
    obj.location = location
    screw = obj.modifiers.new("Lathe", "SCREW")
    screw.steps = screw.render_steps = LATHE_STEPS
    screw.use_smooth_shade = True
    screw.use_merge_vertices = True
    screw.merge_threshold = 1e-6
    split = obj.modifiers.new("Edges", "EDGE_SPLIT")
    split.split_angle = math.radians(40)
    return obj


def wire(name, points, radius, material, sides=10):
    """A wire along a path, round or with fewer sides; a curve, as artists would draw it."""
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution, curve.use_fill_caps = (
        "3D",
        radius,
        (sides - 4) // 2,
        True,
    )
    spline = curve.splines.new("POLY")
    spline.points.add(len(points) - 1)
    for point, place in zip(spline.points, points):
        point.co = (*place, 1.0)
    spline.use_smooth = True
    curve.materials.append(material)
    return link(name, curve)


def rounded(points, steps=6):
    """(radius, height) along a Catmull-Rom curve through `points`, "radius,height ..."; one given twice is a corner."""
    points = [tuple(float(number) for number in point.split(",")) for point in points.split()]
    result = [points[0]]
    for index in range(len(points) - 1):
        p1, p2 = points[index], points[index + 1]
        if p1 == p2:
            continue
        p0 = points[index - 1] if index > 0 and points[index - 1] != p1 else p1
        p3 = points[index + 2] if index + 2 < len(points) and points[index + 2] != p2 else p2
        for step in range(1, steps + 1):
            t = step / steps
            result.append(
                tuple(
                    0.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - 3 * c + d - a) * t**3)
                    for a, b, c, d in zip(p0, p1, p2, p3)
                )
            )
    return [(max(radius, 0.0), height) for radius, height in result]


# Lamps and cameras


def direction(angle_deg, azimuth_deg):
    """Unit vector of light that travels towards `azimuth` (from +x to +y) and falls in at `angle` from the vertical."""
    angle, azimuth = math.radians(angle_deg), math.radians(azimuth_deg)
    return Vector((math.sin(angle) * math.cos(azimuth), math.sin(angle) * math.sin(azimuth), -math.cos(angle)))


def aim(obj, along):
    """Turn a lamp or camera so that its -z axis points along a vector."""
    obj.rotation_euler = along.to_track_quat("-Z", "Y").to_euler()


def sun(name, along, strength, color=(1.0, 1.0, 1.0), shadow=True):
    light = bpy.data.lights.new(name, "SUN")
    light.energy, light.color, light.angle = strength, color, 0.0
    light.use_shadow = light.cycles.cast_shadow = shadow
    obj = link(name, light)
    aim(obj, along)
    return obj


def point_lamp(name, location, watts, color=(1.0, 1.0, 1.0)):
    light = bpy.data.lights.new(name, "POINT")
    light.energy, light.color, light.shadow_soft_size = watts, color, 0.0
    obj = link(name, light)
    obj.location = location
    return obj


def area_lamp(name, location, target, size, watts, color=(1.0, 1.0, 1.0), shape="RECTANGLE", spread_deg=180.0):
    """A lamp of `size` (across, up) whose front looks at `target`."""
    light = bpy.data.lights.new(name, "AREA")
    light.energy, light.color, light.shape, light.spread = watts, color, shape, math.radians(spread_deg)
    light.size, light.size_y = size
    obj = link(name, light)
    obj.location = location
    aim(obj, Vector(target) - Vector(location))
    return obj


def spot_lamp(name, target, along, distance, cone_deg, watts, color, blend=0.0, radius=0.0):
    """A spot that shines along a vector onto `target` from `distance` away."""
    light = bpy.data.lights.new(name, "SPOT")
    light.energy, light.color, light.shadow_soft_size = watts, color, radius
    light.spot_size, light.spot_blend = math.radians(cone_deg), blend
    obj = link(name, light)
    obj.location = Vector(target) - along * distance
    aim(obj, along)
    return obj


def camera(location, target, lens=50.0, roll_deg=0.0):
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    data.clip_start = 0.001
    obj = link("Camera", data)
    obj.location = location
    aim(obj, Vector(target) - Vector(location))
    if roll_deg:
        obj.rotation_euler = (
            obj.rotation_euler.to_matrix() @ Matrix.Rotation(math.radians(roll_deg), 3, "Z")
        ).to_euler()
    bpy.context.scene.camera = obj
    return obj


def scale_scene(factor):
    """Scale everything around the origin; surfaces under point and spot lamps keep their brightness."""
    bpy.context.view_layer.update()
    for obj in bpy.context.scene.objects:
        obj.location *= factor
        if obj.type == "MESH":
            obj.scale *= factor
        elif obj.type == "LIGHT" and obj.data.type != "SUN":
            obj.data.energy *= factor**2
