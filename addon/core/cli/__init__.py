"""The command line: options, commands, pictures; needs no Blender, and matplotlib only to draw."""
