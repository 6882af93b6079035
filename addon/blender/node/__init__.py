"""The shader node."""
