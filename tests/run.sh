#!/usr/bin/env bash
# Sets up, builds and tests: tests/run.sh
# Leaves out long tests that seldom find a fault of their own, and lists them at the end; tests/run.sh --all runs all.
# Other arguments go to pytest and choose the tests: tests/run.sh -k convolve        tests/run.sh
# tests/blender/test_batch.py -x
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PYTHONPATH=$PWD/build/stage
python=$PWD/build/venv/bin/python
summary=$(mktemp)
trap 'rm -f "$summary"' EXIT
started=$SECONDS

# step NAME COMMAND...: runs it even after failures, and remembers its result.
step() {
    local name=$1 begin=$SECONDS outcome=ok
    shift
    echo "=== $name"
    "$@" || outcome="FAILED ($?)"
    printf '%-28s %5d s  %s\n' "$name" $((SECONDS - begin)) "$outcome" >>"$summary"
}

failures() { grep -c FAILED "$summary"; }

finish() {
    echo "=== summary"
    cat "$summary"
    echo "total $((SECONDS - started)) s, $([ "$(failures)" = 0 ] && echo "all passed" || echo "$(failures) FAILED")"
    exit $(($(failures) > 0))
}

# The native smoke test in a module built with AddressSanitizer and UBSan.
# (ThreadSanitizer takes every hand-over between threads for a race, as it can't see into TBB.)
sanitized() {
    local runtime
    # The sanitizer has to be loaded first, and libstdc++ with it, because the process looks up its functions for
    # exceptions at the start.
    runtime="$(c++ -print-file-name=libasan.so) $(c++ -print-file-name=libstdc++.so.6)"
    tools/build.sh asan || return
    # No leak detection: Python keeps much memory until it exits.
    env LD_PRELOAD="$runtime" PYTHONPATH="$PWD/build/asan/stage" PYTHONMALLOC=malloc \
        ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 "$python" tests/smoke.py
}

in_venv() { "$python" -m pytest "$@"; }

in_blender() { blender -b --factory-startup --python-exit-code 1 --python tests/blender/run.py -- "$@"; }

# The same tests in an official Blender, which is newer and brings libraries of its own.
in_bpy() {
    PYTHONPATH=$PWD/build/bpy-4.5 "$python" tests/blender/run.py -- "$@"
}

# Blenders that try the zip: the oldest, an official LTS and the newest, or all.
choose_matrix() {
    matrix=(3.4 4.5)
    [ $all = 0 ] || matrix+=(4.2 5.0)
    if unshare -m mount -t tmpfs none /mnt 2>/dev/null; then
        matrix+=(5.2)
        [ $all = 0 ] || matrix+=(debian13 sid)
    else
        skipped "the zip in Blender 5.2 and others of Debian 13 and unstable: chroots need root, and the right to mount"
    fi
}

# Blender 3.4 has these, too. Those of lamps, and of files, nodes and panels, stay, because these changed between the
# versions. The numbers of a bake follow from what is read of a scene; they are compared with Cycles in 3.4, and with
# 3.4's for all examples where the zip is tried in 4.5. Child processes start in the tests of colors by Cycles.
long_in_bpy=(test_bent_bounced test_bodies test_bodies_cycles test_cycles_copy test_cycles_extended_lights test_cycles_filter
             test_cycles_irradiance test_cycles_lamps test_cycles_process test_indirect test_light_is_not_lost test_live
             test_live_and_bakes test_live_bounced test_live_in_cycles test_panorama test_passes
             test_read_emitters test_read_world test_reflectance test_scattering_texture test_shown_in_cycles test_transparency)
long_cases_in_bpy=("test_read_lamps and (scaled or penumbra or no_size)"
                   "test_bounced_light and (coloured or metal or image or ball or bounces_end)"
                   "test_examples and all_are_baked")
in_bpy_without_long() {
    local name cases ignored=()
    for name in "${long_in_bpy[@]}"; do ignored+=("--ignore=tests/blender/$name.py"); done
    cases=$(printf ' or (%s)' "${long_cases_in_bpy[@]}")
    in_bpy "${ignored[@]}" -k "not (${cases# or })" "$@"
}

skipped() { printf 'SKIPPED  %s\n' "$*" >>"$summary"; }

all=0
if [ "${1:-}" = --all ]; then
    all=1
    shift
fi
step set-up tools/setup.sh --tests
[ "$(failures)" = 0 ] || finish
if [ $# = 0 ]; then
    choose_matrix
    # Fetching leaves a core to the build. A failure here is repeated, and reported, when the Blender is needed.
    tests/matrix/set_up.sh "${matrix[@]}" &
fi
step build tools/build.sh release
[ "$(failures)" = 0 ] || finish

if [ $# -gt 0 ]; then
    # Paths choose the side; without a path, both sides look for the tests that the other arguments choose.
    venv=() blender=() others=()
    for argument in "$@"; do
        case "$argument" in
            tests/blender | tests/blender/*) blender+=("$argument") ;;
            tests/*) venv+=("$argument") ;;
            *) others+=("$argument") ;;
        esac
    done
    # 5: no test was chosen, which is fine if the other side had one.
    none=0
    tolerant() {
        local code=0
        "$@" || code=$?
        [ $code != 5 ] || { none=$((none + 1)); code=0; }
        return $code
    }
    if [ ${#venv[@]} -gt 0 ] || [ ${#blender[@]} = 0 ]; then step "tests" tolerant in_venv "${venv[@]}" "${others[@]}"; else none=1; fi
    if [ ${#blender[@]} -gt 0 ] || [ ${#venv[@]} = 0 ]; then step "tests in Blender" tolerant in_blender "${blender[@]}" "${others[@]}"; else none=$((none + 1)); fi
    [ $none -lt 2 ] || step "choice of tests" false
    finish
fi

step "format" "$python" tools/lint.py format
step "ruff" "$python" tools/lint.py ruff
if [ $all = 1 ]; then
    step "clang-tidy" "$python" tools/lint.py tidy
    step "sanitizers" sanitized
fi

step "the zip" cmake --build build/release --target package
# Two runs at a time, because tests in a Blender use one core most of the time. The output of the second run comes at
# its end; it gets some of Blender's tests, so that both take about as long.
moved=(tests/blender/test_batch.py tests/blender/test_curves.py tests/blender/test_read_world.py)
beside=$(mktemp)
chosen=()
[ $all = 1 ] || chosen=(-m "not long")
{
    step "tests" in_venv "${chosen[@]}"
    if [ $all = 1 ]; then step "tests in bpy 4.5" in_bpy; else step "tests in bpy 4.5" in_bpy_without_long "${chosen[@]}"; fi
    step "some of those in Blender" in_blender "${chosen[@]}" "${moved[@]}"
} >"$beside" 2>&1 &
step "tests in Blender" in_blender "${chosen[@]}" "${moved[@]/#/--ignore=}"
step "the zip in Blenders" env ZIP="$(echo build/release/beamspread-*.zip)" tests/matrix.sh "${matrix[@]}"
wait
cat "$beside"
rm -f "$beside"
if [ $all = 1 ]; then
    step "wheel" tests/wheel.sh
else
    skipped "the tests of tests/long_tests.txt, clang-tidy, sanitizers, Live, bodies and most comparisons with Cycles in bpy 4.5,"
    skipped "the wheel, the zip in Blender 4.2, 5.0, Debian 13's and Debian unstable's: tests/run.sh --all has them"
fi
finish
