"""Bodies whose medium Cycles traces path by path, and the exitance of their surface; a mean free path is 1 cm."""

import math

import bpy
import numpy as np
import scenes
from cycles_truth import target_material
from nodes import Nodes

MEAN_FREE_PATH = 0.01
ANISOTROPY = 0.8
# Height of the ghost over the surface, mean free paths. Larger: light leaves the surface between both.
GHOST_HEIGHT = 0.02


def add_body(name, radius_of, material, height=0.0, segments=96, rings=48):
    """A closed mesh of smooth faces with a radius for each direction; UVs run around z, and from -z up to +z."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=rings, radius=1.0, calc_uvs=True)
    body = bpy.context.object
    body.name = name
    mesh = body.data
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    points = points.reshape(-1, 3).astype(float)
    points *= radius_of(points)[:, None]
    if height:
        normals = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_set("co", points.ravel())
        mesh.update()
        mesh.vertices.foreach_get("normal", normals)
        points += height * normals.reshape(-1, 3)
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.update()
    mesh.materials.append(material)
    return body


def medium_material(albedo):
    nodes = Nodes(bpy.data.materials.new("Volume"), clear=True)
    color = {"Color": (*albedo, 1), "Density": 1 / MEAN_FREE_PATH}
    scatter = nodes.add("VolumeScatter", {**color, "Anisotropy": ANISOTROPY})
    absorption = nodes.add("VolumeAbsorption", color)
    both = nodes.add("AddShader", {0: scatter.outputs[0], 1: absorption.outputs[0]})
    return nodes.finish(both, "Volume")


def cycles_exitance(radius_of, albedo, size, samples, seed=1):
    """Exitance of a body by path tracing, without light that never scattered: float64 (height, width, 3).

    The body is replaced for the time of the bake. A ghost just above it, which only the bake sees, is white and faces
    it: the light that it gets is what leaves the body.
    """
    body = add_body("Traced", radius_of, medium_material(albedo))
    white, image = target_material((1, 1, 1), 4)
    image.scale(*size)
    ghost = add_body("Ghost", radius_of, white, GHOST_HEIGHT * MEAN_FREE_PATH)
    ghost.data.flip_normals()
    for kind in ("camera", "diffuse", "transmission", "volume_scatter", "shadow"):
        setattr(ghost, f"visible_{kind}", False)
    scene = bpy.context.scene
    cycles = scene.cycles
    cycles.samples, cycles.seed, cycles.use_adaptive_sampling, cycles.use_denoising = samples, seed, False, False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    for kind in ("max", "diffuse", "glossy", "transmission", "volume"):
        setattr(cycles, f"{kind}_bounces", 1024)
    cycles.transparent_max_bounces = 1024
    scenes.select(ghost)
    # Light that has not scattered is direct light of the ghost.
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"INDIRECT"}, margin=0, use_clear=True)
    values = math.pi * scenes.pixels(image).astype(float)
    for obj in (body, ghost):
        bpy.data.objects.remove(obj)
    return values


def areas_of(radius_of, size):
    """Area of each texel's part of the body, (height, width)."""
    around, up = np.linspace(0, 1, 4 * size[0] + 1), np.linspace(0, 1, 4 * size[1] + 1)
    phi, theta = np.meshgrid(2 * np.pi * around, np.pi * up)
    points = np.stack([-np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), -np.cos(theta)], -1)
    points *= radius_of(points.reshape(-1, 3)).reshape(phi.shape)[..., None]
    cross = np.cross(points[1:, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, 1:])
    return (np.linalg.norm(cross, axis=-1) / 2).reshape(size[1], 4, size[0], 4).sum((1, 3))
