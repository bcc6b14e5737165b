#!/bin/sh
# SPDX-License-Identifier: MIT
# Octrees built into files, described and drawn, and what is refused.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

# A tetrahedron.
cat >"$work/t.obj" <<'END'
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
END
ends 0 octree --help
for command in build info render; do
    ends 0 octree "$command" --help
    grep -q "^usage: fathom octree $command" "$work/.out" || bad "octree $command --help has no usage line"
done
ends 2 octree
ends 2 octree nonsense
says 'build, info'
ends 2 octree build
ends 2 octree build t.obj
says 'OUT.fmo'
ends 2 octree info
ends 2 octree build t.obj o.fmo --kind nothing
says 'closest, distance'
ends 2 octree build t.obj o.fmo --size 0
ends 2 octree build t.obj o.fmo --size 1048577
ends 2 octree build t.obj o.fmo --method magic
ends 2 octree build t.obj o.fmo --rounds 3
says '--method grown'
ends 2 octree build t.obj o.fmo --code bytes
ends 2 octree build t.obj o.fmo --code short
says '\-\-band'
ends 2 octree build t.obj o.fmo --code short --band 0.3
ends 2 octree build t.obj o.fmo --band 4
ends 2 octree build t.obj o.fmo --kind dag --band 0.2
says '\-\-kind closest'
ends 2 octree build t.obj o.fmo --threshold 0
ends 2 octree build t.obj o.fmo --threshold x
ends 2 octree build t.obj o.fmo --sign winding
says '--kind distance'
ends 2 octree build t.obj o.fmo --kind distance --sign maybe
ends 2 octree build t.obj o.fmo --kind distance --code floats
ends 2 octree build t.obj o.fmo --kind dag --share
ends 2 octree build t.obj o.fmo --kind distance --attribute triangle
ends 2 octree build t.obj o.fmo --kind dag --attribute triangle
says 'voxels, svo and tree64'
ends 2 octree build t.obj o.fmo --kind svo --threshold 1
says 'below 0'
ends 2 octree build t.obj o.fmo --solid 2
says 'not of meshes'
ends 2 octree build t.obj t.obj
says 'end the name in .fmo'
ends 2 octree build t.obj o.fmo --attribute smell
ends 2 octree build t.obj o.fmo --box 0,0,0,1,1
ends 2 octree build t.obj o.fmo --box 0,0,0,1,-1,1
ends 2 octree build t.obj o.fmo --top 0
ends 2 octree build t.obj o.fmo --coarse 8
says '--parts'
ends 2 octree build t.obj o.fmo --parts 0
ends 2 octree build t.obj - --parts 2
ends 2 octree build t.obj o.fmo --backend cpu --device 0
ends 1 octree build t.obj nowhere/o.fmo
ends 1 octree build nothing.obj o.fmo
ends 1 octree build t.obj o.fmo --size 16 --parts 17 --backend cpu
says '17 parts'
holds t.obj

small="--size 24 --backend cpu --quiet"
# shellcheck disable=SC2086
for way in "" "--kind distance --sign winding" "--code octahedral --share" "--code floats --attribute triangle" \
    "--kind bricks" "--kind voxels --attribute triangle" "--kind svo --attribute triangle --threshold -1" "--kind dag" "--kind tree64" "--code short --band 0.1" "--method grown --rounds 4" "--box=-1,-1,-1,2,2,2 --threshold -1" "--top 1" "--parts 3 --coarse 12"; do
    ends 0 octree build t.obj o.fmo $small $way
    [ ! -s "$work/.out" ] || bad "--quiet prints with \"$way\""
    ends 0 octree info o.fmo
    grep -q '^    kind        ' "$work/.out" || bad "info names no kind with \"$way\""
    ends 0 octree info --json o.fmo
    grep -q '"levels":' "$work/.out" || bad "info --json with \"$way\""
    rm "$work/o.fmo"
done
ends 0 octree build t.obj o.fmo --size 16 --backend cpu --box 5,5,5,6,6,6
grep -q 'does --box miss it?' "$work/.err" || bad "a box that misses the mesh is not told"
ends 0 octree build t.obj o.fmo --size 24 --backend cpu --json
grep -q '"build_milliseconds":' "$work/.out" || bad "build --json"
grep -q '"parts":	0' "$work/.out" || bad "a whole file says that it has parts"
# Through pipes.
(cd "$work" && "$fathom" octree build t.obj - --size 24 --backend cpu --quiet | "$fathom" octree info --json -) >"$work/.out" 2>&1 ||
    bad "through a pipe: $(cat "$work/.out")"
