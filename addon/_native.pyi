"""
Light transport of beamspread; import the package `beamspread` instead.
"""

from __future__ import annotations
import numpy
import os
import typing

__all__: list[str] = [
    "AngularSpace",
    "AreaLight",
    "Cancelled",
    "EnvironmentLight",
    "ExtendedLight",
    "LdfLibrary",
    "LdfSample",
    "LdfSource",
    "Light",
    "LightField",
    "Medium",
    "MemoryLimit",
    "MeshLight",
    "OccluderMesh",
    "Occluders",
    "PlaneLight",
    "PointLight",
    "ReceiverGrid",
    "SampleSource",
    "SphereLight",
    "SphereSpotLight",
    "SpotLight",
    "SunDiskLight",
    "SunLight",
    "Transmittance",
    "adaptive_beams",
    "complex_lines",
    "convolve",
    "coverage",
    "embree_version",
    "exact_totals",
    "fast_size",
    "fft_instruction_sets",
    "fresnel",
    "gather_beams",
    "gather_rays",
    "half_lines",
    "henyey_greenstein_pdf",
    "henyey_greenstein_sample",
    "interpolate",
    "ray_layers",
    "read_exr",
    "real_lines",
    "real_transform",
    "simulate",
    "transforms",
    "walk_kernels",
    "write_exr",
]

class Cancelled(Exception):
    """
    A progress callback returned False.
    """

class MemoryLimit(MemoryError):
    """
    More memory would be taken than allowed.
    """

class Medium:
    """
    A homogeneous, plane-parallel, dimensionless medium.

    Parameters
    ----------
    g : float
        Henyey-Greenstein anisotropy, -0.99 to 0.99.
    ior : float
        Refractive index inside over outside, 1 to 3.
    thickness : float
        In mean free paths, > 0; ``inf`` is a half-space.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """
    def __eq__(self, arg0: Medium) -> bool: ...
    def __getstate__(self) -> tuple: ...
    def __hash__(self) -> int: ...
    def __init__(self, g: float = 0.8, ior: float = 1.0, thickness: float = ...) -> None: ...
    def __repr__(self) -> str: ...
    def __setstate__(self, arg0: tuple) -> None: ...
    @property
    def g(self) -> float: ...
    @property
    def ior(self) -> float: ...
    @property
    def thickness(self) -> float: ...

class LdfSource:
    """
    What `convolve` takes LDFs from.
    """

class LdfLibrary(LdfSource):
    """
    Luminance distribution functions of one medium.

    Made by `simulate`, `library` or `LdfLibrary.load`. Angles are in degrees from the surface normal,
    within the simulated ones (a library that reaches 88 degrees serves up to 90); albedos in [0, 1).
    """
    @staticmethod
    def load(path: os.PathLike) -> LdfLibrary:
        """
        Read a library from an OpenEXR file; OSError if it is missing, damaged or something else.
        """
    def __repr__(self) -> str: ...
    def calibrated(self, threads: int = 0) -> LdfLibrary:
        """
        A copy whose totals are those of `exact_totals`.

        The light of each scattering order, with the distribution it was simulated with, is scaled: by as little as makes the
        totals right at 16 albedos from .01 to .99999, least squares weighted by statistical variance. Albedos in between, and
        the totals of every map, follow. `standard_error` then includes what `exact_totals` and the interpolation between angles
        leave; `image_standard_error` stays that of the simulation, an upper bound. Measured over twelve media: totals of 100
        photons are within 3 % of the incident power, of 1000 within .5 %; for albedos beyond .99999 they may be 1.5 % too
        large.

        Parameters
        ----------
        threads : int
            0: all. The result does not depend on it.

        Returns
        -------
        LdfLibrary

        Raises
        ------
        ValueError
            The library was simulated with fewer than 100 photons per angle.
        """
    def diffuse_reflectance(self, albedo: float) -> float:
        """
        Reflectance under uniform diffuse light; needs a library from 0 to at least 88 degrees.
        """
    def image(
        self, angle: float, albedo: float, size: int, pitch: float, side: str = "reflected", beam_diameter: float = 0.0
    ) -> numpy.ndarray:
        """
        The LDF as texel means.

        Parameters
        ----------
        angle, albedo : float
        size : int
            Texels along each side, 1 to 16384.
        pitch : float
            Side of a texel, mean free paths, 1e-6 to 1e18; at least 1e-4 for a beam with a diameter.
        side : {"reflected", "transmitted"}
        beam_diameter : float
            Of the disk around O that the beam evenly lights on the surface, mean free paths, up to 1e6 and 1e4 texels; 0: a
            pencil beam.

        Returns
        -------
        float32, shape (size, size)
            1/mfp^2; rows v, columns u, O at the centre, +u (the beam's direction of travel) to the right.
            The few texels where azimuthal harmonics undershoot may be slightly negative.

        Raises
        ------
        ValueError
            Names the argument, its value and what is allowed.
        """
    def image_standard_error(
        self, angle: float, albedo: float, size: int, pitch: float, side: str = "reflected", beam_diameter: float = 0.0
    ) -> numpy.ndarray:
        """
        Statistical standard error of every texel of `image`.

        From the scatter between eight groups of the simulation's photons, hence with a relative error of about a quarter of its
        own (less between simulated angles, where several simulations add up). Parameters, units and errors as for `image`.

        Returns
        -------
        float32, shape (size, size)
            1/mfp^2; 0 where no photon came near.
        """
    def reflectance(self, angle: float, albedo: float) -> float:
        """
        Diffuse reflectance: power that leaves per unit incident power, specular reflection excluded.
        """
    def save(self, path: os.PathLike) -> None:
        """
        Write a multi-part OpenEXR file; an existing file is replaced only by a complete one.
        """
    def standard_error(self, angle: float, albedo: float, side: str = "reflected") -> float:
        """
        Standard error of `reflectance` or `transmittance`.

        From the scatter of 32 independent batches; it does not know what interpolation between far angles misses. That of a
        calibrated library does: the error halfway between simulated angles is known from `exact_totals`.
        """
    def transmittance(self, angle: float, albedo: float) -> float:
        """
        Power that leaves the far side per unit incident power, the unscattered beam included.
        """
    @property
    def angles(self) -> list[float]:
        """
        Simulated angles, degrees, ascending.
        """
    @property
    def is_calibrated(self) -> bool:
        """
        Whether `calibrated` made it.
        """
    @property
    def medium(self) -> Medium: ...
    @property
    def photons(self) -> int:
        """
        Photons per angle.
        """
    @property
    def seed(self) -> int: ...

