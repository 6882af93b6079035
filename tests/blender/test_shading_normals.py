"""Shading normals of receivers: smooth, sharp, custom and flat ones; scaled and mirrored objects; the mesh stays."""

import bpy
import numpy as np
from beamspread.blender.read.digests import digest_of_mesh
from beamspread.blender.read.geometry import read_polygons


def add_ball(is_smooth=True):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    ball = bpy.context.object
    ball.data.materials.append(bpy.data.materials.new("Skin"))
    ball.data.polygons.foreach_set("use_smooth", [is_smooth] * len(ball.data.polygons))
    return ball


def read(obj):
    bpy.context.view_layer.update()
    return read_polygons(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()), "Skin")


def test_a_smooth_ball_has_the_normals_of_a_ball_and_a_flat_one_none():
    ball = add_ball()
    polygons = read(ball)
    lengths = np.linalg.norm(polygons.corners, axis=1, keepdims=True)
    # Blender weighs the normals of faces by their angles at the vertex, off by up to .006 here.
    np.testing.assert_allclose(polygons.corner_normals, polygons.corners / lengths, atol=8e-3)
    assert polygons.corner_normals.dtype == np.float32
    ball.data.polygons.foreach_set("use_smooth", [False] * len(ball.data.polygons))
    ball.data.update()
    assert read(ball).corner_normals is None


def test_normals_follow_scale_and_mirror_images():
    ball = add_ball()
    ball.scale, ball.rotation_euler = (-1.0, 2.0, 0.5), (0.3, 0.4, 0.5)
    polygons = read(ball)
    # The gradient of the ellipsoid's equation.
    inverse = np.linalg.inv(np.array(ball.matrix_world)[:3, :3])
    exact = polygons.corners @ inverse.T @ inverse
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    np.testing.assert_allclose(polygons.corner_normals, exact, atol=2e-2)


def test_sharp_edges_and_custom_normals_count():
    ball = add_ball()
    mesh = ball.data
    smooth, digest = read(ball).corner_normals, digest_of_mesh(ball)
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth = True
        mesh.auto_smooth_angle = np.pi
    for edge in mesh.edges:
        edge.use_edge_sharp = (
            abs(mesh.vertices[edge.vertices[0]].co.z) < 1e-6 > abs(mesh.vertices[edge.vertices[1]].co.z)
        )
    mesh.update()
    sharp, digest_of_sharp = read(ball).corner_normals, digest_of_mesh(ball)
    assert np.abs(sharp - smooth).max() > 0.05
    assert digest_of_sharp != digest
    mesh.normals_split_custom_set([(0.0, 0.0, 1.0)] * len(mesh.loops))
    np.testing.assert_allclose(read(ball).corner_normals, np.tile((0, 0, 1), (len(mesh.loops), 1)), atol=1e-3)
    assert digest_of_mesh(ball) not in (digest, digest_of_sharp)


def test_the_digest_knows_smooth_faces():
    ball = add_ball()
    smooth = digest_of_mesh(ball)
    ball.data.polygons[0].use_smooth = False
    assert digest_of_mesh(ball) != smooth
    ball.data.polygons[0].use_smooth = True
    assert digest_of_mesh(ball) == smooth
