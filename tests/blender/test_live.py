"""Live: previews follow the scene. In background no timer runs: these tests take its steps."""

import time

import bpy
import numpy as np
import pytest
import scenes
from beamspread.blender.live import session, timer
from live_scenes import (
    hidden_images,
    live_lines,
    live_pixels,
    make_scene,
    settle,
    shown_pixels,
    shows_own_image,
    switch_off,
)

pytestmark = pytest.mark.usefixtures("live_switched_off")


def baked_pixels(plane):
    switch_off()
    return scenes.bake(plane)[0]


def test_at_rest_the_preview_is_the_bake():
    plane, lamp, material = make_scene()
    live_pixels(material)
    lamp.location.x = -0.4
    live = live_pixels(material)
    np.testing.assert_allclose(live, baked_pixels(plane), rtol=1e-4)


@pytest.mark.parametrize("change", ["lamp", "node"])
def test_a_change_is_scanned_before_the_next_step(change, monkeypatch):
    plane, lamp, material = make_scene()
    plane.location.x = 0.1
    settle()  # a scan of more than lamps has been timed
    thread, shown = timer.live.session._thread, []
    monkeypatch.setattr(thread, "show", shown.append)
    if change == "lamp":
        lamp.location.x = -0.4
    else:
        scenes.node_of(material).albedo = (0.8, 0.7, 0.6)
    bpy.context.view_layer.update()
    assert len(shown) == 1


def test_a_change_waits_for_its_picture_unless_that_was_in_vain(monkeypatch):
    _, lamp, material = make_scene()
    before = live_pixels(material)

    def moved(x):
        lamp.location.x = x
        bpy.context.view_layer.update()  # no step of the timer
        return shown_pixels(material)

    monkeypatch.setattr(session, "WAIT_SECONDS", 60)
    with monkeypatch.context() as patched:
        patched.setattr(session, "is_looked_at", lambda _: False)  # as by Solid views alone
        np.testing.assert_array_equal(moved(0.1), before)
    picture = moved(-0.4)
    assert np.abs(picture - before).max() > 0.1 * before.max()
    monkeypatch.setattr(session, "WAIT_SECONDS", 0)
    monkeypatch.setattr(session, "PAUSE_SECONDS", 60)
    with timer.live.session._thread._condition:  # nothing is finished meanwhile
        np.testing.assert_array_equal(moved(0.4), picture)
        monkeypatch.setattr(session, "WAIT_SECONDS", 60)
        np.testing.assert_array_equal(moved(0.2), picture)


def test_live_says_that_no_view_shows_it(monkeypatch):
    _, _, material = make_scene()
    live_pixels(material)
    assert live_lines() == []
    with monkeypatch.context() as patched:
        patched.setattr(timer, "is_looked_at", lambda _: False)  # as by Solid views alone
        assert live_lines() == ["Live waits for a 3D View in Material Preview or Rendered."]
        switch_off()
        assert live_lines() == []


def test_a_moved_lamp_reads_no_mesh(monkeypatch):
    _, lamp, material = make_scene()
    first = live_pixels(material)
    monkeypatch.setattr("beamspread.blender.read.geometry.local_mesh", lambda *_: pytest.fail("a mesh was read"))
    monkeypatch.setattr("beamspread.blender.live.reader.read_polygons", lambda *_: pytest.fail("a mesh was read"))
    lamp.location.x = -0.4
    assert np.abs(live_pixels(material) - first).max() > 0.1 * first.max()


CHANGES = {
    "power": lambda plane, lamp, material: setattr(lamp.data, "energy", 100),
    "place of the receiver": lambda plane, lamp, material: setattr(plane, "location", (0.3, 0, 0)),
    "node": lambda plane, lamp, material: setattr(scenes.node_of(material), "albedo", (0.5, 0.5, 0.5)),
    "shadow": lambda plane, lamp, material: scenes.add_blocker(0.3),
    "world": lambda plane, lamp, material: setattr(bpy.context.scene.world, "color", (0.5, 0.5, 0.5)),
    "another lamp": lambda plane, lamp, material: scenes.add_sun(30),
    "lamp hidden": lambda plane, lamp, material: setattr(lamp, "hide_render", True),
    "mesh": lambda plane, lamp, material: widen(plane.data),
    "nodes of the lamp": lambda plane, lamp, material: dim(lamp.data),
}


def dim(light):
    """Change nodes alone, which Blender reports otherwise than a lamp that gets nodes."""
    light.use_nodes = True
    settle()
    next(node for node in light.node_tree.nodes if node.type == "EMISSION").inputs["Strength"].default_value = 0.5