class LdfSample:
    """
    One LDF as an image.

    Parameters
    ----------
    image : array_like, float32, shape (N, M)
        Mean exitance of each texel per unit incident power, 1/mfp^2 (the paper's luminance, times pi); rows v upward,
        columns u; O, where the beam's axis enters, at the centre; the beam travels toward +u, to the right.
        Undershoots of up to 10 % of the brightest texel are taken for noise, other negative values are refused; so is a
        power, the integral, that is negative or larger than 1.05: no medium returns more than arrives, and 5 % is what a
        simulation of a thousand photons may be off.
    pitch : float
        Side of a texel, mean free paths, 1e-6 to 1e18.
    angle : float
        Of incidence, degrees from the surface normal, [0, 90).
    albedo : float
        [0, 1).
    beam_diameter : float
        Of the evenly lit disk on the surface, mean free paths; 0: a pencil beam.
    g : float, optional
        Anisotropy of the medium.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """
    @staticmethod
    def from_library(
        library: LdfLibrary,
        angle: float,
        albedo: float,
        size: int,
        pitch: float,
        beam_diameter: float = 0.0,
        side: str = "reflected",
    ) -> LdfSample:
        """
        The sample whose image is `library.image(angle, albedo, size, pitch, side, beam_diameter)`.
        """
    @staticmethod
    def load(path: os.PathLike) -> LdfSample:
        """
        Read a sample from an OpenEXR file, ours or another program's.

        The file has one part with the channel Y (or one channel alone) and the attributes, numbers of type float, double or
        int, ``pitch`` (mean free paths), ``angle`` (degrees), ``albedo``, and where known ``beamDiameter`` (mean free paths)
        and ``g``. Its first line is that of the largest v.

        Raises
        ------
        OSError
            The file is missing or damaged; or it lacks, or has a wrong, attribute, channel or value, which the message names.
        """
    def __init__(
        self,
        image: typing.Any,
        pitch: float,
        angle: float,
        albedo: float,
        beam_diameter: float = 0.0,
        g: float | None = None,
    ) -> None: ...
    def __repr__(self) -> str: ...
    def save(self, path: os.PathLike) -> None:
        """
        Write an OpenEXR file that `load` reads; an existing file is replaced only by a complete one.
        """
    @property
    def albedo(self) -> float: ...
    @property
    def angle(self) -> float: ...
    @property
    def beam_diameter(self) -> float: ...
    @property
    def brightest(self) -> tuple:
        """
        H, the brightest point, (u, v) in mean free paths.

        On v = 0, as an LDF is even in v. The image is smoothed as little as brings its noise, the part odd in v, below 1 % of
        the peak; H is the vertex of a paraboloid fitted to what is within 5 % of the peak. A peak next to O that the texels
        don't resolve, such as a pencil beam's, is at O.
        """
    @property
    def g(self) -> float | None: ...
    @property
    def image(self) -> numpy.ndarray:
        """
        float32, shape (N, M), read-only.
        """
    @property
    def pitch(self) -> float: ...
    @property
    def power(self) -> float:
        """
        Power that leaves within the image, per unit incident power.
        """

