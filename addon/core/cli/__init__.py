"""The command line `python3 -m beamspread`. Needs no Blender; the plots need matplotlib."""
