#!/bin/sh
# SPDX-License-Identifier: MIT
# Worlds from the command line: edits, queries, files, what is refused, and their benchmark. No time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
cd "$work" || exit 1

backends=cpu
"$fathom" world --size 8 --backend vulkan --quiet 2>error && backends="cpu vulkan"

# The field of a world that has been edited is that of its saved voxels.
cat >edits.txt <<'END'
# A tower, a tunnel through it, and a hole.
place box 10,10,0 20,20,30 0xe0
delete line 0,15,12 40,15,14 3
update

place sphere 5,5,5 4
place sphere 5,5,5 2 0x100  # black
delete voxel 5,5,5
delete sphere -3,-3,-3 6
place sphere 1000,1000,1000 10
END
for backend in $backends; do
    ends 0 world --scene terrain --size 40,33,21 --scene-seed 3 --edits edits.txt --edit 'delete box 30,30,20 25,25,0' --voxels v.npy \
        --field f.npy --slice s.png --check --backend "$backend"
    grep -q ' 0 too far (by at most 0), 0 too near' .out || bad "the field is not exact: $(cat .out)"
    grep -q '^8 edits in 2 updates' .out || bad "edits were not counted: $(cat .out)"
    ends 0 transform v.npy t.npy --metric l1 --type u8 --saturate --backend cpu
    cmp -s f.npy t.npy || bad "$backend: the field is not that of the voxels"
    ends 0 world v.npy --format squared --field f.npy --voxels w.npy --backend "$backend"
    ends 0 transform v.npy t.npy --squared --type u32 --backend cpu
    cmp -s f.npy t.npy || bad "$backend: the squared field is not that of the voxels"
    cmp -s v.npy w.npy || bad "$backend: voxels changed on the way"
done
ends 0 world v.npy --voxels v.vox --quiet
ends 0 world v.vox --voxels w.npy --voxel-type u8 --quiet
ends 0 info w.npy --stats
grep -q uint8 .out || bad "voxels as colours are not uint8: $(cat .out)"

# What is printed on demand.
for backend in $backends; do
    ends 0 world --size 10 --edit 'place box 0,0,0 9,9,0' --edit 'delete voxel 4,4,0' --at 4,4,4 --at 0,0,1 --at 4,4,0 --at 20 --quiet \
        --backend "$backend"
    printf 'distance 5\ndistance 1\ndistance 1\ndistance 9\n' >wanted
    sed 's/.*\(distance [^,]*\),.*/\1/' .out | cmp -s - wanted || bad "$backend: distances are: $(cat .out)"
    sed -n 2p .out | grep -q 'gradient 0,0,1$' || bad "$backend: the gradient over a floor: $(sed -n 2p .out)"
done
printf 'place voxel 1,2,3 7\nupdate\nupdate\n' | "$fathom" world --size 5,6,7 --edits - --json >j.json || bad "no JSON"
if command -v python3 >/dev/null; then
    python3 -c '
import json
d = json.load(open("j.json"))
assert d["shape"] == [5, 6, 7] and d["edits"] == 1 and d["updates"] == 2 and d["algorithm"] == "exact"
assert d["start"] == "air" and not any(k in d for k in ("near", "far", "voxels", "field", "slice"))
held = {m["purpose"]: m["bytes"] for m in d["memory"]}
assert held["voxels"] == 4 * 5 * 6 * 7 and held["field"] >= 4 * 5 * 6 * 7' || bad "JSON is not as expected"
fi
ends 0 world --size 9 --edit 'place voxel 1,2,4' --algorithm selective --chunk 8 --near fim --field f.npy --slice s.png --json --backend cpu
tr -d '\n\t' <.out | grep -q '"near":"fim","far":"jfa-published".*"field":"f.npy","slice":{"file":"s.png","min":0,"max":[1-9]' ||
    bad "JSON lacks what text has: $(cat .out)"
printf 'place voxel 1,2,3' | "$fathom" world --size 5 --edits - --field - --type u16 2>/dev/null | "$fathom" info - >.out || bad "no field in the pipe"
grep -q 'uint16' .out || bad "the field in the pipe is not uint16"