class AngularSpace:
    """
    The angular space of Manabe et al. 2012 (Sec. 3.2, Fig. 3).

    Places P of the plane as seen from the reference point Q at `height` above the brightest point H: psi in [0, pi/2)
    is the angle at Q between the normal and the direction to P, phi in [0, 2 pi) the azimuth of P around H from the
    beam's direction of travel, +u: ``P = H + height tan(psi) (cos phi, sin phi)``. The paper's text takes for phi the angle
    at P between the directions to O and H, which is 0 everywhere at normal incidence; its Fig. 4 shows the azimuth. The
    maps therefore depend on H and the height alone.

    Parameters
    ----------
    origin : (float, float)
        O, where the beam enters, (u, v) in any unit of length.
    brightest : (float, float)
        H, in the same unit.
    height : float
        Of Q, in the same unit; > 0.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """
    def __init__(self, origin: typing.Sequence[float], brightest: typing.Sequence[float], height: float) -> None: ...
    def __repr__(self) -> str: ...
    def to_angular(self, u: typing.Any, v: typing.Any) -> tuple:
        """
        (phi, psi) of places (u, v), elementwise for arrays; phi is 0 at H.
        """
    def to_planar(self, phi: typing.Any, psi: typing.Any) -> tuple:
        """
        (u, v) of directions, elementwise for arrays; any phi, psi in [0, pi/2).
        """
    @property
    def brightest(self) -> tuple: ...
    @property
    def height(self) -> float: ...
    @property
    def origin(self) -> tuple: ...

class SampleSource(LdfSource):
    """
    LdfSamples of one medium as `convolve` takes them, interpolated by a method of `interpolate`.
    """
    def __init__(self, samples: list[LdfSample], method: str = "angular") -> None: ...

class Transmittance:
    """
    What a surface lets through of the light that crosses it.

    Parameters
    ----------
    color : 3 floats
        0 to 1 in each channel.
    """
    @staticmethod
    def from_image(
        texels: numpy.ndarray,
        extension: str = "repeat",
        is_smooth: bool = True,
        outside: numpy.ndarray = (1.0, 1.0, 1.0),
    ) -> Transmittance:
        """
        From an image that is looked up by the triangles' UVs.

        Parameters
        ----------
        texels : ndarray, float32, shape (H, W, 1) or (H, W, 3), C-contiguous
            0 to 1; row 0 at v = 0. Kept in 16 bits.
        extension : str
            Beyond the border: 'repeat', 'extend', 'clip', 'mirror'.
        is_smooth : bool
            Bilinear, else that of the nearest texel.
        outside : 3 floats
            Beyond the border of a clipped image.

        Raises
        ------
        ValueError
            Wrong dtype or shape, a value outside 0 to 1.
        """
    def __init__(self, color: numpy.ndarray) -> None: ...
    @property
    def is_clear(self) -> bool:
        """
        bool: everything gets through everywhere.
        """
    @property
    def is_colored(self) -> bool:
        """
        bool: channels differ somewhere.
        """
    @property
    def is_opaque(self) -> bool:
        """
        bool: nothing gets through anywhere.
        """

class OccluderMesh:
    """
    A mesh, the places where it stands, and what its triangles let through.

    Parameters
    ----------
    vertices : ndarray, float64, shape (N, 3), C-contiguous
        Metres in the mesh's frame. As all arrays, it must not change before occluders are made of it.
    triangles : ndarray, uint32, shape (M, 3), C-contiguous
        Vertex indices.
    placements : ndarray, float64, shape (K, 12), C-contiguous, optional
        Rows of 3 x 4 matrices from the mesh's frame to the world; None: it stands there as it is.
    transmittances : list of Transmittance
        By material.
    materials : ndarray, uint32, shape (M, 1), C-contiguous, optional
        Of each triangle the index of its material; None: all are opaque.
    uvs : ndarray, float32, shape (M, 6), C-contiguous, optional
        (u, v) of each triangle's corners; None: all are (0, 0).

    Raises
    ------
    ValueError
        Wrong dtype or shape.
    """
    def __init__(
        self,
        vertices: numpy.ndarray,
        triangles: numpy.ndarray,
        placements: numpy.ndarray | None = None,
        transmittances: list[Transmittance] = [],
        materials: numpy.ndarray | None = None,
        uvs: numpy.ndarray | None = None,
    ) -> None: ...

class Occluders:
    """
    Triangles of meshes that block light, or a part of it, on both sides.

    Parameters
    ----------
    meshes : list of OccluderMesh
        None at all is allowed: nothing is blocked.
    origin : 3 floats
        World position near the receivers, metres: rays are traced in single precision relative to it.
    most_crossings : int, optional
        A ray that has crossed so many see-through triangles ends at the next.
    most_copied : int
        Where there are more triangles than this, counting those of each placement, the placements of a mesh share its
        triangles.

    Raises
    ------
    ValueError
        A number that is not finite, an index that is out of range.
    """
    def __init__(
        self,
        meshes: list[OccluderMesh],
        origin: numpy.ndarray = (0.0, 0.0, 0.0),
        most_crossings: int | None = None,
        most_copied: int = 1048576,
    ) -> None: ...
    @property
    def instance_count(self) -> int:
        """
        int: placements that share their mesh's triangles.
        """
    @property
    def is_colored(self) -> bool:
        """
        bool: some let more of one channel through than of another.
        """
    @property
    def is_opaque(self) -> bool:
        """
        bool: all triangles block all light.
        """
    @property
    def triangle_count(self) -> int:
        """
        int: number of triangles, those of each placement counted.
        """

