"""Has example scenes open ready to bake: the camera's view in Material Preview, the object selected, and the add-on's
panel in the side bar of the 3D View. As a script it does that to files that are there:

    blender -b --factory-startup --python-exit-code 1 --python blend_examples/ready.py -- [NAME ...]
"""

import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
WINDOW = HERE / "window" / "window.blend"

BEAMSPREAD_NODE = "BeamspreadNode"


def save_ready(path):
    """Save the open scene as a compressed .blend, without a backup beside it, in the window of window.blend."""
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)
    bpy.ops.wm.open_mainfile(filepath=str(WINDOW))
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    for area in (area for screen in bpy.data.screens for area in screen.areas):
        for space in area.spaces:
            if space.type == "VIEW_3D":
                space.region_3d.view_perspective = "CAMERA"
                # Lines and grids of the editor would lie over the picture.
                space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
                space.overlay.show_extras = space.overlay.show_relationship_lines = False
    select(baked_objects())
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True, check_existing=False)


def baked_objects():
    """Visible objects whose materials have a Beamspread node, the largest first."""
    found = [obj for obj in bpy.context.view_layer.objects if obj.type == "MESH" and _is_baked(obj)]
    return sorted(found, key=lambda obj: -obj.dimensions.length)


def _is_baked(obj):
    trees = (slot.material.node_tree for slot in obj.material_slots if slot.material and slot.material.use_nodes)
    return any(node.bl_idname == BEAMSPREAD_NODE for tree in trees for node in tree.nodes)


def select(objects):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def main():
    sys.path.append(str(HERE.parent / "build" / "stage"))
    import beamspread

    beamspread.register()
    chosen = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    for path in [HERE / f"{name}.blend" for name in chosen] or sorted(HERE.glob("*.blend")):
        bpy.ops.wm.open_mainfile(filepath=str(path))
        save_ready(path)
        print(f"{path.name}: selected {', '.join(obj.name for obj in baked_objects())}")


if __name__ == "__main__":
    main()
