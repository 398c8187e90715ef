#!/bin/sh
# Compares the C interface (functions, their types, the layout of structs) with the committed description of it, abi/armesh.abi.
# Additions are welcome; anything that would break a program compiled before is an error.
#
#     tests/abi.sh             compares
#     tests/abi.sh --update    writes the description anew: with a release, or with a new ABI number
#
# The types are taken from the header, as a C compiler sees them; that the library's own structs are laid out alike is
# asserted in src/capi and tests/layout.c.
set -eu
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cd "$here/include"
{
    echo '#include "armesh.h"'
    # one variable a function, of the function's type
    grep -v 'static inline' armesh.h | grep -oE '\bar_[a-z0-9_]+\(' | tr -d '(' | sort -u |
        sed 's/.*/extern __typeof__(\&&) abi_&; __typeof__(\&&) abi_& = &;/'
} >"$work/interface.c"
${CC:-cc} -g -fPIC -shared -I. -fdebug-prefix-map="$work"=. -fdebug-prefix-map="$here/include"=. \
    -Wl,-soname,libarmesh-interface.so -o "$work/interface.so" "$work/interface.c"
abidw --no-comp-dir-path --no-corpus-path --no-show-locs "$work/interface.so" |
    sed -E "s# path='[^']*'# path='interface.c'#" >"$work/now.abi"

if [ "${1:-}" = --update ]; then
    cp "$work/now.abi" "$here/abi/armesh.abi"
else
    abidiff --no-added-syms "$here/abi/armesh.abi" "$work/now.abi"
fi
