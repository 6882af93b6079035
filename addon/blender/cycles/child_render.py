"""A picture of the scene, by another engine. Part of the child process (child.py)."""

import re

import bpy
import compat
import numpy as np

# What engines say of how far they are, from Blender 5.0 on to handlers alone.
SAMPLES = re.compile(r"\bSample (\d+)/(\d+)")


class BeamspreadNode(bpy.types.ShaderNodeCustomGroup):
    """Enough of the node for its inner tree to be seen: the add-on is not registered here."""

    bl_idname = "BeamspreadNode"
    bl_label = "Beamspread"


def render(request, scene, progress) -> dict:
    """The task `render`: one view layer at one frame into the multi-layer EXR file `picture`, by `engine`.

    Compositing and sequencer are left to the process that asked.
    """
    bpy.utils.register_class(BeamspreadNode)
    scene.render.engine = request["engine"]
    scene.frame_set(request["frame"], subframe=request["subframe"])
    scene.render.use_compositing = scene.render.use_sequencer = False
    # The picture has the size of the border where there is one.
    scene.render.use_crop_to_border = True
    scene.render.use_overwrite, scene.render.use_placeholder = True, False
    scene.render.filepath, scene.render.use_file_extension = request["picture"], False
    compat.save_as_multilayer_exr(scene)
    bpy.app.handlers.render_stats.append(lambda said, *_: _tell(progress, said))
    bpy.ops.render.render(write_still=True, scene=scene.name, layer=request["view_layer"])
    return {"frame": np.array(scene.frame_current)}


def _tell(progress, said) -> None:
    if isinstance(said, str) and (found := SAMPLES.search(said)):
        progress(int(found[1]) / max(int(found[2]), 1))
