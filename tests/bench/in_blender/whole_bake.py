"""Runs inside Blender for whole_bake.py: `make` its scenes, `save` an image, or bake and time the `phases`.

    blender -b [SCENE] --python THIS -- make FOLDER RESOLUTION
    blender -b SCENE --python THIS -- save IMAGE RESOLUTION
    blender -b SCENE --python THIS -- phases FOLDER

With the bpy module: python THIS SCENE -- ...
"""

import sys
import time
from pathlib import Path

import bpy

ALBEDOS = {"white": (0.9, 0.9, 0.9), "rgb": (0.6, 0.9, 0.3)}


def make(folder, resolution):
    """A floor in the light of a sun, half covered by the shadow of a monkey, in one material."""
    import beamspread

    sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "blender"))
    import scenes

    bpy.ops.wm.read_factory_settings(use_empty=True)
    beamspread.register()
    for name, albedo in ALBEDOS.items():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        material = scenes.add_material(albedo=albedo, mean_free_path=(0.02, 0.02, 0.02))
        scenes.add_plane("Floor", (2.0, 2.0), material=material)
        bpy.ops.mesh.primitive_monkey_add(size=0.8, location=(0, 0, 0.4))
        scenes.add_sun(45.0, 30.0)
        bpy.context.scene.beamspread.resolution = int(resolution)
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder) / f"{name}.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    beamspread.unregister()


def save(path, resolution):
    """A new float image as EXR, as Blender saves it by default."""
    image = bpy.data.images.new("Saved", int(resolution), int(resolution), alpha=False, float_buffer=True)
    image.filepath_raw, image.file_format = path, "OPEN_EXR"
    image.save()


def phases(folder):
    """Bake as batch.py does, and print the wall and CPU seconds of each phase."""
    start = time.perf_counter(), time.process_time()
    rows = []

    def timed(name, function):
        def call(*arguments, **options):
            begin = time.perf_counter(), time.process_time()
            try:
                return function(*arguments, **options)
            finally:
                rows.append((name, time.perf_counter() - begin[0], time.process_time() - begin[1]))

        return call

    def time_calls(name, owner, function):
        setattr(owner, function, timed(name, getattr(owner, function)))

    def import_all():
        from beamspread import batch, blender
        from beamspread.blender.images import files
        from beamspread.blender.jobs.run import batch_run as bakes
        from beamspread.core.bake import layers, steps

        return batch, blender, files, bakes, layers, steps

    batch, blender, files, bakes, layers, steps = timed("import", import_all)()
    time_calls("register", blender, "register")
    time_calls("extract", bakes, "prepare_scene")
    time_calls("library from the cache", layers, "_libraries")
    time_calls("light and solution", layers, "spread")
    time_calls("margin", steps, "finished_texture")
    time_calls("image file", files, "write_file")
    time_calls("unregister", blender, "unregister")
    batch.run(["--output", folder, "--report", str(Path(folder) / "report.json")])
    rest = [
        now - begin - sum(row[i] for row in rows)
        for i, now, begin in ((1, time.perf_counter(), start[0]), (2, time.process_time(), start[1]))
    ]
    for name, wall, cpu in [*rows, ("the rest", *rest)]:
        print(f"phase {name}: {wall:.3f} {cpu:.3f}")


def main():
    arguments = sys.argv[sys.argv.index("--") + 1 :]
    if not bpy.app.binary_path and sys.argv[1] != "--":
        bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
    {"make": make, "save": save, "phases": phases}[arguments[0]](*arguments[1:])


main()
