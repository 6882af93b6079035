"""Preferences of the add-on, which apply to all files of a user.

There are none if the package is registered without being an enabled add-on, as batch.py does: then defaults apply.
"""

from __future__ import annotations

import functools
from pathlib import Path

import bpy
from bpy.props import IntProperty, StringProperty

from ..core import native
from ..core.ldf import library
from . import compat
from .popup import wrap
from .registration import all_or_nothing, classes

PACKAGE = __package__.rpartition(".")[0]
"""Name of the add-on: "beamspread", or "bl_ext.REPOSITORY.beamspread" as an extension."""

DOCS = [folder / "docs" for folder in Path(__file__).resolve().parents[1:3]]
"""Possible folders of the documentation: in the package, or beside it in the sources."""


def preferences(context=None):
    """Preferences of the user, or None."""
    addon = (context or bpy.context).preferences.addons.get(PACKAGE)
    return None if addon is None else addon.preferences


def threads() -> int:
    """Number of threads of a bake; 0 for all."""
    chosen = preferences()
    return chosen.threads if chosen else 0


def memory_limit() -> int:
    """Bytes that a bake may use; 0 for all of the machine's memory."""
    chosen = preferences()
    return chosen.memory_limit * 2**20 if chosen else 0


@functools.cache
def documentation(name: str) -> str:
    """URL of a page of the documentation; empty if it is not on this machine."""
    return next((page.as_uri() for folder in DOCS if (page := folder / f"{name}.md").is_file()), "")


def draw_help(layout, name: str) -> None:
    """A button that opens a page of the documentation."""
    if url := documentation(name):
        layout.operator("wm.url_open", text="", icon="HELP", emboss=False).url = url


def _use_cache_folder(chosen, _context) -> None:
    library.choose_cache_folder(bpy.path.abspath(chosen.cache_folder) if chosen.cache_folder else "")


class BeamspreadPreferences(bpy.types.AddonPreferences):
    """Settings of the machine."""

    bl_idname = PACKAGE

    cache_folder: StringProperty(
        name="Cache Folder",
        description="Folder for simulated media, a few megabytes each. Empty: the user's cache folder",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS - {"PATH_SUPPORTS_BLEND_RELATIVE"},
        update=_use_cache_folder,
    )
    threads: IntProperty(
        name="Threads",
        description="Number of threads of a bake. 0: one for each thread of the processor",
        default=0,
        min=0,
        soft_max=64,
        max=1024,
    )
    memory_limit: IntProperty(
        name="Memory Limit",
        description="Megabytes that a bake may use; larger bakes are refused. 0: all of the machine's memory",
        default=0,
        min=0,
        soft_max=65536,
        step=512,
    )

    def draw(self, context) -> None:
        layout = self.layout
        if native.problem:
            characters = max(40, int(context.region.width / context.preferences.system.ui_scale / 7))
            column = layout.column(align=True)
            for number, line in enumerate(wrap(native.problem, characters)):
                column.label(text=line, icon="BLANK1" if number else "ERROR")
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "threads")
        layout.prop(self, "memory_limit", text="Memory Limit (MB)")
        layout.prop(self, "cache_folder")
        files = library.cached_files()
        megabytes = sum(file.stat().st_size for file in files if file.is_file()) / 2**20
        row = layout.row()
        row.label(text=f"{len(files)} simulated media, {megabytes:.1f} MB, in")
        row.operator("beamspread.clear_cache", icon="TRASH")
        layout.label(text=str(library.cache_folder()))  # a row of its own: a button would cut it off
        if url := documentation("guide"):
            layout.operator("wm.url_open", text="Documentation", icon="HELP").url = url


class BEAMSPREAD_OT_clear_cache(bpy.types.Operator):
    """Delete all simulated media from the cache. The media that come with the add-on stay"""

    bl_idname = "beamspread.clear_cache"
    bl_label = "Clear"
    bl_options = {"INTERNAL"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context):
        freed = library.clear_cache()
        self.report({"INFO"}, f"Freed {freed / 2**20:.1f} MB. The next bakes simulate their media again")
        return {"FINISHED"}


def _choose_folder() -> None:
    if chosen := preferences():
        _use_cache_folder(chosen, None)


register, unregister = all_or_nothing(
    (lambda: None, lambda: library.choose_cache_folder("")),
    *classes(BeamspreadPreferences, BEAMSPREAD_OT_clear_cache),
    (_choose_folder, lambda: None),
)
