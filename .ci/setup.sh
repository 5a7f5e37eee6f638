# Shared by examples/run, tests/run and .ci/run; sourced by them, not run.
#   install_packages          installs what is missing from .ci/apt-packages.txt
#   build_targets TARGET...   configures and builds in build/release; seconds when nothing changed
# Works from any folder and leaves the caller in it.
# shellcheck shell=bash

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release

say() { printf '==> %s\n' "$*" >&2; }
fail() {
    printf 'simflex: %s\n' "$*" >&2
    exit 1
}

# The names in .ci/apt-packages.txt that are not installed, one a line.
missing_packages() {
    local wanted installed
    wanted=$(sed 's/#.*//' "$root/.ci/apt-packages.txt" | xargs -n1 | sort -u)
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
    if ! { "${as_root[@]}" apt-get update -q &&
        "${as_root[@]}" apt-get install -y -q --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
        tail -n 30 "$log" >&2
        rm -f "$log"
        fail "apt could not install what is needed (its last words are above)"
    fi
    rm -f "$log"
}

# Compilers at a time: one a processor, as far as 1.5 GB for each goes.
compile_jobs() {
    local memory jobs
    jobs=$(nproc)
    memory=$(awk '/^MemAvailable:/ { print int($2 / 1500000) }' /proc/meminfo)
    [ "$memory" -ge 1 ] || memory=1
    [ "$jobs" -le "$memory" ] || jobs=$memory
    echo "$jobs"
}

build_targets() {
    # Always configured: a pull may have brought targets that the old makefiles do not know.
    [ -f "$build/Makefile" ] || say "configuring $build"
    (cd "$root" && cmake --preset release -G "Unix Makefiles" >/dev/null)
    say "building: $*"
    # Only lines that say something: what is compiled, made or wrong.
    cmake --build "$build" --parallel "$(compile_jobs)" --target "$@" |
        { grep --line-buffered -vE 'Built target|^Consolidate|^Scanning|^\[ *[0-9]+%\] Linking|^-- ' || true; } >&2
}
