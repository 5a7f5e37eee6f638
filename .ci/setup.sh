# Shared by examples/run, tests/run and .ci/run; sourced, not run.
# Installs what is missing from .ci/apt-packages.txt, then configures and builds simflex in build/release.

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build/release
cd "$root"

say() { printf '\033[1m==>\033[0m %s\n' "$*"; }

# Lists the packages of the list that are not installed.
missing_packages() {
    local name
    sed 's/#.*//' "$root/.ci/apt-packages.txt" | xargs -n1 | while read -r name; do
        dpkg-query -W -f='${db:Status-Status}\n' "$name" 2>/dev/null | grep -qx installed || echo "$name"
    done
}

install_packages() {
    local missing sudo=
    missing=$(missing_packages | xargs)
    [ -n "$missing" ] || return 0
    say "installing: $missing"
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "simflex: run as root, or install sudo, to get: $missing" >&2; exit 1; }
        sudo=sudo
    fi
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get update -qq
    # shellcheck disable=SC2086
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
}

# build_targets TARGET...: configures once, then builds; prints compiler output only when something fails or is rebuilt.
build_targets() {
    if [ ! -f "$build/CMakeCache.txt" ]; then
        say "configuring build/release"
        cmake --preset release >/dev/null
    fi
    say "building: $*"
    cmake --build "$build" --parallel "$(nproc)" --target "$@" | grep -vE '^\[ *[0-9]+%\] Built target|^Consolidate' || true
    [ "${PIPESTATUS[0]}" -eq 0 ]
}
