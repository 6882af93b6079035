"""Previews that follow the scene while it is worked on.

scene_changes  changes that depsgraph handlers note
texture_cache  base colors of textures, read again only when their nodes change
preview        hidden images that nodes show in place of their own
reader         the scene as targets to render; reads only changed data
session        one session: scans the scene, has it rendered beside the window, shows previews
timer          switches the session on and off, steps it, and passes Blender's handlers on
"""
