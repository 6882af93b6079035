"""A copy of the scene on disk, for the processes that compute on it."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...core.messages import Message, warning
from ...core.scene.lights import WorldLight
from ...core.target import Target
from ..node.find import find_node_in_groups
from ..node.tree import BASE_COLOR
from ..read.image_nodes import missing_images
from ..read.nodes import Links
from ..read.reflection import reflectance_of
from ..read.visibility import with_instanced
from .folders import Folder

FILE, IMAGES = "scene.blend", "images.npz"


class SceneCopy:
    """A scene as it is now, in a folder of its own. The data of this Blender stay as they are.

    Make it in the main thread (it reads `bpy.data`), and use it in any thread. The folder is removed with the object,
    when the process ends, or by `remove()`. A copy from a pickle is of the same folder, which it leaves alone.

    Attributes
    ----------
    request : plain data for every process on it: scene, view layer, and whether drivers may run Python.
    warnings : messages about images whose unsaved pixels the copy lacks.
    """

    def __init__(self, scene, view_layer) -> None:
        for obj in with_instanced(scene.objects):
            if obj.mode == "EDIT":
                obj.update_from_editmode()
        self._write(scene, {"scene": scene.name, "view_layer": view_layer.name})

    def _write(self, block, request: dict) -> None:
        """Write a data-block, and all that it uses, to the file."""
        self._folder = Folder()
        self.warnings: list[Message] = []
        self.binary = bpy.app.binary_path
        self.request = request | {"scripts": bpy.context.preferences.filepaths.use_scripts_auto_execute}
        try:
            # Unlike saving the file, this runs no handlers of other add-ons, packs nothing and makes no preview.
            bpy.data.libraries.write(str(self.file), {block}, path_remap="ABSOLUTE", compress=False)
            self._keep_unsaved_images()
        except BaseException:
            self.remove()
            raise

    @property
    def folder(self) -> Path:
        return self._folder.path

    @property
    def file(self) -> Path:
        return self.folder / FILE

    def remove(self) -> None:
        """Remove the folder."""
        self._folder.remove()

    def __enter__(self) -> SceneCopy:
        return self

    def __exit__(self, *_error) -> None:
        self.remove()

    def _keep_unsaved_images(self) -> None:
        """Save pixels that are in memory only."""
        pixels = {}
        for image in bpy.data.images:
            if not image.is_dirty or image.library is not None or image.source not in {"GENERATED", "FILE"}:
                if image.is_dirty and image.source == "TILED":
                    text = f"The image '{image.name}' is not saved: Cycles reads its files."
                    self.warnings.append(warning(image.name, text))
                continue
            if not image.size[0] or not image.users:
                continue
            values = np.empty(len(image.pixels), np.float32)
            image.pixels.foreach_get(values)
            pixels[image.name] = values.reshape(image.size[1], image.size[0], image.channels)
        np.savez(self.folder / IMAGES, **pixels)


class WorldCopy(SceneCopy):
    """A world as it is now, without its scene."""

    def __init__(self, world) -> None:
        scene = bpy.context.scene
        frame = {"frame": scene.frame_current, "subframe": scene.frame_subframe}
        self._write(world, {"scene": "", "world": world.name} | frame)


class CopyForCycles:
    """A copy of a scene for Cycles, with results evaluated on it. Make it in the main thread.

    A job in a file names the copy's folder, which goes with this object: a process that runs the job needs a Blender,
    and the folder for as long as it runs.

    Attributes
    ----------
    reflectances : colors that replace the baked materials, by name.
    textures : names of the groups around the node of a material, of the node and of its input with a texture.
    panorama : the world as a light, once it was rendered.
    base_colors : evaluated base colors, by target.
    """

    def __init__(self, scene, view_layer) -> None:
        self.scene = SceneCopy(scene, view_layer)
        self.panorama: WorldLight | None = None
        self.base_colors: dict[Target, object] = {}
        nodes = {material.name: find_node_in_groups(material) for material in bpy.data.materials}
        nodes = {name: node for name, node in nodes.items() if node is not None}
        self.reflectances = {name: reflectance_of(node.surface()) for name, (node, _) in nodes.items()}
        self.textures = {
            name: ([group.name for group in groups], node.name, BASE_COLOR)
            for name, (node, groups) in nodes.items()
            if node.has_texture() and not missing_images(Links(), node.color_input(groups))
        }
