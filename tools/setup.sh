#!/usr/bin/env bash
# Prepares a bare Debian 12 (git, a compiler, python3) for building, baking and, with --tests, testing. Leaves alone all
# that is installed; takes a fraction of a second if nothing is missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tests=0
for argument in "$@"; do
    case "$argument" in
        --tests) tests=1 ;;
        *) echo "usage: tools/setup.sh [--tests]" >&2; exit 2 ;;
    esac
done

packages=(g++ cmake ninja-build ccache python3 python3-dev python3-venv python3-numpy blender)
# The official bpy wheel links to the X libraries but opens no window. Debian's Blender opens one on a screen in memory,
# for tests/blender/test_window.py.
test_packages=(binutils libegl1 libgl1 libgomp1 libsm6 libx11-6 libxfixes3 libxi6 libxkbcommon0 libxrender1 libxxf86vm1
               xvfb xauth libgl1-mesa-dri)
debian_python=/usr/bin/python3
venv=build/venv

say() { echo "setup: $*" >&2; }
die() { say "$*"; exit 1; }

missing_packages() {
    command -v dpkg-query >/dev/null || { printf '%s\n' "$@"; return; }
    # awk, not grep -v: a package that was never installed is reported on stderr and has no line at all.
    dpkg-query -W -f '${Package} ${db:Status-Status}\n' "$@" 2>/dev/null |
        awk -v wanted="$*" '$2 == "installed" { there[$1] = 1 }
            END { n = split(wanted, w, " "); for (i = 1; i <= n; i++) if (!(w[i] in there)) print w[i] }'
}

install_packages() {
    local as_root=() missing
    read -r -a missing <<<"$(missing_packages "$@" | xargs)"
    [ ${#missing[@]} -gt 0 ] || return 0
    local by_hand="apt-get update && apt-get install --no-install-recommends ${missing[*]}"
    command -v apt-get >/dev/null || die "this is not a Debian; install what corresponds to: ${missing[*]}"
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null ||
            die "these packages are missing: ${missing[*]}
setup: neither root nor sudo is available; run this as root, then try again:
    $by_hand"
        as_root=(sudo)
        # Without a terminal nobody can type a password.
        [ -t 0 ] || as_root=(sudo -n)
        "${as_root[@]}" true || die "sudo was refused; these packages are missing: ${missing[*]}
setup: run this as root, then try again:
    $by_hand"
    fi
    say "installing ${missing[*]}"
    "${as_root[@]}" apt-get -q update >&2 || say "apt-get update reported an error; going on with the lists there are"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get -q install -y --no-install-recommends "${missing[@]}" >&2 || die "these packages could not be installed: ${missing[*]}"
}

make_venv() {
    "$venv/bin/python" -c pass 2>/dev/null && return
    say "making $venv"
    rm -rf "$venv"
    "$debian_python" -m venv --system-site-packages "$venv"
}

# install_into_venv REQUIREMENTS...
# --no-deps: the files list every package, so that nothing replaces Debian's numpy.
install_into_venv() {
    say "installing Python packages into $venv"
    local file arguments=()
    for file in "$@"; do arguments+=(-r "$file"); done
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps "${arguments[@]}" >&2
}

# fetch_into FOLDER REQUIREMENTS WHAT: packages beside the venv, fetched once per version and kept whatever else
# changes.
fetch_into() {
    local folder=$1 requirements=$2
    [ ! -f "$folder/.complete" ] || ! cmp -s "$folder/.complete" "$requirements" || return 0
    say "fetching $3 into $folder"
    rm -rf "$folder" "$folder.partial"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --target "$folder.partial" \
        -r "$requirements" >&2
    cp "$requirements" "$folder.partial/.complete"
    mv "$folder.partial" "$folder"
}

# The module is built for Debian's Python; another python3 first on PATH can import it if it is the same minor version
# and has numpy, and draw with it if it has matplotlib.
prepare_other_python() {
    local other ours
    [ "$(readlink -f "$(command -v python3)")" != "$(readlink -f "$debian_python")" ] || return 0
    other=$(python3 -c 'import importlib.util as u, sys
print("%d.%d" % sys.version_info[:2], all(u.find_spec(name) for name in ("numpy", "matplotlib")))' 2>/dev/null) || return 0
    ours=$("$debian_python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    case "$other" in
        "$ours True") ;;
        "$ours False")
            say "installing numpy and matplotlib for $(command -v python3)"
            # The oldest numpy that is supported here is Debian's.
            python3 -m pip install --quiet --disable-pip-version-check 'numpy>=1.24' 'matplotlib>=3.6' >&2 ||
                say "note: $(command -v python3) has no numpy or matplotlib and pip could not install them: use $debian_python to import beamspread" ;;
        *) say "note: $(command -v python3) is Python ${other% *}; the module is built for $ours: use $debian_python to import beamspread" ;;
    esac
}

mkdir -p build/.setup
# Two runs at a time would spoil each other's folders.
exec 9>build/.setup/lock
flock 9

wanted=("${packages[@]}")
inputs=(tools/setup.sh tools/requirements.txt)
requirements=(tools/requirements.txt)
stamp=base
if [ "$tests" = 1 ]; then
    wanted+=("${test_packages[@]}")
    requirements+=(tools/requirements-tests.txt)
    inputs+=(tools/requirements-tests.txt tools/requirements-bpy.txt tools/requirements-numpy2.txt)
    stamp=tests
fi
install_packages "${wanted[@]}"

# The folder belongs to the key because a venv can't be moved; the interpreter because an upgrade replaces it.
key=$( (pwd; readlink -f "$debian_python"; command -v python3; cat "${inputs[@]}") | sha256sum | cut -d' ' -f1)
if [ "$(cat build/.setup/$stamp 2>/dev/null)" = "$key" ] && [ -x "$venv/bin/python" ] &&
    { [ "$tests" = 0 ] || [ -f build/numpy-2/.complete ]; }; then
    exit 0
fi
make_venv
fetched=
if [ "$tests" = 1 ]; then
    # Beside the venv's own packages: unpacking either takes one core.
    (
        fetch_into build/bpy-4.5 tools/requirements-bpy.txt "the official Blender module (1 GB)"
        fetch_into build/numpy-2 tools/requirements-numpy2.txt "numpy 2"
    ) &
    fetched=$!
fi
install_into_venv "${requirements[@]}"
[ -z "$fetched" ] || wait "$fetched"
prepare_other_python
echo "$key" >build/.setup/$stamp
say "ready"
