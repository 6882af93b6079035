"""One session of Live: scans the scene for changes, has them rendered beside the window, and shows previews."""

from __future__ import annotations

import time
from dataclasses import replace

import bpy

from ...core.live.live_target import LiveTarget
from ...core.live.render_thread import RenderThread
from ...core.live.renderer import Rendering
from ...core.messages import Level, Message, Messages, note
from ...core.target import Target
from ..cycles.sky import SkyService
from ..images.facts import ImageFacts, facts_of, owners_of
from ..jobs.state import redraw, restart_views, state
from ..node.find import find_node
from ..node.node import image_of_side
from ..node.output import is_linked
from ..read.geometry import remedy_for
from ..read.scene_cache import scene_cache
from ..read.scene_changes import SceneChanges
from .preview import Preview
from .reader import Reader, shows_medium_alone

END_SECONDS = 10.0
"""Seconds that threads may take to end; a single transform, which can't be stopped, is shorter."""

SMALL_SCAN_SECONDS = 0.01
"""Scans shorter than this (seconds) run inside the depsgraph update; longer ones wait for the timer."""

WAIT_SECONDS = 0.05
"""Seconds for which a change waits for its picture, so that the window draws both at once; more draws less often."""

PAUSE_SECONDS = 0.5
"""Seconds without such waiting after it was in vain."""

CALM_SECONDS = 0.3
"""Seconds without changes before Cycles gets a new preview, which restarts its render, or previews count as saved."""

CYCLES_PAUSE_SECONDS = 1.0
"""Seconds between two previews for Cycles while renderings are still to come; more restarts it less often."""

SHADED = {"MATERIAL", "RENDERED"}
"""Shading of 3D Views that show previews."""

ImageKey = tuple[str, str]
"""Name of a material and a side, see `Target.image_key`."""

MAX_OVERLAP = 0.5
"""Overlap (fraction of texels) above which two objects collide in one preview; margins overlap less."""


