"""States of targets in the panel: what is refused before the bake, renamed, duplicated, or has two materials."""

import bpy
import pytest
from beamspread.blender.jobs.state import Status, state
from beamspread.blender.node.find import find_targets
from beamspread.blender.popup import wrap
from panel_layout import panel
from scenes import add_material, add_mesh, add_plane, add_sun, bake, glowing_material, select


@pytest.fixture(autouse=True)
def small():
    bpy.context.scene.beamspread.resolution = 16
    add_sun(0)


def statuses() -> dict:
    return {str(target): row.status for target, row in state.rows.items()}


def metaball_with(material):
    data = bpy.data.metaballs.new("Ball")
    data.elements.new()
    data.materials.append(material)
    obj = bpy.data.objects.new("Ball", data)
    bpy.context.collection.objects.link(obj)
    return obj


@pytest.mark.parametrize("kind", ["RGB", "TexImage", "Emission", "TexNoise"])
def test_node_without_a_link_is_no_change(kind):
    material, lamp = add_material(shader=True), glowing_material()
    plane, other = add_plane(material=material), add_plane("Lamp", material=lamp)
    other.location.z = 5
    texture = material.node_tree.nodes.new("ShaderNodeTexChecker")
    material.node_tree.links.new(material.node_tree.nodes["Beamspread"].inputs["Base Color"], texture.outputs[0])
    bake(plane)
    for tree in (material.node_tree, lamp.node_tree):
        node = tree.nodes.new(f"ShaderNode{kind}")
        if kind == "TexImage":
            node.image = bpy.data.images.new("Unused", 4, 4)
    said = panel()
    assert "Changed" not in said
    assert statuses()["Plane / Medium"] in (Status.BAKED, Status.WARNED)


def test_renamed_target_keeps_its_bake_beside_a_duplicate():
    """The duplicate stands where no light of it reaches the plane: without bounces it changes nothing."""
    bpy.context.scene.beamspread.use_indirect = False
    plane = add_plane(material=add_material())
    bake(plane)
    plane.name = "Renamed"
    panel()  # the scan after the change
    copy = plane.copy()
    bpy.context.collection.objects.link(copy)
    copy.location.x = 100
    assert "Renamed: " in panel()
    image = plane.material_slots[0].material.node_tree.nodes["Beamspread"].image
    assert image.name == "Plane_Medium"
    changed = [message.text for message in state.rows[next(iter(state.rows))].messages]
    assert statuses()["Renamed / Medium"] != Status.NEVER, changed
    assert statuses()[f"{copy.name} / Medium"] == Status.NEVER
    plane.data.materials[0].name = "Wax"  # both names have changed by now
    panel()
    assert statuses()["Renamed / Wax"] != Status.NEVER


def test_slots_of_one_object_are_told_apart():
    plane = add_mesh(
        "Pair", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)], [(0, 1, 2, 3), (1, 4, 5, 2)]
    )
    for name in ("Wax", "Jade"):
        plane.data.materials.append(add_material(name))
    plane.data.polygons[1].material_index = 1
    add_plane("Alone", material=add_material("Soap"))
    said = panel()
    assert "Pair / Wax: Never baked" in said
    assert "Pair / Jade: Never baked" in said
    assert "Alone: Never baked" in said


@pytest.mark.parametrize("is_baked", [False, True])
def test_a_metaball_is_named(is_baked):
    material = add_material()
    plane, ball = add_plane(material=material), metaball_with(material)
    if is_baked:
        bake(plane)
    select(plane)
    said = panel()
    assert "Ball: Can't be baked" in said
    assert "'Ball' is not a mesh. Convert it to one" in said
    select(ball)
    with pytest.raises(RuntimeError, match="'Ball' is not a mesh"):
        bpy.ops.beamspread.bake()
    ball.hide_render = True
    assert "Ball: Can't be baked" not in panel()


@pytest.mark.parametrize("selected", [False, True])
@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda plane: plane.data.clear_geometry(), "'Plane' has no faces"),
        (lambda plane: setattr(plane, "scale", (0, 0, 0)), "The object's scale is zero"),
        (lambda plane: setattr(plane.data.polygons[0], "material_index", 1), "No face uses this material"),
        (lambda plane: setattr(plane, "hide_render", True), "is hidden from render"),
        (lambda plane: setattr(plane.data.materials[0].node_tree.nodes["Beamspread"], "uv_map", "Gone"), "no UV map"),
        (lambda plane: setattr(plane.data.materials[0].node_tree.nodes["Beamspread"], "ior", 0.5), "The IOR is 0.5"),
    ],
)
def test_mesh_that_can_not_be_baked_says_why_before(spoil, reason, selected):
    plane = add_plane(material=add_material())
    plane.data.materials.append(None)
    spoil(plane)
    if selected:
        select(plane)
    else:
        bpy.ops.object.select_all(action="DESELECT")
    said = panel()
    assert "Plane: Can't be baked" in said
    assert said.replace(" ", "").count(reason.replace(" ", "")) == 1  # said once, however it is wrapped


@pytest.mark.parametrize("modifier", ["", "MIRROR", "SOLIDIFY", "NODES"])
def test_a_material_without_faces_is_left_out_beside_others(modifier):
    """Slots of imported characters often have none. A modifier that may set the material keeps it in."""
    plane = add_plane(material=add_material())
    plane.data.materials.append(add_material("Unused"))
    if modifier:
        plane.modifiers.new("M", modifier)
    if modifier == "SOLIDIFY":
        plane.modifiers["M"].material_offset = 1
    if modifier == "NODES":
        plane.modifiers["M"].node_group = tree = bpy.data.node_groups.new("Sets", "GeometryNodeTree")
        tree.nodes.new("GeometryNodeSetMaterial")
    is_kept = modifier in ("SOLIDIFY", "NODES")
    assert [target.material_name for target in find_targets([plane])] == ["Medium", "Unused"][: 1 + is_kept]
    plane.data.polygons[0].material_index = 1
    assert [target.material_name for target in find_targets([plane])] == ["Medium", "Unused"][not is_kept :]


def test_long_names_are_broken_rather_than_cut_off():
    """Names that differ at their ends alone must differ in a narrow panel."""
    name = "Armchair_of_the_living_room.001"
    lines = wrap(f"{name}: Never baked", 20)
    assert max(map(len, lines)) <= 20
    assert "".join(lines).startswith(name)


def test_bake_without_a_selected_node_says_that_it_bakes_all():
    planes = [add_plane(name, material=add_material(name)) for name in ("First", "Second")]
    planes[1].location.x = 5
    other = add_plane("Other")
    other.location.z = -5
    select(other)
    assert "No selected object has a Beamspread node" in panel()
    select(planes[0])
    assert "No selected object" not in panel()
