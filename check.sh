#!/bin/sh
# Builds armesh (the first time) and checks a part:
#
#     ./check.sh                       the bundled example part
#     ./check.sh PART [OPTIONS]        your own: STL, OBJ, PLY or 3MF; ./check.sh --help lists the options
#
# Exit status: 0 slenderness under the limit, 1 at or over it, 2 anything else.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
. "$here/scripts/need.sh"

(
    need cmake make g++ ca-certificates
    need_cargo
    # one compile for this, for cargo and for test.sh
    export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$here/target}"
    cmake -S "$here" -B "$here/build" -DCMAKE_BUILD_TYPE=Release >"$here/.build.log" 2>&1 &&
        cmake --build "$here/build" >>"$here/.build.log" 2>&1
) || {
    cat "$here/.build.log" >&2 2>/dev/null || true
    echo "check.sh: the build failed" >&2
    exit 2
}
rm -f "$here/.build.log"

[ $# -gt 0 ] || set -- "$here/examples/parts/bracket.stl"
exec "$here/build/armesh-check" "$@"
