#!/usr/bin/env bash
# One zip in every Blender: tests/matrix.sh [NAME...]
# In each: install as artists do, upgrade, bake the examples and compare them with Blender 3.4.1's, a node's life,
# disable and remove; no error in the log, nothing left behind. Without names all of:
#
#     3.4       Debian 12's Blender 3.4.1
#     4.2 4.5 5.0   official, Python 3.11, as modules
#     5.2       official, Python 3.13, as a module in a chroot of Debian 13
#     debian13  Debian 13's own Blender, in the same chroot
#     sid       Debian unstable's own, in a chroot
#
# tests/matrix/set_up.sh fetches missing Blenders into build/matrix. Chroots need root. ZIP=path tests that zip instead
# of a new one.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
matrix=$root/build/matrix
python=$root/build/venv/bin/python
all=(3.4 4.2 4.5 5.0 5.2 debian13 sid)
# Messages that are harmless in a chroot, and without a screen or a sound card.
harmless='Could not get a list of mounted file-systems|ALSA|Unable to open a display|XDG_RUNTIME_DIR|dconf|Fontconfig'

if [ $# -gt 0 ]; then names=("$@"); else names=("${all[@]}"); fi
for name in "${names[@]}"; do
    [[ " ${all[*]} " == *" $name "* ]] || { echo "matrix: there is no Blender named $name, only ${all[*]}" >&2; exit 2; }
done

if [ -z "${ZIP:-}" ]; then
    tools/build.sh release && cmake --build build/release --target package >&2 || exit 1
    ZIP=$(echo build/release/beamspread-*.zip)
fi
ZIP=$(realpath "$ZIP")
# Results of 3.4.1 that belong to this zip and these examples.
key=$(cat "$ZIP" blend_examples/*.blend tests/matrix/*.py | sha256sum | cut -d' ' -f1)
reference=$matrix/work/3.4/out
if [[ " ${names[*]} " == *" 3.4 "* ]] || [ "$(cat "$matrix/work/3.4/key" 2>/dev/null)" != "$key" ]; then
    rest=()
    for name in "${names[@]}"; do [ "$name" = 3.4 ] || rest+=("$name"); done
    names=(3.4 "${rest[@]}")
fi

# in_blender NAME ARGUMENTS...: the Blender (or Python) of a row, with nothing of this environment. A plain PATH:
# Debian's Blender takes its Python from the first python3 there.
in_blender() {
    local name=$1
    shift
    local folder=$matrix/work/$name clean=(env -i HOME=/beamspread/home PATH=/usr/bin:/bin LANG=C.UTF-8)
    case "$name" in
        3.4) "${clean[@]}" HOME="$folder/home" blender "$@" ;;
        4.2 | 4.5 | 5.0) "${clean[@]}" HOME="$folder/home" "$matrix/$name/bin/python" "$@" ;;
        5.2) in_chroot trixie "$folder" "${clean[@]}" PYTHONPATH=/opt/bpy python3 "$@" ;;
        debian13) in_chroot trixie "$folder" "${clean[@]}" blender "$@" ;;
        sid) in_chroot sid "$folder" "${clean[@]}" blender "$@" ;;
    esac
}

# in_chroot SUITE FOLDER COMMAND...: the folder is its /beamspread. Mounts go with the command.
in_chroot() {
    mkdir -p "$matrix/$1/beamspread"
    unshare -m bash -ec 'mount -t proc proc "$1/proc"; mount --bind "$2" "$1/beamspread"; exec chroot "$1" "${@:3}"' - \
        "$matrix/$1" "${@:2}"
}

# Names inside the chroot.
inside() { case "$1" in 5.2 | debian13 | sid) echo /beamspread ;; *) echo "$matrix/work/$1" ;; esac; }

is_module() { case "$1" in 4.2 | 4.5 | 5.0 | 5.2) true ;; *) false ;; esac; }

# phase NAME PHASE: in a process of its own, its output into NAME/PHASE.log
phase() {
    local here=$(inside "$1") log=$matrix/work/$1/$2.log code=0
    if is_module "$1"; then
        in_blender "$1" "$here/drive.py" "$2" "$here" >"$log" 2>&1 || code=$?
    else
        in_blender "$1" -b --python-exit-code 1 --python "$here/drive.py" -- "$2" "$here" >"$log" 2>&1 || code=$?
    fi
    return $code
}

# command NAME ARGUMENTS...: `blender --command extension ...` where Blender is a program that has it.
extension() {
    local name=$1
    shift
    in_blender "$name" -b --command extension "$@" >>"$matrix/work/$name/command.log" 2>&1
}

# errors NAME: lines of its logs that no artist should see.
errors() {
    grep -HniE 'traceback|^[a-z.]*error|\berror:|not freed|leak|segmentation|exception' "$matrix/work/$1"/*.log |
        grep -vE "$harmless" | grep -v 'Error: beamspread has no working native module' | sed "s|^$matrix/work/||"
}

# take_media CACHE: compares the medium that a Blender has simulated with 3.4.1's, bit for bit, and then adds those of the
# examples, which 3.4.1 has simulated, too. Says what differs.
take_media() {
    local file other=$matrix/work/3.4/cache
    for file in "$1"/*.exr; do
        [ -e "$file" ] || continue
        cmp -s "$file" "$other/$(basename "$file")" || { echo "FAILED: $(basename "$file") is not as 3.4.1 has simulated it"; return; }
    done
    mkdir -p "$1"
    cp "$other"/*.exr "$1/"
}

# row NAME: everything with one Blender; 0 if all is well, and one line that says so.
row() {
    local name=$1 begin=$SECONDS folder=$matrix/work/$1 outcome="" code=0 found here
    rm -rf "$folder"
    mkdir -p "$folder/home" "$folder/out" "$folder/scenes"
    cp "$ZIP" tests/matrix/drive.py "$folder/"
    "$python" tests/matrix/newer.py "$ZIP" "$folder" >/dev/null || return 1
    cp blend_examples/*.blend tests/blender/files/node_before_sockets.blend "$folder/scenes/"
    here=$(inside "$name")
    if ! is_module "$name" && [ "$name" != 3.4 ]; then
        extension "$name" validate "$here/$(basename "$ZIP")" &&
            extension "$name" install-file -r user_default -e "$here/$(basename "$ZIP")" ||
            outcome="FAILED: the extension commands, see build/matrix/work/$name/command.log"
    fi
    for step in install work remove; do
        [ -z "$outcome" ] || break
        if phase "$name" $step; then
            [ $step != install ] || [ "$name" = 3.4 ] || outcome=$(take_media "$folder/cache")
            continue
        fi
        code=$?
        if [ $step = work ] && [ $code = 3 ]; then continue; fi
        outcome="FAILED: $(grep -h '^MATRIX' "$folder/$step.log" | head -1 || true)"
        [ "$outcome" != "FAILED: " ] || outcome="FAILED: $step ended with $code, see build/matrix/work/$name/$step.log"
    done
    if [ -z "$outcome" ]; then
        found=$(errors "$name")
        [ -z "$found" ] || outcome="FAILED: errors in the log: $(head -3 <<<"$found" | tr '\n' ';')"
    fi
    "$python" tests/matrix/report.py "$name" "$folder" "$reference" $((SECONDS - begin)) "$outcome"
}

failed=0
printf '%-9s %-12s %-8s %-6s %-7s %6s  %s\n' name Blender Python glibc numpy seconds result
for name in "${names[@]}"; do
    if ! tests/matrix/set_up.sh "$name"; then
        printf '%-9s FAILED: not set up\n' "$name"
        failed=1
        continue
    fi
    row "$name" || failed=1
    [ "$name" != 3.4 ] || echo "$key" >"$matrix/work/3.4/key"
done
exit $failed
