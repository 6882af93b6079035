#!/usr/bin/env bash
# Fetches the headers of Pythons that Debian 12 doesn't have, for modules that newer Blenders load:
# tools/python_headers.sh [FOLDER]. apt checks its packages' signatures; nothing is installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
folder=$(realpath -m "${1:-build/deps/python}")
# Python 3.13 is in Blender 5.1 and 5.2, 3.14 in the 5.2 of Debian's unstable branch.
wanted=(3.13:trixie 3.14:sid)

fetch() {
    local version=${1%:*} suite=${1#*:} lists=$folder/.apt/${1#*:} package
    mkdir -p "$lists/lists/partial" "$lists/cache/archives/partial"
    echo "deb http://deb.debian.org/debian $suite main" >"$lists/sources.list"
    local apt=(apt-get -q -o Dir::Etc::SourceList="$lists/sources.list" -o Dir::Etc::SourceParts=/dev/null
               -o Dir::State::Lists="$lists/lists" -o Dir::Cache="$lists/cache" -o Acquire::Languages=none
               -o Acquire::Check-Valid-Until=false -o APT::Sandbox::User=root)
    "${apt[@]}" update >&2
    (cd "$lists" && "${apt[@]}" download "libpython$version-dev" >&2)
    package=$(find "$lists" -maxdepth 1 -name "libpython$version-dev_*.deb")
    dpkg-deb --fsys-tarfile "$package" | tar -x -C "$folder" ./usr/include
}

# Python 3.10, of Blender 3.4 to 4.0, is in no Debian any more. TensorFlow's wheel for it carries CPython's headers, but
# for the file of this platform's sizes, which is the same in 3.11.
fetch_3_10() {
    local wheel=tensorflow_cpu-2.10.0-cp310-cp310-manylinux_2_17_x86_64.manylinux2014_x86_64.whl
    local sha256=eaeabba8e8b462ab6a1465ccc1f569692e73f5f312a0061309275a433e23dd23
    local include=$folder/usr/include
    mkdir -p "$folder/.apt"
    build/venv/bin/python -m pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: --python-version 3.10 \
        --platform manylinux2014_x86_64 --dest "$folder/.apt" tensorflow-cpu==2.10.0 >&2 || return
    echo "$sha256  $folder/.apt/$wheel" | sha256sum --check --status || return
    mkdir -p "$include/x86_64-linux-gnu/python3.10"
    cp /usr/include/x86_64-linux-gnu/python3.11/pyconfig.h "$include/x86_64-linux-gnu/python3.10/" || return
    /usr/bin/python3 - "$folder/.apt/$wheel" "$include" <<'END'
import pathlib, sys, zipfile

prefix = "tensorflow/include/external/local_config_python/python_include/"
with zipfile.ZipFile(sys.argv[1]) as wheel:
    for name in wheel.namelist():
        if name.startswith(prefix) and name.endswith(".h"):
            path = pathlib.Path(sys.argv[2], "python3.10", name.removeprefix(prefix))
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(wheel.read(name))
END
}

unavailable() { echo "python_headers: Python $1 has no headers here: no module is built for it" >&2; }

[ -f "$folder/usr/include/python3.10/Python.h" ] || [ "$(uname -m)" != x86_64 ] || fetch_3_10 || unavailable 3.10
for python in "${wanted[@]}"; do
    [ ! -f "$folder/usr/include/python${python%:*}/Python.h" ] || continue
    fetch "$python" || unavailable "${python%:*}"
done
rm -rf "$folder/.apt"
