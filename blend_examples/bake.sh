#!/usr/bin/env bash
# Bakes every example in Blender, renders each with Cycles from its bake, and plots the cut through the shadow
# border of `obstacle`. Sets up and builds first. The pictures end up in build/examples.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(dirname "$here")
pictures=$root/build/examples
logs=$pictures/logs

"$root/tools/build.sh"
package=$root/build/stage/beamspread
mkdir -p "$logs" "$pictures/baked"

# step NAME COMMAND...: its output goes to a log, which is shown after a failure.
step() {
    local name=$1 log=$logs/${1// /_}.log begin=$SECONDS
    shift
    printf '%-24s' "$name"
    if ! "$@" >"$log" 2>&1; then
        echo "FAILED"
        tail -n 40 "$log" >&2
        echo "the whole log: $log" >&2
        exit 1
    fi
    printf '%4d s\n' $((SECONDS - begin))
}

bake() { # SCENE [batch options]; a copy of the scene keeps the UV maps that the bake makes
    local scene=$1 copy=$pictures/baked/$1.blend
    shift
    cp "$here/$scene.blend" "$copy"
    step "bake $scene" blender -b --factory-startup "$copy" --python-exit-code 1 --python "$package/batch.py" -- \
        --save --output "$pictures/baked/$scene" --report "$pictures/baked/$scene.json" "$@"
    step "render $scene" blender -b --factory-startup "$copy" --python-exit-code 1 \
        --python "$here/render_examples.py" -- "$pictures/baked/$scene.json" "$pictures"
}

# Scenes without indirect light: their references, or their dark parts, have none.
bake laser_beams --no-indirect
bake obstacle --no-indirect --frames 1-2
bake marble_floor --no-indirect
bake low_sun --no-indirect
bake jade_bowl --no-indirect
bake soapstone
bake stage
bake shop_window
bake soap_bar
bake plank_floor
bake acrylic_letters
bake round_soap
bake marble_head
bake paper_page
bake paper_shade
bake veined_slab
bake quail_egg
bake inlay
bake printed_letters
bake freckled_arm
step "plot obstacle_cut" env PYTHONPATH="$root/build/stage" MPLBACKEND=Agg "$root/build/venv/bin/python" \
    "$here/cut_plot.py" "$pictures/baked/obstacle.json" "$here/cycles_edge.csv" "$pictures/obstacle_cut.png"
cat "$logs/plot_obstacle_cut.log"

echo "The pictures are in $pictures:"
(cd "$pictures" && ls -1 -- *.png)