class Session:
    """State from switching Live on to switching it off.

    Attributes
    ----------
    seconds : time from the change that was scanned last to its preview.
    """

    def __init__(self) -> None:
        self._thread, self._sky = RenderThread(), SkyService()
        self._reader = Reader(self._sky)
        self._time: int | None = None  # of the last scan, as the cache counts it
        self._targets: list[LiveTarget] = []
        self._previews: dict[ImageKey, Preview] = {}
        self._errors: dict[Target, Message] = {}
        self._notes: dict[Target, tuple[Message, ...]] = {}  # of the last rendering
        self._facts: dict[ImageKey, tuple[int, ImageFacts]] = {}  # address and facts of each image in nodes
        self._sizes: dict[tuple, tuple[int, int]] = {}  # of previews without an image, by key and resolution
        self._targets_at_bake: list[LiveTarget] | None = None
        self._is_resting = self._was_changed = False
        self._scan_seconds = 1.0  # of the last scan of more than lamps
        self._changed_at = self._renewed_at = self._waits_after = time.perf_counter()
        self._is_new_to_cycles = False
        self.seconds = 0.0
        scene_cache.log.shown_by_live = self._names_shown

    # Events

    def note(self, depsgraph) -> None:
        """Take note of an update of the depsgraph, which the cache has noted already."""
        changes = self._changes()
        if changes and not self._was_changed:
            self._changed_at = time.perf_counter()
        self._was_changed = bool(changes)
        is_small = self._scan_seconds < SMALL_SCAN_SECONDS or changes.is_lamps_alone()
        is_simple = changes.is_movement_alone() and all(map(shows_medium_alone, changes.materials))
        if (changes or changes.nodes) and is_simple and is_small and not self._is_resting and not is_occupied():
            # Now, so that it is rendered before the window is drawn, or meanwhile.
            self._scan(depsgraph)
            self._show_at_once(bpy.context)

    def recover(self) -> None:
        """Read everything again and make previews anew after undo, which replaces any data."""
        undone = {key for key, (_address, facts) in self._facts.items() if _facts_of(key)[1] != facts}
        self._thread.forget([target for target in self._reader.targets if target.image_key in undone])
        self._facts.clear()
        self._reader, self._time = Reader(self._sky), None
        for preview in self._previews.values():
            if not self._is_resting and preview.fits():
                preview.refresh()

    def hide(self) -> None:
        """Have nodes show their own images until the next step."""
        for preview in self._previews.values():
            preview.hide()

    def show(self) -> None:
        """Have nodes show the previews again, unless Live is resting."""
        for preview in self._previews.values():
            if not self._is_resting and preview.fits():
                preview.place()

    def end(self, can_remove: bool = True) -> None:
        """Stop, and have nodes show their own images. Where hidden images can't be removed they stay without users."""
        self._thread.end()
        self._sky.end()
        for preview in self._previews.values():
            if can_remove:
                preview.remove()
            else:
                preview.hide()
        self._previews.clear()
        scene_cache.log.shown_by_live = tuple
        scene_cache.drop_arrays()
        self._thread.join(END_SECONDS)
        self._sky.join(END_SECONDS)

    # State for panels and the timer

    def is_busy(self) -> bool:
        """True while renderings are still to come."""
        return bool(self._changes()) or self._thread.is_busy() or self._sky.is_busy()

    def names(self) -> set[str]:
        """Names of all hidden images."""
        return {name for preview in self._previews.values() for name in preview.names()}

    def messages(self) -> Messages:
        """Messages for panels."""
        errors = (self._reader.errors | self._errors).items()
        messages = Messages(replace(_for_target(target, error), subject=str(target)) for target, error in errors)
        messages.add(*self._reader.messages())
        notes = ((target.target, self._notes.get(target.target, ())) for target in self._targets)
        messages.add(*(_for_target(target, message) for target, lines in notes for message in lines))
        nodes = {name: find_node(bpy.data.materials.get(name)) for name, _side in self._previews}
        unseen = [name for name, node in nodes.items() if node is not None and not is_linked(node)]
        if unseen:
            names = ", ".join(f"'{name}'" for name in unseen)
            messages.add(note("", f"Live's pictures of {names} are not shown: bake, or link the node to the output."))
        if self._sky.problem:
            messages.add(note("", f"Live shows no light from the sky. {self._sky.problem}"))
        medium = self._thread.libraries.simulating
        if medium:
            messages.add(note("", f"Live first simulates the medium ({medium}), in preview quality."))
        if self._reader.left_out:
            messages.add(note("", f"Live leaves out {', '.join(self._reader.left_out)}."))
        return messages

    # Steps of the timer

    def rests(self, context) -> bool:
        """True while a bake or a render has the scene, or the active object is painted on; then Live pauses."""
        if is_occupied():
            if self._targets_at_bake is None and not bpy.app.is_job_running("RENDER"):
                self._targets_at_bake = self._read_all(context.evaluated_depsgraph_get())
        elif is_painting(context):
            self._leave_to_painter(context.scene.tool_settings.image_paint)
        else:
            return False
        if not self._is_resting:
            self._is_resting = True
            self._targets = []
            self._thread.show(())
            for preview in self._previews.values():
                preview.mark_saved()
        return True

    def step(self, context) -> bool:
        """Scan, have it rendered, show; True if more is to come soon."""
        if self.rests(context):
            return False
        had_rest, self._is_resting = self._is_resting, False
        self._adopt_bakes(context)
        has_changed, changed_at = bool(self._changes()), self._changed_at
        self._scan(context.evaluated_depsgraph_get())
        self._keep_previews(had_rest)
        shown = self._show_renderings(context)
        if shown:
            self.seconds = time.perf_counter() - changed_at
        self._follow_cycles(context, shown)
        if not shown and not has_changed and time.perf_counter() - self._changed_at >= CALM_SECONDS:
            any(preview.mark_saved() for preview in self._previews.values())  # at most one in each step
        return has_changed or shown or self.is_busy()

    def _leave_to_painter(self, settings) -> None:
        """Have nodes show their own images, so that Blender's paint slots have these."""
        shown = [preview for preview in self._previews.values() if preview.is_shown()]
        for preview in shown:
            preview.hide()
        if shown:
            settings.mode = settings.mode  # has Blender collect the slots again

    def _changes(self) -> SceneChanges:
        """Changes since the last scan; at first, and after undo, anything may have changed."""
        return SceneChanges(rest={""}) if self._time is None else scene_cache.log.since(self._time)

    def _scan(self, depsgraph) -> None:
        start = time.perf_counter()
        changes = self._changes()
        resolution = depsgraph.scene.original.beamspread.resolution
        sizes = {key: size for (key, wanted), size in self._sizes.items() if wanted == resolution}
        targets = self._read(depsgraph, changes, sizes)
        if changes and not changes.is_lamps_alone():
            self._scan_seconds = time.perf_counter() - start
        if [*map(id, targets)] != [*map(id, self._targets)]:
            self._targets = targets
            self._thread.show(targets)

    def _read(self, depsgraph, changes: SceneChanges, sizes: dict | None = None) -> list[LiveTarget]:
        self._time, self._was_changed = scene_cache.time, False
        return self._reader.read(depsgraph, changes, sizes)

    def _read_all(self, depsgraph) -> list[LiveTarget]:
        """All targets as the scene is now."""
        return self._read(depsgraph, SceneChanges(rest={""}))

    def _adopt_bakes(self, context) -> None:
        """Leave nodes that show a new bake alone until the scene changes from that which the bake has read."""
        targets, self._targets_at_bake = self._targets_at_bake, None
        baked = set()
        for key in {target.image_key for target in self._reader.targets}:
            (address, facts), preview = _facts_of(key), self._previews.get(key)
            former_address, former = self._facts.get(key, (address, facts))
            # A copy of the image in a node, as Make Float puts there, has the same bakes.
            is_new = facts != former and (address == former_address or facts.bakes != former.bakes)
            if is_new and facts.bakes and (preview is None or not preview.is_shown()):
                baked.add(key)
            self._facts[key] = address, facts
        if not baked:
            return
        if targets is None:
            targets = self._read_all(context.evaluated_depsgraph_get())
        adopted = [target for target in targets if target.target.image_key in baked]
        self._thread.adopt(adopted)
        for target in adopted:
            self._errors.pop(target.target, None)
        for key in baked & set(self._previews):
            self._previews.pop(key).remove()

    def _keep_previews(self, had_rest: bool) -> None:
        """Show all previews whose targets are still there, and remove the others."""
        known = set(self._reader.targets)
        for key, preview in list(self._previews.items()):
            gone = set(preview.parts) - known
            if gone == set(preview.parts) or not preview.fits():
                self._thread.forget(set(preview.parts))
                self._previews.pop(key).remove()
            elif gone:
                self._thread.forget(gone)
                preview.drop(gone)
            elif had_rest or not preview.is_shown():
                preview.refresh()

    def _show_renderings(self, context) -> bool:
        """Show the last rendering of each target; True if there was one."""
        renderings = self._thread.take()
        wanted = {target.target for target in self._targets}
        shown = False
        for target, rendering in renderings.items():
            self._errors.pop(target, None)
            if target in wanted and rendering.error:
                self._errors[target] = rendering.error
            elif target in wanted:
                self._notes[target] = rendering.messages
                shown |= self._show(rendering)
        if renderings:
            restart_views(context)
            redraw(context, "VIEW_3D")
        return shown

    def _show_at_once(self, context) -> None:
        """Show quick renderings before the window is drawn if they are there soon, in previews that are there."""
        previews = [self._previews.get(target.target.image_key) for target in self._targets]
        if None in previews or not all(preview.is_shown() for preview in previews) or is_seen_by_cycles(context):
            return
        if time.perf_counter() < self._waits_after or not is_looked_at(context):
            return
        if not self._thread.await_quick(WAIT_SECONDS):
            self._waits_after = time.perf_counter() + PAUSE_SECONDS
        elif self._show_renderings(context):
            self.seconds = time.perf_counter() - self._changed_at

    def _show(self, rendering: Rendering) -> bool:
        """Show one rendering; False if its node has changed meanwhile, or another object is in its place."""
        target, size = rendering.target, rendering.texture.shape[1::-1]
        preview = self._previews.get(target.image_key)
        if preview is None or preview.size != size:
            preview = Preview(*target.image_key, size)
        if not preview.fits():
            return False
        covering = self._covered_by(rendering)
        if covering is not None:
            text = f"Live shows '{covering.object_name}', which has the same material and UVs."
            self._errors[target] = Message(Level.ERROR, "", text, "Give this object a material of its own.")
            return False
        former = self._previews.get(target.image_key)
        if former is not None and former is not preview:
            former.remove()
        self._previews[target.image_key] = preview
        preview.show(rendering)
        if _image_of(target.image_key) is None:
            self._sizes.setdefault((target.image_key, bpy.context.scene.beamspread.resolution), size)
        return True

    def _covered_by(self, rendering: Rendering) -> Target | None:
        """Another target of the same preview with the same texels: one with a bake there, else the first by name."""
        target = rendering.target
        preview, image = self._previews.get(target.image_key), _image_of(target.image_key)
        if preview is None or len(preview.parts) < (2 if target in preview.parts else 1):
            return None
        owners = owners_of(image) if image is not None else []

        def rank(candidate: Target) -> tuple:
            return candidate not in owners, str(candidate)

        inside = rendering.framed.inside
        for neighbor, framed in preview.parts.items():
            if neighbor == target or framed.inside.shape != inside.shape or rank(neighbor) >= rank(target):
                continue
            if (framed.inside & inside).sum() > MAX_OVERLAP * inside.sum():
                return neighbor
        return None

    def _follow_cycles(self, context, has_new: bool) -> None:
        """Give Cycles new previews once the scene is calm, if it renders a view."""
        if not is_seen_by_cycles(context):
            self._is_new_to_cycles = False
            for preview in self._previews.values():
                preview.remove_former()
            return
        now = time.perf_counter()
        self._is_new_to_cycles |= has_new
        is_calm = not self._changes() and now - self._changed_at >= CALM_SECONDS
        if (
            self._is_new_to_cycles
            and is_calm
            and (not self.is_busy() or now - self._renewed_at >= CYCLES_PAUSE_SECONDS)
        ):
            self._is_new_to_cycles, self._renewed_at = False, now
            for preview in self._previews.values():
                preview.renew()

    def _names_shown(self) -> set[str]:
        """Names of images and inner trees whose updates come from Live, or change nothing that it reads."""
        images = filter(None, map(_image_of, self._previews))
        trees = {preview.tree_name for preview in self._previews.values()}
        return self.names() | trees | {image.name for image in images}


