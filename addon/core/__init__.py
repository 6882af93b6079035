"""Host-independent part of the add-on: plain dataclasses and numpy arrays, no bpy."""
