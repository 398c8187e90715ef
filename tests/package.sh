#!/bin/sh
# Builds with CMake, installs to a temporary place, and uses the installed package as others would: find_package (shared
# and static), pkg-config with a C99 compiler, the header alone. Also holds the exported symbols and the SONAME.
#   tests/package.sh [work directory]      needs cargo, cmake, a C and a C++ compiler, pkg-config; Ninja if it is there
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
work=${1:-$(mktemp -d)}
mkdir -p "$work"
work=$(cd "$work" && pwd)
# one cargo directory for all builds below
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}"
CC=${CC:-cc}
CXX=${CXX:-c++}
# no "set -e" surprises inside pipes: a step says what it was before it fails
step() { printf '== %s\n' "$*"; }
fail() { printf 'package test failed: %s\n' "$*" >&2; exit 1; }


step "layout and standards of the headers"
$CC -std=c11 -Wall -Wextra -Werror -pedantic -fsyntax-only -I"$root/include" "$root/tests/layout.c"
printf '#include <armesh.h>\n' >"$work/header.c"
$CC -std=c99 -Wall -Wextra -Werror -pedantic -fsyntax-only -I"$root/include" "$work/header.c"
$CXX -std=c++11 -Wall -Wextra -Werror -pedantic -fsyntax-only -x c++ -I"$root/include" "$work/header.c"
printf '#include <armesh.hpp>\n' >"$work/header.cpp"
for standard in c++17 c++20; do
  $CXX -std=$standard -Wall -Wextra -Wshadow -Wconversion -Werror -pedantic -fno-rtti -fsyntax-only -I"$root/include" \
    "$work/header.cpp"
done

for generator in "Unix Makefiles" Ninja; do
  if [ "$generator" = Ninja ] && ! command -v ninja >/dev/null 2>&1; then
    step "no ninja here: left out"
    continue
  fi
  name=$(echo "$generator" | tr -d ' ')
  build="$work/build-$name" prefix="$work/prefix-$name"
  step "$generator: build, install to $prefix"
  cmake -S "$root" -B "$build" -G "$generator" -DCMAKE_INSTALL_PREFIX="$prefix" >/dev/null
  cmake --build "$build" -j2 >/dev/null
  [ -x "$build/minimal" ] || fail "no build/minimal"
  "$build/minimal"

  step "$generator: building again makes nothing"
  touch "$work/mark"
  cmake --build "$build" -j2 >/dev/null
  made=$(find "$build" -newer "$work/mark" -type f \( -name minimal -o -name armesh-check -o -name '*.o' -o -name 'libarmesh*' \))
  [ -z "$made" ] || fail "made anew: $made"

  cmake --install "$build" >/dev/null
  lib=$(dirname "$(find "$prefix" -name libarmesh.a)")
  step "$generator: a project that finds the package"
  mv "$prefix" "$prefix-moved" # it must not matter where it is
  cmake -S "$root/tests/package" -B "$work/consumer-$name" -G "$generator" -DCMAKE_PREFIX_PATH="$prefix-moved" \
    -DEXAMPLE="$root/examples/minimal.c" >/dev/null
  cmake --build "$work/consumer-$name" >/dev/null
  for program in cpp_armesh cpp_armesh_static c_armesh c_armesh_static; do
    (cd "$work/consumer-$name" && "./$program" >/dev/null) || fail "$program"
  done
  if ldd "$work/consumer-$name/cpp_armesh_static" | grep -q armesh; then fail "the static program needs the library"; fi
  mv "$prefix-moved" "$prefix"
done

if [ "$(uname)" = Linux ]; then
  step "exported symbols and SONAME"
  abi=$(sed -n 's/^#define AR_ABI_VERSION //p' "$root/include/armesh.h")
  so="$lib/libarmesh.so.$abi"
  strange=$(nm -D --defined-only "$so" | awk '{print $NF}' | grep -v '^ar_' || true)
  [ -z "$strange" ] || fail "exported besides ar_*: $strange"
  for function in $(sed -n 's/^[a-z].*[ *]\(ar_[a-z0-9_]*\)(.*/\1/p' "$root/include/armesh.h" | grep -v '_init$'); do
    nm -D --defined-only "$so" | grep -q " $function\$" || fail "$function is in the header but not in the library"
  done
  readelf -d "$so" | grep -q "SONAME.*\[libarmesh.so.$abi\]" || fail "SONAME"
  [ "$(readlink "$lib/libarmesh.so")" = "libarmesh.so.$abi" ] || fail "the link libarmesh.so"
fi

step "pkg-config, C99"
export PKG_CONFIG_PATH="$lib/pkgconfig"
$CC -std=c99 -Wall -Wextra -Werror -pedantic "$root/examples/minimal.c" -o "$work/minimal-shared" \
  $(pkg-config --cflags --libs armesh) -Wl,-rpath,"$lib"
"$work/minimal-shared" >/dev/null
# the archive by name, as -larmesh would take the shared one beside it
$CC -std=c99 "$root/examples/minimal.c" -o "$work/minimal-static" $(pkg-config --cflags armesh) "$lib/libarmesh.a" \
  $(pkg-config --static --libs armesh | sed 's/-larmesh//')
"$work/minimal-static" >/dev/null
[ "$(pkg-config --modversion armesh)" = "$(sed -n 's/^version = "\(.*\)"/\1/p' "$root/Cargo.toml" | head -1)" ] ||
  fail "version"
step "C++ without RTTI"
$CXX -std=c++17 -fno-rtti -Wall -Wextra -Werror "$root/tests/package/consumer.cpp" -o "$work/no-rtti" \
  $(pkg-config --cflags --libs armesh) -Wl,-rpath,"$lib" -pthread
(cd "$work" && ./no-rtti)
echo "package test passed"
