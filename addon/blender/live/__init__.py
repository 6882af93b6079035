"""Previews that follow the scene while it is worked on.

preview        hidden images that nodes show in place of their own
reader         the scene as targets to render; from the cache of `read` where it has not changed
session        one session: scans the scene, has it rendered beside the window, shows previews
timer          switches the session on and off, steps it, and passes Blender's handlers on
"""
