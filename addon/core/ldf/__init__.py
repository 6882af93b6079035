"""Luminance distribution functions: simulated, cached, shipped, or from an artist's samples."""
