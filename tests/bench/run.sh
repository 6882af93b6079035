#!/usr/bin/env bash
# Builds and runs the measurements: tests/bench/run.sh [NAME...], default: all. They take minutes and assert nothing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
tools/setup.sh --tests
tools/build.sh release
export PYTHONPATH=$PWD/build/stage

names=("$@")
if [ ${#names[@]} = 0 ]; then
    for file in tests/bench/*.cpp tests/bench/*.py; do
        [ ! -e "$file" ] || names+=("$(basename "${file%.*}")")
    done
fi
for name in "${names[@]}"; do
    echo "=== $name"
    if [ -e "tests/bench/$name.cpp" ]; then
        cmake --build build/release --target "bench_$name" >&2
        "build/release/bench_$name"
    else
        build/venv/bin/python "tests/bench/$name.py"
    fi
done
