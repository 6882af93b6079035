"""Preferences of the add-on, which hold for all files of a user.

Where the package is registered without being an enabled add-on, as batch.py does, there are none: then defaults hold.
"""

from __future__ import annotations

import functools
import textwrap
from pathlib import Path

import bpy
from bpy.props import IntProperty, StringProperty

from ..core import native
from ..core.ldf import library
from . import compat
from .registration import all_or_nothing, classes

# Of the add-on: "beamspread", or "bl_ext.REPOSITORY.beamspread" as an extension.
PACKAGE = __package__.rpartition(".")[0]

# In the package, or beside it where it is used from its sources.
DOCS = [folder / "docs" for folder in Path(__file__).resolve().parents[1:3]]


def preferences(context=None):
    """Those of the user, or None."""
    addon = (context or bpy.context).preferences.addons.get(PACKAGE)
    return None if addon is None else addon.preferences


def threads() -> int:
    own = preferences()
    return own.threads if own else 0


def memory_limit() -> int:
    """In bytes; 0: no other than the machine's."""
    own = preferences()
    return own.memory_limit * 2**20 if own else 0


@functools.cache
def documentation(name: str) -> str:
    """A page of the documentation as a URL; empty where it is not on this machine."""
    return next((page.as_uri() for folder in DOCS if (page := folder / f"{name}.md").is_file()), "")


def draw_help(layout, name: str) -> None:
    """A button that opens a page of the documentation."""
    if url := documentation(name):
        layout.operator("wm.url_open", text="", icon="HELP", emboss=False).url = url


def _use_cache_folder(own, _context) -> None:
    library.choose_cache_folder(bpy.path.abspath(own.cache_folder) if own.cache_folder else "")


class BeamspreadPreferences(bpy.types.AddonPreferences):
    """What depends on the machine and not on the scene."""

    bl_idname = PACKAGE

    cache_folder: StringProperty(
        name="Cache Folder",
        description="Where simulated media are kept, a few megabytes each. Empty: the user's cache folder",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS - {"PATH_SUPPORTS_BLEND_RELATIVE"},
        update=_use_cache_folder,
    )
    threads: IntProperty(
        name="Threads",
        description="Threads that a bake uses. 0: one for each of the processor's",
        default=0,
        min=0,
        soft_max=64,
        max=1024,
    )
    memory_limit: IntProperty(
        name="Memory Limit",
        description="A bake that would need more megabytes is refused beforehand. 0: all of the machine's memory",
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
            for number, line in enumerate(textwrap.wrap(native.problem, characters)):
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
        layout.label(text=str(library.cache_folder()))  # by itself: beside a button it would be cut
        if url := documentation("node"):
            layout.operator("wm.url_open", text="Documentation", icon="HELP").url = url


class BEAMSPREAD_OT_clear_cache(bpy.types.Operator):
    """Delete the simulated media that are kept; those that come with the add-on stay"""

    bl_idname = "beamspread.clear_cache"
    bl_label = "Clear"
    bl_options = {"INTERNAL"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context):
        freed = library.clear_cache()
        self.report({"INFO"}, f"Freed {freed / 2**20:.1f} MB: these media are simulated anew when they are next baked")
        return {"FINISHED"}


def _choose_folder() -> None:
    if own := preferences():
        _use_cache_folder(own, None)


register, unregister = all_or_nothing(
    (lambda: None, lambda: library.choose_cache_folder("")),
    *classes(BeamspreadPreferences, BEAMSPREAD_OT_clear_cache),
    (_choose_folder, lambda: None),
)
