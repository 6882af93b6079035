"""The frames that a batch has written, as an image sequence in the node: it follows the frame by itself."""

from __future__ import annotations

import re
from pathlib import Path

import bpy

from ...core.bake.bake_settings import COMBINED
from ...core.batch.batch_options import parse
from ...core.errors import ImageError
from ...core.target import Target
from ..node.find import find_node, find_targets
from ..node.node import link_result
from ..node.tree import FRAMES
from ..read.instances import with_instanced
from ..registration import all_or_nothing, classes
from .files import file_of
from .outputs import Outputs

# Of a sequence: the image that the node had before. A pointer, so that it stays in the file.
FORMER = "beamspread_former"


def is_sequence(image) -> bool:
    """Whether an image is one that was made here."""
    return image is not None and image.source == "SEQUENCE" and FRAMES in image


def size_of_frames(image) -> tuple[int, int]:
    """Width and height of such a sequence's frames."""
    return tuple(image[FRAMES][2:])


def file_at(image, frame: int) -> Path | None:
    """The file that such a sequence has for a frame, or None."""
    first, last, *_ = image[FRAMES]
    path = file_of(image)
    return path.with_name(re.sub(r"\d+$", f"{frame:04d}", path.stem) + path.suffix) if first <= frame <= last else None


def find_frames(scene, target: Target) -> tuple[list[int], Path]:
    """Numbers of the frames that a batch with the scene's settings has written for a target, and the first one's file.

    ImageError where it could write none.
    """
    path = Outputs(scene, parse(["--frames", "1-1"])).path(target, COMBINED, 1)
    start, ending = path.name.removesuffix(f"0001{path.suffix}"), path.suffix
    pattern = re.compile(rf"{re.escape(start)}(\d{{4,}}){re.escape(ending)}")
    names = (one.name for one in path.parent.iterdir()) if path.parent.is_dir() else ()
    frames = sorted(int(found[1]) for name in names if (found := pattern.fullmatch(name)))
    return frames, path.with_name(f"{start}{frames[0]:04d}{ending}") if frames else path


def show_frames(node, frames: list[int], path: Path) -> tuple[list[str], list[str]]:
    """Have the node show the sequence; warnings and notes, as for a bake."""
    former = node.image[FORMER] if is_sequence(node.image) and FORMER in node.image else node.image
    image = bpy.data.images.load(str(path))
    size = tuple(image.size)  # which a sequence does not tell
    image.name = re.sub(r"_\d+$", "", path.stem) + " frames"
    image.source = "SEQUENCE"
    image.filepath = bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)
    image[FRAMES] = [frames[0], frames[-1], *size]
    if former is not None:
        image[FORMER] = former
    return link_result(node, image)


class BEAMSPREAD_OT_show_frames(bpy.types.Operator):
    """Have Beamspread nodes show the frames that a batch (--frames) has written to its folder, from frame to frame. \
Their own images are kept: Show Single Images brings them back"""

    bl_idname = "beamspread.show_frames"
    bl_label = "Show Frames"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        shown = []
        targets = _targets(context.scene)
        for target in targets:
            node, material = find_node(bpy.data.materials[target.material_name]), target.material_name
            if bpy.data.materials[material].library is not None:
                continue
            try:
                frames, path = find_frames(context.scene, target)
            except ImageError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            if not frames:
                folder = path.parent
                continue
            gaps = frames[-1] - frames[0] + 1 - len(frames)
            warnings, notes = show_frames(node, frames, path)
            if gaps:
                warnings.append(f"Of the frames {frames[0]} to {frames[-1]} of '{target}' {gaps} are missing.")
            for level, sentences in (("WARNING", warnings), ("INFO", notes)):
                for sentence in sentences:
                    self.report({level}, sentence)
            shown.append(f"'{target}' shows the frames {frames[0]} to {frames[-1]}")
        if not shown:
            where = f" in {folder}" if targets else ""
            self.report({"ERROR"}, f"There are no frames of a batch{where}: bake them with --frames A-B")
            return {"CANCELLED"}
        self.report({"INFO"}, ". ".join(shown))
        return {"FINISHED"}


class BEAMSPREAD_OT_show_single(bpy.types.Operator):
    """Have Beamspread nodes show their own images in place of the frames of a batch"""

    bl_idname = "beamspread.show_single"
    bl_label = "Show Single Images"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return any(_sequences(context.scene))

    def execute(self, context):
        for node in list(_sequences(context.scene)):
            node.image = node.image.get(FORMER)
        return {"FINISHED"}


def _targets(scene) -> list[Target]:
    return find_targets(with_instanced(scene.objects))


def _sequences(scene):
    """Nodes that show one."""
    nodes = (find_node(bpy.data.materials[target.material_name]) for target in _targets(scene))
    return (node for node in nodes if is_sequence(node.image))


register, unregister = all_or_nothing(*classes(BEAMSPREAD_OT_show_frames, BEAMSPREAD_OT_show_single))