def widen(mesh):
    for vertex in mesh.vertices:
        vertex.co *= 1.5
    mesh.update()


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_every_change_is_followed(change):
    plane, lamp, material = make_scene()
    world = bpy.data.worlds.new("World")
    world.color = (0, 0, 0)
    bpy.context.scene.world = world
    live_pixels(material)
    change(plane, lamp, material)
    live = live_pixels(material)
    np.testing.assert_allclose(live, baked_pixels(plane), rtol=1e-4, atol=1e-5)


def test_switched_off_nodes_show_their_own_images_again():
    plane, lamp, material = make_scene()
    baked = scenes.bake(plane)[0]
    lamp.location.x = -0.4
    assert np.abs(live_pixels(material) - baked).max() > 0.1 * baked.max()
    switch_off()
    assert shows_own_image(material)
    np.testing.assert_array_equal(shown_pixels(material), baked)


def test_the_nodes_own_image_is_never_touched(tmp_path):
    """Live neither writes its pixels nor its file, and packs nothing."""
    _plane, lamp, material = make_scene()
    image = scenes.node_of(material).image
    image.colorspace_settings.is_data = True
    image.filepath_raw, image.file_format = str(tmp_path / "target.exr"), "OPEN_EXR"
    image.save()
    image.source = "FILE"
    file, pixels = (tmp_path / "target.exr").read_bytes(), scenes.pixels(image)
    for x in (-0.4, 0.3):
        lamp.location.x = x
        assert live_pixels(material).max() > 0
    assert not image.is_dirty
    assert image.packed_file is None
    np.testing.assert_array_equal(scenes.pixels(image), pixels)
    assert (tmp_path / "target.exr").read_bytes() == file
    assert len(list(tmp_path.iterdir())) == 1


def test_a_node_without_image_is_shown_in_the_resolution_of_the_scene():
    _plane, _lamp, material = make_scene()
    node = scenes.node_of(material)
    node.image = None
    bpy.context.scene.beamspread.resolution = 48
    assert live_pixels(material).max() > 0
    assert live_pixels(material).shape == (48, 48, 3)
    bpy.context.scene.beamspread.resolution = 32
    assert live_pixels(material).shape == (32, 32, 3)
    switch_off()
    assert node.image is None
    assert shows_own_image(material)


