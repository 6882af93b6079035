"""Reflection of materials for our own bounced light: a diffuse part, and one glossy lobe over it.

Closures that reflect are added up: the diffuse part may come from images, the lobe is the mean over them. Normal and
bump maps, anisotropy and the roughness of diffuse closures don't count. Closures of other kinds are left to Cycles.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core.bake.surface import Surface
from ...core.errors import MaterialError, MissingImageError, NotSupportedError
from ...core.native import native
from .. import compat
from .fresnel import dielectric_lobe, lobe_edge, lobe_energy, mean_fresnel, mean_layer_weight
from .image_nodes import Pixels, UVTransform, from_srgb, missing_images
from .nodes import InputSocket, Links, Source, converted, shows_bake, surface_of
from .scene_cache import SceneCache
from .transparency import PROBE, TexelEvaluator

# Largest side of an image of albedo, texels: light from a wall does not show more.
MAX_SIDE = 256

# Largest side at which images are converted from sRGB; of finer ones every second, third, ... texel counts.
MAX_READ_SIDE = 1024

# A lobe that is narrower than this roughness, and returns more of even light than this, is left to Cycles.
SHARP_ROUGHNESS, STRONG_LOBE = 0.2, 0.15

# Part of the light that may be transmitted or returned by sheen and still counts as none.
NEGLIGIBLE = 0.01

# Reflectance of a coat at normal incidence.
COAT = 0.04

# Channels of a reflection: diffuse albedo, without the light that a lobe over it takes; reflectance of lobes under even
# light; the mean of this times the roughness.
BELOW, LOBE, ROUGHNESS = slice(0, 3), slice(3, 6), slice(6, 7)
DARK = np.zeros((1, 1, 7))

# Color of images that no renderer can load, in Cycles.
MAGENTA = np.float32([[[1, 0, 1, 1]]])

# Albedo of a surface without a material in Cycles.
DEFAULT_ALBEDO = (0.8, 0.8, 0.8)


@dataclass(frozen=True, eq=False)
class MaterialReflection:
    """Reflection of a material.

    Attributes
    ----------
    reflector : a native `Reflector`; None for a black material, and where only Cycles can trace it.
    uv_transform : UV transform of the image of its albedo, or None.
    problem : sentence that says why only Cycles can trace it; "" if our own rays can.
    """

    reflector: object | None = None
    uv_transform: UVTransform | None = None
    problem: str = ""


Medium = tuple[Surface, InputSocket | None]
"""Medium of a material that is baked, and the input that a texture of its color is linked to, or None."""

MediumOf = Callable[[object], Medium | None]
"""Gives the medium of an original material; None for a material of another kind."""


@functools.lru_cache(256)
def diffuse(*albedo: float) -> MaterialReflection:
    """Reflection by Lambert's law, the same object for the same color."""
    if not any(albedo):
        return MaterialReflection()
    return MaterialReflection(native.Reflector(native.ColorTexture(albedo)))


def reflection_of(material, cache: SceneCache, medium_of: MediumOf, min_roughness: float) -> MaterialReflection:
    """Reflection of an evaluated material; None stands for Cycles' default.

    `min_roughness` is that of lobes after a diffuse bounce, see `compat.filtered_roughness`.
    """
    if material is None:
        return diffuse(*DEFAULT_ALBEDO)
    block = material.original
    medium = medium_of(block)
    if medium is None:
        images = cache.tree(material).images
        key, state = ("reflection", block), min_roughness
        return cache.get(key, [block], lambda: _read(material, min_roughness, cache.check), images, state)
    surface, texture = medium
    images = () if texture is None else cache.texture(block, texture).images
    key, state = ("reflection", block), (surface, texture is None)
    return cache.get(key, [block], lambda: _read_medium(surface, texture, cache.check), images, state)


def reflectance_of(surface: Surface) -> tuple[float, ...]:
    """Albedo of a medium as a surface; black if its values are out of range."""
    try:
        return tuple(surface.reflectance())
    except MaterialError:  # of another object, whose own bake reports it
        return 0.0, 0.0, 0.0


