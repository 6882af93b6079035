"""Panels announce how long bakes will take, from facts that need no meshes."""

from dataclasses import replace

import beamspread
import bmesh
import bpy
import pytest
from beamspread.blender import compat
from beamspread.blender.jobs.announced import line_of, simulation_line
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.run.bake_plan import prepare_scene, read_scene
from beamspread.blender.jobs.state import Run, state
from beamspread.blender.live import timer
from beamspread.blender.node.find import find_targets
from beamspread.core.bake.bounced import BouncedLight
from beamspread.core.bake.estimate import SKY
from beamspread.core.bake.forecast import Finders, seconds_of
from beamspread.core.bake.pace import pace
from beamspread.core.bake.surroundings import OPEN
from beamspread.core.ldf import library
from beamspread.core.progress import Progress
from beamspread.core.target import Target
from mathutils import Matrix
from nodes import Nodes
from panel_layout import panel
from scenes import (
    add_lamp,
    add_material,
    add_mesh,
    add_plane,
    add_sun,
    add_world,
    diffuse_material,
    glowing_material,
    select,
)


@pytest.fixture(autouse=True)
def fresh(tmp_path, monkeypatch):
    """No times of other tests, no simulated media."""
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(timer, "messages", list)
    pace.forget()
    state.factors.clear()
    bpy.context.scene.beamspread.resolution = 256
    yield
    pace.forget()


def plane(name="Plane", x=0.0, size=(2.0, 2.0), **properties):
    values = {"anisotropy": 0.8, "ior": 1.0} | properties
    material = add_material(f"Medium of {name}", **values)
    made = add_plane(name, size, Matrix.Translation((x, 0, 0)), material=material)
    bpy.context.view_layer.update()
    return made


def announced(*objects):
    """Seconds for objects, or for all, without the media's simulation."""
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    chosen = find_targets(objects or bpy.context.scene.objects)
    return sum(seconds_of(state.announced[target].steps) for target in chosen)


def forecasts():
    """The same by bakes, which read meshes."""
    targets = find_targets(bpy.context.scene.objects)
    settings = bpy.context.scene.beamspread.for_bake()
    return [plan.forecast().steps(settings) for plan in read_scene(bpy.context, targets)]


def test_the_panel_announces_the_selected_objects_and_all():
    add_lamp((0, 0, 1))
    select(plane())
    assert "About 1 s" in panel()
    for number in range(40):
        plane(f"Other {number}", 3.0 + 3.0 * number)
    assert "About 1 s; all about" in panel()


def test_nothing_is_announced_without_light_or_faces():
    select(plane())
    assert "About" not in panel()
    add_sun()
    bpy.data.meshes["Plane"].clear_geometry()
    assert "About" not in panel()


def test_the_time_follows_resolution_and_lights():
    add_sun()
    one = plane()
    few = announced(one)
    bpy.context.scene.beamspread.resolution = 2048
    many = announced(one)
    assert many > few
    add_lamp((0, 0, 1), radius=0.2)
    both = announced(one)
    assert both > 2 * many
    bpy.context.scene.beamspread.resolution = 256
    assert announced(one) < 0.5 * both


def test_an_image_has_its_own_size():
    add_lamp((0, 0, 1))
    small = announced(plane())
    image = bpy.data.images.new("Large", 2048, 2048, float_buffer=True)
    assert announced(plane("Large", 5.0, image=image)) > 10 * (small - 0.05)


def test_a_medium_to_simulate_is_named_with_its_share():
    add_sun()
    bpy.context.scene.beamspread.quality = "final"
    select(plane("Skin", ior=1.37))
    assert "to simulate 'Medium of Skin', only once" in panel()
    bpy.context.scene.beamspread.quality = "preview"
    beamspread.library(beamspread.Medium(0.8, 1.37), quality="preview")
    assert library.is_known(beamspread.Medium(0.8, 1.37), "preview")
    assert "simulate" not in panel()


def test_bakes_share_the_simulation_of_a_medium():
    add_sun()
    bpy.context.scene.beamspread.quality = "final"
    both = [plane("First", ior=1.37), plane("Second", 5.0, ior=1.37)]
    stale.refresh(bpy.context)
    single, all_of_it = (simulation_line(state.announced, find_targets(some)) for some in (both[:1], both))
    assert all_of_it == single.replace("'Medium of First'", "'Medium of First' and 1 more")


def bounced_of(target):
    (step,) = [step for step in state.announced[target].steps if step.kind == BouncedLight.name]
    return step.seconds


