#!/bin/sh
# SPDX-License-Identifier: MIT
# Moving meshes in the painting program: every choice of their panel changes the picture as it should, in a window on a virtual
# screen, with the validation layer on.
# shellcheck source=tests/app_common.sh
. "$(dirname "$0")/app_common.sh"

backend=${APP_BACKEND:-vulkan}

# shot NAME: what the program shows once it has come to rest.
shot() {
    settle
    now
    xdotool key F12
    expect "a picture of $1" '^screenshot '
    mv "$(printf '%s' "$line" | cut -d ' ' -f 2)" "$work/$1.png"
    [ -z "${APP_PICTURES:-}" ] || cp "$work/$1.png" "$APP_PICTURES/mesh-$1.png"
}

# same ONE OTHER, differ ONE OTHER: by their pixels.
same() {
    cmp -s "$work/$1.png" "$work/$2.png" || bad "the pictures $1 and $2 are not the same"
}
differ() {
    cmp -s "$work/$1.png" "$work/$2.png" && bad "the pictures $1 and $2 are the same"
}

# headless NAME OPTIONS...: the same without a window, on the processor.
headless() {
    name=$1
    shift
    "$paint" --headless --mesh --backend cpu --edge 24 --window 96x64 --frames 2 --last-frame "$work/$name.png" "$@" \
        >"$work/$name.out" 2>&1 || bad "$name: $(cat "$work/$name.out")"
}

headless cone --csv "$work/cone.csv"
headless again
same cone again
headless held --hold
headless field --surface field
headless rtsdf --field rtsdf
headless coarse --field coarse
headless blended --blend
headless share --view share
headless large --sun-size 10
for shadow in none ray rtsdf rays map; do
    headless shadow-$shadow --shadow $shadow
    differ cone shadow-$shadow
done
for other in held field rtsdf coarse blended share large; do
    differ cone $other
done
grep -q '^field ms  *2 ' "$work/cone.out" || bad "no times of two fields: $(cat "$work/cone.out")"
[ "$(wc -l <"$work/cone.csv")" = 3 ] || bad "the table of 2 frames has $(wc -l <"$work/cone.csv") lines"
# A file is known to be a mesh by itself.
cat >"$work/pyramid.obj" <<EOF
v 0 0 0
v 4 0 0
v 4 3 0
v 0 3 0
v 2 1 5
f 1 3 2
f 1 4 3
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
EOF
headless pyramid "$work/pyramid.obj"
differ cone pyramid
grep -q 'pyramid.obj, [0-9]* triangles' "$work/pyramid.out" || bad "the pyramid: $(cat "$work/pyramid.out")"
# The same pyramid, lying on its side as files do whose axis y points up, stands again.
awk '$1 == "v" { print "v", $2, $4, -$3; next } { print }' "$work/pyramid.obj" >"$work/lying.obj"
headless lying "$work/lying.obj"
differ pyramid lying
headless standing "$work/lying.obj" --up y
same pyramid standing
"$paint" --headless --mesh --up y >"$work/said" 2>&1 && bad "--up is taken without a file"
"$paint" --headless --mesh --backend cpu "$work/none.ply" >"$work/said" 2>&1 && bad "a mesh that is not there is taken"
"$paint" --headless --mesh --shadow soft >"$work/said" 2>&1 && bad "shadows of voxels are taken for those of meshes"
for wrong in '--edge 7' '--rays 65' '--sun-size 21' '--field none'; do
    # shellcheck disable=SC2086
    "$paint" --headless --mesh $wrong >"$work/said" 2>&1
    [ $? = 2 ] || bad "$wrong is taken"
done

open_screen

start_program --validation --backend "$backend" --mesh --size 32 --edge 24 --pixels 4 --window 480x760 --pictures "$work" --hold --shadow ray
shot ray
press hold
expect "moving objects" '^settings .*hold=0 '
shot moved
differ ray moved
press hold
expect "objects that are held" '^settings .*hold=1 '
shot ray
shot again
same ray again

# Shadows.
choose shadows map shadows
choose map 256 map
shot map
differ ray map
choose shadows rays shadows
choose samples 1 samples
shot rays
differ map rays
choose shadows none shadows
shot none
differ rays none
press light
expect "the light's size" '^settings .*light=[5-9]'

# Fields, exact and published, first where none is made.
choose field rtsdf field
choose rays 0 rays
choose flood jfa+2 flood
choose shadows rtsdf shadows
shot rtsdf
differ none rtsdf
choose field coarse field
shot coarse
differ rtsdf coarse
choose field exact field
choose sign winding sign
choose band all band
choose edge 32 edge
choose shadows cone shadows
shot cone
differ rtsdf cone

# The surface, views, and pictures that are blended with those before.
choose shadows none shadows
choose surface field surface
shot surface
differ none surface
for view in normal steps share color; do
    choose view $view seen
done
shot color
same surface color
press blend
expect "blending" '^settings .*blend=1 '
shot blended
differ blended color
press blend
expect "no blending" '^settings .*blend=0 '

# Keys fly, and do not paint.
now
xdotool mousemove --window "$window" 430 500 click 1
expect "a click into the picture" '^captured 1$'
lines=$(grep -c '^settings' "$log")
xdotool key 3 ctrl+z ctrl+y ctrl+s ctrl+o click 1 click 3 click 5
now
xdotool key w
expect "the key w" '^camera '
settle
[ "$(grep -c '^settings' "$log")" = "$lines" ] || bad "a key has changed something: $(tail -n 3 "$log")"
grep -q -e '^edit' -e '^saved' -e '^loaded' -e '^failed' "$log" && bad "painting keys do something: $(tail -n 3 "$log")"
now
xdotool key Tab
expect "Tab" '^captured 0$'
shot there

# To voxels, which are made now, and back.
open_list mode voxels
press mode/voxels
voxels made
[ "$solid" -gt 1000 ] || bad "the world has $solid solid voxels"
expect "voxels" '^settings .*mode=voxels '
expect "their panel" '^widget algorithm '
shot voxels
differ voxels there
choose mode meshes mode
expect "the panel of meshes" '^widget hold '
shot back
same there back
grep '^failed' "$log" && bad "something failed"
press quit
wait_end
finish
