"""The kinds of light that can be baked; strengths follow Cycles (see each class).

A new kind is one class here, which extends the way in which it arrives (light.py), and its reader in blender/read/.
"""

from .area import AreaLight
from .field import DIRECTIONS, STRATA, WEIGHTS, Field, FieldLight, LampFieldLight
from .light import ExtendedLight, Light, TracedLight
from .mesh import MeshLight
from .point_like import PointLight, SpotLight, SunLight
from .round import WIDEST_SUN, SphereLight, SphereSpotLight, SunDiskLight
from .world import WorldLight

__all__ = [
    "DIRECTIONS",
    "STRATA",
    "WEIGHTS",
    "WIDEST_SUN",
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
