"""The operators Bake and Cancel."""

from __future__ import annotations

from collections.abc import Callable

import bpy
from bpy.props import EnumProperty

from ....core.bake.runner import Bake
from ....core.errors import BakeError, message_of
from ....core.target import Target
from ...node.find import NOTHING_FOUND, find_bakeable, find_misplaced
from ...registration import all_or_nothing, classes
from ..out_of_date import stale
from ..state import state
from .bake_plan import read_scene
from .bake_run import BakeRun, steps_of
from .run_operator import RunOperator, end_threads

NOTHING_STALE = BakeError("Nothing is out of date.")


def chosen_targets(context, report: Callable[[set[str], str], None]) -> tuple[list[Target], list[Bake]]:
    """Targets among the selected objects, and failed bakes of nodes that no bake can use; all if there are none."""
    chosen = context.selected_objects
    targets, misplaced = find_bakeable(context.view_layer, chosen), find_misplaced(chosen, with_images=True)
    if targets or misplaced:
        return targets, misplaced
    report({"INFO"}, "No selected object has a Beamspread node: all that have one are baked")
    return all_targets(context)


def all_targets(context) -> tuple[list[Target], list[Bake]]:
    """The same of all objects."""
    return find_bakeable(context.view_layer), find_misplaced(context.scene.objects)


class BEAMSPREAD_OT_bake(RunOperator, bpy.types.Operator):
    """Bake the light inside translucent surfaces into the images of their Beamspread nodes"""

    bl_idname = "beamspread.bake"
    bl_label = "Bake Beamspread"
    bl_options = {"UNDO"}

    objects: EnumProperty(
        name="Objects",
        description="Choose the objects to bake",
        items=[
            ("SELECTED", "Selected", "Bake the selected objects. If none has a Beamspread node, bake all", 0),
            ("ALL", "All", "Bake all objects that have a Beamspread node", 1),
            ("STALE", "Out of Date", "Bake again every object that changed since its last bake", 2),
        ],
        default="SELECTED",
    )

    @classmethod
    def description(cls, _context, properties):
        return properties.bl_rna.properties["objects"].enum_items[properties.objects].description

    def _prepare(self, context, in_window: bool) -> bool:
        """Read the scene for the run; False if there is nothing to do. Nodes that no bake can use fail at once."""
        if not self._new(BakeRun(self.report, in_window), in_window):
            return False
        targets, misplaced = self._chosen(context)
        if not targets and not misplaced:
            self._run.fail(message_of(NOTHING_STALE if self.objects == "STALE" else NOTHING_FOUND))
            return False
        state.forget_failures()
        for bake in misplaced:
            self._run.end(bake)
        plans = read_scene(context, targets, fills_nodes=True)
        parts = stale.parts_of(context, targets)  # with the UV maps that the reader makes
        self._run.take(steps_of(plans, context.scene.beamspread.for_bake(), preview_first=in_window), parts)
        return True

    def _chosen(self, context) -> tuple[list[Target], list[Bake]]:
        if self.objects == "STALE":
            stale.refresh(context)
            return [row.target for row in state.rows.values() if row.is_stale], []
        return chosen_targets(context, self.report) if self.objects == "SELECTED" else all_targets(context)


class BEAMSPREAD_OT_cancel(bpy.types.Operator):
    """Stop the bake that is running: images keep their former pixels (Esc)"""

    bl_idname = "beamspread.cancel"
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        return state.is_running()

    def execute(self, _context):
        state.ask_to_stop()
        return {"FINISHED"}


register, unregister = all_or_nothing(*classes(BEAMSPREAD_OT_bake, BEAMSPREAD_OT_cancel), (lambda: None, end_threads))
