"""Objects whose UV maps don't fit into one image get one of their own, which the image then uses."""

import subprocess

import bmesh
import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import state
from beamspread.blender.node.tree import show_map
from beamspread.blender.node.uv_maps import make_maps
from beamspread.blender.read.geometry import OWN_MAP, read_polygons
from beamspread.blender.read.visibility import as_rendered
from beamspread.core.scene.islands import check_map
from beamspread.core.target import Target
from live_scenes import live_lines, live_pixels, settle, switch_off
from nodes import Nodes

SIDE = 64


@pytest.fixture(autouse=True)
def light():
    scenes.add_lamp_and_sky(SIDE)


def add_box(*, uvs=True):
    bpy.ops.mesh.primitive_cube_add(size=1.0, calc_uvs=uvs)
    box = bpy.context.object
    box.data.materials.append(scenes.add_material(linked=True))
    return box


def set_uvs(mesh, values):
    mesh.uv_layers[0].data.foreach_set("uv", np.ascontiguousarray(values, np.float32).ravel())


def uvs_of(mesh, name):
    values = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[name].data.foreach_get("uv", values)
    return values.reshape(-1, 2)


PROBLEMS = {
    "overlaps: 83% of it": lambda mesh: np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (6, 1)),
    "reaches outside the image": lambda mesh: uvs_of(mesh, "UVMap") * 11 - 10,
    "no area in 6 of 6 faces": lambda mesh: np.zeros((24, 2)),
    "not numbers": lambda mesh: np.full((24, 2), np.nan),
}


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_map_that_does_not_fit_stays_and_another_one_is_used(problem):
    box = add_box()
    values = PROBLEMS[problem](box.data)
    set_uvs(box.data, values)
    box.data.uv_layers.new(name="Second", do_init=False)
    box.data.uv_layers.active_index = 1
    pixels = scenes.bake(box)[0]
    layers = box.data.uv_layers
    assert [layer.name for layer in layers] == ["UVMap", "Second", OWN_MAP]
    assert layers.active_index == 1
    assert layers["UVMap"].active_render
    np.testing.assert_array_equal(uvs_of(box.data, "UVMap"), np.float32(values))
    (line,) = [line for line in state.lines() if OWN_MAP in line]
    assert problem in line
    assert line.endswith(f" So 'Cube' has a new UV map '{OWN_MAP}', which its image uses.")
    assert (pixels > 0).any(axis=2).mean() > 0.5


def test_a_mesh_without_a_map_gets_one_and_the_next_bake_keeps_it():
    box = add_box(uvs=False)
    first = scenes.bake(box)[0]
    values = uvs_of(box.data, OWN_MAP)
    np.testing.assert_array_equal(scenes.bake(box)[0], first)
    np.testing.assert_array_equal(uvs_of(box.data, OWN_MAP), values)
    assert not any(OWN_MAP in line for line in state.lines())


def test_a_map_that_fits_is_used_as_before():
    box = add_box()
    scenes.bake(box)
    assert [layer.name for layer in box.data.uv_layers] == ["UVMap"]
    tree = scenes.node_of(box.data.materials[0]).node_tree
    assert "UV Map" not in tree.nodes


def test_a_map_of_our_own_follows_a_changed_mesh():
    box = add_box(uvs=False)
    scenes.bake(box)
    before = uvs_of(box.data, OWN_MAP)
    box.data.uv_layers[OWN_MAP].data.foreach_set("uv", np.zeros(48, np.float32))
    box.data.update()
    scenes.bake(box)
    np.testing.assert_array_equal(uvs_of(box.data, OWN_MAP), before)


