"""Digests of the scene that each bake has read, and their comparison with the present scene."""
