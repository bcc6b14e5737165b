#!/bin/sh
# SPDX-License-Identifier: MIT
# The painting program in a real window on a virtual screen, driven by keys and mouse, with the validation layer on.
# shellcheck source=tests/app_common.sh
. "$(dirname "$0")/app_common.sh"

open_screen
start_program --validation --scene terrain --size 32 --pixels 4 --window 1100x820 --pictures "$work" --backend "${APP_BACKEND:-vulkan}"
voxels made
first_solid=$solid
first_hash=$hash
[ "$first_solid" -gt 1000 ] || bad "the scene has $first_solid solid voxels"
expect "the first frame" '^picture 275 205$'
picture start

# Fly.
now
xdotool mousemove --window "$window" 800 600 click 1
expect "a click into the picture" '^captured 1$'
[ "$(value '^aim' 2)" = 1 ] || bad "nothing is under the cross-hair"
now
xdotool keydown w
sleep 0.3
xdotool keyup w
expect "W" '^camera '
before=$line
now
xdotool mousemove_relative -- 40 10
expect "the mouse" '^camera .*yaw'
[ "$(printf '%s' "$before" | cut -d ' ' -f 6)" != "$(printf '%s' "$line" | cut -d ' ' -f 6)" ] || bad "the mouse does not turn: $line"
for key in a s d space shift q e; do
    now
    xdotool keydown $key
    expect "key $key" '^camera '
    xdotool keyup $key
done
[ "$(value '^aim' 2)" = 1 ] || bad "nothing is ahead any longer: $(grep '^aim' "$log" | tail -n 1)"

# Radius and colour.
now
xdotool click 5
expect "the wheel" '^settings .*radius=3 '
now
xdotool key 3
expect "a number key" '^settings .*colour=orange '

# Place and delete, take back and do again.
now
xdotool click 1
voxels placed
placed_hash=$hash
[ "$solid" -gt "$first_solid" ] || bad "placing left $solid solid voxels of $first_solid"
placed=$solid
picture placed
now
xdotool click 3
voxels deleted
deleted_hash=$hash
[ "$solid" -lt "$placed" ] || bad "deleting left $solid solid voxels of $placed"
now
xdotool key ctrl+z
voxels undone
[ "$hash" = "$placed_hash" ] || bad "undo does not restore what was before the deletion"
now
xdotool key ctrl+z
voxels undone
[ "$hash" = "$first_hash" ] || bad "undo does not restore the scene"
now
xdotool key ctrl+y
voxels redone
[ "$hash" = "$placed_hash" ] || bad "redo does not place again"
now
xdotool key ctrl+y
voxels redone
[ "$hash" = "$deleted_hash" ] || bad "redo does not delete again"

# Pictures.
now
xdotool key F12
expect "F12" '^screenshot '
file=$(printf '%s' "$line" | cut -d ' ' -f 2)
[ "$(identify -format '%wx%h' "$file")" = 275x205 ] || bad "the screenshot is no picture of 275x205: $file"

# Save and load, by keys and by buttons.
now
xdotool key Tab
expect "Tab" '^captured 0$'
name_file world.npy
press save
expect "Save" '^saved world.npy$'
saved_hash=$deleted_hash
press undo
voxels undone
[ "$hash" != "$saved_hash" ] || bad "the button does not undo"
press redo
voxels redone
[ "$hash" = "$saved_hash" ] || bad "the button does not do again"
press undo
voxels undone
now
xdotool key ctrl+o
voxels loaded
[ "$hash" = "$saved_hash" ] || bad "what is loaded is not what was saved"
name_file world.vox
now
xdotool key ctrl+s
expect "Ctrl+S, in the text even" '^saved world.vox$'
count=$solid
press load
voxels loaded
[ "$solid" = "$count" ] || bad "world.vox brings $solid solid voxels back, not $count"
name_file no/such/file.vox
press load
expect "a file that is not there" '^failed load: no/such/file.vox'

# The window.
now
xdotool windowsize "$window" 900 700
expect "a smaller window" '^picture 2[0-9]* 1[0-9]*$'
picture small
now
xdotool windowminimize "$window"
expect "minimising" '^hidden$'
now
xdotool windowmap "$window"
expect "the window again" '^shown$'
now
xdotool windowsize "$window" 1100 820
expect "a larger window" '^picture 275 205$'
now
xdotool key F1
picture bare
xdotool key F1
expect "F1" '^widget scene '

end_program

# The benchmark in a window ends by itself.
: >"$log"
(cd "$work" && exec "$paint" --log "$log" --validation --size 32 --pixels 4 --auto-edit 5 --interval 0 --frames 20 --csv frames.csv \
    --backend "${APP_BACKEND:-vulkan}") >"$work/said" 2>&1 || bad "the benchmark: $(cat "$work/said")"
grep -q '^20 frames, 20 edits, seed 5, an edit a frame$' "$work/said" || bad "the summary: $(cat "$work/said")"
[ "$(wc -l <"$work/frames.csv")" = 21 ] || bad "the table of 20 frames has $(wc -l <"$work/frames.csv") lines"
grep -q '^quit validation 0$' "$log" || bad "validation messages: $(grep -m 3 validation "$work/said")"
finish
