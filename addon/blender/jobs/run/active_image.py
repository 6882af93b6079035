"""The image that Blender's own Bake fills: the one of the active texture node. Textures of the artist are refused.

Blender clears the image before it asks the engine for anything, and writes black to it if the engine refuses. *Bake
Active Image* therefore refuses beforehand. Where Blender's operator was started by itself, refused images get their
pixels back afterwards, and so do images of nodes whose bake failed or was stopped. Only in scripts, which tell nobody
that they begin, are pixels lost that were never saved.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from pathlib import Path

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ....core.bake.bake_settings import COMBINED, BakeSettings
from ....core.bake.runner import CANCELLED, WRITTEN, Bake
from ....core.errors import ImageError
from ....core.messages import Level
from ... import popup
from ...images.udim import is_tiled
from ...node.find import BakeTarget, find_node, targets_of
from ...node.output import former_output
from ...node.tree import own_map
from ...read.nodes import Links
from ...registration import all_or_nothing, classes, handlers

ENGINE = "BEAMSPREAD"

MAX_OBJECTS = 100
"""Number of selected objects whose images a panel checks. More slow the drawing down."""


def active_image(material):
    """The image that Blender's Bake fills: that of the texture node that was active last, or else of the first one."""
    if material is None or material.node_tree is None:
        return None
    textures = [node for node in material.node_tree.nodes if node.type == "TEX_IMAGE"]
    textures.sort(key=lambda node: not node.show_texture)
    return textures[0].image if textures else None


def check_active_image(target: BakeTarget, settings: BakeSettings, is_running: bool = False) -> None:
    """Raise ImageError if the result would be taken for luminance, or would replace a texture of the material.

    `is_running`: Blender's bake has begun, and may have cleared the image.
    """
    active = active_image(target.material)
    if active is None:
        return
    if is_tiled(active):
        raise ImageError(
            f"The active image '{active.name}' has UDIM tiles, which Blender's own Bake can't fill with Beamspread.",
            "Choose it in the Beamspread node, and use Bake Beamspread.",
        )
    reader = _reader(active, target)
    if reader:
        remedy = "Select an Image Texture node with another image."
        if is_running and not (_saved.has(active) or _saved.take_in_script(active)):
            remedy = f"Blender has cleared it, and no file has its pixels. {remedy}"
        text = f"Blender's own Bake would erase the active image '{active.name}', a texture of {reader}."
        raise ImageError(text, remedy)
    if settings.layer != COMBINED and active in (target.node.image, target.node.image_back):
        raise ImageError(
            f"The image '{active.name}' shows luminance in the Beamspread node.",
            f"Choose another active image for {settings.output.lower()}.",
        )


def other_map(uv_map: str, own: str) -> ImageError:
    """The error about a node's image that Blender would fill by another UV map than the node shows it by."""
    return ImageError(
        f"Blender's Bake fills the UV map '{uv_map}', and the node shows its image by '{own}'.",
        "Use Beamspread's own Bake, or make that map active (Object Data Properties > UV Maps).",
    )


def _check_map(target: BakeTarget) -> None:
    """Raise ImageError if the active image is the node's, and the active UV map is another than the node's."""
    layers, tree = target.obj.data.uv_layers, target.node.node_tree
    if target.image is None or target.image != active_image(target.material):
        return
    name = target.node.uv_map or ("" if tree is None else own_map(tree))
    own = layers.get(name) if name else next((layer for layer in layers if layer.active_render), None)
    if own is None or layers.active is None or own.name == layers.active.name:
        return
    if not np.array_equal(_uvs(own), _uvs(layers.active)):
        raise other_map(layers.active.name, own.name)


def _uvs(layer) -> np.ndarray:
    uvs = np.empty(2 * len(layer.data), np.float32)
    layer.data.foreach_get("uv", uvs)
    return uvs


def _reader(image, target: BakeTarget) -> str:
    """Words for the node whose inputs read the image: the Beamspread node, or the material's former shader; or ""."""
    node = target.node
    # A texture at an input of the group around the node counts, too.
    sources = Links().readers(node.color_input(target.groups)) if node.has_texture() else ()
    outer = {getattr(source.node, "image", None) for source in sources if source.socket.is_output}
    if image in outer | _images_read(node):
        return "the Beamspread node"
    former = former_output(node)
    if former is not None and image in _images_read(former.node):
        return f"'{former.node.name}', the former shader,"
    return ""


