"""Beamspread: bakes how light spreads inside translucent surfaces, depending on where it comes from.

Outside Blender this package is the Python interface of the native module; inside Blender it is an add-on as well.
"""

import sys

if "bl_info" in globals():
    # An update was installed over the running add-on, whose modules are still loaded: load them again. A native module
    # can't be replaced; core/native.py checks its version.
    for _name in [name for name in sys.modules if name.startswith(f"{__name__}.") and not name.endswith("._native")]:
        del sys.modules[_name]
        globals().pop(_name[len(__name__) + 1 :], None)  # otherwise `from . import blender` finds the old module

from .core.native import native, problem

bl_info = {
    "name": "Beamspread",
    "description": "Bakes light inside translucent surfaces, depending on where it comes from",
    "author": "Beamspread developers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Beamspread; Shader Editor > Add > Shader > Beamspread",
    "category": "Render",
    "doc_url": "https://extensions.blender.org/add-ons/beamspread/",
    "tracker_url": "https://extensions.blender.org/add-ons/beamspread/reviews/",
}

if problem:
    # Inside Blender the add-on registers all the same, and its panel shows the message.
    if "bpy" not in sys.modules:
        raise ImportError(problem)
    __all__ = ["register", "unregister"]
else:
    from .core.bake.convolve import adaptive_beams, convolve, convolve_lights, luminance
    from .core.ldf.albedo import albedo_from_color
    from .core.ldf.library import library
    from .core.material import Material, presets

    AngularSpace = native.AngularSpace
    Cancelled = native.Cancelled
    LdfLibrary = native.LdfLibrary
    LdfSample = native.LdfSample
    Medium = native.Medium
    exact_totals = native.exact_totals
    interpolate = native.interpolate
    simulate = native.simulate
    walk_kernels = native.walk_kernels
    __all__ = [
        "AngularSpace",
        "Cancelled",
        "LdfLibrary",
        "LdfSample",
        "Material",
        "Medium",
        "adaptive_beams",
        "albedo_from_color",
        "convolve",
        "convolve_lights",
        "exact_totals",
        "interpolate",
        "library",
        "luminance",
        "presets",
        "simulate",
    ]


def register() -> None:
    from . import blender

    if problem:
        sys.stderr.write(f"Beamspread: {problem}\n")
    blender.register()


def unregister() -> None:
    from . import blender

    blender.unregister()


def glTF2_pre_export_callback(_settings) -> None:  # Blender's exporter looks for this name in add-ons
    """Have glTF files get the bakes, not the previews of Live, by nodes that the exporter reads."""
    from .blender.live import timer
    from .blender.node import gltf

    timer.hide_previews()
    gltf.begin_export()


def glTF2_post_export_callback(_settings) -> None:
    """Put the nodes back, and show the previews of Live again."""
    from .blender.live import timer
    from .blender.node import gltf

    gltf.end_export()
    timer.show_previews()
