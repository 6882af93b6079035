#!/usr/bin/env bash
# Builds changed files and stages the importable package: tools/build.sh [PRESET], presets as in CMakePresets.json.
# `release` (the default) stages into build/stage, the others into build/PRESET/stage.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
preset=${1:-release}

tools/setup.sh
# ccache then finds objects of clones in other folders.
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1

# ninja re-runs cmake after a change of a CMake file, but not after a change of the presets, the folder or the compiler,
# and would keep the libraries that it once found.
key=$( (pwd; c++ --version; cat CMakePresets.json cmake/dependencies/*) | sha256sum | cut -d' ' -f1)
stamp=build/$preset/.configured
if [ ! -f "build/$preset/build.ninja" ] || [ "$(cat "$stamp" 2>/dev/null)" != "$key" ]; then
    # A cache made elsewhere or by another compiler can't be re-used.
    rm -rf "build/$preset/CMakeCache.txt" "build/$preset/CMakeFiles"
    cmake --preset "$preset" >&2
    echo "$key" >"$stamp"
fi
exec cmake --build "build/$preset" >&2
