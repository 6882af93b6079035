#!/usr/bin/env bash
# Brings the Blenders of tests/matrix.sh into build/matrix: tests/matrix/set_up.sh NAME...
# Leaves existing ones alone. Chroots hold only the packages that Blender needs: no compiler, no -dev package, nothing
# of ours. They need root; nothing stays mounted.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=$PWD/build/matrix
mirror=${DEBIAN_MIRROR:-http://deb.debian.org/debian}
# Libraries that the official bpy wheels link to.
libraries=(libx11-6 libxrender1 libxxf86vm1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1 libegl1 libgomp1)

say() { echo "matrix: $*" >&2; }
die() { say "$*"; exit 1; }

# venv NAME PACKAGE...: an official Blender as a module for the host's Python.
venv() {
    local place=$folder/$1
    shift
    [ "$(cat "$place/.complete" 2>/dev/null)" != "$*" ] || return 0
    say "fetching $* into $place (1 GB)"
    rm -rf "$place"
    /usr/bin/python3 -m venv "$place"
    "$place/bin/python" -m pip install --quiet --disable-pip-version-check "$@" >&2
    echo "$*" >"$place/.complete"
}

# venv_of_tests NAME: the bpy that the other tests use, in a venv that has nothing else.
venv_of_tests() {
    local place=$folder/$1 site
    [ ! -f "$place/.complete" ] || return 0
    tools/setup.sh --tests
    rm -rf "$place"
    /usr/bin/python3 -m venv --without-pip "$place"
    site=$("$place/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
    echo "$PWD/build/bpy-4.5" >"$site/bpy.pth"
    touch "$place/.complete"
}

# chroot_of SUITE PACKAGE...: a Debian with these packages and their dependencies.
chroot_of() {
    local suite=$1 place=$folder/$1 missing
    shift
    [ "$(id -u)" = 0 ] || die "a chroot of Debian $suite needs root"
    if [ ! -f "$place/.complete" ]; then
        command -v debootstrap >/dev/null || {
            apt-get -q update >&2
            apt-get -q install -y --no-install-recommends debootstrap >&2
        }
        say "making a chroot of Debian $suite"
        rm -rf "$place"
        mkdir -p "$place"
        debootstrap --variant=minbase "$suite" "$place" "$mirror" >"$place.log" 2>&1 || { tail "$place.log" >&2; return 1; }
        touch "$place/.complete"
    fi
    missing=$( (chroot "$place" dpkg-query -W -f '${Package} ${db:Status-Status}\n' "$@" 2>/dev/null || true) |
        awk -v wanted="$*" '$2 == "installed" { there[$1] = 1 }
            END { n = split(wanted, w, " "); for (i = 1; i <= n; i++) if (!(w[i] in there)) print w[i] }')
    [ -n "$missing" ] || return 0
    say "installing $(echo $missing) in Debian $suite"
    cp /etc/resolv.conf /etc/hosts "$place/etc/"
    # Services have nothing to start here.
    printf '#!/bin/sh\nexit 101\n' >"$place/usr/sbin/policy-rc.d"
    chmod +x "$place/usr/sbin/policy-rc.d"
    # A separate mount namespace: no mount outlives this command.
    unshare -m bash -ec 'mount -t proc proc "$1/proc"
        chroot "$1" apt-get -o Acquire::Check-Valid-Until=false -q update
        DEBIAN_FRONTEND=noninteractive chroot "$1" apt-get -q install -y --no-install-recommends ${*:2}
        chroot "$1" apt-get clean' - "$place" $missing >"$place.log" 2>&1 || { tail "$place.log" >&2; return 1; }
}

# wheel_in SUITE PYTHON PACKAGE...: an official Blender as a module in the chroot's /opt/bpy; pip runs outside.
wheel_in() {
    local place=$folder/$1/opt/bpy python=$2 glibc platforms=()
    shift 2
    for glibc in 17 27 28; do platforms+=(--platform "manylinux_2_${glibc}_x86_64"); done
    [ "$(cat "$place/.complete" 2>/dev/null)" != "$*" ] || return 0
    say "fetching $* into $place (1 GB)"
    rm -rf "$place"
    build/venv/bin/python -m pip install --quiet --disable-pip-version-check --target "$place" --only-binary :all: \
        --ignore-requires-python \
        --python-version "$python" --implementation cp "${platforms[@]}" --platform manylinux2014_x86_64 "$@" >&2
    echo "$*" >"$place/.complete"
}

[ $# -gt 0 ] || die "usage: tests/matrix/set_up.sh NAME..., names as in tests/matrix.sh"
mkdir -p "$folder"
# Two runs at a time would spoil each other's folders.
exec 9>"$folder/.lock"
flock 9
for name in "$@"; do
    case "$name" in
        3.4) command -v /usr/bin/blender >/dev/null || tools/setup.sh ;;
        4.2) venv 4.2 bpy==4.2.23 ;;
        4.5) venv_of_tests 4.5 ;;
        5.0) venv 5.0 bpy==5.0.1 ;;
        5.2) chroot_of trixie python3 "${libraries[@]}"; wheel_in trixie 3.13 bpy==5.2.3 ;;
        debian13) chroot_of trixie blender python3-numpy ;;
        # sid's python3-cattr and python3-requests serve the extension commands; Blender only recommends them.
        sid) chroot_of sid blender python3-numpy python3-cattr python3-requests ;;
        *) die "there is no Blender named $name" ;;
    esac
done
