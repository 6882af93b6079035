"""Bakes without a window: `blender -b scene.blend --python batch.py -- [options]`; `--help` lists the options.

The add-on need not be installed. `python batch.py scene.blend [options]` works if `import bpy` does.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import shutil
import sys
from pathlib import Path

PACKAGE_FOLDER = Path(__file__).resolve().parent


def load_package() -> str:
    """Name of the package that this run uses: the add-on if it is enabled, else the package of this file.

    Two copies in one process would register the same classes and native types twice.
    """
    import bpy

    node_class = bpy.types.Node.bl_rna_get_subclass_py("BeamspreadNode")
    if node_class is not None:
        return node_class.__module__.rpartition(".blender.")[0]
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
    """Parse the arguments, open the scene, bake and report; the exit code."""
    import bpy

    from . import blender
    from .blender.jobs.run import batch_run
    from .core.batch import batch_options as command_line
    from .core.batch.log_file import log_file, unwritable
    from .core.batch.stop import listening
    from .core.native import problem

    options = command_line.parse(arguments)
    registers = not hasattr(bpy.types.Scene, "beamspread")
    if registers:
        blender.register()
    try:
        trouble = problem or unwritable(options.log) or _open(options.scene)
        if trouble:
            print(f"Beamspread: {trouble}", file=sys.stderr)
            return 1
        with listening() as stop, log_file(options.log, _versions()):
            report = batch_run.bake_all(options, stop)
            is_saved = _save(report, options.report)
            if stop and not report.all_written():
                return stop.exit_code
            if options.save:
                is_saved &= _save_scene()
        return 0 if is_saved and report.all_written() and (options.allow_dark or not report.dark()) else 1
    finally:
        # Registered classes, and nodes of unregistered ones, can keep newer versions from exiting.
        if registers:
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            blender.unregister()


def _versions() -> str:
    import bpy

    version = (PACKAGE_FOLDER / "VERSION").read_text(encoding="utf-8").strip()
    return f"Beamspread {version}, Blender {bpy.app.version_string}, Python {sys.version}"


def _save(report, path: str | None) -> bool:
    """Write the report if there is a path; True unless that fails."""
    if path is None:
        return True
    try:
        report.save(path)
    except OSError as error:
        print(f"Beamspread: the report {path} cannot be written: {error}", file=sys.stderr)
        return False
    return True


def _save_scene() -> bool:
    """Save the .blend file; True unless that fails."""
    import bpy

    try:
        bpy.ops.wm.save_mainfile()
    except RuntimeError as error:
        print(f"Beamspread: the scene cannot be saved: {error}", file=sys.stderr)
        return False
    return True


def _open(path: str | None) -> str:
    """Open a .blend file if there is a path; a message if it cannot be opened."""
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


def main() -> int:
    """Run as a script; the exit code."""
    import bpy

    # `python batch.py` puts this folder first in the search path, where it would hide other modules of the same names.
    sys.path[:] = [folder for folder in sys.path if Path(folder or ".").resolve() != PACKAGE_FOLDER]
    try:
        package = load_package()
        inside_blender = bool(bpy.app.binary_path)
        options = importlib.import_module(f"{package}.core.batch.batch_options")
        arguments = options.arguments_for_script(sys.argv, inside_blender)
        return importlib.import_module(f"{package}.batch").run(arguments)
    except Exception:  # noqa: BLE001 - Blender would print it and exit with 0
        import traceback

        traceback.print_exc()
        return 1


def leave(code: int) -> None:
    """End the process with this exit code.

    Blender as a module (4.2.23) crashes after Python has ended if an add-on's properties had callbacks, as ours have.
    """
    import bpy

    if bpy.app.binary_path:
        sys.exit(code)
    sys.stdout.flush()
    sys.stderr.flush()
    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    os._exit(code)


if __name__ == "__main__":
    leave(main())
