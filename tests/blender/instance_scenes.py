"""Collections that stand in a scene through instances alone."""

import bpy
from mathutils import Euler, Matrix
from scenes import add_blocker, add_instancer, add_material, add_plane, new_collection

WITHIN = Matrix.Translation((0.3, -0.2, 0.1)) @ Euler((0.1, 0.2, 0.7)).to_matrix().to_4x4()
TURNED = Euler((0.1, -0.2, 2.0)).to_matrix().to_4x4()
SKEWED = Matrix.Translation((1, 2, 0.5)) @ TURNED @ Matrix.Diagonal((1, 0.7, 1, 1))
MIRRORED = Matrix.Translation((-1, 0, 0.2)) @ Matrix.Diagonal((-1.2, 1, 1, 1))
OFFSET = (0.4, 0.1, -0.3)


def add_tile(matrix=WITHIN, **properties):
    """A plane and a wall upon it in a collection that the scene does not have; it, and its material."""
    material = add_material(**properties)
    tile, wall = add_plane("Tile", matrix=matrix, material=material), add_blocker(0.5, matrix=matrix)
    collection = new_collection("Tiles", tile, wall)
    collection.instance_offset = OFFSET
    return tile, collection


def nest(collection):
    """A collection with an instance of another collection, and the transform of the inner objects."""
    outer = bpy.data.collections.new("Outer")
    add_instancer(collection, MIRRORED, "Middle", outer)
    return outer, MIRRORED @ Matrix.Translation(-collection.instance_offset)