def test_objects_of_one_material_without_image_share_a_preview():
    """Their faces ask for images of different shapes; the preview has one."""
    plane, _lamp, material = make_scene()
    scenes.node_of(material).image = None
    plane.data.uv_layers.active.data.foreach_set("uv", np.ravel([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)]))
    wide = scenes.add_plane(
        "Wide", size=(4, 1), material=material, uvs=np.add([(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)], 0.5)
    )
    wide.location.x = 4
    bpy.context.scene.beamspread.resolution = 64
    pixels = live_pixels(material)
    half = pixels.shape[0] // 2
    assert pixels[:half, : pixels.shape[1] // 2].mean() > 0
    assert pixels[half:, pixels.shape[1] // 2 :].mean() > 0
    assert len(hidden_images()) == 1


@pytest.mark.parametrize("kind", ["another size", "UDIM tiles", "lost file", "8 bits", "no pixels of its own"])
def test_images_of_all_kinds(kind, tmp_path):
    _plane, lamp, material = make_scene()
    node, first = scenes.node_of(material), live_pixels(material).copy()
    image = {
        "another size": lambda: bpy.data.images.new("Other", 32, 16, float_buffer=True),
        "UDIM tiles": lambda: bpy.data.images.new("Tiles", 32, 32, tiled=True),
        "lost file": lambda: lost_image(tmp_path),
        "8 bits": lambda: bpy.data.images.new("Bytes", 64, 64),
        "no pixels of its own": lambda: None,
    }[kind]()
    node.image = image
    lamp.data.energy *= 2
    settle()
    if kind == "UDIM tiles":
        assert shows_own_image(material)
        assert "has UDIM tiles" in live_lines()[0]
        node.image = None
        settle()
    assert shown_pixels(material).mean() == pytest.approx(2 * first.mean(), rel=0.1)
    assert not live_lines()
    switch_off()
    assert shows_own_image(material)


def lost_image(folder):
    """An image whose file is gone."""
    image = bpy.data.images.new("Lost", 16, 16, float_buffer=True)
    image.filepath_raw, image.file_format = str(folder / "lost.exr"), "OPEN_EXR"
    image.save()
    image.source = "FILE"
    (folder / "lost.exr").unlink()
    image.reload()
    return image


def test_objects_of_one_material_keep_to_their_parts():
    """Texels outside of both have the values of the node's own image."""
    plane, _lamp, material = make_scene()
    bpy.context.scene.beamspread.margin = 0
    quarter = [(0, 0), (0.5, 0), (0.5, 0.5), (0, 0.5)]
    plane.data.uv_layers.active.data.foreach_set("uv", np.ravel(quarter))
    other = scenes.add_plane("Other", material=material, uvs=np.add(quarter, 0.5))
    other.location.x = 2.5
    image = scenes.node_of(material).image
    image.pixels.foreach_set(np.full(64 * 64 * 4, 7, np.float32))
    values = live_pixels(material)
    assert (values[32:, :32] == 7).all()
    assert (values[:32, 32:] == 7).all()
    assert values[:32, :32].mean() > values[32:, 32:].mean() > 0


def test_messages_name_objects_that_cannot_follow_and_the_others_follow():
    _plane, _lamp, material = make_scene()
    bare = scenes.add_plane("Bare", material=scenes.add_material("Other"))
    bare.location.x = 5
    bare.data.uv_layers.remove(bare.data.uv_layers[0])
    assert live_pixels(material).max() > 0
    (message,) = live_lines()
    assert message.startswith("Bare / Other: The mesh has no UV map")


def test_a_medium_without_library_is_simulated_and_then_shown(monkeypatch, tmp_path):
    monkeypatch.setenv("BEAMSPREAD_CACHE", str(tmp_path))
    plane, _lamp, material = make_scene(anisotropy=0.37, ior=1.37)
    settle(lambda: any("simulates the medium (g 0.37, IOR 1.37)" in message for message in live_lines()))
    assert not hidden_images()
    settle(lambda: list(tmp_path.iterdir()))
    np.testing.assert_allclose(live_pixels(material), baked_pixels(plane), rtol=1e-4)


ABUSE = {
    "object": lambda plane, lamp, material: bpy.data.objects.remove(plane),
    "material": lambda plane, lamp, material: bpy.data.materials.remove(material),
    "node": lambda plane, lamp, material: material.node_tree.nodes.remove(scenes.node_of(material)),
    "image": lambda plane, lamp, material: bpy.data.images.remove(scenes.node_of(material).image),
    "lamp": lambda plane, lamp, material: bpy.data.objects.remove(lamp),
    "mesh": lambda plane, lamp, material: plane.data.clear_geometry(),
    "scene": lambda plane, lamp, material: bpy.ops.scene.new(),
    "image's size": lambda plane, lamp, material: scenes.node_of(material).image.scale(32, 16),
    "names": lambda plane, lamp, material: [setattr(data, "name", "New") for data in (plane, lamp, material)],
    "edit mode": lambda plane, lamp, material: (scenes.select(plane), bpy.ops.object.mode_set(mode="EDIT")),
}


@pytest.mark.parametrize("happens", ABUSE.values(), ids=ABUSE)
@pytest.mark.parametrize("is_rendering", [False, True], ids=["at rest", "while rendering"])
def test_deleted_and_changed_data(happens, is_rendering, caplog):
    plane, lamp, material = make_scene()
    live_pixels(material)
    if is_rendering:
        lamp.location.x = -0.4
        bpy.context.view_layer.update()
        timer.step(bpy.context)
    happens(plane, lamp, material)
    for _ in range(20):
        timer.step(bpy.context)
        time.sleep(0.01)
    assert not caplog.records
    switch_off()
    assert not hidden_images()


def test_it_goes_on_after_undo():
    _plane, lamp, material = make_scene()
    bpy.ops.ed.undo_push(message="before")
    lamp.location.x = -0.4
    bpy.ops.ed.undo_push(message="moved")
    moved = live_pixels(material)
    bpy.ops.ed.undo()
    material = bpy.data.materials["Medium"]
    undone = live_pixels(material)
    assert np.abs(undone - moved).max() > 0.1 * moved.max()
    np.testing.assert_allclose(undone, baked_pixels(bpy.data.objects["Plane"]), rtol=1e-4)


def test_another_file_ends_it():
    make_scene()
    settle()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert timer.live.session is None


def test_frames_of_an_animation_are_followed():
    plane, lamp, material = make_scene()
    for frame, x in ((1, 0.3), (10, -0.4)):
        lamp.location.x = x
        lamp.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    first = live_pixels(material)
    bpy.context.scene.frame_set(10)
    last = live_pixels(material)
    assert np.abs(last - first).max() > 0.1 * first.max()
    np.testing.assert_allclose(last, baked_pixels(plane), rtol=1e-4)


def test_a_scene_that_goes_back_to_its_bake_is_rendered_again():
    plane, lamp, material = make_scene()
    live_pixels(material)
    baked = scenes.bake(plane)[0]
    for x in (-0.4, 0.3):
        lamp.location.x = x
        live = live_pixels(material)
    np.testing.assert_allclose(live, baked, rtol=1e-4)


def test_an_object_that_casts_no_light_is_not_read_again_for_its_node(monkeypatch):
    """While a value of the medium is dragged."""
    _plane, _lamp, material = make_scene()
    live_pixels(material)
    monkeypatch.setattr("beamspread.blender.read.geometry.local_mesh", lambda *_: pytest.fail("a mesh was read"))
    node = scenes.node_of(material)
    node.ior = 1.3  # tells handlers, unlike other values that scripts set
    bpy.context.view_layer.update()
    live_pixels(material)


def add_stripes(material, values=(0.2, 0.7)):
    """Image of upright stripes at the Base Color."""
    scenes.node_of(material).color_mode = "BASE_COLOR"
    colors = np.ones((4, 8, 4), np.float32)
    colors[..., :3] = np.resize(np.repeat(values, 2), 8)[None, :, None]
    image = bpy.data.images.new("Stripes", 8, 4, float_buffer=True)
    image.pixels.foreach_set(colors.ravel())
    image.pack()
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, "Closest"
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], texture.outputs["Color"])
    return texture