class ReceiverGrid:
    """
    The plane that receives light, divided into texels.

    Parameters
    ----------
    origin : 3 floats
        World position, in metres, of the outer corner of texel (0, 0).
    x_axis, y_axis, normal : 3 floats each
        Unit vectors at right angles in the world: along a row of texels, from row to row, and out of the lit side. They may
        be left-handed (a mirrored texture).
    pitch_x, pitch_y : float
        Size of a texel in metres.
    width, height : int
        Texels, 1 to 65536.

    Raises
    ------
    ValueError
        An argument is out of range; the message names it.
    """
    def __init__(
        self,
        origin: numpy.ndarray,
        x_axis: numpy.ndarray,
        y_axis: numpy.ndarray,
        normal: numpy.ndarray,
        pitch_x: float,
        pitch_y: float,
        width: int,
        height: int,
    ) -> None: ...

class Light:
    """
    A light of strength 1 without colour; its kinds are SunLight, PointLight, SpotLight.

    Each raises ValueError for an argument that is out of range, with a message that names it.
    """
    def position_in(self, grid: ReceiverGrid) -> tuple | None:
        """
        Where all of the light comes from.

        Parameters
        ----------
        grid : ReceiverGrid

        Returns
        -------
        tuple of 3 floats or None
            Metres along the grid's x_axis, y_axis and normal from the outer corner of texel (0, 0); None: a light infinitely
            far away.
        """

class SunLight(Light):
    """
    Parallel light of 1 W/m^2 at normal incidence.

    Parameters
    ----------
    direction : 3 floats
        Of travel in the world, any length but 0.
    """
    def __init__(self, direction: numpy.ndarray) -> None: ...

class PointLight(Light):
    """
    A point lamp of 1 W.

    Parameters
    ----------
    position : 3 floats
        In the world, metres.
    """
    def __init__(self, position: numpy.ndarray) -> None: ...

class SpotLight(Light):
    """
    A spot lamp of 1 W over the whole sphere, as Blender counts it.

    Parameters
    ----------
    position : 3 floats
        In the world, metres.
    frame : (3, 3) floats
        Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
        along -z.
    spot_size : float
        Full angle of the cone in radians, 0 < spot_size <= pi.
    blend : float
        Soft part of the cone, 0 to 1.
    falloff : str
        "scaled": as Cycles in Blender 4.2, 4.5 and 5.0, where the lamp's scale shapes the cone. "legacy": as in 3.4, where
        it does not, and light falls off with the cosine to the axis besides.
    """
    def __init__(
        self, position: numpy.ndarray, frame: numpy.ndarray, spot_size: float, blend: float, falloff: str = "scaled"
    ) -> None: ...

class ExtendedLight:
    """
    A light of a size; its kinds are SunDiskLight, SphereLight,
    SphereSpotLight, AreaLight, EnvironmentLight and MeshLight. Each raises ValueError for an argument that is out of range,
    with a message that names it.
    """
    def irradiance(self, point: numpy.ndarray, normal: numpy.ndarray) -> tuple:
        """
        What reaches a point with nothing in between.

        Parameters
        ----------
        point : 3 floats
            In the world, metres.
        normal : 3 floats
            Unit vector out of the lit side of the plane there.

        Returns
        -------
        tuple of 3 floats
            W/m^2 in each channel.
        """
    def sample(self, point: numpy.ndarray, normal: numpy.ndarray, square: numpy.ndarray) -> tuple:
        """
        Rays from a point towards the light.

        Parameters
        ----------
        point, normal
            Those of `irradiance`.
        square : ndarray, float64, shape (N, 2), C-contiguous
            Places in the unit square; even ones give the density of rays that `flux` stands for.

        Returns
        -------
        travel : ndarray, float64, shape (N, 3)
            Unit vectors along which the light travels, world.
        distance : ndarray, float64, shape (N,)
            To the light, metres.
        flux : ndarray, float32, shape (N, 3)
            W/m^2 on a square metre that faces the ray, over the density of rays: the mean of flux times cosine to the normal is
            the irradiance.
        """
    @property
    def is_colored(self) -> bool:
        """
        bool: whether its rays differ in colour.
        """

class SunDiskLight(ExtendedLight):
    """
    Light of 1 W/m^2 from a disk infinitely far away.

    Parameters
    ----------
    direction : 3 floats
        Of travel in the world from the disk's centre, any length but 0.
    angle : float
        Full angle of the disk in radians, 0 to pi.
    disk : str
        "even": of even radiance, and 1 W/m^2 at normal incidence, as Cycles in Blender 4.5. "flat": each part of a flat
        disk gives the same flux, as in 3.4; E at normal incidence is smaller, by 1.7 % for an angle of 30 degrees.
    """
    def __init__(self, direction: numpy.ndarray, angle: float, disk: str = "even") -> None: ...