def test_rooms_take_longer_as_their_bakes_do():
    """A room whose lamp is hidden takes many rays, a dark one few; panel and bake agree."""
    bpy.context.scene.beamspread.use_indirect = True
    add_sun()
    target = plane()
    card = add_plane("Card", (0.5, 0.5), Matrix.Translation((1.5, 0, 0.5)))
    card.data.materials.append(diffuse_material((0.5, 0.5, 0.5)))
    stale.refresh(bpy.context)
    (name,) = find_targets([target])
    beside_a_card = bounced_of(name)
    bpy.ops.mesh.primitive_cube_add(size=6)
    stale.refresh(bpy.context)
    # The sun stays outside: there is no light whose noise could matter.
    dark = bounced_of(name)
    add_lamp((0, 0, 2))
    add_plane("Shade", (2.0, 2.0), Matrix.Translation((0, 0, 1.5)))
    stale.refresh(bpy.context)
    in_a_room = bounced_of(name)
    assert in_a_room > 5 * max(dark, beside_a_card)
    (plan,) = read_scene(bpy.context, [name])
    (read,) = [
        step.seconds
        for step in plan.forecast().steps(bpy.context.scene.beamspread.for_bake())
        if step.kind == BouncedLight.name
    ]
    assert in_a_room == pytest.approx(read, rel=0.05)  # which reads triangles, the panel counts faces


@pytest.mark.parametrize(("gray", "radius"), [(0.2, 0.0), (0.7, 0.0), (0.7, 0.6)])
def test_few_rays_find_about_as_much_bounced_light_as_the_bake(gray, radius):
    """Part of all light that is bounced, in a room whose floor is baked; a shade hides the lamp from its middle.

    Bound: 1.3 times, since 128 rays have a tenth of noise or so, and later bounces are guessed.
    """
    scene = bpy.context.scene
    scene.beamspread.use_indirect = True
    floor = plane(size=(4.0, 4.0))
    bpy.ops.mesh.primitive_cube_add(size=4, location=(0, 0, 1.99))
    shade = add_plane("Shade", (2 * radius or 0.01,) * 2, Matrix.Translation((0, 0, 1.5)))
    for obj in (bpy.context.object, shade):
        obj.data.materials.append(diffuse_material((gray,) * 3))
    add_lamp((0, 0, 2.5))
    stale.refresh(bpy.context)
    (name,) = find_targets([floor])
    announced_part = state.announced[name].around.returned[0]
    means = []
    for indirect in (True, False):
        settings = scene.beamspread.for_bake(output="IRRADIANCE", indirect=indirect)
        (bake,) = prepare_scene(bpy.context, [name], settings, 32)
        bake.run()
        assert not bake.error
        means.append(float(bake.texture.mean()))
    part = 1 - means[1] / means[0]
    assert part / 1.3 < announced_part < 1.3 * part


def light_below_a_pane(material):
    """Surroundings that the panel finds for a plane below a pane of a material, all of whose sun comes through it."""
    (name,) = find_targets([plane()])
    pane = add_plane("Pane", (40.0, 40.0), Matrix.Translation((0, 0, 1.0)))
    pane.data.materials.append(material)
    add_sun(strength=2.0).data.angle = 0.1
    stale.refresh(bpy.context)
    return state.announced[name].around


@pytest.mark.parametrize("has_others", [False, True])
def test_light_of_lamps_through_glass_is_found_by_paths_that_meet_them(has_others):
    """The sun fills a part of a path's directions: its form factor, the squared sine of half its angle.

    Nodes that lead to no output count for nothing.
    """
    nodes = Nodes(bpy.data.materials.new("Glass"), clear=True)
    if has_others:
        nodes.add("BsdfPrincipled")
    around = light_below_a_pane(nodes.finish(nodes.add("BsdfGlass", {})))
    met = 0.05**2
    assert (around.lit, around.returned[0]) == (0, 1)
    assert around.met == pytest.approx(met, rel=1e-2)
    assert around.spikes == pytest.approx(1 / met, rel=1e-2)


def test_a_pane_that_is_not_clear_blocks_lamps():
    around = light_below_a_pane(diffuse_material((0.5, 0.5, 0.5)))
    assert (around.lit, around.met, around.spikes) == (0, 0, 0)


def test_materials_without_nodes_return_their_color():
    """Blender 5 has none: there it stands for a diffuse surface of .8."""
    scene = bpy.context.scene
    scene.beamspread.use_indirect = True
    (name,) = find_targets([plane()])
    card = add_plane("Card", (1.0, 2.0), Matrix.Translation((0.5, 0, 0.5)))
    add_lamp((0, 0, 0.3))
    material = bpy.data.materials.new("Plain")
    card.data.materials.append(material)
    parts = []
    for value in (0.8, 0.1):
        material.diffuse_color = (value, value, value, 1)
        if compat.uses_nodes(material):
            Nodes(material, clear=True).finish(Nodes(material).add("BsdfDiffuse", {"Color": material.diffuse_color}))
        stale.refresh(bpy.context)
        mean = state.announced[name].around.returned[0]
        parts.append(mean / (1 - mean))
    assert parts[0] > 6 * parts[1] > 0