def rendered(samples=8):
    """A picture by Cycles from above the corner of the box."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (2, -2, 1.6), (1.06, 0, 0.785)
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    return camera


def test_renderers_show_the_image_by_its_map(tmp_path):
    """The picture of a box with a map of its own is that of a box whose only map is the same."""
    box = add_box()
    set_uvs(box.data, np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (6, 1)))
    scenes.bake(box)
    rendered()
    pictures = []
    for number in range(2):
        bpy.context.scene.render.filepath = str(tmp_path / f"{number}.exr")
        bpy.context.scene.render.image_settings.file_format = "OPEN_EXR"
        bpy.ops.render.render(write_still=True)
        pictures.append(scenes.pixels(bpy.data.images.load(str(tmp_path / f"{number}.exr"))))
        set_uvs(box.data, uvs_of(box.data, OWN_MAP))
        tree = scenes.node_of(box.data.materials[0]).node_tree
        show_map(tree, "")
    assert pictures[0].max() > 0
    # Eight samples of the coat and of the sky: the same seed in both.
    np.testing.assert_allclose(pictures[0], pictures[1], atol=1e-3 * pictures[0].max())


MODIFIERS = {
    "ARRAY": {"count": 3},
    "MIRROR": {"use_axis": (True, False, False)},
    "BEVEL": {"width": 0.02, "segments": 1},
    "SOLIDIFY": {"thickness": 0.1},
}


@pytest.mark.parametrize("kind", MODIFIERS)
def test_faces_that_modifiers_make_have_places_of_their_own(kind):
    """A modifier after the others makes the map. The texels hold as much light as the faces receive."""
    box = add_box()
    modifier = box.modifiers.new("First", kind)
    for name, value in MODIFIERS[kind].items():
        setattr(modifier, name, value)
    settings = bpy.context.scene.beamspread
    settings.output, settings.resolution = "IRRADIANCE", 256
    if kind == "BEVEL":  # Blender itself gives its faces places in the map
        set_uvs(box.data, np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (6, 1)))
    scenes.select(box)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert [modifier.name for modifier in box.modifiers] == ["First", "Beamspread UV Map"]
    assert OWN_MAP not in box.data.uv_layers
    (line,) = [line for line in state.lines() if OWN_MAP in line]
    assert "has a new modifier 'Beamspread UV Map'" in line
    evaluated = box.evaluated_get(bpy.context.evaluated_depsgraph_get())
    polygons = read_polygons(evaluated, box.data.materials[0].name, evaluated.matrix_world)
    assert polygons.uv_map == OWN_MAP
    density = polygons.uv_areas / polygons.areas
    assert density.min() > 0.9 * density.max()
    assert density.sum() * polygons.areas.mean() > 0.3
    scenes.select(box)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    assert len(box.modifiers) == 2


@pytest.mark.parametrize("kinds", [["SUBSURF"], ["ARRAY", "SUBSURF"], ["SUBSURF", "SUBSURF"]])
def test_the_map_fits_all_levels_of_subdivision(kinds):
    """Renders have more levels than the window. Each part of the surface has its place in the image in both."""
    box = add_box(uvs=False)
    for kind in kinds:
        modifier = box.modifiers.new(kind, kind)
        if kind == "ARRAY":
            modifier.relative_offset_displace[0] = 1.5
    assert modifier.levels < modifier.render_levels
    scenes.bake(box)
    names = [OWN_MAP in box.data.uv_layers, *box.modifiers.keys()]
    expected = [False, "ARRAY", "Beamspread UV Map", "SUBSURF"] if "ARRAY" in kinds else [True, *box.modifiers.keys()]
    assert names == expected

    def middles():
        evaluated = box.evaluated_get(bpy.context.evaluated_depsgraph_get())
        polygons = read_polygons(evaluated, box.data.materials[0].name, evaluated.matrix_world)
        assert polygons.uv_map == OWN_MAP
        check_map(polygons)
        means = [np.add.reduceat(values, polygons.starts[:-1]) for values in (polygons.uvs, polygons.corners)]
        return [mean / np.diff(polygons.starts)[:, None] for mean in means]

    in_window = middles()
    with as_rendered(bpy.context.view_layer):
        in_renders = middles()
    assert len(in_renders[0]) >= 4 * len(in_window[0])
    for uv, place in zip(*in_window):
        nearest = np.linalg.norm(in_renders[0] - uv, axis=1).argmin()
        # Faces of half the size, on a surface that is smoother: a cube of 1 has faces of .3 in the window.
        assert np.linalg.norm(in_renders[1][nearest] - place) < 0.25


def map_after_modifiers(obj):
    """The faces of an object after its modifiers, with the map that the image uses, which has been checked."""
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    polygons = read_polygons(evaluated, obj.data.materials[0].name, evaluated.matrix_world)
    assert polygons.uv_map == OWN_MAP
    check_map(polygons)
    return polygons


def make_map(obj):
    """Give an object a map without a bake; the text of the note."""
    bpy.context.view_layer.update()
    targets = [Target(obj.name, obj.data.materials[0].name)]
    return str(make_maps(bpy.context.evaluated_depsgraph_get(), targets)[obj.name])


def test_a_closed_smooth_mesh_gets_a_map():
    """Blender's own node UV Unwrap gives a map without area."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    ball = bpy.context.object
    ball.data.materials.append(scenes.add_material())
    ball.modifiers.new("Smooth", "SUBSURF").levels = 2
    ball.modifiers.new("Twice", "ARRAY").count = 2
    assert "new modifier" in make_map(ball)
    assert map_after_modifiers(ball).uv_areas.sum() > 0.3


