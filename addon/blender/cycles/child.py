"""Program of the child process, in Blender or with Blender as a module: child.py -- FILE.blend REQUEST.json

Each process does one task, and may change the copy of the scene, which no other process sees. The arrays that the task
returns, by name, are written to the file that the request names.
"""

import json
import os
import re
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.append(str(Path(__file__).resolve().parents[1]))  # for compat
import child_colors
import child_fields
import child_world
import compat

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


TASKS = {
    "world": child_world.panorama,
    "fields": child_fields.fields,
    "colors": child_colors.colors,
    "render": render,
}


def restore_images(file: Path) -> None:
    """Restore pixels that images had in memory only."""
    with np.load(file) as pixels:
        for name in pixels.files:
            old, values = bpy.data.images.get(name), pixels[name]
            if old is None:
                continue
            height, width, channels = values.shape
            image = bpy.data.images.new(name, width, height, alpha=channels == 4, float_buffer=old.is_float)
            image.colorspace_settings.name = old.colorspace_settings.name
            image.alpha_mode = old.alpha_mode
            full = np.ones((height, width, 4), np.float32)
            full[..., :channels] = values if channels > 1 else np.broadcast_to(values, (height, width, 1))
            image.pixels.foreach_set(full.ravel())
            old.user_remap(image)


def main() -> None:
    """Do the task of the request."""
    blend, request_file = map(Path, sys.argv[sys.argv.index("--") + 1 :])
    request = json.loads(request_file.read_text())
    if not bpy.app.binary_path:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.open_mainfile(filepath=str(blend), use_scripts=request["scripts"])
    restore_images(blend.with_name("images.npz"))
    scene = bpy.data.scenes[request["scene"]]
    window = bpy.context.window
    if window is not None:
        window.scene = scene
        window.view_layer = scene.view_layers[request["view_layer"]]

    def progress(fraction: float) -> None:
        # The process ends here if its parent is gone: writing fails.
        sys.stdout.write(f"\n{request['mark']} {fraction:.4f}\n")
        sys.stdout.flush()

    progress(0.0)
    arrays = TASKS[request["task"]](request, scene, progress)
    np.savez(request["output"], **arrays)


if __name__ == "__main__":
    try:
        main()
    except BaseException:  # noqa: BLE001 - the parent shows every error
        traceback.print_exc()
        code = 1
    else:
        code = 0
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # some versions hang while they clean up
