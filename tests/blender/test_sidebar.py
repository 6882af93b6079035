"""The panel in the 3D View's side bar is drawn, with the state of objects."""

from types import SimpleNamespace

import panel_layout
import pytest
from beamspread.blender.jobs.state import redraw
from beamspread.blender.ui.sidebar import BEAMSPREAD_PT_sidebar
from scenes import add_material, add_plane, add_sun, bake, select


class Layout(panel_layout.Layout):
    """Takes properties and buttons as well."""

    def __init__(self):
        super().__init__()
        self.properties, self.buttons = [], []

    def operator(self, *arguments, text="", **options):
        self.buttons.append(text)
        return super().operator(*arguments, **options)

    def prop(self, _data, name, **_options):
        self.properties.append(name)


@pytest.mark.parametrize("use_size", [True, False])
def test_it_has_live_the_state_and_the_settings_of_each_bake(use_size):
    add_sun(0)
    plane = add_plane(material=add_material())
    select(plane)
    context = panel_layout.context()
    context.scene.beamspread.resolution = 16
    bake(plane)
    panel_layout.panel()  # the state is up to date
    context.scene.beamspread.resolution = 64
    context.scene.beamspread.use_size = use_size
    layout = Layout()
    BEAMSPREAD_PT_sidebar.draw(SimpleNamespace(layout=layout), context)
    assert "Plane: Baked" in layout.said
    assert ("resolution" in layout.properties) != use_size
    assert ("Resize 16 x 16 to 64 x 64" in layout.buttons) != use_size
    assert {"use_live", "use_indirect"} <= set(layout.properties)


def test_a_new_state_redraws_the_side_bar_and_not_the_picture_of_the_view():
    """Blender 5.2 draws neither again by itself, and a picture of EEVEE or Cycles would begin anew."""
    drawn = []

    def part(name, **parts):
        return SimpleNamespace(type=name, tag_redraw=lambda: drawn.append(name), **parts)

    areas = [part("VIEW_3D", regions=[part("WINDOW"), part("UI")]), part("PROPERTIES", regions=[]), part("INFO")]
    manager = SimpleNamespace(windows=[SimpleNamespace(screen=SimpleNamespace(areas=areas))])
    redraw(SimpleNamespace(window_manager=manager))
    assert drawn == ["UI", "PROPERTIES"]
    drawn.clear()
    redraw(SimpleNamespace(window_manager=manager), "VIEW_3D")
    assert drawn == ["VIEW_3D", "PROPERTIES"]
