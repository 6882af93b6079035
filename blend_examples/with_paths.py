"""Renders an example with light that Cycles traces through its bodies as volumes, all else being the same:

    blender -b --factory-startup SCENE.blend --python-exit-code 1 --python with_paths.py -- OUT.png SAMPLES

Every Beamspread node becomes a volume of the same medium without a surface; sheets with a thickness become solid. The
medium must not refract: paths through a refracting surface don't find lamps.
"""

import sys
from pathlib import Path

import bpy

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "build" / "stage"))

import beamspread  # noqa: E402


def replace(tree, node):
    """Put a volume of the node's medium in the node's place."""
    if node.ior != 1.0:
        raise SystemExit("with_paths.py takes media of ior 1")
    medium, output = node.surface().resolve("final"), tree.get_output_node("CYCLES")
    density = [1 / length for length in medium.mean_free_path]
    highest = max(density)
    scattering = [albedo * value for albedo, value in zip(medium.albedo, density)]
    absorption = [(1 - albedo) * value for albedo, value in zip(medium.albedo, density)]
    scatter, absorb = tree.nodes.new("ShaderNodeVolumeScatter"), tree.nodes.new("ShaderNodeVolumeAbsorption")
    scatter.inputs["Color"].default_value = (*(value / highest for value in scattering), 1.0)
    scatter.inputs["Anisotropy"].default_value = medium.anisotropy
    # Cycles absorbs density * (1 - color).
    absorb.inputs["Color"].default_value = (*(1 - value / highest for value in absorption), 1.0)
    add = tree.nodes.new("ShaderNodeAddShader")
    for index, shader in enumerate((scatter, absorb)):
        shader.inputs["Density"].default_value = highest
        tree.links.new(shader.outputs[0], add.inputs[index])
    for link in list(output.inputs["Surface"].links):
        tree.links.remove(link)
    tree.links.new(add.outputs[0], output.inputs["Volume"])


def make_solid(obj, thickness):
    """Give a sheet its thickness, half of it on each side."""
    solidify = obj.modifiers.new("Thickness", "SOLIDIFY")
    solidify.thickness, solidify.offset, solidify.use_even_offset = thickness, 0.0, True


def main():
    picture, samples = sys.argv[sys.argv.index("--") + 1 :]
    beamspread.register()
    try:
        for material in bpy.data.materials:
            for node in list(material.node_tree.nodes) if material.node_tree else ():
                if node.bl_idname == "BeamspreadNode":
                    for obj in bpy.data.objects if node.thickness > 0 else ():
                        if material.name in obj.material_slots:
                            make_solid(obj, node.thickness)
                    replace(material.node_tree, node)
        scene = bpy.context.scene
        cycles = scene.cycles
        cycles.samples, cycles.use_adaptive_sampling = int(samples), False
        cycles.max_bounces = cycles.volume_bounces = 1024
        # A clamp, as new scenes have one, takes from the light.
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
        scene.render.filepath = str(Path(picture).resolve())
        bpy.ops.render.render(write_still=True)
    finally:
        beamspread.unregister()


main()
