"""Renderings that follow a scene while it changes: quick at first, exact once it rests.

kernel_cache     terms and kernels of a medium on a grid, cached for light of any directions
library_service  libraries of media: at hand, or simulated in the background
live_target      everything that a rendering needs
bounced_layer    light that bounces, coarsely and as in a bake
framed_receiver  a receiver and the texels around its charts
renderer         luminance at few texels with cached fields, and at all texels as in a bake
render_thread    the thread that renders
"""
