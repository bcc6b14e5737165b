#!/bin/sh
# SPDX-License-Identifier: MIT
# script/reproduce-tables writes what it measured beside the published figures. No time is judged.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
script=$(dirname "$0")/../script/reproduce-tables

"$script" "$(dirname "$fathom")" --quick --out "$work/t" --only final,final-1024,exact >"$work/.out" 2>"$work/.err" ||
    bad "it failed: $(tail -n 3 "$work/.err")"
for table in final final-1024 exact; do
    [ -s "$work/t/$table.csv" ] || bad "no $table.csv: $(tail -n 3 "$work/.err")"
done
grep -q '^| 64 | 64 | 0.295 | - | 65.2 | .* | published-final | [0-9]' "$work/t/tables.md" || bad "our figure is missing beside the published one"
grep -q '^| 256 | 256 | 29.3 | .* | not run here |' "$work/t/tables.md" || bad "what was not run does not say so"
grep -q 'its field is 1 in all air' "$work/t/tables.md" || bad "nothing is said about the published final kernel"
grep -q '^| 128 | 32 | 0.057 | .* another world |' "$work/t/tables.md" || bad "a smaller world passes for one of 1024"
grep -q 'Small worlds only' "$work/t/tables.md" || bad "it does not say that worlds were small"
"$script" "$work/nothing" >"$work/.out" 2>"$work/.err" && bad "a tree that is not there was measured"
"$script" --slow >"$work/.out" 2>"$work/.err" && bad "an unknown option was taken"
finish
