"""The part that works without Blender: plain dataclasses and numpy arrays, no bpy.

Each package imports only those above it (tests/unit/test_layers.py reads this list):

    native     the compiled module, or a stand-in that raises a message
    messages   messages of a bake for the artist
    errors     exceptions that become messages
    target     one material of one object: a bake fills one image for it
    time_left  time that a run still takes, from estimates and speed
    progress   progress of a job made of stages
    disk       files that are complete or unchanged, their names and headers
    display    exposure, sRGB and PNG of files that hold no values above 1
    recent     caches
    arrays     array arguments, converted without loss
    material   optical properties, measured presets
    scene      receivers (charts on planes), lights, triangles that cast shadows
    ldf        libraries, samples, the albedo for a color
    bake       from a job to its layers, with their margin, and the status of each bake
    live       previews that follow a scene while it changes
    batch      command line and report of many bakes
    cli        `python3 -m beamspread`
"""
