"""Makes the example scenes, each a .blend beside this file: those below and the modules that it imports.

    tools/build.sh && blender -b --factory-startup --python-exit-code 1 --python blend_examples/make_scenes.py

Lengths are metres. The files are checked in; run this after changing it.
"""

import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "build" / "stage")]

import acrylic_letters  # noqa: E402
import beamspread  # noqa: E402
import freckled_arm  # noqa: E402
import inlay  # noqa: E402
import jade_bowl  # noqa: E402
import low_sun  # noqa: E402
import marble_floor  # noqa: E402
import marble_head  # noqa: E402
import paper_page  # noqa: E402
import paper_shade  # noqa: E402
import plank_floor  # noqa: E402
import printed_letters  # noqa: E402
import quail_egg  # noqa: E402
import round_soap  # noqa: E402
import scene_parts as parts  # noqa: E402
import shop_window  # noqa: E402
import soap_bar  # noqa: E402
import soapstone  # noqa: E402
import stage  # noqa: E402
import veined_slab  # noqa: E402

# The medium of the paper's figures 7 and 8 (Manabe et al. 2012): index-matched, forward scattering, coloured.
PAPER_MEDIUM = {"color_mode": "ALBEDO", "albedo": (0.6, 0.9, 0.3), "anisotropy": 0.8, "ior": 1.0}


def laser_beams():
    """The paper's figure 7: seven narrow beams, straight down in the middle, at 45 and 55 degrees around it."""
    scene = parts.empty_scene("Laser beams", 720, 720, samples=16)
    # The halo of a beam falls to a hundredth within about 8 mean free paths (albedo 0.9). At 4 mm the picture is
    # 64 mean free paths wide: halos fill it without running into each other, and a texel is a quarter of one.
    mean_free_path, width = 0.004, 0.256
    material, _ = parts.medium_material("Paper medium", mean_free_path=(mean_free_path,) * 3, **PAPER_MEDIUM)
    scene.beamspread.resolution = 256
    parts.plane("Plate", width, width, material)
    # One degree is the narrowest cone that Blender allows: 7 mm from this distance, under two mean free paths.
    distance, cone_deg, watts = 0.4, 1.0, 400.0
    parts.spot_lamp("White", (0, 0, 0), Vector((0, 0, -1)), distance, cone_deg, watts, (1, 1, 1))
    around = [
        ("Red", (1, 0, 0)),
        ("Magenta", (1, 0, 1)),
        ("Blue", (0, 0, 1)),
        ("Cyan", (0, 1, 1)),
        ("Green", (0, 1, 0)),
        ("Yellow", (1, 1, 0)),
    ]
    for index, (name, color) in enumerate(around):
        azimuth_deg, angle_deg = 60.0 * index, (45.0, 55.0)[index % 2]
        radius = 18 * mean_free_path
        target = (radius * math.cos(math.radians(azimuth_deg)), radius * math.sin(math.radians(azimuth_deg)), 0)
        along = parts.direction(angle_deg, azimuth_deg)  # away from the middle
        parts.spot_lamp(f"{name} {angle_deg:.0f}", target, along, distance, cone_deg, watts, color)
    view = parts.camera((0, 0, 1), (0, 0, 0))
    view.rotation_euler = (0, 0, 0)
    view.data.type, view.data.ortho_scale = "ORTHO", width


def obstacle():
    """The paper's figure 8: a standing rectangle, sun at 55 degrees from the left (frame 1) and the right (frame 2)."""
    scene = parts.empty_scene("Obstacle", 960, 640, samples=48)
    # Light gets some ten mean free paths into the shadow. At 4 mm the plate is 100 by 64 of them and the shadow 30
    # long: the borders at its foot and at its end do not reach each other, and both are well visible.
    mean_free_path = 0.004
    material, _ = parts.medium_material("Paper medium", mean_free_path=(mean_free_path,) * 3, **PAPER_MEDIUM)
    scene.beamspread.resolution = 800
    parts.plane("Plate", 100 * mean_free_path, 64 * mean_free_path, material)
    half, height = 20 * mean_free_path, 21 * mean_free_path
    corners = [(0, -half, 0), (0, half, 0), (0, half, height), (0, -half, height)]
    grey = parts.plain_material("Grey", (0.06, 0.06, 0.06), roughness=0.7, specular=0.2)
    parts.mesh_object("Obstacle", corners, [(0, 1, 2, 3)], grey)
    lamp = parts.sun("Sun", parts.direction(55, 0), 20.0)
    scene.frame_start, scene.frame_end = 1, 2
    for frame, azimuth_deg in ((1, 0), (2, 180)):
        parts.aim(lamp, parts.direction(55, azimuth_deg))
        lamp.keyframe_insert("rotation_euler", frame=frame)
    for curve in lamp.animation_data.action.fcurves:
        for key in curve.keyframe_points:
            key.interpolation = "CONSTANT"
    scene.frame_set(1)
    parts.camera((0.11, -0.60, 0.46), (0.0, -0.01, 0.012), lens=54)


def main():
    beamspread.register()
    scenes = {
        "acrylic_letters": acrylic_letters.build,
        "freckled_arm": freckled_arm.build,
        "inlay": inlay.build,
        "jade_bowl": jade_bowl.build,
        "laser_beams": laser_beams,
        "obstacle": obstacle,
        "marble_floor": marble_floor.build,
        "marble_head": marble_head.build,
        "low_sun": low_sun.build,
        "paper_page": paper_page.build,
        "paper_shade": paper_shade.build,
        "plank_floor": plank_floor.build,
        "printed_letters": printed_letters.build,
        "quail_egg": quail_egg.build,
        "round_soap": round_soap.build,
        "soapstone": soapstone.build,
        "soap_bar": soap_bar.build,
        "stage": stage.build,
        "shop_window": shop_window.build,
        "veined_slab": veined_slab.build,
    }
    # Names after the `--` choose.
    chosen = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    for name in chosen or scenes:
        scenes[name]()
        parts.save(str(HERE / f"{name}.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)


if __name__ == "__main__":
    main()
