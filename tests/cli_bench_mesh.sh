#!/bin/sh
# SPDX-License-Identifier: MIT
# fathom bench mesh measures every mode, checks its samples and writes its tables; script/reproduce-rtsdf sets them beside the
# published ones. No time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
script=$(dirname "$0")/../script/reproduce-rtsdf

small="--triangles 600 --frames 3 --seconds 0.01 --warm-up 0 --check 200 --backend cpu"
# shellcheck disable=SC2086
ends 0 bench mesh $small --mode rtsdf,coarse,exact,build,refit --mesh torus,sphere --size 8,5 --edge 16,17 --rays 0,2 --mask .1,inf \
    --csv m.csv --json m.json
# Two meshes: 2 sizes, rays and masks each, then two edges for two modes, then the tree twice.
[ "$(wc -l <"$work/m.csv")" = 29 ] || bad "m.csv has $(wc -l <"$work/m.csv") lines, not 29"
awk -F, 'NR == 1 { n = NF; next } { gsub(/"[^"]*"/, "x"); if (NF != n) exit 1 }' "$work/m.csv" || bad "rows of m.csv differ in length"
grep -q FAILED "$work/.out" && bad "a case failed: $(grep FAILED "$work/.out" | head -n 1)"
if command -v python3 >/dev/null; then
    python3 -c '
import json, sys
d = json.load(open(sys.argv[1]))
assert len(d) == 28
assert all(r["failure"] == "" and r["wrong"] == 0 and r["samples"] == 200 for r in d)
assert all(r["kernels"]["runs"] >= 3 and r["wall"]["median_ms"] > 0 for r in d)
names = lambda r: [p["name"] for p in r["passes"]]
assert all(names(r)[-3:] == ["voxelize", "flood", "trace"] for r in d if r["mode"] == "rtsdf")
assert all("tree" in names(r) for r in d if r["mode"] == "rtsdf" and r["rays"] > 0)
masks = {r["mask"] if r["mask"] == "inf" else round(r["mask"], 6) for r in d if r["mode"] == "rtsdf"}
assert masks == {0.1, "inf"}
' "$work/m.json" || bad "m.json is not as expected"
fi
# Scenes: composed of their objects' fields, and made anew.
# shellcheck disable=SC2086
ends 0 bench mesh $small --mode compose,scene --edge 24 --moving 3 --json s.json
grep -q FAILED "$work/.out" && bad "a case failed: $(grep FAILED "$work/.out" | head -n 1)"
if command -v python3 >/dev/null; then
    python3 -c '
import json, sys
d = json.load(open(sys.argv[1]))
assert [r["mode"] for r in d] == ["compose", "scene"]
assert all(r["failure"] == "" and r["wrong"] == 0 and r["samples"] == 200 for r in d)
assert all(r["objects"] == 8 and r["moving"] == 3 and r["edge"] == 24 for r in d)
assert [p["name"] for p in d[0]["passes"]] == ["compose"]
' "$work/s.json" || bad "s.json is not as expected"
fi
# shellcheck disable=SC2086
{
    ends 2 bench mesh $small --mode compose --moving 9
    ends 1 bench mesh $small --mode coarse --edge 8 --mesh nothing.ply
    ends 2 bench mesh $small --mode fast
    ends 2 bench mesh $small --size XL
    ends 2 bench mesh $small --size 1025
    ends 2 bench mesh $small --rays 65
    ends 2 bench mesh $small --mask 0
    ends 2 bench mesh $small --flood 2jfa
    ends 1 bench mesh $small --mode refit --csv nowhere/m.csv
}

"$script" "$(dirname "$fathom")" --quick --out "$work/t" >"$work/.out" 2>"$work/.err" || bad "it failed: $(tail -n 3 "$work/.err")"
for table in sizes masks exact; do
    [ -s "$work/t/$table.csv" ] || bad "no $table.csv: $(tail -n 3 "$work/.err")"
done
grep -q '^| flood | L | 16 / 32 | 21.89, ours [0-9]' "$work/t/tables.md" || bad "our figure is missing beside the published one"
grep -q '^| 15 | 3.17, ours [0-9.]* | 7.7, ours [0-9.]* | 12.42, ours [0-9.]* | 32.7, ours [0-9.]* | 46, ours [0-9.]* |$' "$work/t/tables.md" ||
    bad "the masks are missing"
grep -q '^| lighting | M | 8 / 16 | 3.17, ours [0-9]' "$work/t/tables.md" || bad "lighting is missing beside the published one"
grep -q '^| total | 10.22 | [0-9]' "$work/t/tables.md" || bad "the frame has no sum"
grep -q '^4 cones ' "$work/t/tables.md" || bad "the ways of shadows are missing"
grep -q 'Small fields only' "$work/t/tables.md" || bad "it does not say that fields were small"
# Paths are the caller's; a mesh that cannot be read stops it before anything is measured or written.
tree=$(dirname "$fathom")
script=$(cd "$(dirname "$script")" && pwd)/reproduce-rtsdf
(cd "$work" && "$script" "$tree" --quick --out u --mesh none.ply) >"$work/.out" 2>"$work/.err" && bad "a mesh that is not there was measured"
grep -q 'none.ply' "$work/.err" || bad "it does not name the mesh: $(cat "$work/.err")"
[ ! -e "$work/u" ] || bad "it wrote for a mesh that is not there"
"$script" "$work/nothing" >"$work/.out" 2>"$work/.err" && bad "a tree that is not there was measured"
rm -rf "$work/t"
holds m.csv m.json s.json
finish
