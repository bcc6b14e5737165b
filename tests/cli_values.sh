#!/bin/sh
# SPDX-License-Identifier: MIT
# Each option does what it says, on rows short enough to work out by hand.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

# The bytes 0 0 5 0 0 7 7: a row of seven voxels.
printf '\000\000\005\000\000\007\007' >"$work/row.raw"

# gives "NUMBERS" OD-TYPE ARGUMENTS...: the field of the row, written raw, has these elements.
gives() {
    numbers=$1
    layout=$2
    shift 2
    ends 0 transform row.raw field.raw --shape 7,1,1 --input-type u8 --quiet "$@"
    [ ! -s "$work/.out" ] || bad "--quiet printed: $(cat "$work/.out")"
    got=$(od -An -v -w64 "-t$layout" "$work/field.raw" | tr -s ' ' | sed 's/^ //; s/ $//')
    [ "$got" = "$numbers" ] || bad "got $got, not $numbers: $*"
    rm -f "$work/field.raw" "$work/field.raw.txt"
}

gives '2 1 0 1 1 0 0' f4
gives '2 1 0 1 1 0 0' u1 --type u8 --metric l1
gives '2 1 0 1 1 0 0' u2 --type u16 --metric linf
gives '4 1 0 1 1 0 0' u4 --type u32 --squared
gives '4 1 0 1 1 0 0' u4 --type u32 --squared --algorithm brute-force
gives '2 1 0 1 1 0 0' f4 --algorithm separable --threads 1
gives '2 1 -1 1 1 -1 -1' d1 --type i8 --signed --metric l1
gives '1 1 -1 1 1 -1 -2' d1 --type i8 --signed --metric l1 --outside solid
gives '5 4 3 2 1 0 0' u1 --type u8 --metric l1 --threshold 6
gives '5 4 3 2 1 0 0' u1 --type u8 --metric l1 --label 7
gives '2 1 0 1 2 3 4' u1 --type u8 --metric l1 --label 5
gives '2 2 2 2 1 0 0' u1 --type u8 --metric l1 --label 7 --max-distance 2
gives '255 255 255 255 255 255 255' u1 --type u8 --metric l1 --label 99
gives '3 3 3 3 3 3 3' u1 --type u8 --metric l1 --label 99 --max-distance 3
gives '0 0 0 0 0 0 0' f4 --threshold 0

# What selects nothing, or all, is said; what the type cannot hold is refused.
ends 0 transform row.raw field.npy --shape 7,1,1 --input-type u8 --label 99
says 'note: no voxel is solid'
ends 0 transform row.raw field.npy --shape 7,1,1 --input-type u8 --threshold 8
says 'note: no voxel is solid'
ends 0 transform row.raw field.npy --shape 7,1,1 --input-type u8 --threshold 0 --signed --type i16
says 'note: every voxel is solid'
ends 0 transform row.raw field.npy --shape 7,1,1 --input-type u8 --threshold 7 --signed --type i16
[ ! -s "$work/.err" ] || bad "a field of both sides is noted: $(cat "$work/.err")"
ends 2 transform row.raw none.npy --shape 7,1,1 --input-type u8 --label 256
says 'from 0 to 255'
ends 2 transform row.raw none.npy --shape 7,1,1 --input-type i8 --label -129
says 'from -128 to 127'
ends 2 transform row.raw none.npy --shape 7,1,1 --input-type u8 --spacing file
says 'tells no voxel size'
[ ! -e "$work/none.npy" ] || bad "a refusal wrote a field"
rm "$work/field.npy"

gives '1 0.5 0 0.5 0.5 0 0' f4 --spacing 0.5,1,1
gives '1 0.5 0 0.5 0.5 0 0' f4 --spacing 0.5,3,2
gives '1 0.5 0 0.5 0.5 0 0' f4 --spacing 0.5
gives '2 1 0 1 1 0 0' u1 --type u8 --metric L1 --backend CPU

# Statistics, of whole numbers and of floats, from a file and from a pipe.
ends 0 info row.raw --shape 7,1,1 --input-type u8 --stats
for text in 'values    0 to 7, 3 different' 'non-zero  3 of 7 (42.9 %)' 'commonest 0: 4 voxels' '7: 2 voxels'; do
    grep -q "$text" "$work/.out" || bad "--stats lacks \"$text\": $(cat "$work/.out")"
done
grep -q NaN "$work/.out" && bad "--stats of integers counts NaN"
printf '\000\000\200\277\000\000\300\177\000\000\200\177\000\000\000\100' >"$work/floats.raw"
ends 0 info floats.raw --shape 4,1,1 --input-type f32 --stats
for text in 'values    -1 to 2$' 'non-zero  4 of 4' '1 NaN, 1 infinite'; do
    grep -q "$text" "$work/.out" || bad "--stats of floats lacks \"$text\": $(cat "$work/.out")"