class SphereLight(ExtendedLight):
    """
    A point lamp of 1 W with a radius.

    Parameters
    ----------
    position : 3 floats
        Of its centre in the world, metres.
    radius : float
        In metres, 0 or more.
    model : str
        "sphere"; or "disk", which faces each point that it lights.
    """
    def __init__(self, position: numpy.ndarray, radius: float, model: str) -> None: ...

class SphereSpotLight(ExtendedLight):
    """
    A spot lamp of 1 W with a radius.

    Parameters
    ----------
    position, frame, spot_size, blend, falloff
        Those of `SpotLight`.
    radius, model
        Those of `SphereLight`.
    """
    def __init__(
        self,
        position: numpy.ndarray,
        frame: numpy.ndarray,
        spot_size: float,
        blend: float,
        falloff: str,
        radius: float,
        model: str,
    ) -> None: ...

class AreaLight(ExtendedLight):
    """
    An area lamp of 1 W as Blender counts it: of the radiance 1 W / (4 area).

    Parameters
    ----------
    position : 3 floats
        Of its centre in the world, metres.
    frame : (3, 3) floats
        Rows: the lamp's x, y and z axes in the world with their scale (the columns of its 3 x 3 world matrix). It shines
        along -z.
    size_x, size_y : float
        Whole lengths along its own axes, 0 or more; without an area it is dark.
    is_round : bool
        An ellipse instead of a rectangle.
    spread : float
        Full angle that light leaves in, radians, 0 to pi.
    """
    def __init__(
        self,
        position: numpy.ndarray,
        frame: numpy.ndarray,
        size_x: float,
        size_y: float,
        is_round: bool = False,
        spread: float = 3.141592653589793,
    ) -> None: ...

class EnvironmentLight(ExtendedLight):
    """
    Light from all directions.

    Parameters
    ----------
    radiance : ndarray, float32, shape (H, W, 3), C-contiguous
        W/(m^2 sr), 0 or more, equirectangular: from row 0 up the elevation rises from -pi/2 to pi/2, along a row the
        azimuth falls from pi to -pi. Copied.
    to_world : (3, 3) floats
        Matrix that turns directions of the image into the world.
    """
    def __init__(self, radiance: numpy.ndarray, to_world: numpy.ndarray) -> None: ...

class MeshLight(ExtendedLight):
    """
    Triangles that glow on both sides.

    Parameters
    ----------
    vertices : ndarray, float64, shape (N, 3), C-contiguous
        World positions in metres. Copied.
    triangles : ndarray, uint32, shape (M, 3), C-contiguous
        Vertex indices. Copied.
    radiance : ndarray, float32, shape (M, 3), C-contiguous
        Of each triangle, W/(m^2 sr), 0 or more. Copied.
    """
    def __init__(self, vertices: numpy.ndarray, triangles: numpy.ndarray, radiance: numpy.ndarray) -> None: ...

class PlaneLight:
    """
    What arrives on a plane from one light, and what is known of where from.

    Parameters
    ----------
    irradiance : ndarray, float32, shape (H, W)
        W/m^2 where the colour is 1, cosine and visibility included; not copied.
    direction : ndarray, float32, shape (3,) or (H, W, 3)
        Unit vectors of travel in the plane frame, z < 0: one for all texels, or one for each; not copied.
    color : sequence of float
        Factor of the irradiance in each channel.
    """
    @staticmethod
    def from_point(irradiance: numpy.ndarray, position: typing.Sequence[float], color: list[float]) -> PlaneLight:
        """
        All light comes from one position: x, y, z > 0 in metres from the outer corner of texel (0, 0).
        """
    @staticmethod
    def of_channels(irradiance: numpy.ndarray, direction: numpy.ndarray, channels: int) -> list[PlaneLight]:
        """
        Lights for irradiance (H, W) or (H, W, channels): one where channels differ by a factor, else one for each.
        """
    def __init__(self, irradiance: numpy.ndarray, direction: numpy.ndarray, color: list[float]) -> None: ...
    def by_channel(self) -> list[PlaneLight]:
        """
        The same light as one for each channel.
        """
    def mean(self) -> float:
        """
        float: mean irradiance of all texels and channels, W/m^2.
        """

