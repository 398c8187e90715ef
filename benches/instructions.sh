#!/bin/sh
# Instructions that three fixed cases take, by callgrind: the same on a busy machine, so that a regression shows. One
# thread, and the instruction set that this processor has (callgrind knows AVX2).
#
#     benches/instructions.sh [CASE ...]     bracket-print bracket-paper dumb-bell; takes some minutes
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/scripts/need.sh"
need cmake make g++ valgrind
need_cargo
build="$root/build/instructions"
mkdir -p "$build"
cd "$root"
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}"
cmake -S . -B build -DCMAKE_BUILD_TYPE=Release >"$build/log" 2>&1 && cmake --build build >>"$build/log" 2>&1 || {
    cat "$build/log" >&2
    exit 1
}
cargo run --quiet --release --locked --example composites -- "$build" 1
awk 'NR > 2 && NF == 3 { print "v", $0 } NF == 4 { print "f", $2 + 1, $3 + 1, $4 + 1 }' "$build/dumb-bell.off" \
    >"$build/dumb-bell.obj"

count() { # count NAME PART OPTIONS...
    name=$1
    shift
    valgrind --tool=callgrind --callgrind-out-file="$build/$name.out" build/armesh-check "$@" --threads 1 --quiet \
        >"$build/$name.log" 2>&1 || [ $? -eq 1 ] || { cat "$build/$name.log" >&2; exit 1; }
    awk -v name="$name" '/Collected/ { printf "%-16s %8.0f million instructions\n", name, $NF / 1e6 }' "$build/$name.log"
}

for case in "${@:-all}"; do
    case $case in bracket-print | all) count bracket-print examples/parts/bracket.stl ;; esac
    case $case in bracket-paper | all) count bracket-paper examples/parts/bracket.stl --profile paper ;; esac
    case $case in dumb-bell | all) count dumb-bell "$build/dumb-bell.obj" ;; esac
done
