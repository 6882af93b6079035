"""The scene quail_egg: an egg of speckled wax in low light. Lengths are meters.

Light from the wax around a small speckle passes below it and washes it out; large ones stay dark. The egg is a body:
light goes round into its shade. A texture that multiplies light keeps every speckle.
"""

import math

import numpy as np
import scene_parts as parts

MM = 0.001
LENGTH, WIDTH = 34 * MM, 26 * MM
RINGS, SEGMENTS = 32, 64
TEXELS = 512, 256


def build():
    scene = parts.empty_scene("Quail egg", 540, 360, samples=64, view_transform="Filmic")
    scene.view_settings.look = "Medium High Contrast"
    scene.beamspread.resolution = 256
    wax, node = parts.medium_material(
        "Wax", color_mode="BASE_COLOR", mean_free_path=(0.25 * MM,) * 3, anisotropy=0.8, ior=1.4
    )
    parts.paint(wax, node, "Speckles", speckles())
    egg(wax)
    cloth = parts.plain_material("Cloth", (0.055, 0.07, 0.075), roughness=0.9)
    parts.box("Table", (-0.3, -0.3, -0.02), (0.3, 0.3, 0.0), cloth)
    parts.area_lamp("Lamp", (-0.12, 0.03, 0.07), (0, 0, 0.012), (0.02, 0.02), 0.55, (1.0, 0.88, 0.7))
    sky = scene.world.node_tree.nodes["Background"].inputs
    sky["Color"].default_value, sky["Strength"].default_value = (0.55, 0.7, 1.0, 1.0), 0.05
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 4, 2, 2
    parts.camera((0.012, -0.105, 0.052), (0.0, 0.0, 0.0115), lens=72)


def egg(material):
    """An egg on its side, whose map shows longitude and latitude."""
    u, v = np.meshgrid(np.linspace(0, 1, SEGMENTS + 1), np.linspace(0, 1, RINGS + 1))
    angle, around = math.pi * v, 2 * math.pi * u
    blunt = 1 + 0.13 * np.cos(angle)  # the upper end is pointed
    across = WIDTH / 2 * np.sin(angle) * (2 - blunt)
    points = np.stack([across * np.cos(around), across * np.sin(around), LENGTH / 2 * np.cos(angle)], -1)
    corner = (np.arange(RINGS)[:, None] * (SEGMENTS + 1) + np.arange(SEGMENTS)).ravel()
    quads = np.stack([corner, corner + SEGMENTS + 1, corner + SEGMENTS + 2, corner + 1], 1)
    # Vertices of the map's border and of the ends are one in the mesh.
    kept, numbers = np.unique(np.round(points.reshape(-1, 3), 9), axis=0, return_inverse=True)
    places = np.stack([u, 1 - v], -1).reshape(-1, 2)
    faces, uvs = [], []
    for quad in quads.tolist():
        of_face = [(int(numbers.ravel()[k]), places[k].tolist()) for k in quad]
        of_face = [pair for k, pair in enumerate(of_face) if pair[0] != of_face[k - 1][0]]
        faces.append([number for number, _ in of_face])
        uvs += [place for _, place in of_face]
    body = parts.mesh_object("Quail egg", kept.tolist(), faces, material)
    layer = body.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.array(uvs, np.float32).ravel())
    for face in body.data.polygons:
        face.use_smooth = True
    body.rotation_euler, body.location = (math.radians(90), math.radians(8), math.radians(62)), (0, 0, WIDTH / 2)


def speckles():
    """Round speckles, and a few blotches of several, on a ball by longitude and latitude."""
    columns, rows = TEXELS
    generator = np.random.default_rng(5)
    azimuth, angle = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    azimuth, angle = 2 * np.pi * azimuth, np.pi * angle
    place = np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], -1)

    def spots(middles, radii):
        """1 within spots of radii in radians, 0 outside of them."""
        part = np.zeros((rows, columns))
        for middle, radius in zip(middles, radii):
            apart = np.arccos(np.clip(place @ middle, -1, 1))
            part = np.maximum(part, np.clip((radius - apart) / 0.012 + 0.5, 0, 1))
        return part

    def anywhere(count):
        way = generator.normal(size=(count, 3))
        return way / np.linalg.norm(way, axis=1, keepdims=True)

    fine = spots(anywhere(420), generator.uniform(0.012, 0.03, 420))
    middles = np.repeat(anywhere(34), 7, axis=0) + 0.09 * generator.normal(size=(34 * 7, 3))
    coarse = spots(middles / np.linalg.norm(middles, axis=1, keepdims=True), generator.uniform(0.03, 0.085, 34 * 7))
    ground, pale, dark = np.array([0.80, 0.72, 0.56]), np.array([0.34, 0.24, 0.15]), np.array([0.10, 0.055, 0.035])
    color = ground + fine[..., None] * (pale - ground)
    return color + coarse[..., None] * (dark - color)
