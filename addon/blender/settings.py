"""Settings of a scene: `scene.beamspread`."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from ..core.bake.bake_settings import MAX_SAMPLES, OUTPUTS, BakeSettings
from ..core.bake.spread import side_for
from ..core.bake.surface import Surface
from . import compat, preferences
from .registration import all_or_nothing, classes


def _follows_size(settings) -> bool:
    return not settings.is_property_set("resolution")


def _follow_size(settings, value: bool) -> None:
    if value:
        settings.property_unset("resolution")
    else:
        settings.resolution = settings.resolution


class BeamspreadSettings(bpy.types.PropertyGroup):
    """How and where to bake."""

    resolution: IntProperty(
        name="Resolution",
        description="Set the longer side of new images, in pixels. Existing images keep their size: use Resize",
        default=1024,
        min=1,
        soft_min=64,
        soft_max=8192,
        max=65536,
        subtype="PIXEL",
    )
    use_size: BoolProperty(
        name="Resolution from Size",
        description="Choose the resolution of each new image by the size of its object, Texel Density, and how far "
        "the medium spreads light. A resolution that you set switches this off",
        get=_follows_size,
        set=_follow_size,
    )
    texel_density: FloatProperty(
        name="Texel Density",
        description="Set the pixels per meter of new images. Their longer side has 512 to 2048 pixels: up to 4096 "
        "where light spreads over short distances, and fewer on curved surfaces whose light is smooth",
        default=512.0,
        min=0.01,
        soft_min=16.0,
        soft_max=4096.0,
    )
    solver: EnumProperty(
        name="Solver",
        description="Choose how the scattering of light is computed. All methods agree within their tolerance",
        items=[
            ("fft", "FFT", "Takes seconds for any number of lights", 0),
            (
                "direct",
                "Direct",
                "Reference, very slow: minutes for 256 x 256 pixels under a lamp, days for 2048 x 2048",
                1,
            ),
            ("adaptive", "Adaptive", "Method of the paper (Manabe et al. 2012)", 2),
        ],
        default="fft",
    )
    quality: EnumProperty(
        name="Quality",
        description="Choose the quality of the material simulation, which runs once for each material",
        items=[
            ("preview", "Preview", "A few seconds for a new material; slightly noisy", 0),
            (
                "final",
                "Final",
                "1 to 2 minutes for a new material, with a quick preview meanwhile; built-in materials are instant",
                1,
            ),
        ],
        default="final",
    )
    distributions: EnumProperty(
        name="Distributions",
        description="Choose where light distributions (LDFs) come from. Samples are for research",
        items=[
            ("LIBRARY", "Library", "Simulated for each material, for all angles and albedos", 0),
            ("ANGULAR", "Angular", "Your own samples, interpolated by the method of Manabe et al. 2012", 1),
            (
                "ADAPTIVE",
                "Adaptive",
                "Your own samples, with interpolated logarithms: more accurate",
                2,
            ),
            ("PLANAR", "Planar", "Your own samples, blended linearly: for comparison", 3),
        ],
        default="LIBRARY",
    )
    sample_folder: StringProperty(
        name="LDF Samples",
        description="Choose a folder of EXR files with one LDF sample each. They replace anisotropy, index of "
        "refraction and thickness of all materials. Albedos and angles of light must lie between those of "
        "the samples",
        default="",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    samples: IntProperty(
        name="Samples",
        description="Set the number of rays for light and shadows. Twice the value takes four times as long and "
        "halves the noise; above 8, that of lights without a size alone",
        default=4,
        min=1,
        soft_max=16,
        max=MAX_SAMPLES,
    )
    margin: IntProperty(
        name="Margin",
        description="Extend the result past UV borders by so many pixels, as in Blender's Bake > Margin",
        default=16,
        min=0,
        soft_max=64,
        max=1024,
        subtype="PIXEL",
    )
    margin_type: EnumProperty(
        name="Margin Type",
        description="Choose what fills the margin",
        items=[
            ("EXTEND", "Extend", "The colors at the border of each UV island go on", 0),
            ("ADJACENT_FACES", "Adjacent Faces", "The colors of the face on the other side of the UV border go on", 1),
        ],
        default="EXTEND",
    )
    output: EnumProperty(
        name="Output",
        description="Choose what to bake. Irradiance and Direction go to extra images, named after the node's",
        items=[
            ("LUMINANCE", "Luminance", "Scattered light that leaves the surface, W/(m² sr): the node shows it", 0),
            (
                "IRRADIANCE",
                "Irradiance",
                "Light that arrives at the surface, W/m²: π times a white diffuse bake",
                1,
            ),
            (
                "DIRECTION",
                "Direction",
                "Mean direction in which the arriving light travels: right, up and out of the texture",
                2,
            ),
        ],
        default="LUMINANCE",
    )
    use_indirect: BoolProperty(
        name="Indirect Light",
        description="Include light that bounces from other objects",
        default=True,
    )
    output_dir: StringProperty(
        name="Folder",
        description="Choose the folder that Bake Animation, Bake to Files and batches write to",
        default="//beamspread/",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    image_storage: EnumProperty(
        name="Storage",
        description="Choose where new images are kept",
        items=[
            ("FILES", "Files", "OpenEXR files. In a scene that was never saved, images are packed", 0),
            ("PACKED", "Packed", "In the .blend file, which grows by 200 MB for 4096 x 4096 pixels", 1),
        ],
        default="FILES",
    )
    image_dir: StringProperty(
        name="Folder",
        description="Choose the folder for the files of new images",
        default="//textures/",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    image_name: StringProperty(
        name="Name",
        description="Name new images and their files. {object} and {material} are replaced by the names of both",
        default="{object}_{material}",
    )
    use_udim: BoolProperty(
        name="UDIM Tiles",
        description="Give new images a tile for each unit square of the UV map that an object uses, in files "
        "NAME.<UDIM>.exr. Off: an object whose UVs leave the image gets a UV map of its own",
        default=False,
    )
    use_view_transform: BoolProperty(
        name="View Transform",
        description="Give PNG files the view transform, exposure and look of Color Management, as in a render",
        default=False,
    )
    render_engine: EnumProperty(
        name="Render With",
        description="Choose the engine that renders images (F12) while the render engine is Beamspread",
        items=[
            ("CYCLES", "Cycles", "Path tracing; needs no OpenGL", 0),
            ("EEVEE", "EEVEE", "Faster; needs OpenGL", 1),
        ],
        default="CYCLES",
    )
    use_live: BoolProperty(
        name="Live",
        description="Preview the bake while you change lights, objects and materials. Nodes show a hidden image; "
        "their own image keeps the last bake. Switch off to see the last bake again",
        default=False,
    )
    format: EnumProperty(
        name="Format",
        description="Choose the file format of Bake Animation, Bake to Files and batches",
        items=[
            ("EXR", "OpenEXR", "Linear, 32-bit float, W/(m^2 sr)", 0),
            ("PNG", "PNG", "sRGB, 8 bits; values above 1 are clipped unless Fit Exposure scales them", 1),
            ("EXR_HALF", "OpenEXR Half", "Linear, 16-bit float, W/(m^2 sr): half the size, 3 digits", 2),
            ("PNG16", "PNG 16 Bit", "sRGB, 16 bits; values above 1 are clipped unless Fit Exposure scales them", 3),
            ("HDR", "Radiance HDR", "Linear, 8 bits and a shared exponent: 2 digits", 4),
        ],
        default="EXR",
    )
    use_frame_range: BoolProperty(
        name="Own Range",
        description="Choose the frames of Bake Animation, instead of those of the scene or of its preview range",
        default=False,
    )
    frame_first: IntProperty(name="First Frame", description="Set the first frame of Bake Animation", default=1, min=0)
    frame_last: IntProperty(name="Last", description="Set the last frame of Bake Animation", default=250, min=0)
    use_exposure: BoolProperty(
        name="Fit Exposure",
        description="Multiply the values of PNG files by the power of two that brings them to 1 or below. The file, "
        "the report and the material name the factor",
        default=False,
    )

    def side_for(self, length: float, surface: Surface, is_textured: bool, is_bent: bool = False) -> int:
        """Pixels along the longer side of a new image; arguments as of `spread.side_for`."""
        if not self.use_size:
            return self.resolution
        density = self.texel_density * self.id_data.unit_settings.scale_length
        return side_for(length, surface, density, is_textured, is_bent)

    def for_bake(
        self, solver: str | None = None, output: str | None = None, indirect: bool | None = None
    ) -> BakeSettings:
        """The settings as core needs them; arguments override the scene's."""
        return BakeSettings(
            solver=solver or self.solver,
            layer=OUTPUTS[output or self.output],
            indirect=self.use_indirect if indirect is None else indirect,
            samples=self.samples,
            threads=preferences.threads(),
            memory_limit=preferences.memory_limit(),
            margin=self.margin,
            margin_type=self.margin_type,
            quality=self.quality,
            distributions=self.distributions.lower(),
            sample_folder=bpy.path.abspath(self.sample_folder),
        )


def _add_to_scenes() -> None:
    bpy.types.Scene.beamspread = PointerProperty(type=BeamspreadSettings)


def _take_from_scenes() -> None:
    del bpy.types.Scene.beamspread


register, unregister = all_or_nothing(*classes(BeamspreadSettings), (_add_to_scenes, _take_from_scenes))