class LightField:
    """
    Luminance of light that comes bit by bit, in memory that does not grow with it.

    By the solver 'fft'; parameters as of `convolve`.

    Parameters
    ----------
    shape : (int, int)
        Height and width of the plane, texels.
    lights : sequence of PlaneLight
        Those of one direction are part of the field. All others only stand for light to come where terms are chosen.
    survey_shape : (int, int)
        Of the plane that the survey looks at, as large but of fewer texels.
    survey : sequence of PlaneLight
        All light to come, on that plane: its angles and colours. Without `lights`, terms are chosen for any light of these
        angles, by the kernels alone: those are off by `tolerance`.
    ldf, albedo, mean_free_path, pitch, tolerance, threads, progress
        As for `convolve`; the progress is that of the choice of terms.
    memory_limit : int
        Bytes that what is kept of light to come may take, 0: any. How many they are is known once terms are chosen.

    Raises
    ------
    MemoryLimit
        They would be more.
    """
    def __init__(
        self,
        shape: tuple,
        lights: list[PlaneLight],
        survey_shape: tuple,
        survey: list[PlaneLight],
        ldf: list[LdfSource],
        albedo: list[float],
        mean_free_path: list[float],
        pitch: typing.Sequence[float],
        tolerance: float,
        threads: int = 0,
        memory_limit: int = 0,
        progress: typing.Any = None,
    ) -> None: ...
    def add(self, light: PlaneLight) -> None:
        """
        Adds a PlaneLight, also one of `lights` that only stood for it.
        """
    def add_rays(
        self,
        grid: ReceiverGrid,
        light: ExtendedLight,
        color: list[float],
        coverage: numpy.ndarray,
        occluders: Occluders = None,
        rays: int = 16,
        seed: int = 0,
        threads: int = 0,
        clearance: float = 0.0,
        even_rays: int = 0,
        progress: typing.Any = None,
    ) -> None:
        """
        Adds the rays of a light of a size, see `gather_rays`.

        `color`: factor in each channel; `coverage`: float32 (H, W), part of each texel that receives light.
        """
    def clear(self) -> None:
        """
        Forgets what was added; terms and kernels stay for the light that comes next.
        """
    def solve(self, progress: typing.Any = None) -> numpy.ndarray:
        """
        Luminance, float32 (H, W, C) in W/(m^2 sr).
        """
    @property
    def terms(self) -> int:
        """
        int: how many transforms of light `solve` makes.
        """

def adaptive_beams(light: PlaneLight, tolerance: float) -> tuple[numpy.ndarray, numpy.ndarray]:
    """
    Squares that the adaptive solver lights by one beam each; the engine behind `beamspread.adaptive_beams`.

    Returns int64 (N, 3) of row, column and size, and float64 (N,) mean irradiance.
    """

def complex_lines(values: numpy.ndarray, forward: bool, instruction_set: str = "") -> numpy.ndarray:
    """
    Transforms of lines of complex values, complex64 (N, size), by e^-i, or backward by e^i; both are plain sums.
    """

def convolve(
    lights: list[PlaneLight],
    ldf: list[LdfSource],
    albedo: list[float],
    mean_free_path: list[float],
    pitch: typing.Sequence[float],
    solver: str,
    tolerance: float,
    threads: int,
    progress: typing.Any,
    memory: int = 335544320,
    coarsening: int = 0,
) -> numpy.ndarray:
    """
    Luminance of lights on a grid; the engine behind `beamspread.convolve`.

    C libraries, albedos and mean free paths (metres), pitch (x, y) in metres; returns float32 (H, W, C) in W/(m^2 sr).
    `memory`: bytes that the spectra of the solver 'fft' may take; where the whole plane needs more it is solved in tiles.
    `coarsening`: texels from node to node of the grid on which it spreads light far: 4, 8, 16, ... 64, 1 for no such grid,
    0 for what costs least.
    """

def coverage(
    corners: numpy.ndarray, corner_counts: numpy.ndarray, width: int, height: int, threads: int = 0
) -> numpy.ndarray:
    """
    The exact part of each texel of a grid that polygons cover.

    Parameters
    ----------
    corners : ndarray, float64, shape (N, 2), C-contiguous
        The corners of all polygons, one after the other, in texels: texel (row y, column x) spans [x, x+1] x [y, y+1].
        Polygons may be concave, have either orientation and reach beyond the grid.
    corner_counts : ndarray, uint32, shape (P,), C-contiguous
        How many corners each polygon has: 3 or more; all 3 for triangles.
    width, height : int
        Of the grid in texels.
    threads : int
        0: all.

    Returns
    -------
    coverage : ndarray, float32, shape (height, width)
        0 to 1; where polygons overlap the sum is cut at 1.

    Raises
    ------
    ValueError
        An argument is out of range; the message names it.
    """

def embree_version() -> int:
    """
    The version of Embree in use, 31305 for 3.13.5: not that of the host process.
    """

def exact_totals(medium: Medium, angles: list[float], albedos: list[float], threads: int = 0) -> tuple:
    """
    Reflectance and transmittance of a medium without noise, by discrete ordinates and doubling of layers.

    The plane-parallel problem alone, as van de Hulst 1980 and Prahl, van Gemert, Welch 1993 (Appl. Opt. 32, 559) solve it:
    it knows nothing of where light leaves, and so checks simulations and calibrates libraries. Twice as many
    directions change the results by less than 1e-4 of each for -.95 <= g <= .95 and angles up to 88 degrees.

    Parameters
    ----------
    medium : Medium
    angles : sequence of float
        Angles of incidence, degrees from the surface normal, 0 <= angle < 90.
    albedos : sequence of float
        Single-scattering albedos, 0 <= albedo < 1.
    threads : int
        0: all. The result does not depend on it.

    Returns
    -------
    reflectance, transmittance : float64, shape (angles, albedos)
        Power per unit incident power: what `LdfLibrary.reflectance` and `LdfLibrary.transmittance` estimate.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """

def fast_size(min_size: int) -> int:
    """
    The smallest even size of fast transforms.
    """

