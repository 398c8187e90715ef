#!/bin/sh
# armesh and its peers side by side, in one run; see README.md.
#
#     benches/peers/run.sh [--parts FOLDER] [SECTION ...]
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
. "$root/scripts/need.sh"
need cmake make g++ binutils libcgal-dev libeigen3-dev libembree-dev python3 python3-venv
need_cargo
build="$root/build/peers"
mkdir -p "$build"

export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}"
cmake -S "$root" -B "$root/build" -DCMAKE_BUILD_TYPE=Release >"$build/log" 2>&1 &&
    cmake --build "$root/build" >>"$build/log" 2>&1 || { cat "$build/log" >&2; exit 1; }
newer() { [ ! -x "$build/$1" ] || [ "$here/$1.cpp" -nt "$build/$1" ]; }
if newer peers; then
    g++ -std=c++17 -O3 -DNDEBUG -DCGAL_EIGEN3_ENABLED -I"$root/include" -I"$root/cpp-tests" -isystem /usr/include/eigen3 \
        "$here/peers.cpp" "$root/cpp-tests/shapes.cpp" -o "$build/peers" \
        -L"$root/build/lib" -larmesh -Wl,-rpath,"$root/build/lib" -lgmp -lmpfr
fi
if newer embree; then
    g++ -std=c++17 -O3 -march=native -DNDEBUG "$here/embree.cpp" -o "$build/embree" -lembree3 -pthread
fi
ln -sf ../armesh-check "$build/armesh-check"
ln -sf ../lib/libarmesh.so "$build/libarmesh.so"
if [ ! -x "$build/venv/bin/python" ]; then
    python3 -m venv "$build/venv"
fi
"$build/venv/bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt"
exec "$build/venv/bin/python" "$here/peers.py" "$build" "$@"
