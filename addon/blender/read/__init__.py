"""Blender data as the plain dataclasses of core."""
