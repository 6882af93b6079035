"""Renderings that follow a scene while it changes: quick at first, exact once it rests.

library_service  libraries of media: at hand, or simulated in the background
fields           terms and kernels of a medium on a grid, cached for light of any directions
live_target      everything that a rendering needs
renderer         luminance at few texels with cached fields, and at all texels as in a bake
render_thread    the thread that renders
"""
