"""Steps of a run: quick previews of media that are not simulated yet, jobs made in their turn, refusals."""

import time
from types import SimpleNamespace

import beamspread
import bpy
import pytest
from beamspread.blender import popup, preferences
from beamspread.blender.images.results import Results
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run import bake_plan, operator
from beamspread.blender.jobs.run.bake_plan import read_scene
from beamspread.blender.jobs.run.bake_run import BakeThread, Pass, steps_of
from beamspread.blender.jobs.state import Run, Status, state
from beamspread.blender.node.draw import draw_node
from beamspread.blender.node.find import find_targets
from beamspread.core.bake.runner import CANCELLED
from beamspread.core.ldf import library
from beamspread.core.progress import Progress
from beamspread.core.target import Target
from beamspread.core.time_left import duration
from mathutils import Matrix
from nodes import Nodes
from scenes import add_material, add_plane, add_sun, messages_of, node_of, pixels, select

KNOWN, UNKNOWN = {"anisotropy": 0.8, "ior": 1.0}, {"anisotropy": 0.8, "ior": 1.37}


@pytest.fixture(autouse=True)
def small(tmp_path, monkeypatch):
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path / "cache"))
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.quality = 32, "final"
    add_sun(0)


def plane(name, x=0.0, **properties):
    made = add_plane(name, matrix=Matrix.Translation((x, 0, 0)), material=add_material(name, **properties))
    bpy.context.view_layer.update()
    return made


def queue(preview_first=True):
    plans = read_scene(bpy.context, find_targets(bpy.context.scene.objects))
    return steps_of(plans, bpy.context.scene.beamspread.for_bake(), preview_first)


def in_words(steps):
    jobs = (step.bake().job for step in steps)
    return [(job.name, job.settings.quality, job.settings.indirect) for job in jobs]


def first_bake():
    return queue()[0].bake()


def test_to_read_the_scene_changes_no_material():
    """Views and material icons would be drawn anew: where drawing is slow, the window would stand still meanwhile."""
    plane("Known", **KNOWN)
    changed = []

    def note(_scene, depsgraph):
        changed.extend(update.id.name for update in depsgraph.updates if update.is_updated_shading)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        queue()
        assert not changed
        node_of(bpy.data.materials["Known"]).edges = "MIRROR"  # by a script, which tells Blender nothing
        queue()
        assert "Known" in changed
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)


def test_media_that_are_not_simulated_get_a_quick_preview_and_their_bake_after_all():
    plane("Unknown", **UNKNOWN)
    plane("Known", 5.0, **KNOWN)
    bpy.context.scene.beamspread.use_indirect = True
    assert in_words(queue()) == [
        ("Unknown", "preview", False),
        ("Known", "final", True),
        ("Unknown", "final", True),
    ]
    assert in_words(queue(preview_first=False)) == [("Unknown", "final", True), ("Known", "final", True)]
    bpy.context.scene.beamspread.quality = "preview"
    assert [quality for _, quality, _ in in_words(queue())] == ["preview", "preview"]


def test_those_that_share_an_image_are_baked_together_again():
    image = bpy.data.images.new("Atlas", 32, 32, float_buffer=True)
    plane("Unknown", image=image, **UNKNOWN)
    plane("Known", 5.0, image=image, **KNOWN)
    plane("Apart", 9.0, **KNOWN)
    assert [name for name, *_ in in_words(queue())] == ["Unknown", "Known", "Apart", "Unknown", "Known"]
    assert [step.purpose for step in queue()] == [Pass.PREVIEW, Pass.PREVIEW, Pass.SINGLE, Pass.FINAL, Pass.FINAL]


def test_nothing_is_simulated_for_passes_without_a_medium():
    plane("Unknown", **UNKNOWN)
    bpy.context.scene.beamspread.output = "IRRADIANCE"
    assert len(queue()) == 1


def test_jobs_are_made_when_it_is_their_turn(monkeypatch):
    for number in range(3):
        plane(f"Plane {number}", 5.0 * number)
    made = []
    build = bake_plan.build_receiver
    monkeypatch.setattr(bake_plan, "build_receiver", lambda *arguments: made.append(1) or build(*arguments))
    steps = queue()
    assert len(made) == 0
    steps[0].bake()
    assert len(made) == 1


