"""The standing of a baked plane, for tests of what makes bakes out of date."""

import bpy
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.target import Target
from scenes import add_blocker, add_material, add_plane, add_sun, bake

PLANE = Target("Plane", "Medium")


def row(target=PLANE):
    stale.refresh(bpy.context)
    return state.rows[target]


def update():
    bpy.context.view_layer.update()


def baked_plane():
    """A plane baked under a sun, beside a wall."""
    bpy.context.scene.beamspread.resolution = 32
    plane = add_plane(material=add_material())
    add_sun(20)
    add_blocker(1.0)
    assert row().status == Status.NEVER
    bake(plane)
    assert row().status == Status.BAKED
    return plane


def see_through(_plane):
    material = bpy.data.materials.new("Veil")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.5
    bpy.data.objects["Wall"].data.materials.append(material)
