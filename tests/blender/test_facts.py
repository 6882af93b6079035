"""Facts that images keep: files of earlier versions, renamed targets, and damaged texts."""

import json
from dataclasses import asdict

import bpy
import pytest
from beamspread.blender.images.facts import (
    KEY,
    Frames,
    ImageFacts,
    Record,
    facts_of,
    is_sequence,
    note_bake,
    record_of,
    set_facts,
)
from beamspread.blender.jobs.out_of_date import stale
from beamspread.blender.jobs.state import Status, state
from beamspread.core.target import Target
from scenes import add_material, add_plane, add_sun, bake, image_of, node_of, reopen, run_batch, save_scene

PLANE = Target("Plane", "Medium")


def image():
    return bpy.data.images.new("Image", 4, 4)


def use_keys_of_earlier_versions(image):
    """Store the facts of an image as version 0.1 did before they had one key."""
    facts = facts_of(image)
    del image[KEY]
    image["beamspread_results"] = json.dumps([[target.object_name, target.material_name] for target in facts.bakes])
    image["beamspread_bakes"] = json.dumps({str(target): asdict(record) for target, record in facts.bakes.items()})
    image["beamspread_stamp"] = facts.stamp
    if facts.is_undone:
        image["beamspread_undone"] = "yes"
    if facts.frames:
        image["beamspread_frames"] = list(facts.frames)
    if facts.former:
        image["beamspread_former"] = facts.former


def test_facts_survive_saving_the_file(tmp_path):
    facts = ImageFacts({PLANE: Record({"lights": "1"}, ("warning",), True, ("note",))}, "stamp", True)
    facts.frames, facts.former = Frames(3, 5, 16, 8), bpy.data.images.new("Former", 4, 4)
    first = image()
    first.use_fake_user = True
    set_facts(first, facts)
    reopen(tmp_path)
    facts.former = bpy.data.images["Former"]  # nothing else shows it
    assert facts_of(bpy.data.images["Image"]) == facts


def test_facts_of_earlier_versions_are_read_and_get_the_one_key():
    facts = ImageFacts({PLANE: Record({"lights": "1"}, ("warning",), True, ("note",))}, "stamp", True)
    facts.frames, facts.former = Frames(3, 5, 16, 8), bpy.data.images.new("Former", 4, 4)
    old = image()
    set_facts(old, facts)
    use_keys_of_earlier_versions(old)
    assert KEY not in old
    assert len(old.keys()) == 6
    assert facts_of(old) == facts
    set_facts(old, facts_of(old))
    assert list(old.keys()) == [KEY]
    assert facts_of(old) == facts


def test_a_bake_in_a_file_of_an_earlier_version_is_known(tmp_path):
    plane = add_plane(material=add_material())
    add_sun(0)
    bpy.context.scene.beamspread.resolution = 16
    bake(plane)
    use_keys_of_earlier_versions(image_of(plane))
    reopen(tmp_path)
    state.forget()
    stale.refresh(bpy.context)
    assert state.rows[PLANE].status == Status.BAKED
    bpy.data.objects["Sun"].data.energy *= 2
    stale.refresh(bpy.context)
    assert state.rows[PLANE].status == Status.STALE
    bake(bpy.data.objects["Plane"])
    stale.refresh(bpy.context)
    assert state.rows[PLANE].status == Status.BAKED
    assert [key for key in image_of(bpy.data.objects["Plane"]).keys() if key.startswith("beamspread")] == [KEY]  # noqa: SIM118


def test_frames_of_an_earlier_version_are_shown(tmp_path):
    plane = add_plane(material=add_material())
    add_sun(0)
    bpy.context.scene.beamspread.resolution = 16
    save_scene(tmp_path)
    bake(plane)
    own = image_of(plane).name
    assert run_batch("--frames", "3-4").all_written()
    bpy.ops.beamspread.show_frames()
    use_keys_of_earlier_versions(image_of(plane))
    assert is_sequence(image_of(plane))
    stale.refresh(bpy.context)
    assert state.rows[PLANE].messages[0].text.startswith("Shows the frames 3 to 4")
    assert bpy.ops.beamspread.show_single() == {"FINISHED"}
    assert image_of(plane).name == own


def test_a_record_is_found_by_the_new_name_of_its_object():
    plane = add_plane(material=add_material(image=image()))
    record = Record({"lights": "1"})
    note_bake(image_of(plane), PLANE, record)
    plane.name = "Renamed"
    renamed = Target("Renamed", "Medium")
    assert record_of(image_of(plane), renamed) == record
    note_bake(image_of(plane), renamed)
    assert facts_of(image_of(plane)).bakes == {renamed: record}


def test_an_owner_without_a_record_was_never_baked_as_far_as_is_known():
    plane = add_plane(material=add_material(image=image()))
    note_bake(image_of(plane), PLANE)
    assert record_of(image_of(plane), PLANE) is None
    assert facts_of(image_of(plane)).bakes == {PLANE: Record()}


@pytest.mark.parametrize("text", ["", "{", "[1]", "null"])
def test_a_damaged_text_counts_as_no_facts(text):
    damaged = image()
    damaged[KEY] = {"facts": text}
    assert facts_of(damaged) == ImageFacts()


def test_images_that_live_of_an_earlier_version_made_are_removed_on_load(tmp_path):
    material = add_material(image=bpy.data.images.new("Plane_Medium", 4, 4, float_buffer=True))
    add_plane(material=material)
    packed = bpy.data.images.new("Packed", 4, 4)
    packed.pixels[0] = 1.0
    packed.pack()
    packed.use_fake_user = True
    for made in (node_of(material).image, packed):
        made["beamspread_preview"] = True
    reopen(tmp_path)
    assert node_of(bpy.data.materials["Medium"]).image is None
    assert [image.name for image in bpy.data.images] == ["Packed"]
    assert "beamspread_preview" not in bpy.data.images["Packed"]
