#!/bin/sh
# SPDX-License-Identifier: MIT
# Installs Fathom into a directory of its own and uses it from there. Run from the repository's root:
#   run.sh install BUILD PREFIX KIND   installs KIND (static or shared): BUILD itself if it is of that kind, else a build beside
#                                      PREFIX with BUILD's compiler and options
#   run.sh cmake BUILD PREFIX          builds and runs the consumer by find_package
#   run.sh pkg-config BUILD PREFIX     ... by pkg-config, static or shared as PREFIX is
#   run.sh readme BUILD PREFIX         builds and runs the C programs that README.md prints, with the command that it prints
#   run.sh symbols BUILD PREFIX        the library defines no name but fm_*, for a program may have any other
#   run.sh program BUILD PREFIX        runs the installed command-line program, and the painting program where BUILD has it
set -eu
step=$1
build=$2
prefix=$3
here=tests/consumer
work=$prefix-work

cached() {
    sed -n "s/^$1:[A-Z]*=//p" "$build/CMakeCache.txt"
}
CC=$(cached CMAKE_C_COMPILER)
PKG_CONFIG_PATH=$(find "$prefix" -type d -name pkgconfig 2>/dev/null || true)
LD_LIBRARY_PATH=${PKG_CONFIG_PATH%/pkgconfig}
export CC PKG_CONFIG_PATH LD_LIBRARY_PATH
mkdir -p "$work"

is_static() {
    [ -e "$LD_LIBRARY_PATH/libfathom.a" ]
}

case $step in
install)
    rm -rf "$prefix" "$prefix-first"
    shared=OFF
    [ "$4" = static ] || shared=ON
    source=$build
    if [ "$(cached BUILD_SHARED_LIBS)" != $shared ]; then
        source=$work/build
        cmake -S . -B "$source" -G Ninja -DBUILD_SHARED_LIBS=$shared -DFATHOM_TESTS=OFF -DCMAKE_C_COMPILER="$CC" \
            -DCMAKE_BUILD_TYPE="$(cached CMAKE_BUILD_TYPE)" -DFATHOM_VULKAN="$(cached FATHOM_VULKAN)" \
            -DFATHOM_CLI="$(cached FATHOM_CLI)" -DFATHOM_APP="$(cached FATHOM_APP)" -DFATHOM_WERROR="$(cached FATHOM_WERROR)"
        cmake --build "$source" -j 2
    fi
    # Moved once it is installed: nothing in it may hold the place that it was installed to.
    cmake --install "$source" --prefix "$prefix-first"
    mv "$prefix-first" "$prefix"
    ;;
cmake)
    rm -rf "$work/cmake"
    cmake -S $here -B "$work/cmake" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
    cmake --build "$work/cmake"
    unset LD_LIBRARY_PATH
    "$work/cmake/consumer"
    ;;
pkg-config)
    command -v pkg-config >/dev/null || { echo "skipped: there is no pkg-config"; exit 77; }
    if is_static; then
        # Every object of the archive, not only those that the program needs: so a missing dependency shows.
        # shellcheck disable=SC2046
        $CC -o "$work/consumer" $here/main.c -Wl,--whole-archive "$LD_LIBRARY_PATH/libfathom.a" -Wl,--no-whole-archive \
            $(pkg-config --cflags --static --libs fathom)
        "$work/consumer"
    fi
    # shellcheck disable=SC2046
    $CC -o "$work/consumer" $here/main.c $(pkg-config --cflags $(is_static && echo --static) --libs fathom)
    "$work/consumer"
    ;;
readme)
    # The three blocks fenced as C, and the one line that compiles the first.
    block() {
        awk -v wanted="$1" '/^```c$/ { on = ++count == wanted; next } /^```$/ { on = 0 } on' README.md
    }
    block 1 >"$work/nearest.c"
    block 2 >"$work/turning.c"
    block 3 >"$work/octree.c"
    command=$(grep '^cc .*nearest\.c' README.md)
    [ -s "$work/nearest.c" ]
    [ -s "$work/turning.c" ]
    [ -s "$work/octree.c" ]
    [ -n "$command" ]
    cc() {
        $CC -std=c11 -Wall -Wextra -Wpedantic -Werror "$@"
    }
    (
        cd "$work"
        eval "$command"
        ./nearest >nearest.txt
        rm -f part.stl
        for program in turning octree; do
            eval "$(echo "$command" | sed "s/nearest/$program/g")"
            # The reader's mesh is not there.
            ! ./$program 2>$program.txt
            grep -q part.stl $program.txt
        done
        # Now it is: a tetrahedron.
        {
            echo "solid part"
            for corners in "0 0 0,0 1 0,1 0 0" "0 0 0,1 0 0,0 0 1" "1 0 0,0 1 0,0 0 1" "0 1 0,0 0 0,0 0 1"; do
                echo "facet normal 0 0 0"
                echo "outer loop"
                echo "$corners" | tr , '\n' | sed 's/^/vertex /'
                echo "endloop"
                echo "endfacet"
            done
            echo "endsolid part"
        } >part.stl
        ./octree
        [ -s part.fmo ]
        [ -s part.png ]
    )
    # What the first prints stands in the block fenced as text that follows.
    sed -n '/^```c$/,${/^```text$/,/^```$/{/^```/!p}}' README.md | diff - "$work/nearest.txt"
    ;;
symbols)
    if is_static; then
        nm -g --defined-only "$LD_LIBRARY_PATH/libfathom.a" >"$work/symbols.txt"
    else
        nm -D --defined-only "$LD_LIBRARY_PATH/libfathom.so" >"$work/symbols.txt"
    fi
    grep -q ' T fm_version$' "$work/symbols.txt"
    if grep -E '^[0-9a-f]+ [A-Z] ' "$work/symbols.txt" | grep -v ' fm_' | head -n 20 | grep .; then
        echo "the library defines these names, of $(grep -Ec '^[0-9a-f]+ [A-Z] ' "$work/symbols.txt") in all, beside fm_*: in a program"
        echo "that has them too, such as one that links libvulkan, they take the place of the program's"
        exit 1
    fi
    ;;
program)
    unset LD_LIBRARY_PATH
    "$prefix/bin/fathom" version
    "$prefix/bin/fathom" devices
    if [ -e "$build/fathom-paint" ]; then
        # Found beside the program, and needs no window system.
        "$prefix/bin/fathom" paint --headless --backend cpu --size 16 --window 64x64 --auto-edit 1 --interval 0 --frames 2 \
            --csv "$work/frames.csv"
        [ "$(wc -l <"$work/frames.csv")" = 3 ]
    fi
    ;;
*)
    echo "run.sh: no such step: $step" >&2
    exit 2
    ;;
esac
