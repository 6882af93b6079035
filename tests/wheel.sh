#!/usr/bin/env bash
# Builds the source package and from it, without a network, the wheel; installs that into fresh environments with the
# oldest and the newest numpy, and uses it there: tests/wheel.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1
out=build/wheel
python=/usr/bin/python3
rm -rf "$out"
mkdir -p "$out"

"$python" -m venv "$out/tools"
"$out/tools/bin/pip" install --quiet -r tools/requirements-wheel.txt
"$out/tools/bin/python" -m build --sdist --no-isolation --outdir "$out" . >"$out/sdist.log" 2>&1 || { tail -40 "$out/sdist.log"; exit 1; }
sdist=$(ls "$out"/beamspread-*.tar.gz)
tar -tzf "$sdist" >"$out/sdist.list"
for archive in build/deps/archives/*; do
    grep -qF "$archive" "$out/sdist.list" || { echo "$sdist lacks $archive"; exit 1; }
done

# The build uses the source package alone: the proxy's address leads nowhere. It takes the dependencies that this
# machine has built before, unless BEAMSPREAD_WHEEL_FROM_NOTHING is set.
mkdir "$out/source"
tar -xzf "$sdist" -C "$out/source" --strip-components 1
dependencies=$PWD/build/deps
[ -z "${BEAMSPREAD_WHEEL_FROM_NOTHING:-}" ] || dependencies=$out/source/build/deps
env http_proxy=http://127.0.0.1:9 https_proxy=http://127.0.0.1:9 no_proxy= PIP_NO_INDEX=1 PIP_FIND_LINKS= \
    CMAKE_ARGS="-DBEAMSPREAD_DEPENDENCIES_DIR=$dependencies -DBEAMSPREAD_ARCHIVES_DIR=$PWD/$out/source/build/deps/archives" \
    "$out/tools/bin/python" -m build --wheel --no-isolation --outdir "$out" "$out/source" >"$out/wheel.log" 2>&1 ||
    { tail -60 "$out/wheel.log"; exit 1; }
wheel=$(ls "$out"/beamspread-*.whl)
"$out/tools/bin/auditwheel" show "$wheel"
# auditwheel checks that no library must be bundled, and names the oldest glibc of the wheel.
PATH=$PWD/$out/tools/bin:$PATH "$out/tools/bin/auditwheel" repair --wheel-dir "$out/repaired" "$wheel"
wheel=$(ls "$out"/repaired/*.whl)
case "$wheel" in *manylinux_2_3[0-5]_* | *manylinux_2_2[0-9]_*) ;; *) echo "$wheel needs a newer glibc than 2.35"; exit 1 ;; esac
"$out/tools/bin/python" -m zipfile -l "$wheel" | awk '/[.]libs[/]/ { print "bundled: " $1; found = 1 } END { exit found }'

for numpy in "==1.26.4" ">=2"; do
    "$python" -m venv "$out/numpy$numpy"
    "$out/numpy$numpy/bin/pip" install --quiet "numpy$numpy" "$wheel"
    # A line each: a command that fails within && would not end the script.
    (cd "$out/numpy$numpy"
        unset PYTHONPATH
        bin/python ../../../tests/smoke.py
        bin/python -m beamspread presets | sed -n 1,2p
        bin/python -c "import beamspread, pathlib, numpy; p = pathlib.Path(beamspread.__file__).parent
assert (p / '_native.pyi').exists() and (p / 'py.typed').exists() and any((p / 'library').iterdir()), p
assert not list(p.parent.rglob('_native_test*'))
print(beamspread.__file__.split('site-packages')[1], 'with numpy', numpy.__version__)")
done
echo "wheel: $wheel"