# Every algorithm; which are exact, and which are not and say so.
for backend in $backends; do
    for method in brute-force fim jfa-fim 'fim --chunk 8 --border exchange' 'jfa-fim --chunk 16 --border exchange --convergence host'; do
        # shellcheck disable=SC2086
        ends 0 world --scene terrain --size 24,17,20 --edits edits.txt --algorithm $method --check --backend "$backend"
        grep -q 'field of the world: .* 0 too far (by at most 0), 0 too near (by at most 0)' .out ||
            bad "$backend, $method is not exact: $(grep against .out)"
    done
    for method in 'fim --chunk 8' 'brute-force --chunk 8 --border halo' 'jfa-fim --chunk 8 --border halo --convergence host'; do
        # shellcheck disable=SC2086
        ends 0 world --scene terrain --size 24,17,20 --edits edits.txt --algorithm $method --check --backend "$backend"
        grep -q 'what each chunk sees: .* 0 too far (by at most 0), 0 too near (by at most 0)' .out ||
            bad "$backend, $method is not exact in its chunks: $(grep against .out)"
    done
    ends 0 world --scene sparse --size 32 --algorithm jfa-published --check --backend "$backend"
    grep -q 'world: .* [1-9][0-9]* too far' .out || bad "$backend: published jump flooding made no error: $(grep against .out)"
    ends 0 world --scene shell --size 32 --algorithm published-final --field f.npy --check --backend "$backend"
    ends 0 info f.npy --stats
    grep -q 'values    0 to 1, 2 different' .out || bad "$backend: the published final field is not 1 in all air: $(cat .out)"
done

# What is refused, and how.
ends 2 world
says 'IN or --size'
ends 2 world v.npy --size 8
ends 1 world nothing.npy
ends 2 world --size 8 --scene nowhere
says 'terrain'
printf 'place sphere 1,2,3 4\n\nplcae voxel 1,1,1\n' >bad.txt
ends 2 world --size 8 --edits bad.txt
says 'bad.txt, line 3: "plcae": place, delete or update is wanted'
ends 1 world --size 8 --edits no.txt
for edit in place 'place cone 1,1,1 2' 'place sphere 1,1 2' 'place sphere 1,1,1' 'place sphere 1,1,1 -2' 'place sphere 1,1,1 2 0' \
    'place sphere 1,1,1 2 3 4' 'delete sphere 1,1,1 2 3' 'place box 1,1,1' 'place voxel 1.5,1,1' 'place voxel 1,1,9999999999' 'update now' \
    'place sphere 1,1,1 2 4294967296' 'place line 1,1,1 2,2,2 x'; do
    ends 2 world --size 8 --edit "$edit"
    says '--edit'
done
ends 2 world --size 8 --chunk 8
ends 2 world --size 8 --algorithm fim --chunk 12
says '8, 16, 32, 64, 128 or 256'
ends 2 world --size 8 --algorithm fastest
ends 2 world --size 8 --at 1,2
ends 2 world --size 8 --type i8
ends 2 world --size 8 --voxel-type u16
ends 2 world --size 8 --voxels a.npy --field ./a.npy
ends 1 world --size 8 --voxels nowhere/a.npy
ends 2 world --size 8 --format squared --algorithm fim
says '--format squared is for'
ends 2 world --size 8 --algorithm selective --near jfa
says '--near takes fim'
ends 2 world --size 8 --algorithm selective --far fim
ends 2 world --size 8 --algorithm jfa --chunk 8 --border exchange
ends 1 world --size 20000,1,1
ends 2 world - --edits -
[ ! -e a.npy ] || bad "a world that was refused left a file"

# The benchmark.
for backend in $backends; do
    ends 0 bench world --size 16,9x20x11 --algorithm exact,fim,jfa-published,jfa,jfa-1+,jfa+2,jfa-fim,brute-force,selective,published-final \
        --chunk 0,8 --border padding,exchange --convergence device,host --focus 1,2 --format packed,split-u16,squared --check 500 \
        --check-every 2 --interval 0 --frames 3 --seconds 0.02 --full-runs 2 --radius 0,4 --edits 3 --brushes sphere,box,line \
        --csv b.csv --frames-csv f.csv --json b.json --backend "$backend"
    grep -q FAILED .out && bad "$backend: a case failed: $(grep FAILED .out | head -n 1)"
    for csv in b.csv f.csv; do
        awk -F, 'NR == 1 { n = NF; next } { gsub(/"[^"]*"/, "x"); if (NF != n) exit 1 }' $csv || bad "$backend: rows of $csv differ in length"
    done
    # For each size exact has 3 formats; of the other 2 formats: fim and jfa-fim 6 each (2 ways to converge, 3 domains), jfa-published,
    # jfa, jfa-1+, jfa+2, brute-force, published-final 2 each, selective 4 (2 ways to converge, 2 focuses).
    [ "$(wc -l <b.csv)" = 119 ] || bad "$backend: b.csv has $(wc -l <b.csv) lines, not 119"