done
printf '\377\377\377\377\377\377\377\377\376\377\377\377\377\377\377\377' >"$work/wide.raw"
"$fathom" info - --shape 2,1,1 --input-type u64 --stats <"$work/wide.raw" >"$work/.out" || bad "info of a pipe"
grep -q '18446744073709551614 to 18446744073709551615, 2 different' "$work/.out" || bad "--stats of u64: $(cat "$work/.out")"
# Where all voxels are solid, their indices are as many values.
for count in 65536 65537; do
    ends 0 scene full many.npy --size "$count,1,1"
    ends 0 transform many.npy field.npy --indices many.npy --quiet
    ends 0 info many.npy --stats
    [ "$count" = 65536 ] && words='0 to 65535, 65536 different' || words='0 to 65536, more than 65536 different'
    grep -q "$words" "$work/.out" || bad "--stats of $count values: $(cat "$work/.out")"
done
rm "$work/floats.raw" "$work/wide.raw" "$work/many.npy" "$work/field.npy"

# Pictures: no palette to show, the greys by both names, and the range beside the name.
ends 2 slice row.raw row.png --shape 7,1,1 --input-type u8 --map palette
says 'row.raw has no palette'
[ ! -e "$work/row.png" ] || bad "a picture without its palette was written"
for map in labels GREY gray; do
    ends 0 slice row.raw "$map.png" --shape 7,1,1 --input-type u8 --map "$map"
done
cmp -s "$work/GREY.png" "$work/gray.png" || bad "grey and gray differ"
cmp -s "$work/labels.png" "$work/gray.png" && bad "labels are grey"
ends 0 slice row.raw turned.png --shape 1,7,1 --input-type u8 --flip
ends 0 slice row.raw straight.png --shape 1,7,1 --input-type u8
cmp -s "$work/turned.png" "$work/straight.png" && bad "--flip does nothing"
rm "$work"/*.png

# A grid three slices deep and wide, so that what lies outside is one step from its rim.
head -c 27 /dev/zero >"$work/cube.raw"
ends 0 transform cube.raw field.raw --shape 3,3,3 --input-type u8 --type u8 --metric l1 --outside solid
[ "$(od -An -v -tu1 -w27 "$work/field.raw" | tr -s ' ' | sed 's/^ //')" = '1 1 1 1 1 1 1 1 1 1 1 1 1 2 1 1 1 1 1 1 1 1 1 1 1 1 1' ] ||
    bad "--outside solid: $(od -An -v -tu1 -w27 "$work/field.raw")"

# Indices of the nearest solid voxel, the lower one where two are equally near.
ends 0 transform row.raw field.npy --shape 7,1,1 --input-type u8 --indices nearest.raw
[ "$(od -An -v -tu4 -w28 "$work/nearest.raw" | tr -s ' ' | sed 's/^ //')" = '2 2 2 2 5 5 6' ] ||
    bad "--indices: $(od -An -v -tu4 -w28 "$work/nearest.raw")"

# The report names the passes; the file's own spacing is taken when asked for.
ends 0 scene single one.npy --size 9,5,3
ends 0 convert one.npy one.nrrd
ends 2 transform one.npy field.nrrd --spacing file
printf 'NRRD0004\ntype: uint8\ndimension: 3\nsizes: 7 1 1\nspacings: 0.5 3 2\nencoding: raw\n\n' >"$work/thin.nrrd"
cat "$work/row.raw" >>"$work/thin.nrrd"
ends 0 transform thin.nrrd thin.npy
grep -q 'distances are in voxels, of 0.5, 3, 2 in the file: --spacing file' "$work/.out" || bad "no word of units: $(cat "$work/.out")"
ends 0 transform thin.nrrd thin.raw --spacing file
grep -q 'in voxels' "$work/.out" && bad "world units are called voxels"
[ "$(od -An -v -tf4 -w28 "$work/thin.raw" | tr -s ' ' | sed 's/^ //')" = '1 0.5 0 0.5 0.5 0 0' ] || bad "--spacing file is not applied"
# The sidecar of a raw field tells its spacing too.
ends 0 transform thin.raw again.npy --spacing file
ends 0 transform one.nrrd field.nrrd --spacing file --slice slice.png
grep -q '^total ' "$work/.out" || bad "no table of passes: $(cat "$work/.out")"
grep -q '^backend: ' "$work/.out" || bad "no backend named"
grep -q 'slice.png: middle slice across z, values 0 to 4' "$work/.out" || bad "the slice is not described: $(cat "$work/.out")"
head -c 8 "$work/slice.png" | od -An -tx1 | grep -q '89 50 4e 47 0d 0a 1a 0a' || bad "slice.png is no PNG"
finish
