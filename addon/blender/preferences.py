"""Preferences of the add-on, which apply to all files of a user.

There are none if the package is registered without being an enabled add-on, as batch.py does: then defaults apply.
"""

from __future__ import annotations

import functools
import re
from pathlib import Path

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ..core import native
from ..core.ldf import library
from ..core.material import presets
from . import compat
from .popup import wrap
from .registration import all_or_nothing, classes

PACKAGE = __package__.rpartition(".")[0]
"""Name of the add-on: "beamspread", or "bl_ext.REPOSITORY.beamspread" as an extension."""

DOCS = [folder / "docs" for folder in Path(__file__).resolve().parents[1:3]]
"""Possible folders of the documentation: in the package, or beside it in the sources."""

PAGE_ENDINGS = (".html", ".md")
"""Endings of a page: packages have HTML, sources Markdown."""

CUSTOM_PRESET = "CUSTOM"

NEW_BASE_COLOR, NEW_PATH_M, NEW_IOR = (0.8, 0.8, 0.8), 0.01, 1.4
"""Values of new nodes, unless the preferences have others: the color of Blender's own shaders, meters, index of
refraction. The node's properties have other defaults, those of older files, which don't hold a value."""

MANUAL = (
    ("bpy.types.beamspreadnode.image*", "guide", "4-the-images"),
    ("bpy.types.beamspreadnode*", "guide", "1-the-node"),
    ("bpy.types.beamspreadsettings.image_*", "guide", "4-the-images"),
    ("bpy.types.beamspreadsettings.resolution*", "guide", "4-the-images"),
    ("bpy.types.beamspreadsettings.texel_density*", "guide", "4-the-images"),
    ("bpy.types.beamspreadsettings.format*", "engines", "formats"),
    ("bpy.types.beamspreadsettings.use_exposure*", "engines", "formats"),
    ("bpy.types.beamspreadsettings.output*", "python-and-batch", "passes"),
    ("bpy.types.beamspreadsettings*", "guide", "3-the-bake"),
    ("bpy.types.beamspreadpreferences*", "python-and-batch", "libraries"),
    ("bpy.ops.beamspread.make_plain*", "engines", "by-gltf"),
    ("bpy.ops.beamspread.from_principled*", "guide", "from-principled"),
    ("bpy.ops.beamspread.show_*", "guide", "5-animation"),
    ("bpy.ops.beamspread*", "guide", "3-the-bake"),
)
"""Names of buttons and properties in Python, small letters and wildcards, with the page and the heading for them; the
first that fits counts."""


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
    pages = (folder / f"{name}{ending}" for folder in DOCS for ending in PAGE_ENDINGS)
    return next((page.as_uri() for page in pages if page.is_file()), "")


def manual_map() -> tuple[str, tuple[tuple[str, str], ...]]:
    """Pages that F1 and *Online Manual* open: the start of all URLs, and the rest of each by the button's name."""
    found = ((pattern, documentation(page), heading) for pattern, page, heading in MANUAL)
    return "", tuple((pattern, f"{url}#{heading}") for pattern, url, heading in found if url)


def draw_help(layout, name: str) -> None:
    """A button that opens a page of the documentation."""
    if url := documentation(name):
        layout.operator("wm.url_open", text="", icon="HELP", emboss=False).url = url


def _use_cache_folder(chosen, _context) -> None:
    library.choose_cache_folder(bpy.path.abspath(chosen.cache_folder) if chosen.cache_folder else "")


LABELS = {
    "clorox": "Bleach",
    "gatorade": "Sports Drink",
    "head_and_shoulders_shampoo": "Shampoo, Pearly",
    "pacific_ocean_surface_water": "Ocean Water, Pacific",
    "shampoo": "Shampoo, Clear",
    "skin1": "Skin, Darker",
    "skin2": "Skin, Lighter",
    "spectralon": "White (Spectralon)",
}
"""Labels of presets whose names are trademarks, or tell artists little."""


def _label(name: str) -> str:
    """Label of a preset."""
    words = re.sub(r"(?<=[a-z])(?=\d)", " ", name).replace("_", " ")
    return LABELS.get(name, words.title())


