"""Renders an example whose textures multiply light where it enters and leaves, as other renderers have it:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python with_convention.py -- OUT.png

Bakes every Beamspread node with `texture_method` "MULTIPLIED"; all else stays the same.
"""

import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import beamspread  # noqa: E402
import ready  # noqa: E402


def main():
    (picture,) = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        for material in bpy.data.materials:
            for node in material.node_tree.nodes if material.node_tree else ():
                if node.bl_idname == ready.BEAMSPREAD_NODE:
                    node.texture_method = "MULTIPLIED"
        # Baked files lie beside their scene.
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(picture).resolve().with_suffix(".blend")))
        ready.select(ready.baked_objects())
        bpy.ops.beamspread.bake()
        bpy.context.scene.render.filepath = str(Path(picture).resolve())
        bpy.ops.render.render(write_still=True)
    finally:
        beamspread.unregister()


main()