def test_faces_without_area_spoil_no_map():
    """Two vertices of a box are at the same place, and a bevel makes faces without area around them."""
    box = add_box()
    box.data.vertices[1].co = box.data.vertices[0].co
    box.modifiers.new("Bevel", "BEVEL").width = 0.05
    set_uvs(box.data, np.zeros((24, 2)))
    assert "new modifier" in make_map(box)
    polygons = map_after_modifiers(box)
    shown = polygons.areas > 1e-9
    assert not shown.all()
    density = (polygons.uv_areas / np.maximum(polygons.areas, 1e-30))[shown]
    assert density.min() > 0.5 * density.max()


def test_the_map_is_saved_and_a_copy_with_other_faces_gets_its_own(tmp_path):
    box = add_box()
    box.modifiers.new("Row", "ARRAY").count = 3
    make_map(box)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    box = bpy.data.objects["Cube"]
    before = map_after_modifiers(box).uvs
    copy = box.copy()
    copy.name = "Copy"
    bpy.context.collection.objects.link(copy)
    np.testing.assert_array_equal(map_after_modifiers(copy).uvs, before)
    copy.modifiers["Row"].count = 5
    make_map(copy)
    assert map_after_modifiers(copy).count == 30
    np.testing.assert_array_equal(map_after_modifiers(box).uvs, before)
    sources = [obj for obj in bpy.data.objects if obj.name.startswith("Beamspread UV Map")]
    assert len(sources) == 2
    box.modifiers["Row"].count = 4
    make_map(box)
    assert len([obj for obj in bpy.data.objects if obj.name.startswith("Beamspread UV Map")]) == 2


@pytest.mark.parametrize("kind", [None, "ARRAY", "SUBSURF"])
def test_an_object_in_edit_mode_is_baked(kind, tmp_path):
    """The operator asks for Object Mode, but files may be saved in Edit Mode."""
    box = add_box()
    set_uvs(box.data, np.zeros((24, 2)))
    if kind is not None:
        modifier = box.modifiers.new("First", kind)
    if kind == "SUBSURF":
        modifier.subdivision_type = "SIMPLE"
    scenes.select(box)
    bpy.ops.object.mode_set(mode="EDIT")
    # The new face is not in the mesh until Edit Mode ends.
    edited = bmesh.from_edit_mesh(box.data)
    corners = [edited.verts.new(place) for place in ((2, 0, 0), (3, 0, 0), (3, 1, 0), (2, 1, 0))]
    edited.faces.new(corners)
    bmesh.update_edit_mesh(box.data)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    make_map(box)
    assert box.mode == "EDIT"
    expected = map_after_modifiers(box).uvs
    bpy.ops.object.mode_set(mode="OBJECT")
    polygons = map_after_modifiers(box)
    assert polygons.count == {None: 7, "ARRAY": 14, "SUBSURF": 28}[kind]
    np.testing.assert_array_equal(polygons.uvs, expected)
    command = scenes.batch_command(tmp_path / "scene.blend", "--output", tmp_path, "--resolution", SIDE)
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (file,) = tmp_path.glob("*.exr")
    pixels = scenes.pixels(bpy.data.images.load(str(file)))
    assert (pixels > 0).any(axis=2).mean() > 0.25


@pytest.mark.parametrize("bevels", [False, True])
def test_bakes_that_make_maps_are_up_to_date(bevels):
    boxes = [add_box(uvs=False), add_box(uvs=False)]
    for x, box in enumerate(boxes):
        box.location.x = 3 * x
        if bevels:
            box.modifiers.new("Bevel", "BEVEL")
    bpy.context.scene.beamspread.resolution = 32
    scenes.select(*boxes)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    stale.refresh(bpy.context)
    assert len(state.rows) == 2
    assert not any(row.is_stale for row in state.rows.values())


def test_a_mesh_full_of_maps_is_named():
    box = add_box(uvs=False)
    for number in range(100):
        if box.data.uv_layers.new(name=f"Map {number}", do_init=False) is None:
            break
        box.data.uv_layers[-1].data.foreach_set("uv", np.zeros(48, np.float32))
    else:
        pytest.skip("this Blender has no limit")
    scenes.select(box)
    with pytest.raises(RuntimeError, match="as many UV maps as it can have"):
        bpy.ops.beamspread.bake()


