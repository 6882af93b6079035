"""What Cycles finds for a bake, in a process of its own on a copy of the scene, which stays as it is."""
