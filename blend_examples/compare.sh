#!/usr/bin/env bash
# Makes pictures in blend_examples/pictures: low_sun by Beamspread and by Cycles' own subsurface scattering, the scenes with
# lights of a size by Beamspread and as surfaces that light does not enter. Bakes the examples first. Cycles takes ten
# minutes on two cores for the first, half a minute for each of the others.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(dirname "$here")
pictures=$root/build/examples
"$here/bake.sh"

# beside SCENE TITLE TITLE SAMPLES [diffuse]: Beamspread on the left, Cycles on the right.
beside() {
    local scene=$1 left=$2 right=$3
    shift 3
    blender -b --factory-startup "$here/$scene.blend" --python-exit-code 1 --python "$here/with_diffusion.py" -- \
        "$pictures/${scene}_by_cycles.png" "$@"
    MPLBACKEND=Agg "$root/build/venv/bin/python" "$here/side_by_side.py" "$here/pictures/$scene.png" \
        "$pictures/$scene.png" "$left" "$pictures/${scene}_by_cycles.png" "$right"
}

beside low_sun "Beamspread: light goes on the way it was going" "Cycles, subsurface scattering: it spreads evenly" 1024
for scene in soapstone stage shop_window; do
    beside "$scene" "Beamspread" "Cycles, diffuse" 96 diffuse
done
