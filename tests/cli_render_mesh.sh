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
    "--view share" "--level 1.5" "--camera 0.3,-2,0.5,90,0" "--look-at 0,0,0,3,10,-5"; do
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
