#!/usr/bin/env bash
# Makes pictures in blend_examples/pictures: low_sun by Beamspread and by Cycles' own subsurface scattering; the scenes
# with area lights by Beamspread and as diffuse surfaces; textures also as other renderers have them; stage, the bodies
# and four textures also as volumes with Cycles' paths. Bakes the examples first. On two cores Cycles takes ten minutes for
# low_sun, eight for each texture, two to five for each other volume, half a minute for each of the others.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(dirname "$here")
pictures=$root/build/examples
"$here/bake.sh"

render() { # SCENE SCRIPT [arguments]: a picture of the scene, changed by the script
    local scene=$1 script=$2
    shift 2
    blender -b --factory-startup "$here/$scene.blend" --python-exit-code 1 --python "$here/$script" -- "$@"
}

beside() { # SCENE (PICTURE TITLE)*: what was baked on the left, the others on its right
    local scene=$1
    shift
    MPLBACKEND=Agg "$root/build/venv/bin/python" "$here/side_by_side.py" "$here/pictures/$scene.png" "$@"
}

render low_sun with_diffusion.py "$pictures/low_sun_with_diffusion.png" 1024
beside low_sun "$pictures/low_sun.png" "Beamspread: light goes on the way it was going" \
    "$pictures/low_sun_with_diffusion.png" "Cycles, subsurface scattering: it spreads evenly"

for scene in soapstone stage shop_window soap_bar plank_floor acrylic_letters; do
    render "$scene" with_diffusion.py "$pictures/${scene}_diffuse.png" 64 diffuse
done
for scene in soapstone shop_window soap_bar plank_floor acrylic_letters; do
    beside "$scene" "$pictures/$scene.png" "Beamspread" "$pictures/${scene}_diffuse.png" "Cycles, diffuse"
done

render stage with_volume.py "$pictures/stage_by_volume.png" "$pictures/stage_by_volume.csv" 384 \
    "$pictures/baked/stage/Stage_floor_Milky_acrylic.exr"
beside stage "$pictures/stage.png" "Beamspread" "$pictures/stage_by_volume.png" "Cycles, paths through the volume" \
    "$pictures/stage_diffuse.png" "Cycles, diffuse"

render quail_egg with_convention.py "$pictures/quail_egg_by_convention.png"
beside quail_egg "$pictures/quail_egg.png" "Beamspread: light scatters in the speckles" \
    "$pictures/quail_egg_by_convention.png" "As renderers do: light, times the texture"

# Scenes of a texture beside the convention and beside Cycles' paths.
three() { # SCENE SCRIPT SAMPLES IMAGE
    render "$1" with_convention.py "$pictures/$1_by_convention.png"
    render "$1" "$2" "$pictures/$1_by_volume.png" "$here/$1_paths.csv" "$3" "$pictures/baked/$1/$4.exr" \
        "$pictures/textures/$4.exr"
    beside "$1" "$pictures/$1.png" "Beamspread: light scatters in the texture" "$pictures/$1_by_convention.png" \
        "As renderers do: light, times the texture" "$pictures/$1_by_volume.png" "Cycles, paths through the volume"
}
three printed_letters with_volume.py 160 Eye_chart_Acrylic
three veined_slab with_volume.py 160 Slab_Onyx
three inlay with_volume.py 160 Table_top_Inlay
three freckled_arm with_volume_round.py 128 Arm_Skin

for scene in round_soap jade_bowl marble_head paper_page paper_shade; do
    render "$scene" with_paths.py "$pictures/${scene}_by_paths.png" 128
    beside "$scene" "$pictures/$scene.png" "Beamspread" \
        "$pictures/${scene}_by_paths.png" "Cycles, paths through the volume"
done
