#!/bin/sh
# SPDX-License-Identifier: MIT
# The benchmark runs every engine that is always there, checks its samples and writes its tables. No time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"

ends 0 bench transform --sizes 8,21x9x5 --scenes terrain,sparse,shell,empty --density 0.02 --metrics l1,l2,linf --inputs u8,bits \
    --engines fathom-cpu,brute-force,copy --backend cpu --runs 3 --seconds 0.01 --samples 200 \
    --csv b.csv --passes p.csv --json b.json
# 2 sizes, 4 scenes, 3 metrics of 2 types each, 2 inputs, 3 engines.
[ "$(wc -l <"$work/b.csv")" = 289 ] || bad "b.csv has $(wc -l <"$work/b.csv") lines, not 289"
awk -F, 'NR == 1 { n = NF; next } { gsub(/"[^"]*"/, "x"); if (NF != n) exit 1 }' "$work/b.csv" || bad "rows of b.csv differ in length"
awk -F, 'NR == 1 { n = NF; next } { gsub(/"[^"]*"/, "x"); if (NF != n) exit 1 }' "$work/p.csv" || bad "rows of p.csv differ in length"
grep -q 'FAILED' "$work/.out" && bad "a case failed: $(grep FAILED "$work/.out" | head -n 1)"
if command -v python3 >/dev/null; then
    python3 -c '
import json, sys
d = json.load(open(sys.argv[1]))
assert len(d) == 288
assert all(r["failure"] == "" and r["wrong"] == 0 for r in d)
assert all(r["samples"] == (0 if r["engine"] == "copy" else 200) for r in d)
assert all(r["kernels"]["runs"] >= 3 for r in d)' "$work/b.json" || bad "b.json is not as expected"
fi

ends 1 bench transform --sizes 8 --scenes shell --runs 3 --seconds 0.1 --engines fathom-cpu --csv nowhere/b.csv
ends 1 bench transform --sizes 8 --scenes shell --runs 3 --seconds 0.01 --engines fathom-cpu --csv /dev/full --quiet
ends 2 bench transform --sizes 8 --scenes shell --runs 3 --seconds 0.01 --engines fathom-cpu \
    --csv c.csv --passes ./c.csv
# Old results stay until there are new ones.
cp "$work/b.csv" "$work/old.csv"
ends 1 bench transform --sizes 8 --scenes shell --runs 3 --engines fathom-vulkan --device 'no such device' --csv b.csv
if env --default-signal=INT true 2>/dev/null; then
    (cd "$work" && exec env --default-signal=INT "$fathom" bench transform --sizes 32 --scenes shell --engines brute-force --backend cpu \
        --runs 1000 --seconds 1000 --csv b.csv --json new.json >"$work/.out") &
    bench=$!
    sleep 2
    kill -INT "$bench"
    wait "$bench"
    [ "$?" = 130 ] || bad "SIGINT did not end the benchmark"
fi
cmp -s "$work/b.csv" "$work/old.csv" || bad "results were lost to a benchmark that did not end"
rm "$work/old.csv"
ends 1 bench transform --sizes 8 --scenes shell --runs 3 --seconds 0.1 --engines fathom-vulkan --device 'no such device'
holds b.csv b.json p.csv
finish