def test_the_scene_is_read_at_one_time():
    """The scene may change while others are baked."""
    planes = [plane(f"Plane {number}", 5.0 * number) for number in range(2)]
    first, second = queue()
    first.bake()
    bpy.data.objects.remove(planes[1])
    bpy.data.lights["Sun"].energy = 7.0
    bake = second.bake()
    assert bake.job.receiver.charts[0].grid.origin[0] == pytest.approx(4.0)
    assert bake.job.illumination.lights[0].strength == 1.0


def test_a_material_removed_before_its_bake_is_refused():
    planes = [plane(f"Plane {number}", 5.0 * number) for number in range(2)]
    (first, second), kept = queue(), Results()
    assert kept.admit(first.bake()).job
    bpy.data.materials.remove(planes[1].data.materials[0])
    refused = kept.admit(second.bake())
    assert refused.job is None
    assert "was removed or renamed during the bake" in refused.error


def test_an_object_renamed_during_its_bake_gets_its_result():
    one, kept = plane("Plane"), Results()
    bpy.ops.beamspread.bake()
    image = node_of(one.data.materials[0]).image
    before = pixels(image).mean()
    bpy.data.lights["Sun"].energy = 3.0
    bake = kept.admit(first_bake())
    one.name = "Table"
    bake.run()
    bake.keep(kept.store)
    assert (bake.status, [*bake.messages]) == ("written", [])
    assert node_of(one.data.materials[0]).image == image
    assert pixels(image).mean() == pytest.approx(3 * before, rel=0.01)


def test_a_bake_beyond_the_memory_limit_is_refused(monkeypatch):
    one = plane("Plane")
    monkeypatch.setattr(preferences, "memory_limit", lambda: 1000)
    select(one)
    message = messages_of(bpy.ops.beamspread.bake)
    assert "Baking: 32 x 32 texels take about" in message
    assert "raise the memory limit" in message
    assert state.rows[find_targets([one])[0]].status == Status.FAILED


def test_progress_names_the_stages():
    plane("Unknown", **UNKNOWN)
    stages, progress = [], Progress(lambda _fraction: stages.append(progress.stage))
    first_bake().run(progress)
    assert [*dict.fromkeys(stages)] == ["Simulating the material (quick preview)", "Baking"]