def fft_instruction_sets() -> list[str]:
    """
    What the transforms were compiled for and this processor has, fastest first; the solver uses the first.

    Of "avx512", "avx2" and "baseline". Where a function takes an `instruction_set`, an empty one stands for the fastest.
    """

def fresnel(cos_theta_i: numpy.ndarray, eta: numpy.ndarray) -> typing.Any:
    """
    Reflectance of unpolarized light; eta is the index behind the boundary over the one before it.
    """

def gather_beams(
    grid: ReceiverGrid,
    light: Light,
    occluders: Occluders = None,
    samples: int = 4,
    threads: int = 0,
    progress: typing.Any = None,
    clearance: float = 0.0,
    find_shadows: bool = True,
    directions: bool = True,
) -> tuple:
    """
    Irradiance of a plane by a light of strength 1, and where it comes from.

    Parameters
    ----------
    grid : ReceiverGrid
    light : Light
    occluders : Occluders, optional
        What casts shadows; None: nothing does.
    samples : int
        samples x samples points in each texel, each with its own visibility; 1 to 64.
    threads : int
        0: all. The result is the same, bit for bit, for any number.
    progress : callable, optional
        progress(fraction) returns False to stop.
    clearance : float
        How far off the plane shadow rays start, in metres, besides what rounding needs: as far as the receiver's own faces,
        where they are among the occluders, depart from the plane.
    find_shadows : bool
        False: rays are traced from every texel, also where none can be blocked or one triangle blocks them all. The result
        is the same; for measurements.

    Returns
    -------
    irradiance : ndarray, float32, shape (height, width), or (height, width, 3) past coloured occluders
        W/m^2: cosine and visible part included, 0 if the light is behind the plane or in it. Row 0 is the lowest row.
    direction : ndarray, float32, shape (height, width, 3), or float64, shape (3,) of a light infinitely far away
        Unit vectors of travel in the plane frame (x_axis, y_axis, normal), z < 0. Where no light arrives: that of the
        unblocked light, or (0, 0, -1) if the light is behind the plane or in it.

    Raises
    ------
    ValueError
        An argument is out of range; the message names it.
    Cancelled
        `progress` returned False.
    """

def gather_rays(
    grid: ReceiverGrid,
    light: ExtendedLight,
    occluders: Occluders = None,
    rays: int = 16,
    seed: int = 0,
    threads: int = 0,
    progress: typing.Any = None,
    clearance: float = 0.0,
    even_rays: int = 0,
) -> typing.Any:
    """
    Irradiance of a plane by a light of a size, and where it comes from on the whole.

    Parameters
    ----------
    grid : ReceiverGrid
    light : ExtendedLight
    occluders : Occluders, optional
        What casts shadows; None: nothing does.
    rays : int
        From each texel, 1 to 4096. Where nothing is in the way the irradiance does not depend on it, and has no noise.
    seed : int
        Another one gives other rays.
    threads : int
        0: all. The result is the same, bit for bit, for any number.
    progress : callable, optional
        progress(fraction) returns False to stop.
    clearance : float
        How far off the plane shadow rays start, in metres, besides what rounding needs.
    even_rays : int
        First, a look by so many rays: where they, and those of the texels around, all met light or all an obstacle, they are
        enough, and `rays` are traced from the other texels only. 0: from all.

    Returns
    -------
    irradiance : ndarray, float32, shape (height, width, 3)
        W/m^2: cosine and visible part included. Row 0 is the lowest row.
    flow : ndarray, float32, shape (height, width, 3)
        The sum over the rays of the irradiance, the mean of its channels, times unit vector of travel in the plane frame
        (x_axis, y_axis, normal), W/m^2.

    Raises
    ------
    ValueError
        An argument is out of range; the message names it.
    Cancelled
        `progress` returned False.
    """

def half_lines(half: numpy.ndarray, size: int, instruction_set: str = "") -> numpy.ndarray:
    """
    Inverse of `real_lines` but for a factor: complex64 (N, size // 2 + 1) to `size` times float32 (N, size).
    """

def henyey_greenstein_pdf(cos_theta: numpy.ndarray, g: numpy.ndarray) -> typing.Any:
    """
    Density per steradian of a deflection.
    """

def henyey_greenstein_sample(g: numpy.ndarray, u: numpy.ndarray) -> typing.Any:
    """
    Cosine of a deflection, from u uniform in [0, 1).
    """

