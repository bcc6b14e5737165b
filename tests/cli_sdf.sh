#!/bin/sh
# SPDX-License-Identifier: MIT
# Fields and voxels of meshes on the command line.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' >"$work/a.obj"
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >"$work/open.obj"

ends 0 sdf a.obj a.npy --size 20 --backend cpu --triangles t.npy --slice a.png
grep -q 'sign: pseudonormal, the mesh is one closed surface' "$work/.out" || bad "the report does not say which sign and why"
grep -q 'grid: 20 x 20 x 20' "$work/.out" || bad "the report does not tell the grid"
grep -q '^nearest ' "$work/.out" || bad "the report does not time the passes"
[ -s "$work/a.png" ] || bad "there is no picture"
ends 0 sdf open.obj o.npy --size 20 --backend cpu --json
! command -v python3 >/dev/null || python3 - "$work/.out" <<'END' || bad "the JSON of a field is not what it should be"
import json, sys
r = json.load(open(sys.argv[1]))
assert r["sign"] == "winding" and r["sign_why"] == "the mesh is not closed" and r["band"] == 3 and r["far"] == "band"
assert r["triangles"] == 1 and r["shape"] == [20, 20, 9] and abs(r["spacing"][0] - 1 / 12) < 1e-12 and r["backend"] == "cpu"
assert [p["name"] for p in r["passes"]] == ["nearest", "sign"]
END
ends 0 sdf a.obj full.npy --size 12 --backend cpu --band full --margin 2 --sign winding
ends 0 sdf a.obj flooded.npy --size 12 --backend cpu --far flooded --sign none
ends 0 sdf a.obj box.nrrd --size 8 --backend cpu --box=-1,-1,-1,1,1,3
ends 0 sdf a.obj a.nvdb --size 20 --backend cpu
if command -v python3 >/dev/null; then
    (cd "$work" && python3 - <<'END') || bad "the fields are not what they should be"
import array, ast

def load(name, kind):
    data = open(name, "rb").read()
    start = 10 + int.from_bytes(data[8:10], "little")
    return ast.literal_eval(data[10:start].decode())["shape"], array.array(kind, data[start:])

shape, a = load("a.npy", "f")
_, t = load("t.npy", "I")
h = 1 / 12
assert shape == (20, 20, 20) and abs(max(map(abs, a)) - 3 * h) < 1e-6 and min(a) < 0 < max(a)
assert sum((n < 4) == (abs(d) < 3 * h) for n, d in zip(t, a)) > 0.99 * len(a) and max(t) == 2**32 - 1
# The corner of the grid sees the tetrahedron's corner at 0, from 1.5 voxels of 1 / 8 away along each axis.
shape, full = load("full.npy", "f")
assert shape == (12, 12, 12) and abs(full[0] - 1.5 / 8 * 3**0.5) < 1e-6 and min(full) < 0
_, flooded = load("flooded.npy", "f")
assert min(flooded) >= 0 and max(flooded) > 3 / 4 * 0.5
END
fi
ends 0 voxelize a.obj v.npy --size 10 --backend cpu --solid --slice v.png
ends 0 voxelize a.obj v.npy --size 10 --backend cpu --thin --json
grep -q '"surface":[[:space:]]*"thin"' "$work/.out" || bad "the report does not say that the surface is thin"
ends 0 voxelize a.obj v.vox --size 10 --backend cpu -q
[ ! -s "$work/.out" ] || bad "--quiet prints"

# Which way up, over which way round, and through a pipe.
ends 0 sdf a.obj up.npy --size 10 --backend cpu --up y
grep -q 'from -1.75, -2.75, -1.75' "$work/.out" || bad "the grid does not turn with the mesh: $(grep grid: "$work/.out")"
(cd "$work" && "$fathom" sdf - piped.npy --input-format obj --size 20 --backend cpu -q <a.obj) || bad "no mesh through a pipe"
cmp -s "$work/a.npy" "$work/piped.npy" || bad "a mesh through a pipe is another"
(cd "$work" && "$fathom" info - --input-format OBJ <a.obj) >"$work/.out" 2>&1 || bad "no info of a mesh through a pipe"
grep -q 'surface *closed' "$work/.out" || bad "info of a pipe tells no mesh"
ends 0 sdf a.obj o.npy --size 20 --backend cpu --flip
grep -q '^note: .*look inwards' "$work/.out" || bad "a mesh that looks inwards is not spoken of"
ends 0 sdf open.obj o.npy --size 20 --backend cpu
grep -q '^note: .*not closed' "$work/.out" || bad "a field without inside is not spoken of"
ends 0 voxelize open.obj o.npy --size 20 --backend cpu --solid
grep -q '^note: .*not closed' "$work/.out" || bad "--solid of an open mesh is not spoken of"
ends 0 voxelize a.obj v.npy --size 20 --backend cpu --solid --up y
! grep -q '^note: ' "$work/.out" || bad "a closed mesh is spoken of"
ends 2 sdf a.obj b.npy --input-format vox
says 'ply, obj'
ends 2 voxelize a.obj b.npy --up x

ends 0 sdf a.obj alias --format nvdb --size 20 --backend cpu
cmp -s "$work/alias" "$work/a.nvdb" || bad "nvdb is not nanovdb"
ends 2 sdf a.obj b.npy --size 3 --size 4
says '--size=4 is given twice'
for command in "slice a.obj b.png" "convert a.obj b.npy" "transform a.obj b.npy"; do
    # shellcheck disable=SC2086
    ends 1 $command
    says 'fathom sdf or fathom voxelize'
done
ends 2 sdf a.obj b.npy --size 0
says '--size'
ends 2 sdf a.obj b.npy --size 17000
says 'at most 16384'
ends 2 sdf a.obj b.npy --band -1
ends 2 sdf a.obj b.npy --band full --far band
says 'leave one of the two out'
ends 2 sdf a.obj b.npy --sign inside
ends 2 sdf a.obj b.npy --box 0,0,0,1,1
says 'X0,Y0,Z0'
ends 2 sdf a.obj b.npy --box 0,0,0,1,1,1 --margin 3
ends 2 sdf a.obj b.npy --triangles ./b.npy
says 'same file'
ends 2 sdf a.obj b.npy --size 8 --margin 4
says 'at most 3'
ends 2 voxelize a.obj b.npy --backend cpu --device 0
ends 1 sdf none.obj b.npy
ends 1 sdf a.obj no/b.npy
[ ! -e "$work/b.npy" ] || bad "a call that failed left a file"

meshes=$(dirname "$0")/../../shared/data/meshes
if [ -d "$meshes" ]; then
    meshes=$(cd "$meshes" && pwd)
    ends 0 sdf "$meshes/spot.obj" spot.npy --size 48 --backend cpu
    grep -q 'sign: pseudonormal' "$work/.out" || bad "spot is closed"
    ends 0 sdf "$meshes/stanford_bunny_zipper.ply" bunny.npy --size 48 --backend cpu
    grep -q 'sign: winding, the mesh is not closed' "$work/.out" || bad "the bunny is open"
    ends 0 sdf "$meshes/self_intersect.obj" tube.npy --size 48 --backend cpu
    grep -q 'sign: winding, the mesh intersects itself' "$work/.out" || bad "the tube runs through itself"
    ends 0 voxelize "$meshes/pine_tree_thin.ply" pine.npy --size 48 --backend cpu
fi
finish
