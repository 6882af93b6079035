"""The kinds of light that can be baked; strengths follow Cycles (see each class)."""

from .field_light import DIRECTIONS, STRATA, WEIGHTS, BentField, Field, FieldLight
from .light_kinds import AreaLight, Light, MeshLight, PointLight, SpotLight, SunLight, WorldLight

__all__ = [
    "DIRECTIONS",
    "STRATA",
    "WEIGHTS",
    "AreaLight",
    "BentField",
    "Field",
    "FieldLight",
    "Light",
    "MeshLight",
    "PointLight",
    "SpotLight",
    "SunLight",
    "WorldLight",
]
