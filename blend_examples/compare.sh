#!/usr/bin/env bash
# Makes blend_examples/pictures/low_sun.png: the scene low_sun by Beamspread, and by Cycles' own subsurface scattering.
# Bakes the examples first. Cycles takes ten minutes on two cores.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(dirname "$here")
pictures=$root/build/examples
"$here/bake.sh"

blender -b --factory-startup "$here/low_sun.blend" --python-exit-code 1 --python "$here/with_diffusion.py" -- \
    "$pictures/low_sun_with_diffusion.png" 1024
MPLBACKEND=Agg "$root/build/venv/bin/python" "$here/side_by_side.py" "$here/pictures/low_sun.png" \
    "$pictures/low_sun.png" "Beamspread: light goes on the way it was going" \
    "$pictures/low_sun_with_diffusion.png" "Cycles, subsurface scattering: it spreads evenly"