def test_a_texture_at_base_color_is_followed(monkeypatch):
    plane, lamp, material = make_scene(ior=1.0)  # light scatters less often
    plain = live_pixels(material).copy()
    node = scenes.node_of(material)
    texture = add_stripes(material)
    live = live_pixels(material).copy()
    assert np.abs(live - plain).max() > 0.1 * plain.max()
    # Colors from black to white have noise where light goes far, which the bake names, too.
    path, node.mean_free_path = tuple(node.mean_free_path), (0.3,) * 3
    colors = add_stripes(material, (0.0, 0.95))
    live_pixels(material)
    (line,) = live_lines()
    assert line.startswith("The light in the texture of 'Plane' has a noise of ")
    material.node_tree.nodes.remove(colors)
    node.mean_free_path = path
    material.node_tree.links.new(node.inputs["Base Color"], texture.outputs["Color"])
    assert live_pixels(material) == pytest.approx(live, rel=1e-4)
    node.texture_blur = 0.1
    sharper = live_pixels(material).copy()
    assert np.abs(sharper - live).max() > 0.05 * live.max()
    texture.extension, texture.image = "CLIP", bpy.data.images.new("Black", 4, 4, float_buffer=True)
    assert np.abs(live_pixels(material) - sharper).max() > 0.1 * live.max()
    material.node_tree.nodes.remove(texture)
    add_stripes(material, (0.3, 0.5))
    live_pixels(material)
    with monkeypatch.context() as patched:
        patched.setattr("beamspread.blender.live.reader.read_texture", lambda *_: pytest.fail("it was read again"))
        lamp.location.x = -0.4
        live = live_pixels(material).copy()
    np.testing.assert_allclose(live, baked_pixels(plane), rtol=1e-4, atol=1e-6)


def test_messages_name_textures_that_live_cannot_evaluate():
    _plane, _lamp, material = make_scene()
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(scenes.node_of(material).inputs["Base Color"], noise.outputs["Color"])
    assert live_pixels(material).max() > 0
    assert "Live can't evaluate the Base Color of 'Plane'" in live_lines()[0]


def test_a_node_that_its_material_does_not_show_is_named():
    """A new node may stand beside the former shader, which the view then shows in place of Live's picture."""
    _plane, _lamp, material = make_scene()
    settle()
    assert not any("not shown" in message.line() for message in timer.messages())
    links = material.node_tree.links
    for link in list(links):
        links.remove(link)
    settle()
    (said,) = [message.line() for message in timer.messages() if "not shown" in message.line()]
    assert f"'{material.name}'" in said


def test_a_text_is_sent_to_a_bake_which_makes_its_map():
    make_scene()
    bpy.ops.object.text_add(location=(0, 2, 0))
    bpy.context.object.data.materials.append(scenes.add_material("Letters", linked=True))
    settle()
    (said,) = [message.line() for message in timer.messages() if "no area" in message.line()]
    assert said.startswith("Text / Letters: ")
    assert said.endswith("Beamspread's own Bake makes a map.")
