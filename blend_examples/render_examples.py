"""Renders a baked example with Cycles, as the scene looks when it is opened after the bake:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python render_examples.py -- REPORT.json OUT_FOLDER

REPORT.json is the report of the batch that baked the scene. One PNG per frame in it, named after the scene.
"""

import json
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "build" / "stage"))

import beamspread  # noqa: E402


def show(bake):
    """Put a baked file into the node of its material."""
    nodes = bpy.data.materials[bake["material"]].node_tree.nodes
    node = next(node for node in nodes if node.bl_idname == "BeamspreadNode")
    image = bpy.data.images.load(bake["path"], check_existing=True)
    setattr(node, "image_back" if bake["side"] == "BACK" else "image", image)


def main():
    report, folder = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        bakes = json.loads(Path(report).read_text(encoding="utf-8"))["bakes"]
        scene, name = bpy.context.scene, Path(bpy.data.filepath).stem
        frames = sorted({bake["frame"] for bake in bakes})
        for frame in frames:
            scene.frame_set(frame)
            for bake in bakes:
                if bake["frame"] == frame:
                    show(bake)
            suffix = f"_{frame}" if len(frames) > 1 else ""
            scene.render.filepath = str(Path(folder).resolve() / f"{name}{suffix}.png")
            bpy.ops.render.render(write_still=True)
    finally:
        beamspread.unregister()


main()
