"""Blender data as the plain dataclasses of core.

lights        all light of a scene: lamps, emitters (glowing meshes), world; linking says whom it reaches
occluders     all that throws shadows: geometry, and transparency of its materials
kept          what need not be read again
visible       what a render shows; instances: what of it stands there through others; placed: where what is baked does
left_out      what of it no bake knows
node_values   nodes by NumPy: node_links follows links, node_math and blackbody compute, places and texels say where,
              shaders adds up what glows, image_texture and textures read images
"""
