#!/usr/bin/env bash
# Fetches the headers of Pythons that Debian 12 doesn't have, for modules that newer Blenders load:
# tools/python_headers.sh [FOLDER]. apt checks the packages' signatures; nothing is installed.
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

for python in "${wanted[@]}"; do
    [ ! -f "$folder/usr/include/python${python%:*}/Python.h" ] || continue
    fetch "$python" || { echo "python_headers: Python ${python%:*} has no headers here: no module is built for it" >&2; }
done
rm -rf "$folder/.apt"
