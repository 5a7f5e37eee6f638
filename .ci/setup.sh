# Shared by examples/run, tests/run and .ci/run; sourced by them, not run.
#   use_preset NAME           builds by this one of CMakePresets.json from here on; release otherwise
#   install_packages          installs what is missing from .ci/apt-packages.txt, and for a preset that
#                             has a list of its own from .ci/apt-packages-PRESET.txt
#   build_targets TARGET...   configures and builds in build/PRESET; seconds when nothing changed. Where the
#                             environment has CI, warnings are errors
# Works from any folder and leaves the caller in it.
# shellcheck shell=bash

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=release
build=$root/build/$preset
# The project's own scripts of Gmsh are trusted: they also run where the system has no sandbox for them.
export SIMFLEX_SANDBOX=${SIMFLEX_SANDBOX-optional}

say() { printf '==> %s\n' "$*" >&2; }
fail() {
    printf 'simflex: %s\n' "$*" >&2
    exit 1
}

use_preset() {
    local names
    names=$(sed -n '/"configurePresets"/,/^    \]/s/.*"name": "\([^"]*\)".*/\1/p' "$root/CMakePresets.json")
    grep -qxF -- "$1" <<<"$names" || fail "there is no preset '$1'; there are: $(xargs <<<"$names")"
    preset=$1
    build=$root/build/$preset
}

# The names in the lists of packages that are not installed, one a line; of "optional" ones those that apt knows.
missing_packages() {
    local wanted installed
    local -a lists=("$root/.ci/apt-packages.txt")
    [ ! -f "$root/.ci/apt-packages-$preset.txt" ] || lists+=("$root/.ci/apt-packages-$preset.txt")
    if [ "${1-}" = optional ]; then
        wanted=$(comm -12 <(sed -n 's/^#optional: *//p' "${lists[@]}" | sort -u) <(apt-cache pkgnames | sort))
        [ -n "$wanted" ] || return 0
    else
        wanted=$(sed 's/#.*//' "${lists[@]}" | xargs -n1 | sort -u)
    fi
    # dpkg-query fails for a name it has never heard of, and lists the others.
    # shellcheck disable=SC2086
    installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' $wanted 2>/dev/null |
        sed -n 's/ installed$//p' | sort -u || true)
    comm -23 <(printf '%s\n' "$wanted") <(printf '%s\n' "$installed")
}

install_packages() {
    local missing log
    local -a as_root=(env DEBIAN_FRONTEND=noninteractive)
    if ! command -v dpkg-query >/dev/null; then
        say "not a Debian system: the packages of .ci/apt-packages.txt are taken to be there"
        return
    fi
    mapfile -t missing < <(missing_packages)
    [ "${#missing[@]}" -gt 0 ] || return 0
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || fail "run this as root, or install sudo, to get: ${missing[*]}"
        as_root=(sudo "${as_root[@]}")
    fi
    say "installing by apt: ${missing[*]}"
    log=$(mktemp)
    if ! { "${as_root[@]}" apt-get update -q && mapfile -t -O "${#missing[@]}" missing < <(missing_packages optional) &&
        "${as_root[@]}" apt-get install -y -q --no-install-recommends -o Dpkg::Options::=--force-confold "${missing[@]}"; } >"$log" 2>&1; then
        tail -n 30 "$log" >&2
        rm -f "$log"
        fail "apt could not install what is needed (its last words are above)"
    fi
    rm -f "$log"
}

# Compilers at a time: one a processor, as far as 2 GB for each goes.
compile_jobs() {
    local memory jobs
    jobs=$(nproc)
    memory=$(awk '/^MemAvailable:/ { print int($2 / 2100000) }' /proc/meminfo)
    [ "$memory" -ge 1 ] || memory=1
    [ "$jobs" -le "$memory" ] || jobs=$memory
    echo "$jobs"
}

build_targets() {
    # Always configured: a pull may have brought targets that the old makefiles do not know.
    [ -f "$build/Makefile" ] || say "configuring $build"
    (cd "$root" && cmake --preset "$preset" -G "Unix Makefiles" ${CI:+-DSIMFLEX_WARNINGS_AS_ERRORS=ON} >/dev/null)
    say "building: $*"
    # Only lines that say something: what is compiled, made or wrong.
    (cd "$root" && cmake --build --preset "$preset" --parallel "$(compile_jobs)" --target "$@") |
        { grep --line-buffered -vE 'Built target|^Consolidate|^Scanning|^\[ *[0-9]+%\] Linking|^-- ' || true; } >&2
}
