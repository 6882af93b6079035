"""The kinds of light that can be baked; strengths follow Cycles (see each class).

A new kind is one class here, and its reader in blender/read/.
"""

from .area import AreaLight
from .field import DIRECTIONS, STRATA, WEIGHTS, Field, FieldLight, LampFieldLight
from .light import ExtendedLight, Light, TracedLight
from .mesh import MeshLight
from .point_like import PointLight, SpotLight, SunLight
from .round import SphereLight, SphereSpotLight, SunDiskLight
from .world import WorldLight

__all__ = [
    "DIRECTIONS",
    "STRATA",
    "WEIGHTS",
    "AreaLight",
    "ExtendedLight",
    "Field",
    "FieldLight",
    "LampFieldLight",
    "Light",
    "MeshLight",
    "PointLight",
    "SphereLight",
    "SphereSpotLight",
    "SpotLight",
    "SunDiskLight",
    "SunLight",
    "TracedLight",
    "WorldLight",
]