def preset_items() -> list[tuple]:
    """Measured materials as items of an enum."""
    # Files hold the number, which is the row in the table: new materials go to its end.
    items = [
        (name, _label(name), f"Measured by {material.source.partition(',')[0]}", number)
        for number, (name, material) in enumerate(presets().items(), start=1)
    ]
    return [(CUSTOM_PRESET, "Custom", "Values set by hand", 0), *sorted(items, key=lambda item: item[1])]


class BeamspreadPreferences(bpy.types.AddonPreferences):
    """Settings of the machine."""

    bl_idname = PACKAGE

    cache_folder: StringProperty(
        name="Cache Folder",
        description="Choose the folder for simulated materials, a few megabytes each. Empty: the user's cache folder",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS - {"PATH_SUPPORTS_BLEND_RELATIVE"},
        update=_use_cache_folder,
    )
    threads: IntProperty(
        name="Threads",
        description="Limit the threads of a bake. 0: all CPU threads",
        default=0,
        min=0,
        soft_max=64,
        max=1024,
    )
    memory_limit: IntProperty(
        name="Memory Limit",
        description="Refuse bakes that need more megabytes. 0: all of the machine's memory",
        default=0,
        min=0,
        soft_max=65536,
        step=512,
    )

    new_preset: EnumProperty(
        name="Preset",
        description="Choose the measured material of new nodes. Custom: the values below",
        items=preset_items(),
        default=CUSTOM_PRESET,
    )
    new_base_color: FloatVectorProperty(
        name="Base Color",
        description="Set the base color of new nodes",
        subtype="COLOR",
        size=3,
        default=NEW_BASE_COLOR,
        min=0.0,
        max=1.0,
    )
    new_path: FloatProperty(
        name="Mean Free Path (mm)",
        description="Set the mean distance between two scattering events in new nodes, in millimeters",
        default=NEW_PATH_M * 1000,
        min=1e-4,
        soft_max=1000.0,
        precision=3,
    )
    new_ior: FloatProperty(
        name="IOR", description="Set the index of refraction of new nodes", default=NEW_IOR, min=1.0, soft_max=2.0
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
        layout.label(text="Values of new nodes:", icon="NODE_MATERIAL")  # Blender shows no heading above a menu
        column = layout.column()
        column.prop(self, "new_preset")
        if self.new_preset == CUSTOM_PRESET:
            column.prop(self, "new_base_color")
            column.prop(self, "new_path")
            column.prop(self, "new_ior")
        layout.prop(self, "threads")
        layout.prop(self, "memory_limit", text="Memory Limit (MB)")
        layout.prop(self, "cache_folder")
        files = library.cached_files()
        megabytes = sum(file.stat().st_size for file in files if file.is_file()) / 2**20
        row = layout.row()
        row.label(text=f"Cache: {len(files)} simulated materials, {megabytes:.1f} MB")
        row.operator("beamspread.clear_cache", icon="TRASH")
        layout.label(text=str(library.cache_folder()))  # a row of its own: a button would cut it off
        if url := documentation("guide"):
            layout.operator("wm.url_open", text="Help Pages", icon="HELP").url = url


class BEAMSPREAD_OT_clear_cache(bpy.types.Operator):
    """Delete all simulated materials from the cache. Those that come with the add-on stay"""

    bl_idname = "beamspread.clear_cache"
    bl_label = "Clear"
    bl_options = {"INTERNAL"}

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    def execute(self, _context):
        freed = library.clear_cache()
        self.report({"INFO"}, f"Freed {freed / 2**20:.1f} MB. The next bakes simulate their materials again")
        return {"FINISHED"}


def _choose_folder() -> None:
    if chosen := preferences():
        _use_cache_folder(chosen, None)


register, unregister = all_or_nothing(
    (lambda: None, lambda: library.choose_cache_folder("")),
    *classes(BeamspreadPreferences, BEAMSPREAD_OT_clear_cache),
    (lambda: bpy.utils.register_manual_map(manual_map), lambda: bpy.utils.unregister_manual_map(manual_map)),
    (_choose_folder, lambda: None),
)
