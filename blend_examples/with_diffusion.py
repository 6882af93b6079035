"""Renders an example with Cycles' own subsurface scattering in place of Beamspread, all else being the same:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python with_diffusion.py -- OUT.png SAMPLES

and `diffuse` after that leaves the scattering out: a surface of the same colour that light does not enter.

Every Beamspread node becomes a Principled BSDF (random walk) of the same medium, in the terms that it takes: the colour
under even light, the length over which light falls by e far from where it entered, 1 / sqrt(3 sigma_a sigma_t')
(A. Ishimaru, Wave Propagation and Scattering in Random Media, 1978), anisotropy and ior. Its light side is a Lambertian
closure, as in every renderer: it knows how much light arrives, but not from where.
"""

import math
import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "build" / "stage"))

import beamspread  # noqa: E402


def diffusion_length(albedo, mean_free_path, anisotropy):
    absorption, reduced_scattering = 1 - albedo, albedo * (1 - anisotropy)
    return mean_free_path / math.sqrt(3 * absorption * (absorption + reduced_scattering))


def replace(tree, node, subsurface):
    """Put a Principled BSDF of the node's medium in the node's place."""
    medium = node.surface().resolve("final")
    library = beamspread.library(beamspread.Medium(medium.anisotropy, medium.ior))
    color = [library.diffuse_reflectance(albedo) for albedo in medium.albedo]
    bsdf = tree.nodes.new("ShaderNodeBsdfPrincipled")
    bsdf.subsurface_method = "RANDOM_WALK"
    for name, value in {
        "Subsurface": subsurface,
        "Base Color": (*color, 1.0),
        "Subsurface Color": (*color, 1.0),
        "Subsurface Radius": [
            diffusion_length(albedo, length, medium.anisotropy)
            for albedo, length in zip(medium.albedo, medium.mean_free_path)
        ],
        "Subsurface IOR": medium.ior,
        "Subsurface Anisotropy": medium.anisotropy,
        # Reflection at normal incidence, as the socket counts it: 0.5 is 4 %. As rough as the Beamspread node's coat.
        "Specular": ((medium.ior - 1) / (medium.ior + 1)) ** 2 / 0.08,
        "Roughness": 0.1,
    }.items():
        bsdf.inputs[name].default_value = value
    if node.inputs["Base Color"].is_linked:
        tree.links.new(bsdf.inputs["Base Color"], node.inputs["Base Color"].links[0].from_socket)
    tree.links.new(bsdf.outputs["BSDF"], tree.get_output_node("CYCLES").inputs["Surface"])


def main():
    picture, samples, *diffuse = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        for material in bpy.data.materials:
            for node in material.node_tree.nodes if material.node_tree else ():
                if node.bl_idname == "BeamspreadNode":
                    replace(material.node_tree, node, subsurface=0.0 if diffuse else 1.0)
                    break
        scene = bpy.context.scene
        scene.cycles.samples = int(samples)
        scene.render.filepath = str(Path(picture).resolve())
        bpy.ops.render.render(write_still=True)
    finally:
        beamspread.unregister()


main()
