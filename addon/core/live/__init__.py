"""Pictures that follow a scene while it changes: quick first, exact when it rests.

media      the library of a medium, or the nearest one while its own is simulated
fields     terms and kernels of a medium on a grid, kept for whatever light comes
subject    what a picture is made of
picture    luminance at few texels by these, and at all texels as a bake
pace       how fine a picture may be to come in time
painter    the thread that paints
"""
