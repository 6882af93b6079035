"""Phases that tests/matrix.sh runs in every Blender, one per process, without pytest: the life of a zip with a user.

    blender -b --python drive.py -- PHASE FOLDER        python drive.py PHASE FOLDER (where Blender is a module)

FOLDER holds the zips, `scenes` and the home of the user; results go to FOLDER/out, facts of this Blender to
FOLDER/facts.json.
A phase that fails ends with exit code 1 and a line that starts with "MATRIX".
"""

import importlib
import json
import os
import platform
import shutil
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np

IS_EXTENSION = bpy.app.version >= (4, 2, 0)
MODULE = "bl_ext.user_default.beamspread" if IS_EXTENSION else "beamspread"
SETTINGS = {"threads": 2, "memory_limit": 12345}
NODE = {
    "ior": 1.3,
    "anisotropy": 0.8,  # with this ior of a shipped medium: nothing is to be simulated
    "color_mode": "ALBEDO",
    "albedo": (0.9, 0.8, 0.6),
    "mean_free_path": (0.05, 0.05, 0.05),
}


class Failed(Exception):
    """Errors that an artist would have seen."""


def expect(condition, text):
    if not condition:
        raise Failed(text)


def package(part=""):
    """The installed package, or a module of it."""
    return importlib.import_module(f"{MODULE}{part}")


def place() -> Path:
    """Folder of the installed package."""
    if IS_EXTENSION:
        return Path(bpy.utils.user_resource("EXTENSIONS")) / "user_default" / "beamspread"
    return Path(bpy.utils.user_resource("SCRIPTS")) / "addons" / "beamspread"


def preferences():
    return bpy.context.preferences.addons[MODULE].preferences


def install(zip_path):
    if IS_EXTENSION:
        # Blender's command line is used where there is one: tests/matrix.sh.
        bpy.ops.extensions.package_install_files(repo="user_default", filepath=str(zip_path), enable_on_install=True)
    else:
        bpy.ops.preferences.addon_install(filepath=str(zip_path))
        bpy.ops.preferences.addon_enable(module=MODULE)


# --- phases ---------------------------------------------------------------------------------------------------------


def phase_install(folder):
    """Install the older zip unless a command did, set preferences that an upgrade must keep, install the newer zip."""
    older, newer = sorted(folder.glob("beamspread-*.zip"), key=version_of)
    if not place().is_dir():
        install(older)
    expect(MODULE in bpy.context.preferences.addons, "the add-on is not on after its installation")
    expect(installed_version() == version_of(older), f"{installed_version()} is installed, not {version_of(older)}")
    expect(sorted(in_zip(older)) == sorted(on_disk()), "the folder doesn't hold what the zip does")
    set_preferences(folder)
    if not problem():
        scene_with_node()
        bpy.context.scene.beamspread.resolution = 16
        bpy.context.scene.beamspread.quality = "preview"
        material = bpy.data.materials["Medium"]
        node_of(material).thickness = 0.05  # of no shipped medium
        bake()
        expect(len(list((folder / "cache").glob("*.exr"))) == 1, "the simulated medium was not cached")
        save(folder / "before_upgrade.blend")
    bpy.ops.wm.save_userpref()
    # Over the older one while that is on, as artists do.
    install(newer)
    bpy.ops.preferences.addon_enable(module=MODULE)
    expect(installed_version() == version_of(newer), f"{installed_version()} is there after the upgrade")
    expect(sorted(in_zip(newer)) == sorted(on_disk()), "the folder doesn't hold what the newer zip does")
    if "has no working native module" not in problem():
        # A native module stays in its process: nothing of the other version may run with it.
        expect("restart Blender" in problem(), f"after an upgrade without a restart is said: {problem()!r}")
    kept_preferences(folder)
    bpy.ops.wm.save_userpref()


def phase_work(folder):
    """After a restart: preferences that were kept; bakes of the examples; a node's life."""
    kept_preferences(folder)
    write_facts(folder)
    if problem():
        without_module(folder)
        raise SystemExit(3)
    kept_file(folder)
    bake_examples(folder)
    node_life(folder)


def phase_remove(folder):
    """Disable, enable, disable and remove; then look for leftovers."""
    scene_with_node()
    save(folder / "last.blend")
    for operator in (bpy.ops.preferences.addon_disable, bpy.ops.preferences.addon_enable):
        operator(module=MODULE)
    expect(node_is_as_set(), "a node changed while the add-on was off")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    bpy.ops.preferences.addon_disable(module=MODULE)
    left = sorted(name for name in dir(bpy.types) if "beamspread" in name.lower())
    expect(not left, f"classes are left: {left}")
    expect(not hasattr(bpy.types.Scene, "beamspread"), "Scene.beamspread is left")
    left = [
        f"{name}: {one}"
        for name in dir(bpy.app.handlers)
        if isinstance(handlers := getattr(bpy.app.handlers, name), list)
        for one in handlers
        if "beamspread" in getattr(one, "__module__", "")
    ]
    expect(not left, f"handlers are left: {left}")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "last.blend"))  # without the add-on
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    if IS_EXTENSION:
        repos = bpy.context.preferences.extensions.repos
        index = next(number for number, repo in enumerate(repos) if repo.module == "user_default")
        bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="beamspread")
    else:
        bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=False)
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=window.screen.areas[0]):
            bpy.ops.preferences.addon_remove(module=MODULE)
    bpy.ops.wm.save_userpref()
    expect(not place().exists(), f"{place()} is left")
    left = [str(path) for path in place().parent.iterdir() if "beamspread" in path.name]
    expect(not left, f"left in the folder of add-ons: {left}")
    expect(MODULE not in bpy.context.preferences.addons, "the add-on is still in the preferences")


