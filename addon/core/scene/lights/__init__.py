"""The kinds of light that can be baked; strengths follow Cycles (see each class)."""

from .field_light import DIRECTIONS, STRATA, WEIGHTS, Field, FieldLight
from .glowing import MeshLight, WorldLight
from .lamp_kinds import AreaLight, PointLight, SpotLight, SunLight
from .light_base import Light

__all__ = [
    "DIRECTIONS",
    "STRATA",
    "WEIGHTS",
    "AreaLight",
    "Field",
    "FieldLight",
    "Light",
    "MeshLight",
    "PointLight",
    "SpotLight",
    "SunLight",
    "WorldLight",
]
