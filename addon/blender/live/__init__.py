"""Images that follow the scene while it is worked on.

marks      what has changed
reader     the scene as subjects of pictures; reads only what has changed
saved      what an image was last saved as
painting   images on which the user can paint: Live waits
canvas     pixels of images, which get their own back
session    steps of a timer: look, have it painted, show
"""
