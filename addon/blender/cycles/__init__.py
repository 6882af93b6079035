"""What Cycles computes for a bake: in a process of its own, on a copy of the scene, so that the scene stays as it is."""
