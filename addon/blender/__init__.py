"""Blender's half of the add-on: reads scenes into plain data of core, runs bakes, and shows their results.

Each part imports only core and those above it (tests/unit/test_layers.py reads this list):

    compat        all differences between Blender versions
    registration  classes and handlers of a part, added completely or not at all
    popup         popups with important messages
    preferences   settings of the user for all files
    settings      scene.beamspread
    read          geometry, lights, visibility in a render
    node          the shader node, and finding it in a scene
    cycles        light and colors that Cycles finds in a process of its own
    images        images of the scene: their files, facts about their bakes, storing results
    jobs          bakes of targets (run), their status (state), time (announced), and changes since (out_of_date)
    live          previews that follow the scene while it is worked on
    ui            panels
"""

from . import preferences, settings
from .cycles import kept_world, process
from .images import atlas, facts, image_operators, undo
from .jobs import frozen, state
from .jobs.out_of_date import stale
from .jobs.run import active_image, engine, files_operators, operator, render_copy
from .live import timer
from .node import buttons, node
from .read import scene_cache
from .registration import all_or_nothing
from .ui import panels, sidebar

PARTS = (
    preferences,
    settings,
    image_operators,
    atlas,
    facts,
    undo,
    node,
    buttons,
    scene_cache,  # its listeners show the nodes that `node` has restored after undo
    kept_world,
    process,
    state,
    frozen,
    stale,
    active_image,
    engine,
    render_copy,
    operator,
    files_operators,
    timer,
    panels,
    sidebar,
)


register, unregister = all_or_nothing(*((part.register, part.unregister) for part in PARTS))
