"""The kinds of light that can be baked; strengths follow Cycles (see each class)."""

from .field_light import DIRECTIONS, STRATA, WEIGHTS, Field, FieldLight
from .glowing import MeshLight, WorldLight
from .lamp_kinds import WIDEST_SUN, AreaLight, PointLight, SpotLight, SunLight
from .light_base import Light, TracedLight

__all__ = [
    "DIRECTIONS",
    "STRATA",
    "WEIGHTS",
    "WIDEST_SUN",
    "AreaLight",
    "Field",
    "FieldLight",
    "Light",
    "MeshLight",
    "PointLight",
    "SpotLight",
    "SunLight",
    "TracedLight",
    "WorldLight",
]
