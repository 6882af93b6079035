#!/usr/bin/env bash
# Makes the pictures and tables of docs/method.md again: docs/figures.sh [MODULE ...], e.g. docs/figures.sh fig6
# Sets up and builds first. Simulated libraries are cached.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
"$root/tools/setup.sh" --tests
"$root/tools/build.sh" release
PYTHONPATH="$root/build/stage:$root/docs" "$root/build/venv/bin/python" -m figures "$@"
