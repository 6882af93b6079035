"""Operators that bake into files: an animation, the present frame, and the command for a batch without a window."""

from __future__ import annotations

import shlex
from pathlib import Path

import bpy
from bpy.props import EnumProperty

from ....core.errors import BakeError, message_of
from ...node.find import NOTHING_FOUND
from ...registration import all_or_nothing, classes
from ..state import state
from .files_run import FilesRun, check_frames, frames_of
from .operator import all_targets, chosen_targets
from .run_operator import RunOperator

BATCH = Path(__file__).resolve().parents[3] / "batch.py"


class FilesOperator(RunOperator):
    """Base of operators that bake into files of the scene's folder."""

    objects: EnumProperty(
        name="Objects",
        description="Choose the objects to bake",
        items=[
            ("SELECTED", "Selected", "Bake the selected objects. If none has a Beamspread node, bake all", 0),
            ("ALL", "All", "Bake all objects that have a Beamspread node", 1),
        ],
        default="SELECTED",
    )

    def _prepare(self, context, in_window: bool) -> bool:
        is_chosen = self.objects == "SELECTED"
        targets, misplaced = chosen_targets(context, self.report) if is_chosen else all_targets(context)
        try:
            run = FilesRun(self.report, in_window, targets, self._frames(context.scene))
            error = None
        except BakeError as reason:
            run, error = FilesRun(self.report, in_window, targets, None), reason
        if not self._new(run, in_window):
            return False
        state.forget_failures()
        for bake in misplaced:
            run.end(bake)
        if not targets and not misplaced:
            error = error or NOTHING_FOUND
        try:
            if error is not None:
                raise error
            run.check()
        except BakeError as reason:
            run.fail(message_of(reason))
            return False
        return bool(targets)


class BEAMSPREAD_OT_bake_animation(FilesOperator, bpy.types.Operator):
    """Bake each frame into a file of its own, and have the nodes show the sequence. Frames that are up to date stay, \
so that a cancelled animation goes on where it was"""

    bl_idname = "beamspread.bake_animation"
    bl_label = "Bake Animation"
    bl_options = {"UNDO"}

    def _frames(self, scene) -> range:
        first, last = frames_of(scene)
        check_frames(first, last)
        return range(first, last + 1)


class BEAMSPREAD_OT_bake_files(FilesOperator, bpy.types.Operator):
    """Bake the current frame into files of the folder, one for each object and material. The nodes' images stay"""

    bl_idname = "beamspread.bake_files"
    bl_label = "Bake to Files"

    def _frames(self, _scene) -> None:
        return None


class BEAMSPREAD_OT_copy_command(bpy.types.Operator):
    """Copy the command that bakes the same frames without a window, as on a farm. It reads the saved .blend file"""

    bl_idname = "beamspread.copy_command"
    bl_label = "Copy Batch Command"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        if not bpy.data.filepath:
            cls.poll_message_set("Save the .blend file first")
            return False
        return True

    def execute(self, context):
        first, last = frames_of(context.scene)
        program = [bpy.app.binary_path or "blender", "-b", bpy.data.filepath, "--python", str(BATCH)]
        command = shlex.join([*program, "--", "--frames", f"{first}-{last}", "--resume"])
        context.window_manager.clipboard = command
        self.report({"INFO"}, f"Copied: {command}")
        return {"FINISHED"}


register, unregister = all_or_nothing(
    *classes(BEAMSPREAD_OT_bake_animation, BEAMSPREAD_OT_bake_files, BEAMSPREAD_OT_copy_command)
)