def test_the_window_shows_the_step_and_the_remaining_time_of_the_run(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    progress = Progress()
    first, second = progress.split([10, 30])
    for part, seconds in ((first, 10.0), (second, 30.0)):
        part.expect(lambda seconds=seconds: seconds)
    run = Run(progress, Target("Plane", "Stone"), "2 of 2")
    first.begin("Simulating")
    assert run.in_short() == "0%, about 50 s left"
    now[0] += 10
    first(1.0)
    second.begin("Baking")
    assert run.line() == "Baking: Plane / Stone (2 of 2), 25%, about 40 s left (Esc cancels)"
    now[0] += 15
    second(0.5)
    assert run.in_short() == "62%, about 20 s left"
    progress.cancel()
    assert run.line() == "Stopping: Plane / Stone (2 of 2), 62% (Esc cancels)"


@pytest.mark.parametrize("solver", ["fft", "direct", "adaptive"])
@pytest.mark.parametrize("seconds", [0.05, 0.5])
def test_a_bake_stops_within_two_seconds(solver, seconds):
    """Of CPU time, of which other processes take none."""
    settings = bpy.context.scene.beamspread
    # The fft solver may end 1024 x 1024 texels within half a second.
    settings.resolution, settings.solver, settings.quality = (2048 if solver == "fft" else 1024), solver, "preview"
    bpy.data.lights["Sun"].type = "POINT"
    bpy.data.objects["Sun"].location.z = 1.0
    plane("Plane", **KNOWN)
    beamspread.library(beamspread.Medium(0.8, 1.0), quality="preview")  # to read it takes most of a second
    thread = BakeThread(first_bake(), Progress())
    thread.start()
    time.sleep(seconds)
    thread.progress.cancel()
    asked = time.process_time()
    thread.join()
    assert time.process_time() - asked < 2
    assert thread.bake.status == CANCELLED


def test_the_search_for_indirect_light_stops_within_two_seconds():
    settings = bpy.context.scene.beamspread
    settings.quality, settings.use_indirect = "preview", True
    plane("Plane", **KNOWN)
    roof = plane("Roof", **KNOWN)
    roof.location.z = 1.0
    glass = Nodes(bpy.data.materials.new("Glass"), clear=True)
    roof.data.materials[0] = glass.finish(glass.add("BsdfGlass"))  # only Cycles knows it
    bpy.context.view_layer.update()
    thread = BakeThread(first_bake(), Progress())
    thread.start()
    while not thread.progress.stage.startswith("Finding indirect light"):
        assert thread.is_alive()
        time.sleep(0.01)
    thread.progress.cancel()
    asked = time.monotonic()
    thread.join()
    assert time.monotonic() - asked < 2
    assert thread.bake.status == CANCELLED


def test_unregistering_ends_the_run_with_a_message(monkeypatch):
    """Blender would end with an error if a thread of ours still ran when it quits."""
    status = []
    monkeypatch.setattr(bpy.types.WorkSpace, "status_text_set", lambda _workspace, text: status.append(text))
    bpy.context.scene.beamspread.solver = "direct"
    bpy.context.scene.beamspread.resolution = 1024
    bpy.data.lights["Sun"].type = "POINT"
    bpy.data.objects["Sun"].location.z = 1.0
    node = node_of(plane("Plane", **KNOWN).data.materials[0])
    thread = BakeThread(first_bake(), Progress())
    state.start(thread.progress, thread.bake.target)
    thread.start()
    operator.unregister()
    try:
        assert not thread.is_alive()
        assert set(status) == {None}
        texts = []
        draw_node(node, SimpleNamespace(label=lambda text, icon: texts.append(text)))
        assert texts == ["The add-on Beamspread is disabled."]
    finally:
        operator.register()


TIMES = [(0.2, "1 s"), (59.4, "59 s"), (59.6, "1 min"), (90, "2 min"), (7200, "2 h"), (259200, "3 days")]


@pytest.mark.parametrize(("seconds", "words"), TIMES)
def test_times_in_words(seconds, words):
    assert duration(seconds) == words


def test_preferences_have_defaults_where_the_add_on_is_not_enabled():
    assert preferences.preferences() is None
    assert (preferences.threads(), preferences.memory_limit()) == (0, 0)
    assert preferences.PACKAGE == "beamspread"


def test_the_cache_is_cleared_of_its_own_files_alone(tmp_path):
    beamspread.library(beamspread.Medium(0.1, 1.2), quality="preview")
    folder = library.cache_folder()
    (folder / "mine.txt").write_text("mine")
    assert len(library.cached_files()) == 1
    assert bpy.ops.beamspread.clear_cache() == {"FINISHED"}
    assert [path.name for path in folder.iterdir()] == ["mine.txt"]
    assert not library.is_known(beamspread.Medium(0.1, 1.2), "preview")


def test_a_chosen_cache_folder(tmp_path, monkeypatch):
    monkeypatch.delenv("BEAMSPREAD_CACHE")
    library.choose_cache_folder(tmp_path / "chosen")
    try:
        assert library.cache_folder() == tmp_path / "chosen"
    finally:
        library.choose_cache_folder("")
    assert library.cache_folder() != tmp_path / "chosen"


def test_threads_reach_the_bake(monkeypatch):
    monkeypatch.setattr(preferences, "threads", lambda: 3)
    assert bpy.context.scene.beamspread.for_bake().threads == 3


def test_long_sentences_are_wrapped():
    lines = popup.wrap("one two three four five", 10)
    assert lines == ["one two", "three four", "five"]


def test_a_quick_preview_is_kept_with_its_message():
    """The first of the two steps of a run in the window; the second one never comes."""
    one = plane("Unknown", **UNKNOWN)
    step = queue()[0]
    bake = step.bake()
    assert step.purpose == Pass.PREVIEW
    parts = stale.parts_of(bpy.context, [bake.target])
    bake.run()
    bake.keep(Results().store)
    state.note(bake)
    stale.keep(bake, parts[bake.target], is_preview=True)
    stale.refresh(bpy.context)
    row = state.rows[bake.target]
    assert row.is_stale
    assert row.status == Status.WARNED
    assert "Quick preview" in row.messages[0].text
    assert node_of(one.data.materials[0]).image is not None
