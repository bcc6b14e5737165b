#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds the fuzz targets with clang's address and undefined behaviour sanitizers and runs each for a time:
#     fuzz/run.sh SECONDS [TARGET...]
# What a target finds lies in build/fuzz/found; the corpus grows in build/fuzz/corpus.
set -eu

seconds=${1:?usage: fuzz/run.sh SECONDS [TARGET...]}
shift
cd "$(dirname "$0")/.."
build=build/fuzz

CC=clang cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DFATHOM_FUZZ=ON \
    -DFATHOM_SANITIZE=address,undefined -DFATHOM_VULKAN=OFF -DFATHOM_CLI=OFF -DFATHOM_TESTS=OFF >"$build.log" 2>&1 ||
    { cat "$build.log"; exit 1; }
all=$(cat "$build/fuzz/targets")
targets=${*:-$all}
wanted=fuzz_seeds
for target in $targets; do
    wanted="$wanted fuzz_$target"
done
# shellcheck disable=SC2086
ninja -C "$build" $wanted
mkdir -p "$build/found"
for target in $all; do
    mkdir -p "$build/seeds/$target"
done
"$build/fuzz/fuzz_seeds" "$build/seeds"

status=0
for target in $targets; do
    mkdir -p "$build/corpus/$target"
    echo "fuzz_$target: $seconds s"
    # The smallest map has a span for each of its columns.
    longest=4096
    [ "$target" != vxl ] || longest=2200000
    # A page for the header, and for each section.
    [ "$target" != fmo ] || longest=40000
    # And for each part the same.
    [ "$target" != fmo_parts ] || longest=60000
    if ! "$build/fuzz/fuzz_$target" -max_total_time="$seconds" -max_len="$longest" -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
        -artifact_prefix="$build/found/$target-" "$build/corpus/$target" "$build/seeds/$target" >"$build/$target.log" 2>&1; then
        tail -40 "$build/$target.log"
        echo "fuzz_$target: failed, see $build/$target.log"
        status=1
    else
        grep -E "number_of_executed_units|cov:" "$build/$target.log" | tail -2
    fi
done
exit $status
