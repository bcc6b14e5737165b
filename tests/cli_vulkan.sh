#!/bin/sh
# SPDX-License-Identifier: MIT
# A Vulkan device, a software driver included, writes the files that the CPU writes, bit for bit.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
cd "$work" || exit 1

ends 0 scene terrain a.npy --size 40,33,21
"$fathom" transform a.npy a.npy.probe --format npy --backend vulkan --quiet 2>error || skip "no usable Vulkan device: $(cat error)"

same() {
    "$fathom" transform a.npy cpu.npy --backend cpu --quiet "$@" || bad "cpu: $*"
    "$fathom" transform a.npy gpu.npy --backend vulkan --quiet "$@" || bad "vulkan: $*"
    cmp -s cpu.npy gpu.npy || bad "the backends differ: $*"
}

for metric in l1 l2 linf; do
    same --metric "$metric"
    same --metric "$metric" --signed --outside solid
    same --metric "$metric" --threshold 2.5 --max-distance 3
done
for metric in l1 linf; do
    same --metric "$metric" --type u8 --label 2
    same --metric "$metric" --type i16 --signed
done
same --squared --type u32
same --spacing 2,2,2

for backend in cpu vulkan; do
    ends 0 transform a.npy field.npy --indices "$backend.npy" --label 1 --backend "$backend"
    grep -q "^backend: $backend" .out || bad "the report does not name $backend: $(cat .out)"
done
cmp -s cpu.npy vulkan.npy || bad "the backends' indices differ"

ends 0 bench transform --sizes 20x9x7 --scenes terrain,shell,empty --metrics l1,l2,linf --inputs u8,bits --engines fathom-vulkan,copy \
    --backend vulkan --runs 3 --seconds 0.01 --samples 200
grep -q FAILED .out && bad "a case failed: $(grep FAILED .out | head -n 1)"
finish
