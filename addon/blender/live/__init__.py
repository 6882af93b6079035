"""Images that follow the scene while it is worked on.

marks      what has changed
textures   base colours, read again where their nodes change
reader     the scene as subjects of pictures; reads only what has changed
saved      what an image was last saved as
painting   images on which the user can paint: Live waits
canvas     pixels of images, which get their own back
stand_ins  images that Cycles sees in place of these
session    steps of a timer: look, have it painted, show
"""