def _images_read(node) -> set:
    """Images that the node's inputs come from."""
    images, waiting, seen = set(), [node], {node}
    while waiting:
        for socket in waiting.pop().inputs:
            for source in (link.from_node for link in socket.links):
                if source not in seen:
                    seen.add(source)
                    waiting.append(source)
                    images.add(getattr(source, "image", None))
    return images - {None}


def textures_at_risk(context) -> list[str]:
    """Sentences on textures that Blender's Bake of another engine would replace, by the selected objects."""
    found = {}
    for obj in list(context.view_layer.objects.selected)[:MAX_OBJECTS]:
        for target in targets_of(obj) if obj.type == "MESH" else ():
            image = active_image(target.material)
            if image is not None and (reader := _reader(image, target)):
                found[image] = f"Bake replaces '{image.name}', a texture of {reader} in '{target.material.name}'."
    return list(found.values())


def refusals(context, by_active_map: bool = True) -> dict:
    """Images that Blender would clear although no bake may fill them, each with the reason, by the selected objects.

    `by_active_map`: True if Blender fills the active UV map, False if its operator may name another.
    """
    settings, found = context.scene.beamspread.for_bake(), {}
    for obj in list(context.view_layer.objects.selected)[:MAX_OBJECTS]:
        if obj.type != "MESH":
            continue
        targets = targets_of(obj)
        for target in targets:
            try:
                check_active_image(target, settings)
                if by_active_map:
                    _check_map(target)
            except ImageError as error:
                found[active_image(target.material)] = str(error)
        known = {target.material for target in targets}
        for material in {slot.material for slot in obj.material_slots} - known - {None}:
            image = active_image(material)
            if image is not None and image not in found:
                text = f"'{material.name}' of '{obj.name}' has no Beamspread node, so its image '{image.name}'"
                found[image] = f"{text} would only be cleared. Add the node, or deselect the object."
    return found


class BEAMSPREAD_OT_bake_active(bpy.types.Operator):
    """Fill the active image of each selected object by Blender's own Bake. Refuses textures that materials read"""

    bl_idname = "beamspread.bake_active"
    bl_label = "Bake Active Image"

    @classmethod
    def poll(cls, context):
        if context.scene.render.engine != ENGINE:
            cls.poll_message_set("Choose the render engine Beamspread")
            return False
        return bpy.ops.object.bake.poll()

    def execute(self, context):
        return self._bake(context, "EXEC_DEFAULT")

    def invoke(self, context, _event):
        return self._bake(context, "INVOKE_DEFAULT")

    def _bake(self, context, how: str):
        reasons = list(dict.fromkeys(refusals(context).values()))
        if reasons:
            self.report({"ERROR"}, " ".join(reasons))
            return {"CANCELLED"}
        return {"CANCELLED"} if "CANCELLED" in bpy.ops.object.bake(how) else {"FINISHED"}


def _is_stored(image) -> bool:
    """True if a file, or the .blend file, has an image's pixels."""
    return bool(image.packed_files) or Path(bpy.path.abspath(image.filepath, library=image.library)).is_file()


