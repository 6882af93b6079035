"""Several .blend files, one made from the other: each keeps its own results in files."""

import bpy
import numpy as np
import scenes


def make_baked(path):
    settings = bpy.context.scene.beamspread
    settings.resolution, settings.image_storage = 32, "FILES"
    scenes.add_sun(0)
    plane = scenes.add_plane(material=scenes.add_material())
    path.parent.mkdir(exist_ok=True)
    save(path)
    scenes.bake(plane)
    save(path)
    return plane


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def image_of(plane):
    return scenes.node_of(plane.data.materials[0]).image


def brighter(plane):
    bpy.data.objects["Sun"].data.energy *= 4
    return scenes.bake(plane)[0]


def test_a_bake_in_a_file_that_was_saved_as_another_leaves_the_firsts_textures(tmp_path):
    for name in ("same folder/two.blend", "other folder/one.blend"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.context.scene.beamspread.quality, bpy.context.scene.beamspread.use_indirect = "preview", False
        plane = make_baked(tmp_path / "same folder" / "one.blend")
        first = tmp_path / "same folder" / "textures" / "Plane_Medium.exr"
        before, dark = first.read_bytes(), scenes.pixels(image_of(plane)).copy()
        (tmp_path / "other folder").mkdir(exist_ok=True)
        save(tmp_path / name)
        bright = brighter(plane)
        np.testing.assert_allclose(bright, 4 * dark, rtol=1e-5)
        assert first.read_bytes() == before
        assert image_of(plane).filepath.startswith("//textures/")
        own = image_of(plane).filepath
        brighter(plane)  # and keeps that file
        assert image_of(plane).filepath == own


def test_a_renamed_file_keeps_its_textures(tmp_path):
    plane = make_baked(tmp_path / "one.blend")
    own = image_of(plane).filepath
    (tmp_path / "one.blend").rename(tmp_path / "two.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "two.blend"))
    plane = bpy.data.objects["Plane"]
    brighter(plane)
    assert image_of(plane).filepath == own
    assert len(list((tmp_path / "textures").iterdir())) == 1


def test_a_file_that_was_baked_again_is_still_known_as_the_scenes_own(tmp_path):
    plane = make_baked(tmp_path / "one.blend")
    brighter(plane)
    bpy.data.images.remove(image_of(plane))
    brighter(plane)
    assert [path.name for path in (tmp_path / "textures").iterdir()] == ["Plane_Medium.exr"]
