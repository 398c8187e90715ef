#!/bin/sh
# Segmentation beside CGAL's on generated composites with known parts, and time on a mesh of about 100 000 faces.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
. "$root/scripts/need.sh"
need cmake make g++ libcgal-dev libeigen3-dev
need_cargo
build="$root/build/segment"
mkdir -p "$build"

export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}"
cmake -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release >"$build/log" 2>&1 &&
    cmake --build "$root/build" >>"$build/log" 2>&1 || { cat "$build/log" >&2; exit 1; }
g++ -std=c++17 -O3 -DNDEBUG -DCGAL_EIGEN3_ENABLED -I"$root/include" -isystem /usr/include/eigen3 \
    "$here/segment.cpp" -o "$build/segment" -L"$root/build/lib" -larmesh -Wl,-rpath,"$root/build/lib" -lgmp -lmpfr
cd "$root"
cargo run --quiet --release --locked --example composites -- "$build/composites" 1
cargo run --quiet --release --locked --example composites -- "$build/fine" 0.4
"$build/segment" "$build"/composites/*.off "$build/fine/cross-of-tubes.off"