def test_objects_of_one_material_with_different_maps_are_named():
    box = add_box(uvs=False)
    box.name = "Bare"
    scenes.bake(box)
    plane = scenes.add_plane(uvs=np.array([(0.97, 0.97), (1, 0.97), (1, 1), (0.97, 1)]), material=box.data.materials[0])
    plane.location.x = 3
    # The box needs the map of its own beside another one.
    layer = box.data.uv_layers.new(name="Other")
    layer.data.foreach_set("uv", np.zeros(48, np.float32))
    layer.active_render = True
    bpy.context.view_layer.update()
    scenes.select(plane)
    assert bpy.ops.beamspread.bake() == {"FINISHED"}
    (line,) = [line for line in state.lines() if "share a material" in line]
    assert "'Bare' and 'Plane' share a material and have different UV maps: only 'Plane' shows its bake." in line


@pytest.mark.parametrize("saves", [False, True])
def test_a_batch_says_that_a_new_map_is_not_saved_or_saves_it(saves, tmp_path):
    set_uvs(add_box().data, np.tile([(0, 0), (1, 0), (1, 1), (0, 1)], (6, 1)))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    options = "--output", tmp_path, "--resolution", 32, *["--save"] * saves
    done = subprocess.run(scenes.batch_command(tmp_path / "scene.blend", *options), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert ("lacks the new UV map" in done.stdout) == (not saves)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    cube = bpy.data.objects["Cube"]
    assert (OWN_MAP in cube.data.uv_layers) == saves
    # The image, once it is chosen in the node, appears by the new map.
    inner = scenes.node_of(cube.data.materials[0]).node_tree
    assert inner.nodes["Image"].inputs["Vector"].is_linked == saves


def test_live_asks_for_a_bake_and_then_follows():
    box = add_box(uvs=False)
    bpy.context.scene.beamspread.use_live = True
    settle()
    assert any("Bake it: Beamspread's own Bake makes a UV map." in line for line in live_lines())
    baked = scenes.bake(box)[0]
    settle()
    assert "UV map" not in str(live_lines())
    box.location.x = 0.2
    live = live_pixels(box.data.materials[0])
    assert all("bends more than its medium is known for" in line for line in live_lines())
    switch_off()
    np.testing.assert_allclose(live, scenes.bake(box)[0], rtol=1e-4, atol=1e-6)
    assert np.abs(live - baked).max() > 0


def changes_of_color(line) -> int:
    """Number of changes between red and blue along a line of lit texels."""
    is_red = line[:, 0] > line[:, 2]
    return np.count_nonzero(np.diff(is_red[line.max(axis=1) > 0].astype(int)))


@pytest.mark.parametrize("is_modified", [False, True])
def test_a_texture_on_the_artists_map_colors_the_bake(is_modified):
    """The texture repeats over the artist's map; Cycles evaluates it at the texels of the new one.

    A modifier makes the map where another one multiplies faces: two planes above each other.
    """
    bpy.context.scene.render.engine = "CYCLES"
    plane = scenes.add_plane(uvs=np.array([(0, 0), (2, 0), (2, 2), (0, 2)]))
    material = scenes.add_material(linked=True, color_mode="BASE_COLOR")
    plane.data.materials.append(material)
    image = bpy.data.images.new("Halves", 2, 1, float_buffer=True)
    image.pixels = [0.8, 0.2, 0.2, 1, 0.2, 0.2, 0.8, 1]
    nodes = Nodes(material)
    texture = nodes.tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    nodes.tree.links.new(scenes.node_of(material).inputs["Base Color"], texture.outputs["Color"])
    if is_modified:
        array = plane.modifiers.new("Two", "ARRAY")
        array.relative_offset_displace = (1.0, 0.0, 0.0)
        array.use_relative_offset, array.use_constant_offset = False, True
        array.constant_offset_displace = (0.0, 0.0, -2.0)
    pixels = scenes.bake(plane)[0]
    assert [layer.name for layer in plane.data.uv_layers] == ["UVMap", OWN_MAP][: 2 - is_modified]
    # The new map may turn a plane; two lie in a line, with a change between them.
    wanted = 7 if is_modified else 3
    middle = 3 * SIDE // 16  # of a half, whose noise changes no color
    assert sorted(map(changes_of_color, (pixels[middle], pixels[:, middle]))) == [0, wanted]