def _image_of(key: ImageKey):
    """The image of a side in the node of a material, or None."""
    material_name, side = key
    node = find_node(bpy.data.materials.get(material_name))
    return None if node is None else image_of_side(node, side)


def _facts_of(key: ImageKey) -> tuple[int, ImageFacts]:
    """Address and facts of the image of a side in the node of a material."""
    image = _image_of(key)
    return (0, ImageFacts()) if image is None else (image.as_pointer(), facts_of(image))


def _for_target(target: Target, message: Message) -> Message:
    """The message with a remedy that works for the type of the target's object."""
    obj = bpy.data.objects.get(target.object_name)
    return message if obj is None else replace(message, remedy=remedy_for(obj, message.remedy))


def is_occupied() -> bool:
    """True while a bake or a render has the scene."""
    return state.is_running() or any(map(bpy.app.is_job_running, ("RENDER", "OBJECT_BAKE")))


def is_painting(context) -> bool:
    """True while the active object's textures are painted on."""
    obj = context.view_layer.objects.active
    return obj is not None and obj.mode == "TEXTURE_PAINT"


def is_looked_at(context) -> bool:
    """True if a window has a 3D View in Material Preview or Rendered, or if there are no windows."""
    areas = (area for window in context.window_manager.windows for area in window.screen.areas)
    return bpy.app.background or any(
        area.type == "VIEW_3D" and area.spaces.active.shading.type in SHADED for area in areas
    )


def is_seen_by_cycles(context) -> bool:
    """True if Cycles renders a 3D View."""
    if context.scene.render.engine != "CYCLES":
        return False
    areas = (area for window in context.window_manager.windows for area in window.screen.areas)
    return any(area.type == "VIEW_3D" and area.spaces.active.shading.type == "RENDERED" for area in areas)