def test_light_on_both_faces_of_a_slab_counts_together():
    """A lamp below it, beside a wall: its upper face sees nothing."""
    bpy.context.scene.beamspread.use_indirect = True
    target = plane(thickness=0.01)
    card = add_plane("Card", (1.0, 2.0), Matrix.Translation((0.5, 0, -0.5)))
    card.data.materials.append(diffuse_material((0.8, 0.8, 0.8)))
    add_lamp((-0.5, 0, -0.3))
    stale.refresh(bpy.context)
    (name,) = find_targets([target])
    assert state.announced[name].around.returned[0] > 0.01


def test_rays_are_announced_where_obstacles_are_alone():
    """A bake traces few rays where all of a light's arrive, or none; in the panel as in the bake."""

    def share(size):
        for name in ("Card", "Lamp"):
            if name in bpy.data.objects:
                bpy.data.objects.remove(bpy.data.objects[name])
        add_lamp((0, 0, 1.0), radius=0.3)
        add_plane("Card", size, Matrix.Translation((0, 0, 0.4)))
        stale.refresh(bpy.context)
        return state.announced[name_of].around.shares[0]["Lamp"]

    (name_of,) = find_targets([plane()])
    beside, covered = share((0.5, 0.5)), share((40.0, 40.0))
    assert beside > 0.1
    assert covered == 0
    (plan,) = read_scene(bpy.context, [name_of])
    assert plan.bake(bpy.context.scene.beamspread.for_bake()).job.surroundings.shares == ({"Lamp": 0.0},)


def test_faces_without_area_have_no_place_below_a_sky():
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, -1, 0)]
    uvs = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (0.5, 0), (1, 0)]
    floor = add_mesh("Floor", corners, [(0, 1, 2, 3), (0, 4, 1)], uvs=uvs)
    floor.data.materials.append(add_material())
    add_plane("Card", (1, 1), Matrix.Translation((0, 0, 1)))
    add_world()
    (name,) = find_targets([floor])
    stale.refresh(bpy.context)
    assert 0 < state.announced[name].around.shares[0][SKY] <= 1
    floor.scale = 1, 1, 0
    bpy.context.view_layer.update()
    stale.refresh(bpy.context)
    assert name in state.announced