def _read_medium(surface: Surface, texture: InputSocket | None, check) -> MaterialReflection:
    if texture is None or missing_images(Links(), texture):
        return diffuse(*reflectance_of(surface))

    def color(evaluator: ReflectionEvaluator) -> np.ndarray:
        value = converted(evaluator.value(texture), texture.socket.type, "RGBA")
        return value[None, None] if value.ndim == 1 else value

    try:
        texels, transform, outside = _texels(color, check)
    except NotSupportedError as error:
        return MaterialReflection(problem=error.text)
    return _reflection(texels, outside, np.zeros(3), 1.0, transform)


def _read(material, min_roughness: float, check) -> MaterialReflection:
    if not compat.uses_nodes(material):
        return diffuse(*np.clip(material.diffuse_color[:3], 0, 1).tolist())
    surface = surface_of(material.node_tree)
    if surface is None:
        return MaterialReflection()
    if surface.socket.node.inputs["Volume"].is_linked:
        return MaterialReflection(problem="It has a volume.")
    try:
        texels, transform, outside = _texels(lambda evaluator: evaluator.value(surface), check)
        lobe = texels[..., LOBE].mean(axis=(0, 1))
        roughness = float(np.clip(texels[..., ROUGHNESS].mean() / max(lobe.mean(), 1e-30), 0, 1))
        if max(roughness, min_roughness) < SHARP_ROUGHNESS and lobe.mean() > STRONG_LOBE:
            return MaterialReflection(problem="Its reflection is too sharp for them.")
    except NotSupportedError as error:
        return MaterialReflection(problem=error.text)
    f0 = _f0(lobe, roughness)
    albedos = (values[..., BELOW] if f0.any() else values[..., BELOW] + lobe for values in (texels, outside))
    return _reflection(*albedos, f0, max(roughness, min_roughness), transform)


def _f0(lobe: np.ndarray, roughness: float) -> np.ndarray:
    """Reflectance of a lobe at normal incidence; 0 if it is so weak that it counts as diffuse."""
    even, edge = lobe_energy(roughness), lobe_edge(roughness)
    return np.clip((lobe - edge) / (even - edge), 0, 1) if lobe.min() >= edge else np.zeros(3)


def _reflection(
    texels: np.ndarray,
    outside: np.ndarray,
    f0: np.ndarray,
    roughness: float,
    transform: UVTransform | None,
) -> MaterialReflection:
    """The reflection for an albedo (H, W, 3), 0 to 1, with that of a clipped image beyond its border."""
    texels = np.ascontiguousarray(np.clip(np.nan_to_num(texels), 0, 1), np.float32)
    if (texels == texels[:1, :1]).all() and (transform is None or transform.extension != "clip"):
        color = texels[0, 0].tolist()
        if not f0.any():
            return diffuse(*color)
        albedo, transform = native.ColorTexture(color), None
    else:
        beyond = np.broadcast_to(np.clip(np.nan_to_num(outside), 0, 1)[0, 0], 3).tolist()
        albedo = native.ColorTexture.from_image(texels, transform.extension, transform.is_smooth, beyond)
    reflector = native.Reflector(albedo, f0.tolist(), roughness, is_layered=False)
    return MaterialReflection(reflector, transform)


def _texels(value: Callable, check) -> tuple[np.ndarray, UVTransform | None, np.ndarray]:
    """A value at the texels of the largest image, (H, W, channels); the UV transform; the value beyond the images."""
    pixels, links = _CoarsePixels(), Links()
    probe = ReflectionEvaluator(pixels, PROBE, links=links, check=check)
    even = value(probe)
    if probe.transform is None:
        return even, None, even
    texels = value(ReflectionEvaluator(pixels, probe.largest, links=links, check=check))
    return texels, probe.transform, value(ReflectionEvaluator(pixels, is_outside=True, links=links))


