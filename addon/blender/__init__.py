"""Blender's half of the add-on: reads scenes into core's plain data, and shows what comes of it.

Each part imports only core and those above it (tests/unit/test_layers.py reads this list):

    compat        all differences between Blender versions
    registration  what parts add to Blender, all of it or nothing
    popup         popups with important messages
    preferences   what holds for all files of a user
    settings      scene.beamspread
    read          geometry, lights and what a render would show
    node          the shader node, and where a scene has it
    cycles        what Cycles finds in a process of its own: bounced light, the world's radiance
    images        images of the scene, whole files, whose result an image holds
    jobs          how targets are baked (run), how each stands (state), and what changed since (out_of_date)
    live          images that follow the scene while it is worked on
    ui            panels
"""

from . import preferences, settings
from .images import image_operators, previews, sequence, undo
from .jobs import state
from .jobs.out_of_date import stale
from .jobs.run import engine, operator
from .live import session
from .node import buttons, menu, node
from .registration import all_or_nothing
from .ui import panels

PARTS = (
    preferences,
    settings,
    image_operators,
    sequence,
    previews,
    undo,
    node,
    menu,
    buttons,
    state,
    stale,
    engine,
    operator,
    session,
    panels,
)


register, unregister = all_or_nothing(*((part.register, part.unregister) for part in PARTS))