# --- parts of them --------------------------------------------------------------------------------------------------


def version_of(zip_path):
    return tuple(int(number) for number in zip_path.name.split("-")[1].split("."))


def installed_version():
    return tuple(int(number) for number in (place() / "VERSION").read_text().split("."))


def in_zip(path):
    import zipfile

    with zipfile.ZipFile(path) as archive:
        return [name.partition("/")[2] for name in archive.namelist() if not name.endswith("/")]


def on_disk():
    return [
        path.relative_to(place()).as_posix()
        for path in place().rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    ]


def problem():
    return package(".core.native").problem


def kept_preferences(folder):
    own = preferences()
    said = {name: getattr(own, name) for name in SETTINGS}
    expect(said == SETTINGS, f"the preferences became {said}")
    expect(own.cache_folder == str(folder / "cache"), f"the cache folder became {own.cache_folder!r}")


def kept_file(folder):
    """Bakes and caches from before the upgrade."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "before_upgrade.blend"))
    expect(node_is_as_set(), "a node of the older version's file changed")
    image = node_of(bpy.data.materials["Medium"]).image
    expect(image is not None and max(image.pixels[:3]) > 0, "the older version's image is gone")
    cached = sorted((folder / "cache").glob("*.exr"))
    times = [path.stat().st_mtime_ns for path in cached]
    bake()
    expect(sorted((folder / "cache").glob("*.exr")) == cached, "the medium was simulated anew")
    expect([path.stat().st_mtime_ns for path in cached] == times, "the medium was written anew")
    expect(preferences().cache_folder == str(folder / "cache"), "the cache folder was forgotten")


def user_preferences(folder):
    """Read them, as programs do by themselves: Blender as a module starts from factory settings."""
    if bpy.app.version >= (4, 5, 0):
        bpy.ops.wm.read_userpref()
        return
    # Loading preferences ends the process of 4.2.23 with any add-on: the saved values are set once more instead.
    bpy.ops.preferences.addon_enable(module=MODULE)
    set_preferences(folder)


def set_preferences(folder):
    for name, value in SETTINGS.items():
        setattr(preferences(), name, value)
    preferences().cache_folder = str(folder / "cache")


def write_facts(folder):
    facts = {
        "blender": bpy.app.version_string,
        "python": platform.python_version(),
        "glibc": platform.libc_ver()[1],
        "numpy": np.__version__,
        "problem": problem(),
    }
    (folder / "facts.json").write_text(json.dumps(facts))


def without_module(folder):
    """No module for this Python: the message, and that nothing is lost."""
    said = problem()
    for part in (
        f"Python {sys.version_info[0]}.{sys.version_info[1]} in {place()}",
        "Found there: _native",
        "Needed: ",
        "Install the zip of Beamspread",
    ):
        expect(part in said, f"{part!r} is not in {said!r}")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scenes" / "node_before_sockets.blend"))
    older_nodes()
    scene_with_node()
    try:
        bpy.ops.beamspread.bake(objects="ALL")
    except RuntimeError as error:
        expect("no working native module" in str(error), str(error))
    else:
        raise Failed("a bake without a module ended well")
    save(folder / "without.blend")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "without.blend"))
    expect(node_is_as_set(), "a node lost values without the module")
    copies_and_undo()


def bake_examples(folder):
    batch = package(".batch")
    # Blender 3.5 has changed the shape of spot lights, which bakes follow: compare the same light.
    package(".blender.compat").spot_falloff = lambda: "scaled"
    for scene in sorted((folder / "scenes").glob("*.blend")):
        if scene.stem == "node_before_sockets":
            continue
        out = folder / "out" / scene.stem
        code = batch.run(
            [str(scene), "--output", str(out), "--report", f"{out}.json", "--resolution", "64", "--no-indirect"]
        )
        report = json.loads(Path(f"{out}.json").read_text())
        said = [bake["message"] for bake in report["bakes"] if bake["message"]]
        expect(code == 0, f"{scene.name} ended with {code}: {said}")
        expect(list(out.glob("*.exr")), f"{scene.name}: no image was written")


def scene_with_node():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.beamspread.use_indirect = False
    mesh = bpy.data.meshes.new("Plane")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", (0, 0, 1, 0, 1, 1, 0, 1))
    plane = bpy.data.objects.new("Plane", mesh)
    light = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    for obj in (plane, light):
        bpy.context.collection.objects.link(obj)
    material = bpy.data.materials.new("Medium")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    node = material.node_tree.nodes.new("BeamspreadNode")
    for name, value in NODE.items():
        setattr(node, name, value)
    mesh.materials.append(material)
    return material


def node_of(material):
    return next(node for node in material.node_tree.nodes if node.bl_idname == "BeamspreadNode")


def node_is_as_set(name="Medium"):
    node = node_of(bpy.data.materials[name])
    return all(
        np.allclose(np.asarray(getattr(node, key)), value)
        if not isinstance(value, str)
        else getattr(node, key) == value
        for key, value in NODE.items()
    )


def bake():
    result = bpy.ops.beamspread.bake(objects="ALL")
    expect(result == {"FINISHED"}, f"the bake ended with {result}")


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def pixels(image):
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values


def counts():
    """How many data-blocks there are of each kind that a bake could leave behind."""
    kinds = (
        "objects",
        "meshes",
        "materials",
        "node_groups",
        "images",
        "lights",
        "cameras",
        "worlds",
        "scenes",
        "collections",
        "texts",
    )
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def older_nodes():
    """A file of the add-on's first version."""
    iors = [round(node_of(bpy.data.materials[name]).ior, 4) for name in ("Untouched", "Marble", "Set", "Shared")]
    expect(iors == [1.0, 1.5, 1.3, 1.0], f"the older file's nodes have {iors}")
    expect(node_of(bpy.data.materials["Marble"]).preset == "marble", "the older file's preset is lost")
    image = node_of(bpy.data.materials["Untouched"]).image
    expect(np.allclose(image.pixels[:3], (0.25, 0.5, 0.75)), "the older file's image is lost")