class _CoarsePixels(Pixels):
    """Pixels with at most `MAX_SIDE` texels along a side, means of linear color; magenta for a missing image."""

    def __call__(self, node) -> np.ndarray:
        try:
            return super().__call__(node)
        except MissingImageError:
            return MAGENTA

    @staticmethod
    def _read(image) -> np.ndarray:
        values = Pixels._read(image)
        step = -(-max(values.shape[:2]) // MAX_READ_SIDE)
        values = values[::step, ::step]
        if max(values.shape[:2]) <= MAX_SIDE:
            return values
        name = image.colorspace_settings.name
        is_encoded = not (image.is_float or image.colorspace_settings.is_data or name.startswith("Linear"))
        color = from_srgb(values[..., :3]) if is_encoded else values[..., :3]
        values = np.concatenate([color, values[..., 3:]], axis=2)
        for axis in (0, 1):
            edges = np.linspace(0, values.shape[axis], min(values.shape[axis], MAX_SIDE), endpoint=False).astype(int)
            counts = np.diff([*edges, values.shape[axis]]).reshape((-1, 1, 1) if axis == 0 else (1, -1, 1))
            values = np.add.reduceat(values, edges, axis) / counts
        if is_encoded:
            values[..., :3] = _to_srgb(values[..., :3])
        return values.astype(np.float32)


def _to_srgb(linear: np.ndarray) -> np.ndarray:
    """The inverse of `from_srgb`."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)


class ReflectionEvaluator(TexelEvaluator):
    """Evaluates nodes at the texels of images; the quantity of a shader is its reflection, see `BELOW`."""

    NO_SHADER = DARK

    def own_value(self, source: Source) -> np.ndarray | None:
        kind = source.node.bl_idname
        if kind == "ShaderNodeFresnel":
            return mean_fresnel(self.value(source.input("IOR")))
        if kind == "ShaderNodeLayerWeight":
            return mean_layer_weight(self.value(source.input("Blend")), source.socket.name)
        return super().own_value(source)

    def shader(self, source: Source) -> np.ndarray:
        node = source.node
        if source.socket.type != "SHADER" or node.bl_idname in NOT_REFLECTING:
            return DARK
        if node.bl_idname in ("ShaderNodeAddShader", "ShaderNodeMixShader") and not shows_bake(node):
            return super().shader(source)
        closure = CLOSURES.get(node.bl_idname)
        if closure is None:
            raise NotSupportedError("node", node.name)
        return closure(self, source)

    def color(self, source: Source, *names: str) -> np.ndarray:
        """Color (H, W, 3) of the first input of these names that the node has, 0 to 1."""
        return np.clip(self._of_type(_input(source, *names), "RGBA"), 0, 1)

    def number(self, source: Source, *names: str) -> np.ndarray:
        """The same of a number, (H, W, 1)."""
        return np.clip(self._of_type(_input(source, *names), "VALUE"), 0, 1)

    def _mix(self, source: Source) -> np.ndarray:
        factor = np.clip(self._of_type(source.input(0), "VALUE"), 0, 1)
        # A shader of weight 0 need not be understood.
        first = DARK if (factor == 1).all() else self.value(source.input(1))
        second = DARK if not factor.any() else self.value(source.input(2))
        return (1 - factor) * first + factor * second

    def _light_path(self, source: Source) -> np.ndarray:
        """Light Path, which answers for rays that left a diffuse surface."""
        name = source.socket.name
        if not name.startswith("Is ") or name == "Is Shadow Ray":
            raise NotSupportedError("node", source.node.name, f"its output '{name}' is used")
        return np.array([float(name in ("Is Diffuse Ray", "Is Reflection Ray"))])


def _input(source: Source, *names: str) -> InputSocket:
    return source.input(next(name for name in names if name in source.node.inputs))


def _together(below, lobe=0.0, roughness=0.0) -> np.ndarray:
    """The channels of a reflection, from arrays (H, W, 3), or (H, W, 1) for the roughness times the mean lobe."""
    parts = [np.asarray(part, float) for part in (below, lobe, roughness)]
    shape = np.broadcast_shapes((1, 1, 1), *(part.shape[:2] + (1,) for part in parts if part.ndim == 3))[:2]
    sizes = 3, 3, 1
    return np.concatenate([np.broadcast_to(part, (*shape, size)) for part, size in zip(parts, sizes)], axis=2)


def _diffuse(evaluator: ReflectionEvaluator, source: Source) -> np.ndarray:
    return _together(evaluator.color(source, "Color"))


def _glossy(evaluator: ReflectionEvaluator, source: Source) -> np.ndarray:
    color, roughness = evaluator.color(source, "Color"), evaluator.number(source, "Roughness")
    if getattr(source.node, "distribution", "") == "SHARP":  # up to Blender 3.6
        roughness = np.zeros((1, 1, 1))
    color = color * lobe_energy(roughness) * _makes_up(source, color, roughness)
    return _together(0, color, roughness * color.mean(axis=2, keepdims=True))


def _makes_up(source: Source, color: np.ndarray, roughness: np.ndarray) -> np.ndarray | float:
    """Factor by which some lobes make up for light that is lost between facets (Kulla and Conty 2017)."""
    is_made_up = getattr(source.node, "distribution", "") == "MULTI_GGX"
    return 1 + color * (1 / lobe_energy(roughness) - 1) if is_made_up else 1.0


def _principled(evaluator: ReflectionEvaluator, source: Source) -> np.ndarray:
    """Principled BSDF: Disney's of 2012 up to Blender 3.6, and layers of closures since."""
    color, roughness = evaluator.color(source, "Base Color"), evaluator.number(source, "Roughness")
    metallic = evaluator.number(source, "Metallic")
    dielectric = 1 - metallic
    if (dielectric * evaluator.number(source, "Transmission Weight", "Transmission")).mean() > NEGLIGIBLE:
        raise NotSupportedError("node", source.node.name, "it transmits light")
    if evaluator.number(source, "Sheen Weight", "Sheen").mean() > NEGLIGIBLE:
        raise NotSupportedError("node", source.node.name, "it has sheen")
    coat, coat_roughness = evaluator.number(source, "Coat Weight", "Clearcoat"), np.zeros((1, 1, 1))
    if coat.any():
        coat_roughness = evaluator.number(source, "Coat Roughness", "Clearcoat Roughness")
        coat = coat * dielectric_lobe(COAT, coat_roughness)
    if compat.principled_has_layers():
        f0 = _dielectric_f0(evaluator, source)
        base, coat_part, tint = color * dielectric, 1.0, evaluator.color(source, "Specular Tint")
    else:
        subsurface = evaluator.number(source, "Subsurface")
        inner = color if not subsurface.any() else evaluator.color(source, "Subsurface Color")
        base = ((1 - subsurface) * color + subsurface * inner) * dielectric * _disney_albedo(roughness)
        f0 = 0.08 * evaluator.number(source, "Specular")
        coat_part, tint = 0.25, _tint(evaluator, source, color)
    over = dielectric_lobe(f0 * tint, roughness) * (f0 > 0)
    even, edge = lobe_energy(roughness), lobe_edge(roughness)
    metal = (color * (even - edge) + edge) * _makes_up(source, color, roughness)
    coat = coat_part * coat
    around = 1 - coat if compat.principled_has_layers() else 1.0
    lobe, below = (dielectric * over + metallic * metal) * around, base * around
    weighted = roughness * lobe.mean(axis=2, keepdims=True) + coat_roughness * coat
    lobe = lobe + coat
    taken = 1 - over.max(axis=2, keepdims=True) if compat.principled_has_layers() else 1.0
    alpha = evaluator.number(source, "Alpha")
    return alpha * _together(below * taken, lobe, weighted)


def _dielectric_f0(evaluator: ReflectionEvaluator, source: Source) -> np.ndarray:
    """Reflectance at normal incidence, as the level of specular changes it, (H, W, 1)."""
    ior = np.maximum(evaluator._of_type(source.input("IOR"), "VALUE"), 1e-5)
    return np.clip(((ior - 1) / (ior + 1)) ** 2 * 2 * evaluator.number(source, "Specular IOR Level"), 0, 1)


def _tint(evaluator: ReflectionEvaluator, source: Source, color: np.ndarray) -> np.ndarray:
    """Color of specular light up to Blender 3.6: white, or the hue of the base color."""
    tint = evaluator.number(source, "Specular Tint")
    luminance = converted(color, "RGBA", "VALUE")
    hue = np.where(luminance > 0, color / np.maximum(luminance, 1e-30), 1.0)
    return 1 + tint * (hue - 1)


def _disney_albedo(roughness: np.ndarray) -> np.ndarray:
    """Reflectance under even light of the diffuse closure of Burley (2012), with its retro-reflection, over its color.

    Integral over both hemispheres of (1 - F/2)(1 - F'/2) + R (F + F' + F F' (R - 1)), R = r (1 + l.v), F = (1 - c)^5.
    """
    return 0.9529 + 0.1087 * roughness + 0.0035 * roughness**2


CLOSURES = {
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeSubsurfaceScattering": _diffuse,
    "ShaderNodeBsdfGlossy": _glossy,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfPrincipled": _principled,
}
"""Functions of the evaluator and the node, by type."""

NOT_REFLECTING = {
    f"ShaderNode{name}" for name in ("Emission", "Background", "BsdfTransparent", "Holdout", "VolumeAbsorption")
}
"""Shaders that return no light."""