grep -q '"kind":	"closest"' "$work/.out" || bad "through a pipe"
# Voxels.
ends 0 scene city city.npy --size 16 --quiet
for kind in voxels svo dag tree64; do
    ends 0 octree build city.npy v.fmo --kind $kind --backend cpu --quiet
    ends 0 octree info v.fmo
    grep -q "^    kind        $kind" "$work/.out" || bad "info of $kind: $(cat "$work/.out")"
done
for kind in closest distance bricks; do
    ends 2 octree build city.npy v.fmo --kind $kind --backend cpu
    says 'are of meshes'
done
ends 0 octree build city.npy v.fmo --backend cpu --quiet
ends 0 octree info v.fmo
grep -q '^    kind        voxels' "$work/.out" || bad "voxels become: $(cat "$work/.out")"
ends 0 octree build city.npy v.fmo --kind voxels --solid 200 --backend cpu --quiet
for way in "--size 8" "--box 0,0,0,1,1,1" "--attribute triangle"; do
    # shellcheck disable=SC2086
    ends 2 octree build city.npy v.fmo $way
    says 'have their own'
done
ends 2 octree build city.npy v.fmo --kind voxels --parts 2 --backend cpu
says 'no mesh'
# Pictures.
small="--size 48x32 --backend cpu --quiet"
for way in "" "--shadow --reflection 0.3" "--refraction 1.5" "--view normals" "--view reads --epsilon 0.2" "--view levels" \
    "--sun 0,0,1 --shadow" "--camera 0.3,-2,0.5,90,0" "--look-at 0,0,0,3,10,-5"; do
    # shellcheck disable=SC2086
    ends 0 octree render o.fmo $small $way -o p.png
    [ -s "$work/p.png" ] || bad "no picture with \"$way\""
    rm -f "$work/p.png"
done
# shellcheck disable=SC2086
ends 0 octree render t.obj $small --cells 24 --kind distance --stats
grep -q '^rays 1536, ' "$work/.out" || bad "--stats counts no rays: $(cat "$work/.out")"
# shellcheck disable=SC2086
ends 0 octree render city.npy $small --kind dag -o p.png
# shellcheck disable=SC2086
ends 0 octree render v.fmo $small --path 2 -o q.png
holds t.obj o.fmo city.npy v.fmo p.png q0000.png q0001.png
rm "$work/p.png" "$work"/q000?.png
ends 0 octree build t.obj s.fmo --size 32 --parts 4 --backend cpu --quiet
# shellcheck disable=SC2086
ends 0 octree render s.fmo $small --budget 1 --distance 9 --stats -o p.png
grep -q '^parts 64, of which ' "$work/.out" || bad "--stats counts no parts: $(cat "$work/.out")"
# A part that cannot be read: a coarser picture, and a word.
cp "$work/s.fmo" "$work/w.fmo"
size=$(wc -c <"$work/w.fmo")
half=$((size / 8192 * 4096))
dd if=/dev/zero of="$work/w.fmo" bs=4096 seek=$((half / 4096)) count=8 conv=notrunc 2>/dev/null
(cd "$work" && "$fathom" octree render w.fmo --size 48x32 --backend cpu --quiet --distance 9 -o p.png) >"$work/.out" 2>"$work/.err" ||
    bad "a part that cannot be read stops the picture: $(cat "$work/.err")"
says 'stay coarse'
# A description finds it, too.
ends 1 octree info w.fmo
says 'part [0-9]*: '
ends 0 octree info s.fmo
grep -q '^    parts       4 x 4 x 4 of 8 cells of .*; [1-9][0-9]* of 64 hold' "$work/.out" || bad "info of parts: $(cat "$work/.out")"
ends 0 octree info --json s.fmo
grep -q '"parts_checked":	true' "$work/.out" || bad "info --json of parts: $(cat "$work/.out")"
(cd "$work" && "$fathom" octree info - <s.fmo) >"$work/.out" 2>&1 || bad "parts through a pipe: $(cat "$work/.out")"
grep -q '^    parts       64, not checked' "$work/.out" || bad "parts through a pipe: $(cat "$work/.out")"
ends 0 octree build t.obj again.fmo --size 32 --parts 4 --backend cpu
grep -q '^    parts       4 x 4 x 4 ' "$work/.out" || bad "the report of parts: $(cat "$work/.out")"
rm "$work/again.fmo"
# What is no place for an octree says what is.
for command in "info s.fmo" "render s.fmo -o p.png" "octree build s.fmo y.fmo" "transform s.fmo y.npy" "sdf s.fmo y.npy"; do
    # shellcheck disable=SC2086
    ends 1 $command
    says 'it is an octree'
