"""Blender data as the plain dataclasses of core.

lights        all light of a scene: lamps, emitters (emissive meshes), world; light linking
geometry      occluders and polygons of evaluated objects; transparency of their materials
visibility    objects that a render shows, their instances, and objects that no bake knows
scene_cache   results of earlier reads
node_values   nodes by NumPy: node_links follows links, node_math and blackbody compute, places and texels say where,
              shaders adds up radiance, image_texture and textures read images
"""
