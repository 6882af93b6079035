"""Settings of a scene: `scene.beamspread`."""

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from ..core.bake.bake_settings import OUTPUTS, BakeSettings
from . import compat, preferences
from .registration import all_or_nothing, classes


class BeamspreadSettings(bpy.types.PropertyGroup):
    """How and where to bake."""

    resolution: IntProperty(
        name="Resolution",
        description="Texels along the longer side of images that a bake makes. A node's own image keeps its size",
        default=1024,
        min=1,
        soft_min=64,
        soft_max=8192,
        max=65536,
        subtype="PIXEL",
    )
    solver: EnumProperty(
        name="Solver",
        description="How light is spread inside the medium. The result is the same but for each one's tolerance",
        items=[
            ("fft", "FFT", "Fast convolution: seconds for any number of lights", 0),
            (
                "direct",
                "Direct",
                "Adds up every beam at every texel. Under a lamp: minutes for 256 x 256 texels, days for 2048 x 2048",
                1,
            ),
            ("adaptive", "Adaptive", "Lights evenly lit squares by one beam each, as Manabe et al. 2012", 2),
        ],
        default="fft",
    )
    quality: EnumProperty(
        name="Quality",
        description="Of the light transport simulation, which is made once per material and then kept",
        items=[
            ("preview", "Preview", "Simulated in a few seconds; slightly noisy", 0),
            (
                "final",
                "Final",
                "Simulated in a minute or two, unless it comes with the add-on. A first look is shown meanwhile",
                1,
            ),
        ],
        default="final",
    )
    distributions: EnumProperty(
        name="Distributions",
        description="Where the luminance distribution functions come from",
        items=[
            ("LIBRARY", "Library", "Simulated for each material: every angle and albedo", 0),
            ("ANGULAR", "Samples, Angular", "Your own samples, interpolated as Manabe et al. 2012", 1),
            (
                "ADAPTIVE",
                "Samples, Adaptive",
                "Your own samples, their logarithms interpolated: more exact",
                2,
            ),
            ("PLANAR", "Samples, Planar", "Your own samples, blended in place: for comparison", 3),
        ],
        default="LIBRARY",
    )
    sample_folder: StringProperty(
        name="LDF Samples",
        description="Folder of EXR files, one LDF sample each. They replace anisotropy, index of refraction and "
        "thickness of all materials; albedos and angles of light must lie between theirs",
        default="",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    samples: IntProperty(
        name="Samples",
        description="Rays per texel, as the root of their number: 4 makes 16 to each lamp without a size, and up to "
        "1024 to all lamps with one, glowing meshes and the world together, as many as the medium needs; 8 makes four "
        "times as many",
        default=4,
        min=1,
        soft_max=16,
        max=64,
    )
    margin: IntProperty(
        name="Margin",
        description="Texels beyond the border of the UV map that continue the result, so that none unbaked shows",
        default=16,
        min=0,
        soft_max=64,
        max=1024,
        subtype="PIXEL",
    )
    output: EnumProperty(
        name="Bake",
        description="What the texels hold. All but luminance goes into images of its own, named after the node's",
        items=[
            ("LUMINANCE", "Luminance", "What leaves the surface, in W/(m² sr): the node shows it", 0),
            (
                "IRRADIANCE",
                "Irradiance",
                "What arrives on the surface, in W/m²: π times a white diffuse bake",
                1,
            ),
            ("DIRECTION", "Direction", "The mean way that arriving light goes: right, up and out of the texture", 2),
        ],
        default="LUMINANCE",
    )
    use_indirect: BoolProperty(
        name="Indirect Light",
        description="Light that arrives by way of other objects counts, too: Cycles finds it before each bake",
        default=True,
    )
    output_dir: StringProperty(
        name="Output",
        description="Folder that a batch writes to",
        default="//beamspread/",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    image_storage: EnumProperty(
        name="Storage",
        description="Where images are kept that a bake makes because a node has none",
        items=[
            ("FILES", "Files", "OpenEXR files; packed as long as the scene was never saved", 0),
            ("PACKED", "Packed", "In the .blend file, which grows: by 200 MB for 4096 x 4096 texels", 1),
        ],
        default="FILES",
    )
    image_dir: StringProperty(
        name="Folder",
        description="Where the files of new images go",
        default="//textures/",
        subtype="DIR_PATH",
        options=compat.PATH_OPTIONS,
    )
    image_name: StringProperty(
        name="Name",
        description="Of new images and their files: {object} and {material} stand for what they are called",
        default="{object}_{material}",
    )
    use_view_transform: BoolProperty(
        name="View Transform",
        description="PNG files look as a render would: with the view transform, exposure and look of Color Management",
        default=False,
    )
    render_engine: EnumProperty(
        name="Pictures By",
        description="What renders pictures (F12) while the render engine is Beamspread, with the baked images in them",
        items=[
            ("CYCLES", "Cycles", "Path traced, also where there is no OpenGL", 0),
            ("EEVEE", "EEVEE", "Faster; needs OpenGL", 1),
        ],
        default="CYCLES",
    )
    use_live: BoolProperty(
        name="Live",
        description="While lights, things in their way, and materials change, the images of Beamspread nodes follow in "
        "Material Preview and Rendered view: quickly, then as a bake without indirect light. These pixels are a "
        "preview that is neither packed nor saved, but renders show them: switched off, images have the pixels of "
        "their last bake again",
        default=False,
    )
    format: EnumProperty(
        name="Format",
        description="File format that a batch writes",
        items=[
            ("EXR", "OpenEXR", "Linear, 32-bit float, W/(m^2 sr)", 0),
            ("PNG", "PNG", "For looking at: values above 1 are clipped", 1),
        ],
        default="EXR",
    )

    def for_bake(
        self, solver: str | None = None, output: str | None = None, indirect: bool | None = None
    ) -> BakeSettings:
        """What core needs of them; arguments override the scene's."""
        return BakeSettings(
            solver=solver or self.solver,
            layers=(OUTPUTS[output or self.output],),
            indirect=self.use_indirect if indirect is None else indirect,
            samples=self.samples,
            threads=preferences.threads(),
            memory_limit=preferences.memory_limit(),
            margin=self.margin,
            quality=self.quality,
            distributions=self.distributions.lower(),
            sample_folder=bpy.path.abspath(self.sample_folder),
        )


def _add_to_scenes() -> None:
    bpy.types.Scene.beamspread = PointerProperty(type=BeamspreadSettings)


def _take_from_scenes() -> None:
    del bpy.types.Scene.beamspread


register, unregister = all_or_nothing(*classes(BeamspreadSettings), (_add_to_scenes, _take_from_scenes))