done
# Turned: the box's y and z change places.
sed 's/^v 0 1 0/v 0 2 0/; s/^v 0 0 1/v 0 0 5/' "$work/t.obj" >"$work/long.obj"
ends 0 octree build long.obj up.fmo --up y --flip --size 16 --backend cpu --quiet
ends 0 octree build long.obj as.fmo --size 16 --backend cpu --quiet
shape_of() {
    "$fathom" octree info --json "$work/$1" | tr -d ' \n\t' | sed 's/.*"cells":\[\([0-9,]*\)\].*/\1/'
}
turned=$(shape_of up.fmo | awk -F, '{ print $1 "," $3 "," $2 }')
if [ "$turned" = "$(shape_of up.fmo)" ] || [ "$turned" != "$(shape_of as.fmo)" ]; then
    bad "--up y: cells $(shape_of up.fmo), without it $(shape_of as.fmo)"
fi
# shellcheck disable=SC2086
ends 0 octree render t.obj $small --cells 16 --up y -o p.png
rm "$work/up.fmo" "$work/as.fmo" "$work/long.obj"
# All that octrees are compared with, from the same camera.
for kind in closest distance voxels svo dag tree64 bricks field; do
    # shellcheck disable=SC2086
    ends 0 octree render t.obj $small --cells 16 --kind $kind --look-at 0.3,0.3,0.3,3,50,-30 --shadow --stats -o $kind.png
    [ -s "$work/$kind.png" ] || bad "no picture of --kind $kind"
    rm -f "$work/$kind.png"
done
grep -q '^  surface ' "$work/.out" || bad "--kind field tells no times: $(cat "$work/.out")"
# shellcheck disable=SC2086
ends 0 octree render t.obj $small --cells 16 --kind field --box 0,0,0,2,1,1 --sun 0,0,1 --view reads -o p.png
ends 2 octree build t.obj f.fmo --kind field
ends 2 octree render city.npy --kind field -o p.png
says 'is of meshes'
for way in "--view levels" "--reflection 0.5" "--epsilon 0.2" "--top 8" "--share" "--method grown"; do
    # shellcheck disable=SC2086
    ends 2 octree render t.obj --kind field $way -o p.png
done
ends 2 octree render city.npy --up y -o p.png
says 'are of meshes'
ends 2 octree render o.fmo --flip -o p.png
says 'are of meshes'
ends 2 octree render o.fmo --device 0 --backend cpu -o p.png
says 'names a Vulkan device'
ends 2 octree render
ends 2 octree render o.fmo
says 'nothing to do'
ends 2 octree render o.fmo -o p.png --kind distance
says 'as it was built'
ends 2 octree render o.fmo -o p.png --cells 8
ends 2 octree render o.fmo -o p.png --budget 8
says 'is whole'
ends 2 octree render t.obj -o p.png --budget 8
says '\-\-parts'
ends 2 octree render o.fmo -o p.png --budget 0
ends 2 octree render s.fmo -o p.png --distance 0
ends 2 octree render o.fmo -o p.jpg
ends 2 octree render o.fmo -o p.png --view depth
ends 2 octree render o.fmo -o p.png --reflection 1.5
ends 2 octree render o.fmo -o p.png --refraction 1
ends 2 octree render o.fmo -o p.png --refraction 9
ends 2 octree render o.fmo -o p.png --epsilon 9
ends 2 octree render o.fmo -o p.png --sun 0,0,0
ends 2 octree render o.fmo -o p.png --size 0x3
ends 2 octree render o.fmo --path 2 --stats
ends 1 octree render o.fmo -o nowhere/p.png
ends 1 octree render nothing.fmo -o p.png
rm "$work/p.png" "$work/s.fmo" "$work/w.fmo"
# Damaged files.
ends 1 octree info t.obj
says 'does not begin as'
ends 1 octree info nothing.fmo
head -c 5000 "$work/o.fmo" >"$work/cut.fmo"
ends 1 octree info cut.fmo
says 'truncated'
cp "$work/o.fmo" "$work/bad.fmo"
printf 'x' | dd of="$work/bad.fmo" bs=1 seek=5000 conv=notrunc 2>/dev/null
ends 1 octree info bad.fmo
says 'checksum'
holds t.obj o.fmo city.npy v.fmo cut.fmo bad.fmo
finish