done
if command -v python3 >/dev/null; then
    python3 -c '
import csv, json
d = json.load(open("b.json"))
rows = list(csv.DictReader(open("b.csv")))
assert len(d) == len(rows) == 118
for r, c in zip(d, rows):
    assert r["failure"] == c["failure"] == "" and r["algorithm"] == c["algorithm"]
    assert r["near"] == c["near"] and r["far"] == c["far"] and (r["near"] != "") == (r["algorithm"] == "selective")
    assert 1 <= r["frames"] <= 3 and r["update"]["p99_ms"] >= r["update"]["median_ms"] > 0 and r["full"]["runs"] >= 1
    whole = r["whole"]
    assert whole["compared"] >= 500
    exact = r["algorithm"] == "exact" or (r["algorithm"] in ("brute-force", "fim", "jfa-fim") and (r["chunk"] == 0 or r["border"] == "exchange"))
    assert not exact or whole["wrong_share"] == 0, r
    if r["algorithm"] in ("brute-force", "fim", "jfa-fim") and r["chunk"] and r["border"] == "padding":
        assert r["domain"]["wrong_share"] == 0 and whole["above_share"] == 0, r
    assert float(c["voxel_bytes_per_voxel"]) >= 4 and float(c["field_bytes_per_voxel"]) >= 3' || bad "results are not as expected"
fi
ends 0 bench world --targets --size 8,12 --backend cpu --seconds 0.02 --check 100
[ "$(grep -c '^| .*another device or size |$' .out)" = 5 ] || bad "targets are not as expected: $(cat .out)"
ends 0 bench world --input v.npy --backend cpu --interval 5 --frames 2 --seconds 0.02 --csv in.csv
grep -q '"v.npy",0,40,33,21,packed,exact,' in.csv || bad "the file's world was not measured: $(tail -n 1 in.csv)"
if "$(dirname "$0")/../bench/plot-world" --check 2>/dev/null; then
    ends 0 bench world --size 8,16 --algorithm exact,selective --chunk 8 --focus 1,2 --backend cpu --interval 0 --frames 3 --seconds 0.02 \
        --plots pictures
    for picture in time_size fps_size time_focus fps_focus; do
        head -c 8 pictures/$picture.png | od -An -c | grep -q 'P   N   G' || bad "no picture pictures/$picture.png"
    done
    [ ! -e pictures/time_chunk.png ] || bad "a picture of one point"
fi
ends 2 bench world --size 8 --algorithm jfa --border exchange
says 'nothing that can be measured: --border exchange is for'
ends 2 bench world --size 8 --copy-speed -1
says '--copy-speed'
ends 2 bench world --size 8 --frames 5000
ends 2 bench world --size 8 --radius 5,2
ends 2 bench world --size 8 --check-every 2
ends 2 bench world --input v.npy --size 8
ends 2 bench world --targets --algorithm fim
ends 2 bench world --size 8 --csv c.csv --json ./c.csv
ends 1 bench world --size 8 --backend cpu --csv nowhere/b.csv
"$fathom" bench world --size 20000x1x1 --backend cpu --seconds 0.02 >.out 2>.err && bad "a world that there cannot be was measured"
grep -q 'FAILED: .*20000' .out || bad "the row does not say why it failed: $(cat .out)"
# What is solid of a file can be said as for a transform.
ends 0 scene terrain m.npy --size 16
ends 0 world m.npy --threshold 2 --field f.npy --backend cpu
ends 0 transform m.npy t.npy --metric l1 --type u8 --saturate --threshold 2 --backend cpu
cmp -s f.npy t.npy || bad "the threshold is not that of a transform"
ends 0 world m.npy --field f.npy --backend cpu
cmp -s f.npy t.npy && bad "the threshold changes nothing"
ends 2 world --size 8 --threshold 2
# Spacing and origin stay.
ends 0 world m.npy --voxels m.nrrd --backend cpu
sed 's/^space directions:.*/space directions: (2,0,0) (0,3,0) (0,0,4)/' m.nrrd >p.nrrd
ends 0 world p.nrrd --field f.nrrd --voxels v.nrrd --backend cpu
for file in f.nrrd v.nrrd; do
    "$fathom" info $file | grep -q 'spacing *2, 3, 4' || bad "$file: the spacing was lost"
done
finish