class _Saved:
    """Pixels of images that Blender's own operator clears while it runs without ours, as from its search menu.

    Those of refused images come back, and those of nodes' images for which the engine has no result.
    """

    def __init__(self) -> None:
        self._pixels: dict[str, np.ndarray] = {}
        self._packed: set[str] = set()
        self._reasons: dict[str, str] = {}  # by the images that get their pixels back; "" where the artist stopped
        self._filled: set[str] = set()

    def take(self, refused: dict, others: set) -> None:
        """Note images before Blender touches them: refused ones with the reason, and others that may get no result."""
        self.__init__()
        self._reasons = {image.name: reason for image, reason in refused.items()}
        for image in {*refused, *others}:
            if 0 in image.size or is_tiled(image):
                continue
            is_packed = not image.is_dirty and image.source != "GENERATED" and _is_stored(image)
            if is_packed:
                self._packed.add(image.name)
            if image in refused or not is_packed:
                self._take_pixels(image)

    def _take_pixels(self, image) -> None:
        self._pixels[image.name] = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(self._pixels[image.name])

    def take_in_script(self, image) -> bool:
        """Note an image while a script's bake runs; False if it can't get its pixels back.

        Blender may have cleared it: then those of its file come back. The handler that ends the bake is called for
        windows alone, but each operator ends with an update of the scene.
        """
        if threading.current_thread() is not threading.main_thread() or 0 in image.size:
            return False
        if not bpy.context.scene.render.bake.use_clear:
            self._take_pixels(image)
        elif _is_stored(image):
            self._packed.add(image.name)
        else:
            return False
        self._reasons.setdefault(image.name, "")
        self._end_after_script()
        return True

    def _end_after_script(self) -> None:
        if _after_script not in bpy.app.handlers.depsgraph_update_post:
            bpy.app.handlers.depsgraph_update_post.append(_after_script)

    def has(self, image) -> bool:
        """True if the image can get its pixels back."""
        return image.name in self._pixels or image.name in self._packed

    def lose(self, image, reason: str) -> None:
        """Note that the engine has no result for an image; a reason is shown."""
        if image.name not in self._filled and (self.has(image) or self.take_in_script(image)):
            self._reasons[image.name] = self._reasons.get(image.name) or reason

    def fill(self, image) -> None:
        """Note that an image has a result, maybe that of one object among several."""
        self._filled.add(image.name)
        if threading.current_thread() is threading.main_thread():
            self._end_after_script()

    def give_back(self) -> None:
        """Restore the pixels: of files and packed images that had no other ones, from these."""
        given = [name for name in self._reasons if name not in self._filled and self._give_back(name)]
        reasons = list(dict.fromkeys(filter(None, map(self._reasons.get, given))))
        if reasons:
            kept = "The images have their pixels again." if len(given) > 1 else "The image has its pixels again."
            popup.show_soon("Beamspread: nothing was baked", [*reasons, kept])
        self.__init__()

    def _give_back(self, name: str) -> bool:
        image, pixels = bpy.data.images.get(name), self._pixels.get(name)
        if image is None or (pixels is not None and len(image.pixels) != len(pixels)):
            return False
        if name in self._packed:
            # `reload` would pack the image's file again, if there is one.
            image.buffers_free()
            image.gl_free()
        elif pixels is not None:
            image.pixels.foreach_set(pixels)
            image.update()
        return name in self._packed or pixels is not None


_saved = _Saved()


def note_results(bakes: Iterable[Bake]) -> None:
    """Note which images of nodes Blender's Bake fills, and which it only clears, by bakes for the active images."""
    for bake in bakes:
        material = bpy.data.materials.get(bake.target.material_name)
        image = active_image(material)
        if image is None or image not in _images_of_nodes(material):
            continue
        if bake.status == WRITTEN:
            _saved.fill(image)
        else:
            errors = [str(message) for message in bake.messages.of(Level.ERROR)]
            _saved.lose(image, "" if bake.status == CANCELLED else " ".join(errors))


def _images_of_nodes(material) -> set:
    """Images that the material's Beamspread node shows."""
    node = find_node(material)
    return set() if node is None else {node.image, node.image_back} - {None}


def _images_at_risk(context) -> set:
    """Images of nodes that Blender's Bake clears, by the selected objects."""
    objects = [obj for obj in list(context.view_layer.objects.selected)[:MAX_OBJECTS] if obj.type == "MESH"]
    materials = {slot.material for obj in objects for slot in obj.material_slots} - {None}
    return {image for image in map(active_image, materials) if any(image in _images_of_nodes(m) for m in materials)}


@persistent
def _before_bake(*_arguments) -> None:
    if bpy.context.scene.render.engine == ENGINE:
        _saved.take(refusals(bpy.context, by_active_map=False), _images_at_risk(bpy.context))


def _after_script(*_arguments) -> None:
    """Give images back at the first update after a script's bake."""
    bpy.app.handlers.depsgraph_update_post.remove(_after_script)
    _saved.give_back()


@persistent
def _after_bake(*_arguments) -> None:
    _saved.give_back()


def _forget_scripts() -> None:
    if _after_script in bpy.app.handlers.depsgraph_update_post:
        bpy.app.handlers.depsgraph_update_post.remove(_after_script)


register, unregister = all_or_nothing(
    *classes(BEAMSPREAD_OT_bake_active),
    (lambda: None, _forget_scripts),
    *handlers(object_bake_pre=_before_bake, object_bake_complete=_after_bake, object_bake_cancel=_after_bake),
)
