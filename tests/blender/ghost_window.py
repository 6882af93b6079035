"""Scenario of test_ghost_window.py: a view of EEVEE while Live follows a blocker."""

import tempfile
from pathlib import Path

import bpy
import numpy as np
import scenes
from beamspread.blender.live import timer
from scenario_player import in_window, is_over

results = {"differences": [], "changes": []}

SECONDS = 3.0
"""Time in which software OpenGL draws the frames that the view's picture is made of."""

BLOCK = 8
"""Side of the blocks, pixels."""


def view() -> bpy.types.Area:
    return next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "VIEW_3D")


def picture() -> np.ndarray:
    """Colors of the view, 0 to 1: means of blocks, since edges have the noise of the frames' positions."""
    path = str(Path(tempfile.mkdtemp()) / "window.png")
    in_window(bpy.ops.screen.screenshot, filepath=path)
    image = bpy.data.images.load(path)
    width, height = image.size
    colors = np.empty((height, width, 4), np.float32)
    image.pixels.foreach_get(colors.ravel())
    bpy.data.images.remove(image)
    area = view()
    seen = colors[area.y + 50 : area.y + area.height - 50, area.x + 60 : area.x + area.width - 60, :3]
    rows, columns = seen.shape[0] // BLOCK, seen.shape[1] // BLOCK
    return seen[: rows * BLOCK, : columns * BLOCK].reshape(rows, BLOCK, columns, BLOCK, 3).mean((1, 3))


def is_at_rest() -> bool:
    session = timer.live.session
    return session is not None and not session.is_busy()


def scenario():
    bpy.ops.wm.read_homefile(use_empty=False, use_factory_startup=True, load_ui=True)
    yield lambda: True
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    scene, settings = bpy.context.scene, bpy.context.scene.beamspread
    settings.quality, settings.resolution, settings.use_indirect, scene.world = "preview", 64, False, None
    scene.render.engine, scene.view_settings.view_transform = "BLENDER_EEVEE", "Standard"
    scene.eevee.taa_samples = 8
    scenes.add_plane(size=(4, 4), material=scenes.add_material(linked=True))
    scenes.add_sun(0, strength=4)
    blocker = scenes.add_plane("Blocker")
    space = view().spaces.active
    space.shading.type, space.overlay.show_overlays = "RENDERED", False
    space.region_3d.view_perspective, space.region_3d.view_distance = "ORTHO", 8
    space.region_3d.view_rotation, space.region_3d.view_location = (0.97, 0.24, 0, 0), (0, 0, 0)
    settings.use_live = True
    yield is_at_rest
    yield is_over(SECONDS)
    before = picture()
    for x in (1.0, -1.0):
        blocker.location = (x, 0, 1)
        yield is_over(0.5)  # Live notes the change
        yield is_at_rest
        yield is_over(SECONDS)
        seen = picture()
        space.region_3d.view_distance += 1e-4  # the view starts again
        yield is_over(SECONDS)
        results["differences"].append(float(np.abs(picture() - seen).max()))
        results["changes"].append(float(np.abs(seen - before).max()))
        before = seen
