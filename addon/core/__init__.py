"""The part that knows no host: plain dataclasses and numpy arrays, no bpy.

Each package imports only those above it (tests/unit/test_layers.py reads this list):

    missing     message if the compiled module can't be loaded
    native      the compiled module, or what stands for it where it is missing
    messages    what a bake has to tell the artist
    errors      exceptions that become messages
    target      one material of one object, which is what a bake fills an image for
    progress    progress of a job made of stages
    whole_file  files that are complete or unchanged
    exr_header  what OpenEXR files say of their channels
    recent      what was used last, kept
    arrays      array arguments, converted only where nothing is lost
    scene       receivers (charts on planes), lights, triangles that throw shadows
    material    optical properties, measured presets
    ldf         libraries, samples, the albedo behind a colour
    bake        from a job to its layers, margin included, and what became of it
    live        pictures that follow a scene while it changes
    batch       command line and report of many bakes
    cli         `python3 -m beamspread`
"""
