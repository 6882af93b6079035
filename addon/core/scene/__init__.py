"""Receivers, lights, and the meshes between them."""
