#!/bin/sh
# SPDX-License-Identifier: MIT
# The benchmark of shadows: a row for each way, the truth close to itself, cones closer to it than the published march.
# shellcheck source=tests/cli_common.sh
. "$(dirname "$0")/cli_common.sh"
backend=${2:-cpu}

ends 0 bench shadows --backend "$backend" --picture 64x40 --edge 48 --triangles 400 --map-edge 64 --truth 16 --frames 2 --csv "$work/s.csv" \
    --pictures "$work/kept"
# error WAY: of the light's share.
error() {
    awk -F, -v way="\"$1\"" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "share_rmse") column = i }
        $1 == way { print $column }' "$work/s.csv"
}
[ "$(wc -l <"$work/s.csv")" = 9 ] || bad "there are $(wc -l <"$work/s.csv") lines in the table, not 9"
for way in "one ray" "shadow map" "RTSDF" "cone" "4 cones"; do
    [ -n "$(error "$way")" ] || bad "no row of $way"
done
less() {
    awk -v a="$1" -v b="$2" 'BEGIN { exit !(a < b) }' || bad "$3: $1 is not below $2"
}
less "$(error truth)" 0.15 "the truth against itself"
less "$(error cone)" "$(error RTSDF)" "the cone against RTSDF"
less "$(error "4 cones")" "$(error RTSDF)" "4 cones against RTSDF"
[ -s "$work/kept/truth.png" ] && [ -s "$work/kept/4_cones.png" ] || bad "no pictures"

# A folder that cannot be is said before anything is measured.
: >"$work/file"
ends 1 bench shadows --pictures file --csv never.csv
says 'directory'
ends 1 bench shadows --pictures nowhere/deep
[ ! -e "$work/never.csv" ] || bad "there is a table of nothing"
ends 2 bench shadows --light 60
says '--light'
ends 2 bench shadows --picture 0x5
ends 2 bench shadows --edge 4
finish
