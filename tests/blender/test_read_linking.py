"""Which objects a light lights and which cast its shadows, against Cycles: on two white planes side by side."""

import bpy
import pytest
import scenes
from cycles_truth import add_receiver, cycles_irradiance, read
from mathutils import Matrix

pytestmark = pytest.mark.skipif(bpy.app.version < (4, 0, 0), reason="light linking came in Blender 4.0")
NAMES = ("Here", "There")
PLACES = {name: Matrix.Translation((5 * i, 0, 0)) for i, name in enumerate(NAMES)}


def add_planes():
    planes = []
    for name in NAMES:
        plane, image = add_receiver(PLACES[name], texels=4)
        plane.name = name
        planes.append((plane, image))
    return planes


def links_to(name, *objects):
    collection = bpy.data.collections.new(name)
    for obj in objects:
        collection.objects.link(obj)
    return collection


def exclude(links, number=0):
    links[number].light_linking.link_state = "EXCLUDE"


def empty(_here, _there):
    return links_to("Links")


def only_here(here, _there):
    return links_to("Links", here)


def not_here(here, _there):
    links = links_to("Links", here)
    exclude(links.collection_objects)
    return links


def here_and_not_there(here, there):
    links = links_to("Links", here, there)
    exclude(links.collection_objects, [obj.name for obj in links.objects].index(there.name))
    return links


def below(here, _there):
    links = links_to("Links")
    links.children.link(links_to("Middle"))
    links.children[0].children.link(links_to("Inner", here))
    return links


def below_not(here, there):
    links = below(here, there)
    exclude(links.collection_children)
    return links


def here_although_not_below(here, there):
    links = below_not(here, there)
    links.objects.link(here)
    return links


def not_here_although_below(here, there):
    links = below(here, there)
    links.objects.link(here)
    exclude(links.collection_objects)
    return links


def states_below_do_not_count(here, _there):
    links = links_to("Links")
    links.children.link(links_to("Inner", here))
    exclude(links.children[0].collection_objects)
    return links


def something_else(_here, _there):
    return links_to("Links", bpy.data.objects.new("Other", None))


LINKS = [
    empty,
    only_here,
    not_here,
    here_and_not_there,
    below,
    below_not,
    here_although_not_below,
    not_here_although_below,
    states_below_do_not_count,
    something_else,
]


def lit(planes):
    """Which planes Cycles lights, and which we do."""
    cycles = [bool(cycles_irradiance(*plane, samples=16).any()) for plane in planes]
    illumination = read()
    return cycles, [bool(illumination.lighting(name).lights) for name in NAMES]


@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize("emitter", ["lamp", "mesh"])
def test_receivers(emitter, link):
    planes = add_planes()
    if emitter == "lamp":
        light = scenes.add_sun(0)
    else:
        place = Matrix.Translation((2.5, 0, 2))
        light = scenes.add_plane("Panel", (3, 3), place, material=scenes.glowing_material(1.0))
    light.light_linking.receiver_collection = link(*(plane for plane, _ in planes))
    cycles, ours = lit(planes)
    assert ours == cycles


@pytest.mark.parametrize("link", LINKS)
def test_blockers(link):
    planes = add_planes()
    roofs = [scenes.add_plane(f"Roof {name}", (3, 3), PLACES[name] @ Matrix.Translation((0, 0, 1))) for name in NAMES]
    sun = scenes.add_sun(0)
    sun.light_linking.blocker_collection = link(*roofs)
    cycles = [bool(cycles_irradiance(*plane, samples=16).any()) for plane in planes]
    (light,) = read().lights
    ours = [light.blockers is not None and roof.name not in light.blockers for roof in roofs]
    assert ours == cycles


def test_an_instancer_stands_for_its_objects():
    planes = add_planes()
    roof = scenes.add_plane("Roof", (3, 3), Matrix.Translation((0, 0, 1)))
    holder = scenes.add_instancer(scenes.new_collection("Shown", roof))
    sun = scenes.add_sun(0)
    for obj in (holder, roof):
        links = links_to("Links", obj)
        exclude(links.collection_objects)
        sun.light_linking.blocker_collection = links
        assert cycles_irradiance(*planes[0], samples=16).any()
        (light,) = read().lights
        assert "Roof" not in light.blockers


def test_without_links_all_are_lit():
    planes = add_planes()
    scenes.add_sun(0)
    assert lit(planes) == ([True, True], [True, True])
    (light,) = read().lights
    assert (light.receivers, light.blockers) == (None, None)