@pytest.mark.parametrize(("width", "share"), [(0.2, (0.9, 1.0)), (0.0, (0.0, 0.0))])
def test_rays_to_the_sky_are_announced_in_rooms_with_a_window(width, share):
    """Most places see it by less than one of 16 rays; a bake guides its rays there."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    floor = plane(size=(4.0, 4.0))
    bpy.ops.mesh.primitive_cube_add(size=4, location=(0, 0, 1.99))
    room = bpy.context.object.data
    mesh = bmesh.new()
    mesh.from_mesh(room)
    bmesh.ops.delete(mesh, geom=[face for face in mesh.faces if face.normal.z > 0.5], context="FACES_ONLY")
    mesh.to_mesh(room)
    mesh.free()
    for side in (-1, 1):
        x = side * (1 + width / 4)
        add_plane("Half", (2 - width / 2, 4.0), Matrix.Translation((x, 0, 3.99)))
    (name,) = find_targets([floor])
    stale.refresh(bpy.context)
    least, most = share
    assert least <= state.announced[name].around.shares[0]["*"] <= most


def test_objects_without_shadow_block_no_light_of_lamps():
    """A flame around its lamp."""
    bpy.context.scene.beamspread.use_indirect = True
    (name,) = find_targets([plane()])
    add_lamp((0, 0, 1.0))
    bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0, 0, 1.0))
    parts = []
    for casts in (True, False):
        bpy.context.object.visible_shadow = casts
        bpy.context.view_layer.update()
        stale.refresh(bpy.context)
        parts.append(state.announced[name].around.lit)
    assert parts == [0, 1]


def test_measured_times_correct_the_line():
    add_lamp((0, 0, 1))
    one = plane()
    target = find_targets([one])[0]
    before = announced(one)
    for step in state.announced[target].steps:
        step.compare(400 * before)  # a hundred times as long at most
    assert announced(one) == pytest.approx(100 * before)
    assert line_of(state.announced, [target, Target("Gone")]) == ""


def test_a_file_remembers_the_time_of_its_bakes(tmp_path):
    add_lamp((0, 0, 1))
    one = plane()
    bpy.context.scene.beamspread.image_storage = "PACKED"
    select(one)
    announced(one)
    target = find_targets([one])[0]
    (solution,) = state.announced[target].steps
    bpy.ops.beamspread.bake()
    solution.compare(5 * solution.seconds)
    bpy.ops.beamspread.bake()
    measured = pace.ratios_of("Plane")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    pace.forget()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    stale.refresh(bpy.context)
    assert pace.ratios_of("Plane") == measured
    assert solution.kind in measured


def test_a_bake_tells_how_far_plain_facts_are_off():
    """A glowing wall may be bright or dark: only a bake knows how many rays it gets."""
    glowing_wall()
    one = plane()
    announced(one)
    select(one)
    bpy.ops.beamspread.bake()
    announced(one)
    ours, read = state.announced[find_targets([one])[0]].steps, forecasts()[0]
    assert [step.seconds for step in ours] == pytest.approx([step.seconds for step in read])


def light_of_all_kinds():
    add_sun()
    add_lamp((0, 0, 1), radius=0.1)
    add_lamp((0.5, 0, 1), kind="AREA", name="Area")


def glowing_wall():
    wall = add_plane("Wall", matrix=Matrix.Translation((0, 0, 2)))
    wall.data.materials.append(glowing_material())
    add_sun()


def wall():
    made = add_plane("Wall", matrix=Matrix.Translation((0, 0, 2)))
    made.data.materials.append(diffuse_material((0.5, 0.5, 0.5)))
    add_sun()


def glass():
    wall()
    nodes = Nodes(bpy.data.materials.new("Glass"), clear=True)
    bpy.data.objects["Wall"].data.materials[0] = nodes.finish(nodes.add("BsdfGlass"))


def sky():
    nodes, background = add_world()
    nodes.set(background.inputs["Color"], nodes.add("TexSky").outputs[0])
    add_sun()


@pytest.mark.parametrize("scene", [light_of_all_kinds, add_world, wall, glass, sky, glowing_wall])
def test_facts_without_meshes_tell_what_a_bake_reads(scene):
    """The same steps; their times agree where the scene tells all, and within a factor of 2 elsewhere."""
    bpy.context.scene.beamspread.use_indirect = True
    scene()
    one = plane(size=(2.0, 1.0))
    announced(one)
    ours, read = state.announced[find_targets([one])[0]].steps, forecasts()[0]
    assert [step.kind for step in ours] == [step.kind for step in read]
    factor = 2.0 if scene in (sky, glowing_wall) else 1.05
    assert 1 / factor < seconds_of(ours) / seconds_of(read) < factor


def bend(shape, **properties):
    """A cube or a UV sphere of a gray medium under a lamp, with a new image by its size."""
    bpy.context.scene.beamspread.property_unset("resolution")
    add_lamp((2, 1, 3), radius=0.1)
    getattr(bpy.ops.mesh, f"primitive_{shape}_add")()
    one, values = bpy.context.object, {"color_mode": "BASE_COLOR", "base_color": (0.8,) * 3, "ior": 1.4}
    one.data.materials.append(add_material("Gray", **values | properties))
    return one


@pytest.mark.parametrize("shape", ["cube", "uv_sphere"])
def test_bent_meshes_are_announced_by_their_faces(shape):
    """Their texels are those that show a face, and pieces of long ones, as at a sphere's poles."""
    one = bend(shape)
    ours, (read,), (target,) = announced(one), forecasts(), find_targets([one])
    assert [step.kind for step in state.announced[target].steps] == [step.kind for step in read]
    assert 1 / 1.15 < ours / seconds_of(read) < 1.15
    assert state.announced[target].spread.side == 512  # whose light is smooth over 5 cm


def test_faces_that_modifiers_make_are_announced():
    one = bend("cube")
    edges = bpy.data.meshes.new("Profile")
    edges.from_pydata([(1, 0, -1), (1, 0, 1)], [(0, 1)], [])
    edges.materials.append(one.data.materials[0])
    one.data = edges
    one.modifiers.new("Screw", "SCREW")
    assert announced(one) > 0.1


def test_forecasts_know_who_finds_light():
    bpy.context.scene.beamspread.use_indirect = True
    glass()
    plane()
    targets = find_targets(bpy.context.scene.objects)
    finders = read_scene(bpy.context, targets)[0].forecast().finders
    assert replace(finders, around=OPEN) == Finders(bounced=True, is_own=False)


def test_the_bar_shows_the_whole_run():
    progress = Progress()
    first, second = progress.split([1, 1])
    for part in (first, second):
        part.expect(lambda: 30.0)
    first.begin("Baking")
    run = Run(progress, Target("Plane", "Stone"))
    assert run.in_short() == "0%, about 75 s left"
    assert run.line() == "Baking: Plane / Stone, 0%, about 75 s left (Esc cancels)"
