"""Render of the scene by another engine. Part of the child process (child.py)."""

import re

import bpy
import compat
import numpy as np

# Progress in the status text of engines, which Blender 5.0 and later give only to handlers.
SAMPLES = re.compile(r"\bSample (\d+)/(\d+)")


class BeamspreadNode(bpy.types.ShaderNodeCustomGroup):
    """Node class that shows its inner tree: the add-on is not registered in this process."""

    bl_idname = "BeamspreadNode"
    bl_label = "Beamspread"


def render(request, scene, progress) -> dict:
    """Task `render`: one view layer at one frame into the multi-layer EXR file `picture`, by `engine`.

    The parent process does compositing and sequencing.
    """
    bpy.utils.register_class(BeamspreadNode)
    scene.render.engine = request["engine"]
    scene.frame_set(request["frame"], subframe=request["subframe"])
    scene.render.use_compositing = scene.render.use_sequencer = False
    # The image has the size of the render border if there is one.
    scene.render.use_crop_to_border = True
    scene.render.use_overwrite, scene.render.use_placeholder = True, False
    scene.render.filepath, scene.render.use_file_extension = request["picture"], False
    compat.save_as_multilayer_exr(scene)
    bpy.app.handlers.render_stats.append(lambda text, *_: _report(progress, text))
    bpy.ops.render.render(write_still=True, scene=scene.name, layer=request["view_layer"])
    return {"frame": np.array(scene.frame_current)}


def _report(progress, text) -> None:
    if isinstance(text, str) and (match := SAMPLES.search(text)):
        progress(int(match[1]) / max(int(match[2]), 1))
