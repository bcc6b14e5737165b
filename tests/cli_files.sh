#!/bin/sh
# SPDX-License-Identifier: MIT
# What goes wrong with files and data: exit code 1, one line, and no output.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

ends 0 scene terrain a.npy --size 24 --quiet
holds a.npy

# Formats in a circle keep every voxel.
for name in b.raw b.nrrd b.nhdr b.nii b.nii.gz b.npy.gz b.vox; do
    ends 0 convert a.npy "$name"
    ends 0 convert "$name" back.npy
    cmp -s "$work/a.npy" "$work/back.npy" || bad "$name does not come back the same"
    ends 0 info "$name"
done
rm -f "$work"/b.* "$work/back.npy"
holds a.npy

# Inputs that are not what they claim.
ends 1 transform nothing.npy out.npy
says 'nothing.npy'
ends 1 info nothing.npy
echo 'this is no array at all, whatever its name says' >"$work/text.npy"
ends 1 transform text.npy out.npy
ends 1 info text.npy
head -c 1000 "$work/a.npy" >"$work/short.npy"
ends 1 transform short.npy out.npy
says 'short.npy'
: >"$work/zero.npy"
ends 1 transform zero.npy out.npy
cp "$work/a.npy" "$work/a.vox"
ends 0 info a.vox
ends 1 transform a.npy out.npy --shape 99,99,99 --input-type u16
ends 1 transform . out.npy
head -c 24 /dev/zero >"$work/some.raw"
ends 1 transform some.raw out.npy
ends 1 transform some.raw out.npy --shape 2147483647,2147483647,2147483647 --input-type u32
printf 'voxel 4 5 6\n0 0 0\n3 4 5\n' >"$work/map"
ends 0 info map --input-format 3dmap
ends 1 info map --input-format vxl
ends 2 info map --input-format 4dmap
says '3dmap, vxl'
rm "$work/map"
rm -f "$work/a.vox" "$work/zero.npy"
holds a.npy short.npy some.raw text.npy

# Types that cannot hold the answer, and answers that do not exist.
ends 0 scene single row.npy --size 600,1,1
ends 1 transform row.npy out.npy --type u8 --metric l1
says 'u8\|saturate\|uint8'
ends 0 transform row.npy out.npy --type u8 --metric l1 --saturate
rm "$work/out.npy"
ends 1 transform row.npy out.npy --type u8 --metric l1 --max-distance 2.5
printf '\000\000\200\077\000\000\300\177\000\000\000\000' >"$work/nan.raw"
ends 1 transform nan.raw out.npy --shape 3,1,1 --input-type f32
says 'NaN'
ends 1 transform nan.raw out.npy --shape 3,1,1 --input-type f32 --label 1
ends 1 transform a.npy out.npy --device 'no such device'
says 'no such device\|no Vulkan backend'
ends 1 transform a.npy out.npy --backend vulkan --device 99
ends 2 slice a.npy out.png --index 24
holds a.npy nan.raw row.npy short.npy some.raw text.npy

# Outputs that cannot be.
ends 1 transform a.npy nowhere/out.npy
says 'nowhere'
ends 1 scene full nowhere/out.npy --size 4
ends 1 transform a.npy .
ends 1 transform a.npy /proc/out.npy
ends 1 transform a.npy out.npy --indices nowhere/i.npy
ends 1 transform a.npy out.npy --slice nowhere/s.png
ends 1 transform a.npy out.bt --format octomap
ends 1 transform a.npy out.unknown-kind
if [ "$(id -u)" != 0 ]; then
    mkdir "$work/closed"
    chmod 555 "$work/closed"
    ends 1 transform a.npy closed/out.npy
    [ -z "$(ls -A "$work/closed")" ] || bad "a closed directory got $(ls -A "$work/closed")"
    rmdir "$work/closed"
fi
holds a.npy nan.raw row.npy short.npy some.raw text.npy

# A full disk. What went before the output that fails goes too.
ends 1 transform a.npy /dev/full
says '/dev/full'
ends 1 transform a.npy /dev/full --indices i.npy --slice s.png
ends 1 convert a.npy /dev/full --format nrrd
holds a.npy nan.raw row.npy short.npy some.raw text.npy
if [ -w /dev/full ]; then
    "$fathom" transform "$work/a.npy" - >/dev/full 2>"$work/.err" && bad "a full standard output was not noticed"
    grep -c '^fathom: ' "$work/.err" | grep -q '^1$' || bad "a full standard output says: $(cat "$work/.err")"
    "$fathom" devices >/dev/full 2>"$work/.err" && bad "a full standard output of devices was not noticed"
fi

# Outputs that fail late take nothing along: neither files that were there before, nor new ones.
long=$(printf '%0252d' 0).npy
echo PRECIOUS >"$work/i.npy"
ends 1 transform a.npy "$long" --indices i.npy --slice s.png --quiet
[ "$(cat "$work/i.npy")" = PRECIOUS ] || bad "a name that is too long changed another output"
ends 1 transform a.npy /dev/full --indices i.npy --slice s.png --quiet
[ "$(cat "$work/i.npy")" = PRECIOUS ] || bad "a full disk changed another output"
holds a.npy i.npy nan.raw row.npy short.npy some.raw text.npy
ends 0 transform a.npy d.npy --indices i.npy --slice s.png --quiet
ends 0 info i.npy
rm "$work/i.npy" "$work/d.npy" "$work/s.png"

# One file under two names.
mkdir "$work/sub"
ends 2 transform a.npy d.npy --indices ./d.npy
says 'same file'
ends 2 transform a.npy d.npy --indices "$work/sub/../d.npy"
cp "$work/a.npy" "$work/d.npy"
ln -s d.npy "$work/link.npy"
ends 2 transform a.npy d.npy --indices link.npy
cmp -s "$work/a.npy" "$work/d.npy" || bad "a refused command changed its output"
ends 0 transform a.npy d.npy --indices sub/d.npy --quiet
# A link to nowhere becomes the file.
ln -s nowhere "$work/sub/e.npy"
ends 0 transform a.npy sub/f.npy --indices sub/e.npy --quiet
ends 0 info sub/e.npy
rm -r "$work/sub" "$work/d.npy" "$work/link.npy"

# A failure leaves what was there before.
cp "$work/a.npy" "$work/out.npy"
ends 1 transform text.npy out.npy
ends 1 transform row.npy out.npy --type u8 --metric l1
cmp -s "$work/a.npy" "$work/out.npy" || bad "a failure changed the file that was there"
# In place is fine: the input is read before the output is renamed over it.
ends 0 transform out.npy out.npy --type u16 --metric l1
ends 0 info out.npy
grep -q 'uint16' "$work/.out" || bad "a transform onto its own input gives: $(cat "$work/.out")"
rm "$work/out.npy"

# Real files, where they are there.
data=${FATHOM_DATA:-data}
[ -n "${FATHOM_DATA:-}" ] || [ -d data ] || data=../shared/data
if [ -f "$data/volumes/freiburg_geb079.bt" ]; then
    data=$(cd "$data" && pwd)
    ends 0 transform "$data/volumes/freiburg_geb079.bt" out.npy --threshold 2 --type u16 --metric l1 --slice s.png
    ends 0 transform "$data/voxels/many_models_small.vox" out.npy --slice s.png
    ends 0 info "$data/volumes/ct_aorta_120x126x164_i16.raw.gz"
    rm "$work/out.npy" "$work/s.png"
fi
holds a.npy nan.raw row.npy short.npy some.raw text.npy
finish
