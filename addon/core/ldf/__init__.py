"""Luminance distribution functions: simulated, cached, shipped or an artist's own."""
