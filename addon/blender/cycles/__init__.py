"""Light, colors and images by Cycles, computed in another process on a copy of the scene."""
