#!/bin/sh
# SPDX-License-Identifier: MIT
# script/reproduce-tables writes what it measured beside the published figures. No time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
script=$(dirname "$0")/../script/reproduce-tables

"$script" "$(dirname "$fathom")" --quick --out "$work/t" --only final,final-1024,fim,exact >"$work/.out" 2>"$work/.err" ||
    bad "it failed: $(tail -n 3 "$work/.err")"
for table in final final-1024 fim exact; do
    [ -s "$work/t/$table.csv" ] || bad "no $table.csv: $(tail -n 3 "$work/.err")"
done
grep -q '^| 64 | 64 | 0.295 | - | 65.2 | .* | published-final | [0-9]' "$work/t/tables.md" || bad "our figure is missing beside the published one"
grep -q '^| 256 | 256 | 29.3 | .* | not run here |' "$work/t/tables.md" || bad "what was not run does not say so"
grep -q 'its field is 1 in all air' "$work/t/tables.md" || bad "nothing is said about the published final kernel"
grep -q '^| 128 | 32 | 0.057 | .* another world |' "$work/t/tables.md" || bad "a smaller world passes for one of 1024"
grep -q 'Small worlds only' "$work/t/tables.md" || bad "it does not say that worlds were small"
# One speed of a copy stands in all tables, and is that of "must": here published ms x 448 / GB/s.
for table in final final-1024 fim exact; do
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "copy_gb_per_s") at = i; next }
        { gsub(/"[^"]*"/, "text"); print $at }' "$work/t/$table.csv"
done | sort -u >"$work/speeds"
[ "$(wc -l <"$work/speeds")" = 1 ] || bad "the copy was measured anew: $(tr '\n' ' ' <"$work/speeds")"
must=$(awk '{ printf "%.4g", 1.090 * 448 / $1 }' "$work/speeds")
grep -q "^| 64 | 64 | 1.090 | 2.35 | - | $must | fim |" "$work/t/tables.md" || bad "must is not $must ms: $(grep '1.090' "$work/t/tables.md")"
# The processor has one way to converge. Without a GPU it is measured.
if grep -q 'no GPU' "$work/t/tables.md"; then
    grep -q ', host' "$work/t/tables.md" && bad "the processor is listed with two ways to converge"
fi
"$script" "$work/nothing" >"$work/.out" 2>"$work/.err" && bad "a tree that is not there was measured"
"$script" --slow >"$work/.out" 2>"$work/.err" && bad "an unknown option was taken"
finish