def node_life(folder):
    """Bake, save, load, copy, undo, append, with nothing left over."""
    material = scene_with_node()
    bpy.context.scene.beamspread.resolution = 16
    before = counts()
    bake()
    image = node_of(material).image
    baked = pixels(image)
    expect(baked.max() > 0, "the bake is black")
    expected = {**before, "images": before["images"] + 1}
    expect(counts() == expected, f"a bake left {counts()}, not {expected}")
    bake()
    expect(counts() == expected, f"a second bake left {counts()}, not {expected}")
    path = folder / "life.blend"
    save(path)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    expect(node_is_as_set(), "a saved node changed")
    expect((pixels(node_of(bpy.data.materials["Medium"]).image) == baked).all(), "the saved image changed")
    copies_and_undo()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    with bpy.data.libraries.load(str(path)) as (_, target):
        target.materials = ["Medium"]
    expect(node_is_as_set(), "an appended node changed")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "scenes" / "node_before_sockets.blend"))
    older_nodes()


def copies_and_undo():
    """Node of the open file's material."""
    trees = len(bpy.data.node_groups)
    other = bpy.data.materials["Medium"].copy()
    node_of(other).ior = 1.6
    expect(node_is_as_set(), "a change of the copy changed the original")
    bpy.data.materials.remove(other)
    # To remove a tree with its node crashes on undo: it goes when the file is saved.
    path = bpy.data.filepath
    save(path)
    bpy.ops.wm.open_mainfile(filepath=path)
    expect(len(bpy.data.node_groups) == trees, "a removed copy left its tree")
    if bpy.context.preferences.edit.use_global_undo:
        bpy.ops.ed.undo_push(message="before")
        node_of(bpy.data.materials["Medium"]).ior = 1.9
        bpy.ops.ed.undo_push(message="after")
        bpy.ops.ed.undo()
        expect(node_is_as_set(), "undo didn't give the node back")


# --------------------------------------------------------------------------------------------------------------------


def main():
    phase, folder = sys.argv[-2], Path(sys.argv[-1])
    if not bpy.app.binary_path and phase != "install":
        user_preferences(folder)
    try:
        globals()[f"phase_{phase}"](folder)
        code = 0
    except SystemExit as end:
        code = end.code
    except Failed as failure:
        print(f"MATRIX {phase}: {failure}")
        code = 1
    except Exception:  # noqa: BLE001 - said in the log, and by the exit code
        traceback.print_exc()
        print(f"MATRIX {phase}: ended with an exception")
        code = 1
    # Nodes whose class was taken away and came back, as in an upgrade, crash Blender 3.4 at its exit.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=not bpy.app.binary_path)
    if not bpy.app.binary_path:
        # Classes left registered can keep Blender as a module from ending.
        bpy.ops.preferences.addon_disable(module=MODULE)
        sys.stdout.flush()
        sys.stderr.flush()
        shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
        if bpy.app.version < (4, 5, 0):
            os._exit(code)  # 4.2 as a module crashes once Python is gone: see addon/batch.py
    sys.exit(code)


main()
