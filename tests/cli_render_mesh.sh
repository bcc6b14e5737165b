#!/bin/sh
# SPDX-License-Identifier: MIT
# Pictures of meshes and of fields, and what is refused.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

# A tetrahedron, y up.
cat >"$work/t.obj" <<'END'
v 0 0 0
v 1 0 0
v 0 0 -1
v 0 1 0
f 1 3 2
f 1 2 4
f 2 3 4
f 3 1 4
END
small="--edge 24 --size 48x32 --blend 2 --quiet --backend cpu"
# shellcheck disable=SC2086
for way in "" "--up y" "--surface mesh --shadow rays --samples 8" "--shadow ray" "--shadow rtsdf" "--shadow map" "--view normal" "--view steps" \
    "--view share" "--level 1.5" "--floor --up y" "--flip --sign winding" "--light-at 1,-1,2 --light-radius 0.3" \
    "--camera 600000,0,0,90,0" "--camera 0.3,-2,0.5,90,0" "--look-at 0,0,0,3,10,-5"; do
    ends 0 render t.obj $small $way -o picture.png
    [ -s "$work/picture.png" ] || bad "no picture with \"$way\""
    rm -f "$work/picture.png"
done
# shellcheck disable=SC2086
ends 0 render t.obj $small --path 3 -o p.png
[ -s "$work/p0000.png" ] && [ -s "$work/p0002.png" ] && [ ! -e "$work/p0003.png" ] || bad "a path of 3 is not 3 pictures"
# shellcheck disable=SC2086
ends 0 render t.obj $small --stats
grep -q surface "$work/.out" || bad "--stats names no pass"

ends 0 sdf t.obj field.npy --size 24 --far flooded --backend cpu --quiet
ends 0 render field.npy --field --size 48x32 --blend 1 --quiet --backend cpu -o f.png
# Fields that are not what they seem are spoken of; the picture of a field with its spacing given is that of the mesh's own.
drawn() {
    # shellcheck disable=SC2086
    ends 0 render "$@" --edge 24 --size 48x32 --blend 1 --backend cpu
}
notes() {
    grep -q -- "^note: .*$1" "$work/.out" || bad "no note has \"$1\": $(cat "$work/.out")"
}
quiet() {
    ! grep -q '^note: ' "$work/.out" || bad "there is a note: $(cat "$work/.out")"
}
drawn t.obj --up y -o f.png
quiet
sed 's/^f \(.\) \(.\) \(.\)/f \1 \3 \2/' "$work/t.obj" >"$work/inwards.obj"
drawn inwards.obj -o f.png
notes 'look inwards.*--flip'
drawn inwards.obj --flip -o f.png
quiet
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >"$work/open.obj"
drawn open.obj -o f.png
notes 'not closed.*--surface mesh.*--sign pseudonormal'
drawn open.obj --surface mesh -o f.png
quiet
drawn open.obj --sign pseudonormal -o f.png
quiet
ends 0 sdf t.obj fine.npy --size 60 --far flooded --backend cpu
grep -q 'keeps neither spacing nor origin' "$work/.out" || bad "sdf does not say what .npy loses"
spacing=$(sed -n 's/^grid: .* voxels of \([0-9.e-]*\), from.*/\1/p' "$work/.out")
ends 0 sdf t.obj fine.nrrd --size 60 --far flooded --backend cpu
! grep -q 'keeps neither' "$work/.out" || bad "sdf says that .nrrd loses its spacing"
drawn fine.npy --field --view share -o wrong.png
notes 'give --spacing'
drawn fine.npy --field --view share --spacing "$spacing" -o right.png
quiet
drawn fine.nrrd --field --view share -o true.png
quiet
cmp -s "$work/right.png" "$work/true.png" || bad "--spacing is not the spacing of the file"
! cmp -s "$work/wrong.png" "$work/true.png" || bad "the spacing makes no difference"
drawn t.obj -o a.png
drawn t.obj --floor -o b.png
! cmp -s "$work/a.png" "$work/b.png" || bad "there is no floor"
(cd "$work" && "$fathom" render - --input-format obj --edge 24 --size 48x32 --blend 1 --backend cpu -q -o piped.png <t.obj) || bad "no pipe"
cmp -s "$work/a.png" "$work/piped.png" || bad "a mesh through a pipe is another"

ends 2 render t.obj --spacing 1 -o f.png
ends 2 render field.npy --field --spacing 0 -o f.png
ends 2 render field.npy --field --floor -o f.png
ends 2 render t.obj --light-radius 1 -o f.png
says 'where is the lamp'
ends 2 render t.obj --light-at 0,0,1 --sun 0,0,1 -o f.png
ends 2 render t.obj --light-at 0,0,1 --light-radius -1 -o f.png
ends 2 render t.obj --light-at 0,0,1 --shadow map -o f.png
ends 2 render - --input-format stl --sign up -o f.png
ends 2 render field.npy --field --shadow ray -o f.png
says 'triangles'
ends 2 render field.npy --field --up y -o f.png
ends 2 render t.obj
says 'nothing to do'
ends 2 render t.obj --path 2 -o x
says 'NAME.png'
ends 2 render t.obj --sun-size 50 -o f.png
ends 2 render t.obj --shadow soft -o f.png
ends 2 render t.obj --samples 0 -o f.png
ends 1 render t.obj -o nowhere/f.png
ends 0 scene city city.npy --size 16 --quiet
ends 1 render city.npy --field -o f.png
says 'float32'
printf 'ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n' >"$work/empty.ply"
ends 0 render empty.ply --edge 16 --size 16x16 --blend 1 --quiet --backend cpu -o f.png
finish
