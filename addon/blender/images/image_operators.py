"""Buttons that change the image of a node: to float, to the scene's resolution, to the frames of a batch and back.

The frames are shown as an image sequence, which follows the scene's frame.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
from bpy.props import IntProperty

from ...core.bake.bake_settings import COMBINED
from ...core.bake.runner import Bake
from ...core.batch.batch_options import parse
from ...core.errors import ImageError
from ...core.messages import Message, warning
from ...core.target import BACK, FRONT, Target
from ..node.find import BakeTarget, find_node, targets_of
from ..node.node import image_of_side, link_result, set_image
from ..node.tree import follow_frames
from ..read.visibility import with_instanced
from ..registration import all_or_nothing, classes
from . import files, icons
from .facts import Frames, facts_of, is_sequence, set_facts
from .new_image import store_new
from .outputs import Outputs
from .udim import is_tiled


def images_in(context) -> list:
    """Images that the active material's Beamspread node shows."""
    # `context.object` is empty in the render properties.
    material = getattr(context, "material", None) or getattr(context.view_layer.objects.active, "active_material", None)
    node = find_node(material)
    images = () if node is None or material.library is not None else node.shown_images()
    return list(dict.fromkeys(image for image in images if image is not None))


def wanted_size(size: Sequence[int], resolution: int) -> tuple[int, int]:
    """Size of an image of the same shape with `resolution` texels along its longer side."""
    return tuple(max(1, round(resolution * side / max(size))) for side in size)


class ImageOperator:
    """Operator on the images of the active material's node that need it."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(cls.chosen(context))

    @classmethod
    def chosen(cls, context) -> list:
        images = [image for image in images_in(context) if not is_tiled(image) and image.library is None]
        return [image for image in images if 0 not in image.size and cls.needed(context, image)]

    def execute(self, context):
        for image in self.chosen(context):
            self.change(context, image)
        return {"FINISHED"}


class BEAMSPREAD_OT_make_float(ImageOperator, bpy.types.Operator):
    """Replace this image, which clips values above 1, by a float image with the same pixels. Its file stays"""

    bl_idname = "beamspread.make_float"
    bl_label = "Make Float"

    @classmethod
    def needed(cls, _context, image) -> bool:
        return files.clips(image)

    def change(self, _context, image) -> None:
        name, bakes = image.name, facts_of(image).bakes
        bake = Bake(Target(""))
        _path, new = store_new(name, files.linear_pixels(image), bake, image.colorspace_settings.is_data)
        image.user_remap(new)
        image.name, new.name = f"{name} (8 bit)", name
        set_facts(new, replace(facts_of(new), bakes=bakes))
        for material in bpy.data.materials:
            node = find_node(material)
            for side in (FRONT, BACK):
                if node is not None and image_of_side(node, side) == new:
                    set_image(node, new, side)  # the inner tree shows it
        for message in bake.messages:
            self.report({message.level.value}, str(message))


class BEAMSPREAD_OT_resize_image(ImageOperator, bpy.types.Operator):
    """Scale the image to the scene's resolution. The next bake fills it"""

    bl_idname = "beamspread.resize_image"
    bl_label = "Resize Image"

    side: IntProperty(
        name="Side", description="Longer side in pixels. 0: the scene's resolution", min=0, options={"HIDDEN"}
    )

    @classmethod
    def needed(cls, context, image) -> bool:
        settings = context.scene.beamspread
        return settings.use_size or tuple(image.size) != wanted_size(image.size, settings.resolution)

    def change(self, context, image) -> None:
        icons.scale(image, *wanted_size(image.size, self.side or context.scene.beamspread.resolution))
        image.update_tag()  # Blender sends no update for a new size


def find_frames(scene, target: Target) -> tuple[list[int], Path]:
    """Numbers of the frames that a batch with the scene's settings has written for a target, and the first one's file.

    Raises
    ------
    ImageError
        Such a batch has no folder to write to.
    """
    path = Outputs(scene, parse(["--frames", "1-1"])).path(target, COMBINED, 1)
    start, ending = path.name.removesuffix(f"0001{path.suffix}"), path.suffix
    pattern = re.compile(rf"{re.escape(start)}(\d{{4,}}){re.escape(ending)}")
    names = (file.name for file in path.parent.iterdir()) if path.parent.is_dir() else ()
    numbers = sorted(int(match[1]) for name in names if (match := pattern.fullmatch(name)))
    return numbers, path.with_name(f"{start}{numbers[0]:04d}{ending}") if numbers else path