def interpolate(
    samples: list[LdfSample],
    angle: float,
    albedo: float,
    g: float | None = None,
    method: str = "angular",
    height: float | None = None,
) -> LdfSample:
    """
    The LDF at an angle and albedo between samples.

    Parameters
    ----------
    samples : sequence of LdfSample
        On a regular grid of angles and albedos, and of g where that differs, in any order; alike in texels and beam. Only
        the cell of the grid around what is asked for counts.
    angle, albedo : float
        Within the samples' span.
    g : float, optional
        Anisotropy; needed where the samples span more than one.
    method : {"angular", "adaptive", "planar"}
        ``angular`` is the paper's (Eq. 3, 4): exitance is blended with linear weights at the same place of angular space, H
        and Q are blended with the same weights. ``planar`` blends at the same (u, v). ``adaptive`` blends logarithms, with
        weights that follow how LDFs change with angle and albedo: nearer to the truth, by far where albedos differ.
    height : float, optional
        Of Q above H for ``angular``, mean free paths; default: two thirds of the images' width, the paper's 100 units over
        a window of 150. The result doesn't depend on it but for rounding: with the same height for all samples it cancels
        out.

    Returns
    -------
    LdfSample
        Where a sample is asked for, its own image.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed: outside of the samples, their span.
    """

def ray_layers(
    grid: ReceiverGrid,
    light: ExtendedLight,
    occluders: Occluders = None,
    rays: int = 16,
    seed: int = 0,
    threads: int = 0,
    progress: typing.Any = None,
    clearance: float = 0.0,
) -> typing.Any:
    """
    The rays of `gather_rays` one by one; arguments as there, but for `even_rays`.

    Returns
    -------
    list of (irradiance, direction)
        One ray of each texel: ndarrays, float32, shape (height, width, 3), W/m^2 and unit vectors of travel in the plane
        frame with z < 0.
    """

def read_exr(path: str, part: str | None = None) -> tuple:
    """
    Read one part of an OpenEXR file.

    Parameters
    ----------
    path : str
    part : str, optional
        The part's name; may be left out where the file has one part only.

    Returns
    -------
    array : ndarray, float32, shape (H, W, C)
        Rows from the bottom up. Half and integer channels are converted.
    channels : list of str
        The names of the C channels: in the order in which `write_exr` got them, or R, G, B, A first.
    attributes : dict
        Header attributes of type str, int, float and list of float; those that describe the image itself are left out.

    Raises
    ------
    OSError
        The file is missing, damaged or larger than 2^30 numbers, has deep data or subsampled channels, or no such part.
    """

def real_lines(values: numpy.ndarray, instruction_set: str = "") -> numpy.ndarray:
    """
    Transforms of lines of real values: float32 (N, size) to complex64 (N, size // 2 + 1).
    """

def real_transform(values: numpy.ndarray, threads: int = 0, instruction_set: str = "") -> numpy.ndarray:
    """
    Fourier transform of real values, float32 (H, W) with W even; complex64 (H, W / 2 + 1).

    One of these is what tests/bench/fft.py counts the solver's time in.
    """

def simulate(
    medium: Medium,
    angles: list[float],
    photons: int,
    seed: int = 1,
    threads: int = 0,
    progress: typing.Any = None,
    kernel: str = "",
) -> LdfLibrary:
    """
    Simulate the light that beams spread inside a medium, by Monte Carlo.

    One simulation serves every albedo, because what leaves is tallied by scattering order.

    Parameters
    ----------
    medium : Medium
    angles : sequence of float
        Angles of incidence, degrees from the surface normal, 0 <= angle < 90, distinct.
    photons : int
        Per angle, at least 1.
    seed : int
        The result depends on it, and not on the number of threads.
    threads : int
        0: all.
    progress : callable, optional
        Called with the finished fraction. The answer False (or NumPy's) stops, any other goes on; an error passes through.
    kernel : str
        One of `walk_kernels()`; empty: the fastest. They agree up to the simulation's noise.

    Returns
    -------
    LdfLibrary

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    Cancelled
        `progress` returned False.
    """

def transforms(
    lights: list[PlaneLight],
    ldf: list[LdfSource],
    albedo: list[float],
    mean_free_path: list[float],
    pitch: typing.Sequence[float],
    tolerance: float,
) -> int:
    """
    How many transforms of light the solver 'fft' makes of `convolve`.
    """

def walk_kernels() -> list[str]:
    """
    Names of the implementations of the photon walk that this processor can run, fastest first.

    The last, `scalar`, walks one photon at a time in double precision and is the truth for the others, which
    walk as many as a vector has lanes, in single precision.
    """

def write_exr(
    path: str,
    array: numpy.ndarray,
    channels: list[str],
    attributes: dict = {},
    compression: str = "zip",
    half: bool = False,
) -> None:
    """
    Write an OpenEXR file of 32-bit or 16-bit float channels.

    The file is written beside `path` and takes its name when it is whole.

    Parameters
    ----------
    path : str
        A file that exists is replaced, unless it is read-only.
    array : ndarray, float32, shape (H, W, C), C-contiguous
        Rows from the bottom up, as Blender stores images; the file gets them from the top down.
    channels : sequence of str
        C names, such as ["R", "G", "B"].
    attributes : dict, optional
        Header attributes: str, int, float, or a sequence of numbers (stored as 32-bit floats).
    compression : {"zip", "none"}
        Both without loss.
    half : bool
        Round to 16 bits: 11 bits of precision, up to 65504; what is larger becomes infinite.

    Raises
    ------
    ValueError
        An argument is of the wrong shape, dtype or range.
    OSError
        The file cannot be written.
    """

__version__: str = "0.1.0"
