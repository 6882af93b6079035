#!/usr/bin/env bash
# Compares the checked-in types of the native module, addon/_native.pyi, with what the staged module says of itself;
# with --update writes them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
checked_in=addon/_native.pyi
made=build/.stubs/beamspread/_native.pyi

PYTHONPATH=build/stage build/venv/bin/pybind11-stubgen --exit-code --numpy-array-remove-parameters \
    --output-dir build/.stubs beamspread._native
# Of a std::array it is enough to know that any sequence does.
sed -i -e 's/typing.Annotated\[list\[float\], pybind11_stubgen.typing_ext.FixedSize([0-9])\]/typing.Sequence[float]/g' \
    -e '/^import pybind11_stubgen.typing_ext$/d' "$made"
build/venv/bin/ruff format --quiet --isolated --line-length 120 "$made"
if [ "${1:-}" = --update ]; then
    cp "$made" "$checked_in"
elif ! diff -u "$checked_in" "$made"; then
    echo "stubs: $checked_in doesn't describe the built module; if the change is meant: tools/stubs.sh --update" >&2
    exit 1
fi
