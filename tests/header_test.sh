#!/bin/sh
# SPDX-License-Identifier: MIT
# header_test.sh CC CXX: every public header compiles alone, and twice over, as C99, C11 and C++11.
set -eu
cc=$1
cxx=$2
for compiler in "$cc" "$cxx"; do
    if ! command -v "$compiler" >/dev/null; then
        echo "skipped: there is no $compiler"
        exit 77
    fi
done

# $1 compiler, $2 language, $3 standard; the rest: options.
compile() {
    compiler=$1 language=$2 standard=$3
    shift 3
    printf '#include "%s"\n#include "%s"\n' "$header" "$header" |
        "$compiler" -x "$language" -std="$standard" -Wall -Wextra -Wpedantic -Wshadow -Werror -Iinclude -fsyntax-only "$@" -
}

count=0
for file in include/fathom/*.h; do
    header=${file#include/}
    compile "$cc" c c99 -Wstrict-prototypes
    compile "$cc" c c11 -Wstrict-prototypes
    compile "$cxx" c++ c++11 -Wold-style-cast
    count=$((count + 1))
done
[ "$count" -gt 0 ]
echo "$count headers compile alone with $cc and $cxx"
