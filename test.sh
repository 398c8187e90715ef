#!/bin/sh
# Installs what the tests need and runs every suite. Goes on after a failure; the last line counts.
set -u
here=$(cd "$(dirname "$0")" && pwd)
cd "$here" || exit 2
. scripts/need.sh
need cmake make g++ clang pkg-config python3 ca-certificates binutils \
    catch2 libcgal-dev libeigen3-dev libopenmesh-dev abigail-tools valgrind
need_cargo
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$here/target}"

passed=0
failed=""
step() { # step NAME COMMAND...
    name=$1
    shift
    echo
    echo "=== $name"
    start=$(date +%s)
    if "$@"; then
        passed=$((passed + 1))
        echo "=== $name: ok, $(($(date +%s) - start)) s"
    else
        failed="$failed, $name"
        echo "=== $name: FAILED, $(($(date +%s) - start)) s"
    fi
}

only_our_symbols() {
    nm -D --defined-only build/lib/libarmesh.so | awk '$2 ~ /[A-Z]/ { print $3 }' | sort >build/symbols.txt
    if grep -v '^ar_' build/symbols.txt; then
        echo "exported, but not ours"
        return 1
    fi
    # every function of the header is there, and nothing that is not in the header
    grep -oE '\bar_[a-z0-9_]+\(' include/armesh.h | tr -d '(' | sort -u >build/header.txt
    grep -oE 'static inline ar_status ar_[a-z0-9_]+' include/armesh.h | awk '{ print $4 }' | sort -u >build/inline.txt
    comm -23 build/header.txt build/inline.txt | diff - build/symbols.txt
}

fresh_part() { # the committed part is what its generator writes
    mkdir -p build
    cargo run --quiet --release --locked --example parts -- build && cmp build/bracket.stl examples/parts/bracket.stl
}

if cargo fmt --version >/dev/null 2>&1; then
    step "rustfmt" cargo fmt --check
fi
if cargo clippy --version >/dev/null 2>&1; then
    step "clippy" cargo clippy --quiet --release --locked --all-targets -- -D warnings
fi
step "cargo test" cargo test --release --locked
step "example part" fresh_part
step "render" cargo run --quiet --release --locked --example render -- examples/parts/bracket.stl build/bracket.png
# from here on the library is built without what only tests need, and so anew
step "cmake" cmake -S . -B build -DCMAKE_BUILD_TYPE=Release -DARMESH_BUILD_TESTS=ON
step "build" cmake --build build --parallel 2
step "ctest" ctest --test-dir build --output-on-failure
step "symbols" only_our_symbols
step "abidiff" tests/abi.sh
step "package" sh tests/package.sh

echo
if [ -n "$failed" ]; then
    echo "$passed steps passed, failed: ${failed#, }"
    exit 1
fi
echo "$passed steps passed, 0 failed"
