"""Blender data as the plain dataclasses of core.

lights        all light of a scene: lamps, emitters (emissive meshes), world_light; light linking
geometry      occluders and polygons of evaluated objects; transparency of their materials
base_color    colors that nodes give the texels of a receiver
visibility    objects that a render shows, their instances, and objects that no bake knows
scene_cache   results of earlier reads by data-block, their digests, and scene_changes; one handler notes changes
nodes         links and values of node trees: node_math computes, image_nodes look images up, shading adds up radiance
"""
