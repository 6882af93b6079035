"""Bakes without a window: `blender -b scene.blend --python batch.py -- [options]`, `--help` lists them.

Works with the add-on installed or not, and as `python batch.py scene.blend [options]` where `import bpy` works.
"""

from __future__ import annotations

import gc
import importlib
import importlib.util
import sys
import time
from pathlib import Path

PACKAGE_FOLDER = Path(__file__).resolve().parent


def load_package() -> str:
    """Name of the package that this run uses: the add-on if it is on, else the one around this file.

    Two copies in one process would register the same classes and native types twice.
    """
    import bpy

    node_class = bpy.types.Node.bl_rna_get_subclass_py("BeamspreadNode")
    if node_class is not None:
        return node_class.__module__.rpartition(".")[0]
    name = PACKAGE_FOLDER.name if PACKAGE_FOLDER.name.isidentifier() else "beamspread"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            name, PACKAGE_FOLDER / "__init__.py", submodule_search_locations=[str(PACKAGE_FOLDER)]
        )
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return name


def run(arguments: list[str]) -> int:
    """Parse, open the scene, bake, report; the exit code."""
    import bpy

    from . import registration, status
    from .core import batch_options

    options = batch_options.parse(arguments)
    registers = not hasattr(bpy.types.Scene, "beamspread")
    if registers:
        registration.register()
    try:
        problem = status.native_problem() or _open(options.scene)
        if problem:
            print(f"Beamspread: {problem}", file=sys.stderr)
            return 1
        report = _bake_all(options)
        if options.report:
            try:
                report.save(options.report)
            except OSError as error:
                print(f"Beamspread: the report {options.report} cannot be written: {error}", file=sys.stderr)
                return 1
        return 0 if report.all_written() else 1
    finally:
        # Classes left registered can keep newer versions from exiting, and so can nodes of a class that is gone.
        if registers:
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            registration.unregister()


def _open(path: str | None) -> str:
    """Open a .blend file if one is named; one sentence if it cannot be."""
    import bpy

    if path is None:
        return ""
    if not Path(path).is_file():
        return f"The scene {path} does not exist."
    try:
        bpy.ops.wm.open_mainfile(filepath=str(Path(path).resolve()))
    except RuntimeError as error:
        return f"The scene {path} cannot be opened: {error}"
    return ""


def _bake_all(options):
    import bpy

    from .core.report import CANCELLED, Report

    scene = bpy.context.scene
    first, last = options.frames or (scene.frame_current, scene.frame_current)
    report, taken = Report(), set()
    for frame in range(first, last + 1):
        if options.frames:
            scene.frame_set(frame)
        for record in _bake_frame(options, frame, taken):
            report.bakes.append(record)
            print(f"Beamspread: {record}", file=sys.stdout if record.status == "written" else sys.stderr, flush=True)
            if record.status == CANCELLED:
                return report
    if not report.bakes:
        print("Beamspread: No mesh has a material with a Beamspread node.", file=sys.stderr)
    return report


def _bake_frame(options, frame: int, taken: set[str]):
    """Bake every target at the current frame; yields one BakeRecord each, and goes on when one fails."""
    import bpy

    from . import bakes
    from .core.report import BakeRecord

    scene = bpy.context.scene
    wanted = []
    for name in options.objects or [obj.name for obj in scene.objects]:
        found = bakes.find_targets([scene.objects[name]]) if name in scene.objects else []
        if options.objects and not found:
            missing = "has no material with a Beamspread node" if name in scene.objects else "is not in the scene"
            yield BakeRecord(name, frame=frame, message=f"The object '{name}' {missing}.")
        wanted += found
    settings = bakes.core_settings(scene.beamspread, options.solver)
    for prepared in bakes.prepare(bpy.context, wanted, settings, options.resolution):
        record = BakeRecord(prepared.target.object_name, prepared.target.material_name, frame, message=prepared.error)
        if prepared.job is not None:
            record.width, record.height = prepared.job.receiver.width, prepared.job.receiver.height
            _bake_one(prepared, options, record, taken)
        yield record


def _bake_one(prepared, options, record, taken: set[str]) -> None:
    """Bake and write one target and note in `record` what became of it."""
    from . import bakes
    from .core.report import CANCELLED, WRITTEN

    start = time.monotonic()
    try:
        texture = prepared.job.run(_Printer(str(prepared.target)))
        record.path = _write(options, record, texture, taken)
        record.status = WRITTEN
        record.message = " ".join(prepared.job.warnings)
        if record.path.lower().endswith(".png") and texture.max() > 1:
            record.message = f"{record.message} Values above 1 were clipped: EXR keeps them.".strip()
    except KeyboardInterrupt:
        record.status, record.message = CANCELLED, "The bake was cancelled."
    except Exception as error:  # noqa: BLE001 - the others are still to be baked
        record.message = bakes.sentence(error)
    record.seconds = round(time.monotonic() - start, 3)


def _write(options, record, texture, taken: set[str]) -> str:
    """Write to --output, else to the file of the node's image, else to the scene's folder; returns the path."""
    import bpy

    from . import nodes, targets
    from .core.errors import ImageError
    from .core.report import file_name

    settings = bpy.context.scene.beamspread
    if options.output is None:
        image = nodes.find_node(bpy.data.materials[record.material]).image
        if image is not None and _belongs_in(image, options, record):
            targets.fill_image(image, texture)
            return str(targets.file_of(image))
    file_format = options.format or settings.format
    folder = options.output or settings.output_dir
    if folder.startswith("//") and not bpy.data.filepath:
        raise ImageError("The scene was never saved, so there is no folder to write to: give one with --output.")
    frame = record.frame if options.frames else None
    name = file_name(record.object, record.material, frame, targets.EXTENSIONS[file_format], taken)
    path = Path(bpy.path.abspath(folder)).absolute() / name
    targets.write_file(path, texture, file_format)
    return str(path)


def _belongs_in(image, options, record) -> bool:
    """Whether a bake can go to the file that its image already has: one frame, same size and format."""
    from . import targets

    path = targets.file_of(image)
    if path is None or options.frames is not None or tuple(image.size) != (record.width, record.height):
        return False
    return options.format is None or path.suffix.lower() == targets.EXTENSIONS[options.format]


class _Printer:
    """Progress in lines of ten percent."""

    def __init__(self, subject: str) -> None:
        self._subject = subject
        self._shown = 0

    def __call__(self, fraction: float) -> bool:
        tenth = int(10 * fraction)
        if tenth > self._shown:
            self._shown = tenth
            print(f"Beamspread: {self._subject}: {10 * tenth} %", flush=True)
        return True


def main() -> int:
    """Run as a script; the exit code."""
    import bpy

    # `python batch.py` makes this folder the first place to look for any module, such as one named "settings".
    sys.path[:] = [place for place in sys.path if Path(place or ".").resolve() != PACKAGE_FOLDER]
    try:
        package = load_package()
        inside_blender = bool(bpy.app.binary_path)
        options = importlib.import_module(f"{package}.core.batch_options")
        arguments = options.arguments_for_script(sys.argv, inside_blender)
        return importlib.import_module(f"{package}.batch").run(arguments)
    except Exception:  # noqa: BLE001 - Blender would print it and exit with 0
        import traceback

        traceback.print_exc()
        return 1
    finally:
        # The process ends here: don't let Python search everything that Blender and numpy hold for cycles once more.
        gc.freeze()


if __name__ == "__main__":
    sys.exit(main())
