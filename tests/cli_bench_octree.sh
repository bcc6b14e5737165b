#!/bin/sh
# SPDX-License-Identifier: MIT
# fathom bench octree measures every mode and checks what it sees; script/reproduce-vcp sets it beside the published figures. No
# time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
root=$(cd "$(dirname "$0")/.." && pwd)

small="--triangles 2000 --picture 60x40 --frames 2 --seconds 0.01 --warm-up 0 --check 300 --backend cpu --copy 10"
# field CSV WAY NAME: a column of the first row of a way.
field() {
    awk -F, -v way="$2" -v name="$3" 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        { gsub(/"[^"]*"/, "x") } $(at["way"]) == way { print $(at[name]); exit }' "$work/$1"
}
less() {
    awk -v a="$1" -v b="$2" 'BEGIN { exit !(a != "" && b != "" && a + 0 < b + 0) }' || bad "$3: $1 is not below $2"
}
rows() {
    [ "$(wc -l <"$work/$1")" = "$2" ] || bad "$1 has $(wc -l <"$work/$1") lines, not $2"
    awk -F, 'NR == 1 { n = NF; next } { gsub(/"[^"]*"/, "x"); if (NF != n) exit 1 }' "$work/$1" || bad "rows of $1 differ in length"
    grep -q FAILED "$work/.out" && bad "a case failed: $(grep FAILED "$work/.out" | head -n 1)"
}
# shellcheck disable=SC2086
{
    # Twelve ways and two views; of a world, four kinds and the field.
    ends 0 bench octree $small --model torus,terrain --size 32 --csv p.csv --json p.json --pictures .
    rows p.csv 30
    [ -s "$work/torus-closest-32-close.png" ] || bad "no picture"
    rm -f "$work"/torus-*.png
    less "$(field p.csv closest rmse)" "$(field p.csv voxels rmse)" "the error of vectors against that of voxels"
    less "$(field p.csv svo surface_p99_cells)" "$(field p.csv svo-cubes surface_p99_cells)" "contours against cubes"
    less "$(field p.csv closest-thin bytes)" "$(field p.csv svo bytes)" "the bytes of a thin octree against those of an SVO"
    less "$(field p.csv closest-thin surface_p99_cells)" 0.3 "the surface by a thin octree, cells"
    less "$(field p.csv distance surface_p99_cells)" 0.5 "the surface by signed distances, cells"

    ends 0 bench octree $small --mode memory --way closest,dag --size 32,48 --csv m.csv
    rows m.csv 5
    ends 0 bench octree $small --mode error --way closest,voxels,svo --size 24 --most 96 --csv e.csv --strip e.png --view whole,close
    rows e.csv 7
    less "$(awk -v a="$(field e.csv voxels bytes)" -v b="$(field e.csv closest bytes)" 'BEGIN { print (a > b ? a / b : b / a) }')" 1.25 \
        "memory that should be equal"
    [ -s "$work/e.png" ] || bad "no strip"
    ends 0 bench octree $small --mode update --way svo,dag,field --size 32 --edits 5 --radius 1,3 --csv u.csv
    rows u.csv 7
    ends 0 bench octree $small --mode scale --size 32,64 --csv z.csv
    rows z.csv 9
    less "$(field z.csv tree64 bytes)" "$(field z.csv voxels bytes)" "the shell as a 64-tree"
    ends 0 bench octree $small --mode share --model building --way closest,distance --size 64 --csv s.csv
    rows s.csv 3
    less 1.5 "$(field s.csv closest share_ratio)" "what is shared of a building"
    ends 0 bench octree $small --mode code --size 32 --csv c.csv
    rows c.csv 3
    less "$(field c.csv spherical code_surface_p99_cells)" 0.2 "what 32 bits cost"

    ends 2 bench octree $small --mode fast
    ends 2 bench octree $small --size 8
    ends 2 bench octree $small --way octree
    ends 2 bench octree $small --view far
    ends 2 bench octree $small --edits 2000
    ends 1 bench octree $small --csv nowhere/p.csv
}
if command -v python3 >/dev/null; then
    python3 -c '
import json, sys
d = json.load(open(sys.argv[1]))
assert len(d) == 29 and all(r["failure"] == "" and r["samples"] > 0 for r in d)
assert all(r["wrong"] <= 0.02 * r["samples"] and r["primary"]["median_ms"] > 0 for r in d)
assert all(r["bytes"] == r["node_bytes"] + r["leaf_bytes"] + r["attribute_bytes"] for r in d if r["way"] != "field")
' "$work/p.json" || bad "p.json is not as expected"
fi
# One of the rows is made to fail.
mkdir "$work/built"
cat >"$work/built/fathom" <<END
#!/bin/sh
"$fathom" "\$@" || exit
for file do
    case \$file in
    *code.csv) sed '2s/""\$/"too large, it is said"/' "\$file" >"$work/code" && cp "$work/code" "\$file" ;;
    esac
done
END
chmod +x "$work/built/fathom"
"$root/script/reproduce-vcp" "$work/built" --quick --size 16 --picture 48x30 --data "$work/nothing" --out "$work/t" >"$work/.out" 2>"$work/.err" ||
    bad "it failed: $(tail -n 3 "$work/.err")"
grep -q '^| Thai statue, published (10 M triangles) | 2048, 1075 MiB | 2048, 1075 MiB | 4096, 1096 MiB | 2048, 860 MiB |' "$work/t/tables.md" ||
    bad "the published memory is missing"
grep -q '^| torus, ours (0.02 M triangles) | 16, [0-9.]* MiB | [0-9]*, [0-9.]* MiB |' "$work/t/tables.md" || bad "our memory is missing"
grep -q '^| Raptor bottom, published | 13.2 | 12.9 | 12.7 | 16.8 |' "$work/t/tables.md" || bad "the published times are missing"
grep -q '^| building | closest | 16 | ' "$work/t/tables.md" || bad "what is shared is missing"
grep -q 'Small octrees and pictures only' "$work/t/tables.md" || bad "it does not say that octrees were small"
grep -q '^| torus | spherical, failed | 16 | ' "$work/t/tables.md" || bad "a row that failed does not say so"
grep -q '^- torus, spherical, 16 cells: too large, it is said' "$work/t/tables.md" || bad "why a row failed is not said"
[ -s "$work/t/strip.png" ] || bad "no strip"
(cd "$work" && "$root/script/reproduce-vcp" nothing >.out 2>.err) && bad "a tree that is not there was measured"
rm -rf "$work/t" "$work/built" "$work/code"
holds p.csv p.json m.csv e.csv e.png u.csv z.csv s.csv c.csv
finish