def show_frames(node, numbers: list[int], path: Path, side: str = FRONT, uv_map: str | None = None) -> list[Message]:
    """Have a side of the node show the sequence that begins with the file. Map and messages are as of `link_result`."""
    shown = image_of_side(node, side)
    former = facts_of(shown).former if is_sequence(shown) else shown
    first = bpy.data.images.load(str(path))
    size = tuple(first.size)  # a sequence has none
    image = shown if _is_sequence_of(shown, path) else first
    if image != first:
        bpy.data.images.remove(first)
    image.name = re.sub(r"_\d+$", "", path.stem) + " frames"
    image.source = "SEQUENCE"
    image.filepath = bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)
    image.reload()  # of a sequence that was shown before, files may be new
    facts = facts_of(image)
    facts.frames, facts.former = Frames(numbers[0], numbers[-1], *size), former
    set_facts(image, facts)
    messages = link_result(node, image, uv_map, side=side)
    follow_frames(node.node_tree, image, numbers[0], numbers[-1])
    return messages


def _is_sequence_of(image, path: Path) -> bool:
    """True if an image is the sequence of the files that begin with this one."""
    if not is_sequence(image):
        return False
    shown = files.file_of(image)
    name = re.compile(re.escape(re.sub(r"_\d+$", "", path.stem)) + r"_\d+")
    return (shown.parent, shown.suffix) == (path.parent, path.suffix) and name.fullmatch(shown.stem) is not None


class BEAMSPREAD_OT_show_frames(bpy.types.Operator):
    """Show the frames that Bake Animation or a batch has written. They follow the scene's frame. \
Each node keeps its own image for Show Single Images"""

    bl_idname = "beamspread.show_frames"
    bl_label = "Show Frames"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        shown, folders = [], []
        for target in _local_targets(context.scene):
            try:
                numbers, path = find_frames(context.scene, target.name)
            except ImageError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            folders.append(path.parent)
            if numbers:
                self._show(target, numbers, path)
                shown.append(f"'{target.name}' shows the frames {numbers[0]} to {numbers[-1]}")
        if not shown:
            where = f" in {folders[0]}" if folders else ""
            self.report({"ERROR"}, f"There are no frames{where}: Bake Animation makes them")
            return {"CANCELLED"}
        self.report({"INFO"}, ". ".join(shown))
        return {"FINISHED"}

    def _show(self, target: BakeTarget, numbers: list[int], path: Path) -> None:
        messages = show_frames(target.node, numbers, path, target.side)
        missing = numbers[-1] - numbers[0] + 1 - len(numbers)
        if missing:
            text = f"{missing} of the frames {numbers[0]} to {numbers[-1]} of '{target.name}' are missing."
            messages.append(warning(str(target.name), text))
        for message in messages:
            self.report({message.level.value}, str(message))


class BEAMSPREAD_OT_show_single(bpy.types.Operator):
    """Have Beamspread nodes show their own images again, in place of frames"""

    bl_idname = "beamspread.show_single"
    bl_label = "Show Single Images"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return bool(_targets_with_frames(context.scene))

    def execute(self, context):
        for target in _targets_with_frames(context.scene):
            set_image(target.node, facts_of(target.image).former, target.side)
        return {"FINISHED"}


def _local_targets(scene) -> list[BakeTarget]:
    """Targets whose material is in this .blend file: a linked one cannot be changed."""
    targets = (target for obj in with_instanced(scene.objects) for target in targets_of(obj))
    return [target for target in targets if target.material.library is None]


def _targets_with_frames(scene) -> list[BakeTarget]:
    """Targets whose nodes show the frames of a batch."""
    return [target for target in _local_targets(scene) if is_sequence(target.image)]


register, unregister = all_or_nothing(
    *classes(BEAMSPREAD_OT_make_float, BEAMSPREAD_OT_resize_image, BEAMSPREAD_OT_show_frames, BEAMSPREAD_OT_show_single)
)
